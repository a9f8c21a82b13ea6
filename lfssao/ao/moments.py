"""The pyramid of moments of a texture of depth (VO section 4.2)."""

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.kernels import moments as kernels
from lfssao.ao.textures import Texture

_AVERAGE, _BLUR = (0.0, 0.5), (0.125, 0.375)  # taps of a step of the pyramid


def moment_pyramid(depth: Texture, prefilter: bool) -> kernels.Pyramid:
    """Return the pyramid of a texture of cast z, (H, W), +infinity where there is no surface, down to one texel.

    With ``prefilter`` each step blurs by [1 2 1] / 4 before it averages two texels.
    """
    numbers = np.empty((*depth.shape, 3))
    kernels.write_moments(depth, numbers)
    return filtered(numbers, prefilter)


def filtered(numbers: NDArray[np.float64], prefilter: bool) -> kernels.Pyramid:
    """Return the pyramid of three numbers a texel, (H, W, 3) float64."""
    height, width, _ = numbers.shape
    sizes = [(height, width)]
    while max(sizes[-1]) > 1:
        sizes.append(((sizes[-1][0] + 1) // 2, (sizes[-1][1] + 1) // 2))
    pitches = [w + kernels.BORDER for _, w in sizes]
    lengths = [(h + kernels.BORDER) * pitch for (h, _), pitch in zip(sizes, pitches, strict=True)]
    starts = [sum(lengths[:level]) for level in range(len(sizes))]
    moments = np.zeros((sum(lengths), 3))
    base = moments[: lengths[0]].reshape(height + kernels.BORDER, pitches[0], 3)
    base[kernels.BEFORE : kernels.BEFORE + height, kernels.BEFORE : kernels.BEFORE + width] = numbers
    for level, (_, w) in enumerate(sizes[:-1]):
        taps = _BLUR if prefilter else _AVERAGE
        kernels.write_half(moments, starts[level], w, sizes[level + 1][0], starts[level + 1], *taps)
    return kernels.Pyramid(moments.reshape(-1), np.array(starts), np.array(pitches))
