"""The pyramid of depth's moments that area sampling reads (VO section 4.2)."""

import numpy as np

from lfssao.ao.estimators.vo.kernels import moments as kernels
from lfssao.ao.textures import Texture

_AVERAGE, _BLUR = (0.0, 0.5), (0.125, 0.375)


def moment_pyramid(depth: Texture, prefilter: bool) -> kernels.Pyramid:
    """Return the pyramid of a texture of cast z, (H, W), +infinity where there is no surface, down to one texel.

    With ``prefilter`` each step blurs by [1 2 1] / 4 before it averages two texels.
    """
    height, width = depth.shape
    sizes = [(height, width)]
    while max(sizes[-1]) > 1:
        sizes.append(((sizes[-1][0] + 1) // 2, (sizes[-1][1] + 1) // 2))
    pitches = [w + kernels.BORDER for _, w in sizes]
    lengths = [(h + kernels.BORDER) * pitch for (h, _), pitch in zip(sizes, pitches, strict=True)]
    starts = [sum(lengths[:level]) for level in range(len(sizes))]
    moments = np.zeros((sum(lengths), 3))
    kernels.write_base(depth, moments)
    for level, (h, w) in enumerate(sizes[:-1]):
        kernels.write_half(moments, starts[level], w, h, starts[level + 1], *(_BLUR if prefilter else _AVERAGE))
    return kernels.Pyramid(moments.reshape(-1), np.array(starts), np.array(pitches))
