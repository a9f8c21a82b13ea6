"""Distances of logarithmic depth."""

import numpy as np

from lfssao.core.elementary import exp, log
from lfssao.core.jit import kernel


@kernel(rows="depth")
def write_logarithmic(begin, stop, depth, constant, far, z):
    """Write z = (exp(depth ln(C far + 1)) - 1) / C, C the constant; depth and z are (H, W) float64, NaN stays NaN."""
    scale = log(constant * far + 1.0)
    for j in range(begin, stop):
        for i in range(depth.shape[1]):
            d = depth[j, i]
            z[j, i] = (exp(d * scale) - 1.0) / constant if abs(d) < np.inf else d
