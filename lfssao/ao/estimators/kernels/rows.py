"""Where a row of points lands in a texture: what estimators share that look up one sample of many texels at a time.

A point's mapping has an affine half, rows 0 to 2 (3 for a camera) of M (x, y, z, 1), and the rest: offsets of samples
can be added to the first half before the second is done once.
"""

import numpy as np

from lfssao.core.jit import kernel
from lfssao.optics.kernels.display import VALID, display_module, physical_to_image
from lfssao.optics.kernels.projection import (
    CROSSED_SLITS,
    MATRIX,
    affine_row,
    hold_inside,
    last_below,
    nearest_texel,
    project_crossed_slits,
    project_matrix,
    slits_of,
    texel_number,
)


@kernel(inline=True)
def load_row(texture, start, n, row):
    """The vectors of n texels from texel number ``start`` on, texture (3 H W,), into row (3, >= n).

    One flat array, 3 t + k: so LLVM takes vectors apart with shuffles; of a second index it makes gathers.
    """
    for i in range(n):
        t = np.uint64(3) * (np.uint64(start) + np.uint64(i))
        row[0, i], row[1, i], row[2, i] = texture[t], texture[t + np.uint64(1)], texture[t + np.uint64(2)]


@kernel(inline=True)
def affine_rows(projection, n, points, rows):
    """The mapping's affine half of n points (3, >= n) into rows (4, >= n); row 3 is a camera's, else row 2 again."""
    kind, m = projection
    for i in range(n):
        x, y, z = points[0, i], points[1, i], points[2, i]
        rows[0, i], rows[1, i] = affine_row(m, 0, x, y, z), affine_row(m, 1, x, y, z)
        rows[2, i] = affine_row(m, 2, x, y, z)
        rows[3, i] = affine_row(m, 3, x, y, z) if kind == MATRIX else rows[2, i]


@kernel(inline=True)
def project_rows(projection, width, height, n, a, b, c, q, texel, z, inside):
    """Where n points land.

    Parameters
    ----------
    projection : Projection
        The mapping.
    width, height : scalars of its dtype
        Size of the texture.
    n : int
        How many points.
    a, b, c, q : (>= n,) arrays
        The points after the mapping's affine half, an array a row of M; q is a camera's.
    texel, z, inside : (>= n,) uint32, dtype, bool
        Out: the texel (any one where the point lands outside); image z; whether it is in the texture and the domain.
    """
    (kind, m), last_u, last_v = projection, last_below(width), last_below(height)
    if kind == CROSSED_SLITS:
        slits = slits_of(m)
        for i in range(n):
            u, v, w, _ = project_crossed_slits(slits, a[i], b[i], c[i])
            column, row = hold_inside(u, last_u), hold_inside(v, last_v)
            texel[i], z[i] = texel_number(column, row, width), w
            inside[i] = (column == u) & (row == v) & (w < slits.z_m) & (w > slits.z_o)
    elif kind == MATRIX:
        for i in range(n):
            u, v, w, _ = project_matrix(a[i], b[i], c[i], q[i])
            column, row = hold_inside(u, last_u), hold_inside(v, last_v)
            texel[i], z[i] = texel_number(column, row, width), w
            inside[i] = (column == u) & (row == v) & (q[i] > 0)
    else:
        module = display_module(m[12:])
        for i in range(n):
            u, v, answer = physical_to_image(module, a[i], b[i], c[i])
            z[i] = c[i]
            there, texel[i] = nearest_texel(u, v, width, height)
            inside[i] = there & (answer == VALID)
