"""The hierarchy of z (SAO table 1): levels, each half of the last, and those as formulas read them."""

import numpy as np

from lfssao.ao.estimators.sao.kernels import z_pyramid
from lfssao.ao.kernels.levels import Levels
from lfssao.ao.textures import Texture

# Numbers of ``z_pyramid``'s filters.
FILTERS = dict(zip(("none", "rotated", "arithmetic", "harmonic", "min", "max"), range(-1, 5), strict=True))


def z_hierarchy(z: Texture, mip: str, max_level: int, origin: float = 0.0) -> list[Texture]:
    """Return the levels of z, each half of the last, rounded up, until one texel or ``max_level``.

    mip: a key of ``FILTERS``; 'none' makes level 0 only. origin: z from which the harmonic mean counts distances.
    """
    levels = [z]
    while mip != "none" and len(levels) <= max_level and max(levels[-1].shape) > 1:
        height, width = levels[-1].shape
        target = np.empty(((height + 1) // 2, (width + 1) // 2), z.dtype)
        z_pyramid.next_level(levels[-1], FILTERS[mip], z.dtype.type(origin), target)
        levels.append(target)
    return levels


def levels_of(levels: list[Texture]) -> Levels:
    """Return levels of z as formulas read them."""
    first = np.cumsum([0, *(level.size for level in levels[:-1])]).astype(np.int32)
    return Levels(np.concatenate([level.ravel() for level in levels]), first)
