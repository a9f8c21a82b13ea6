"""lfssao.kernels.point a second time, one texel and one sample at a time. Nothing here comes from lfssao."""

import math

import numpy as np

from reference import textbook as display_twin
from reference import twins

DISPLAY = 2


def locate(kind, m, point, offset, sign=1):
    """Where point + sign offset lands: u, v, image z, whether the mapping is defined; the affine halves are added."""
    rows = range(4 if kind == twins.MATRIX else 3)
    sign = m.dtype.type(sign)
    return project(kind, m, [twins.affine_row(m, r, *point) + sign * twins.linear_row(m, r, *offset) for r in rows])


def project(kind, m, a):
    """The same from the affine half, three or, for a camera, four numbers."""
    if kind == DISPLAY:
        u, v, answer = display_twin.physical_to_image(m[12:], *a)
        return u, v, a[2], answer == display_twin.VALID
    return twins.project(kind, m, *a, *[None] * (4 - len(a)))


def texel_at(shape, u, v, valid):
    """Row and column of the texel that holds (u, v), None outside."""
    height, width = shape
    return (math.floor(v), math.floor(u)) if valid and 0 <= u < width and 0 <= v < height else None


def image_depth(kind, m, point):
    """Image z of a surface point: LF's alternative to line 7."""
    z = twins.affine_row(m, 2, *point)
    if kind != twins.MATRIX:
        return z
    q = twins.affine_row(m, 3, *point)
    return z / q if q > 0 else m.dtype.type(np.inf)


@np.errstate(all="ignore")
def share_behind(depth, positions, normals, offsets, kind, m, reach, forward, remap):
    """Occlusion and the number of samples outside; normals None: the full ball."""
    dtype = depth.dtype.type
    occlusion, outside = np.zeros_like(depth), 0
    for j, i in np.ndindex(depth.shape):
        if not depth[j, i] < np.inf:
            continue
        point, count = positions[j, i], 0
        for offset in offsets:
            sign = 1
            if normals is not None:
                n = normals[j, i]
                sign = -1 if (offset[0] * n[0] + offset[1] * n[1]) + offset[2] * n[2] < 0 else 1
            u, v, z, valid = locate(kind, m, point, offset, sign)
            texel = texel_at(depth.shape, u, v, valid)
            if texel is None:
                outside += 1
                continue
            surface, q = depth[texel], positions[texel]
            if not surface < np.inf:
                continue
            d = q - point
            near = (d[0] * d[0] + d[1] * d[1]) + d[2] * d[2] <= reach
            if forward:
                surface = image_depth(kind, m, q)
            plain = not forward and reach == np.inf  # then positions are not read
            count += bool(surface < z and (near or plain))
        share = dtype(count) / dtype(len(offsets))
        occlusion[j, i] = dtype(2) * max(dtype(0), share - dtype(0.5)) if remap else share
    return occlusion, outside
