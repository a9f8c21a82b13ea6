"""SSAO of Sascha Willems' Vulkan examples: shaders/glsl/ssao/ssao.frag, 2026.

It is LearnOpenGL's but for its frame, which is left-handed: b = t x n. Its noise is stored from -1 to 1 and unpacked
once more, to vectors whose z is -1. Its distances are cleared to 1.
"""

from dataclasses import replace
from functools import partial

import numpy as np

from lfssao.ao.estimators.estimator import FloatArray
from lfssao.ao.estimators.oriented import ENTRIES as ORIENTED
from lfssao.ao.estimators.oriented import Hemisphere, OrientedOptions, hemisphere
from lfssao.ao.formulas import sum_formulas
from lfssao.ao.textures import Buffers


def left_handed(
    buffers: Buffers, radius: float, points: FloatArray, weights: FloatArray | None, options: OrientedOptions
) -> Hemisphere:
    """Return the numbers of the oriented hemisphere for points whose y has the other sign."""
    return hemisphere(buffers, radius, np.asarray(points) * [1, -1, 1], weights, options)


ENTRIES = (
    replace(
        ORIENTED[0],
        name="sascha-willems",
        title="share of points in the half ball around the normal that are hidden, in a left-handed frame",
        source="Sascha Willems, Vulkan examples",
        formula="ao = as of oriented-hemisphere, S = C + R (x t + y t x n + |z| n)",
        run=partial(sum_formulas, left_handed),
        formulas=left_handed,
        rotation="tiles",
    ),
)
