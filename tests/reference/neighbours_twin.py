"""Algorithm 2 with neighbours a second time, one sample and one module at a time; nothing here comes from lfssao."""

import math

import numpy as np

from reference import textbook as display_twin
from reference import twins

DISPLAY = 2


def lands_behind(view, point, offset):
    """Whether a sample lies behind a view's surface; None where it falls outside the texture or the domain."""
    depth, kind, m = view
    height, width = depth.shape
    rows = 4 if kind == twins.MATRIX else 3
    moved = [twins.affine_row(m, row, *point) + twins.linear_row(m, row, *offset) for row in range(rows)]
    if kind == DISPLAY:
        u, v, answer = display_twin.physical_to_image(m[12:], *moved)
        z, valid = moved[2], answer == display_twin.VALID
    else:
        u, v, z, valid = twins.project(kind, m, *moved, *[None] * (4 - rows))
    if not (valid and 0 <= u < width and 0 <= v < height):
        return None
    return bool(depth[math.floor(v), math.floor(u)] < z)


@np.errstate(all="ignore")
def share_hidden(surface, positions, offsets, views):
    dtype = surface.dtype.type
    occlusion, outside = np.zeros(surface.shape, dtype), np.zeros(len(surface), np.int64)
    for j, i in np.ndindex(surface.shape):
        if not surface[j, i] < np.inf:
            continue
        hidden = 0
        for offset in offsets:
            answers = [lands_behind(view, positions[j, i], offset) for view in views]
            known = [answer for answer in answers if answer is not None]
            hidden += bool(known) and all(known)
            outside[j] += not known
        occlusion[j, i] = dtype(hidden) / dtype(max(len(offsets), 1))
    return occlusion, outside
