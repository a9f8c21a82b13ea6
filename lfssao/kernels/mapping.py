"""World -> image: where a point lands in a texture, and how deep (LF sections 3 and 4).

A mapping is a kind and sixteen numbers, so that a kernel is compiled once for all displays and cameras.

CROSSED_SLITS, the flat display with the linear diffuser. One ray of it passes through two slits, the module's
vertical line and the observer line, so the two coordinates have different denominators and no 4x4 matrix does it:

    (X, Y, Z) = M (x, y, z, 1)          M: rows of four, parameters 0 to 11
    u = u_0 + X / (z_m - Z)             z_m: parameter 12, u_0: parameter 14
    v = v_0 + Y / (z_o - Z)             z_o: parameter 13, v_0: parameter 15
    image z = Z, defined for z_o < Z < z_m

X and Y are x - m_x and y - y_o of physical space times what does not depend on the point: m_z W / w and z_o (-H / h).

MATRIX, a camera:

    (a, b, c, q) = M (x, y, z, 1)       M: rows of four, parameters 0 to 15
    u = a / q,  v = b / q,  image z = c / q, defined for q > 0

Image space: u right and v down in texels, texel (i, j) covers [i, i+1) x [j, j+1); z grows away from the viewer.
"""

import numpy as np

from lfssao.kernels.jit import kernel

CROSSED_SLITS = 0
MATRIX = 1
PARAMETER_COUNT = 16


@kernel
def affine_row(m, row, x, y, z):
    """Row of M (x, y, z, 1): ((m0 x + m1 y) + m2 z) + m3, m a flat array of rows of four."""
    k = 4 * row
    return ((m[k] * x + m[k + 1] * y) + m[k + 2] * z) + m[k + 3]


@kernel
def linear_row(m, row, x, y, z):
    """Row of M (x, y, z, 0): (m0 x + m1 y) + m2 z, m a flat array of rows of four."""
    k = 4 * row
    return (m[k] * x + m[k + 1] * y) + m[k + 2] * z


@kernel
def world_to_image(kind, m, x, y, z):
    """Image coordinates of a world point.

    Parameters
    ----------
    kind : int
        CROSSED_SLITS or MATRIX.
    m : (16,) float32 or float64
        The mapping's numbers; their dtype is that of the arithmetic.
    x, y, z : scalars of the same dtype
        World coordinates.

    Returns
    -------
    u, v, depth : scalars
        Texels, texels, image z. Finite or not, they mean nothing where ``valid`` is False.
    valid : bool
        Whether the point lies in the mapping's domain (it may still lie outside the texture).
    """
    if kind == CROSSED_SLITS:
        depth = affine_row(m, 2, x, y, z)
        u = m[14] + affine_row(m, 0, x, y, z) / (m[12] - depth)
        v = m[15] + affine_row(m, 1, x, y, z) / (m[13] - depth)
        return u, v, depth, (depth < m[12]) & (depth > m[13])
    q = affine_row(m, 3, x, y, z)
    u = affine_row(m, 0, x, y, z) / q
    v = affine_row(m, 1, x, y, z) / q
    return u, v, affine_row(m, 2, x, y, z) / q, q > 0


@kernel
def locate_crossed_slits(points, offset, m, width, height, texel, threshold):
    """Texel and depth of one sample around each point of a row, CROSSED_SLITS.

    The map's affine half is applied to point and offset separately, once a point and once a sample instead of once
    a pair; what is left per pair is (points + offset) and the two divisions.

    Parameters
    ----------
    points : (4, n) array
        Row 0 to 2: X, Y, Z of the points.
    offset : (4,) array
        X, Y, Z of the sample's offset, linear part only.
    m : (16,) array
        The mapping's numbers.
    width, height : int
        Size of the texture, texels.
    texel : (n,) int32
        Out: number of the texel, row * width + column; any valid number where the sample is outside.
    threshold : (n,) array
        Out: image z of the sample; -infinity where it is outside the texture or the mapping's domain.
    """
    zero, outside = m.dtype.type(0), m.dtype.type(-np.inf)
    wide, high = m.dtype.type(width), m.dtype.type(height)
    last_u, last_v = m.dtype.type(width - 1), m.dtype.type(height - 1)
    row_length = np.int32(width)
    z_module, z_observer, u_0, v_0 = m[12], m[13], m[14], m[15]
    ox, oy, oz = offset[0], offset[1], offset[2]
    px, py, pz = points[0], points[1], points[2]
    # No branch, no gather and no 64-bit product in this loop, so LLVM turns it into vectors.
    for i in range(texel.shape[0]):
        z = pz[i] + oz
        u = u_0 + (px[i] + ox) / (z_module - z)
        v = v_0 + (py[i] + oy) / (z_observer - z)
        inside = (z < z_module) & (z > z_observer) & (u >= zero) & (u < wide) & (v >= zero) & (v < high)
        column = u if u > zero else zero  # NaN becomes 0 here
        column = column if column < last_u else last_u
        line = v if v > zero else zero
        line = line if line < last_v else last_v
        texel[i] = np.int32(np.int32(np.int32(line) * row_length) + np.int32(column))
        threshold[i] = z if inside else outside


@kernel
def locate_matrix(points, offset, m, width, height, texel, threshold):
    """Texel and depth of one sample around each point of a row, MATRIX; arguments of locate_crossed_slits.

    Rows 0 to 3 of points and offset are a, b, c, q.
    """
    zero, outside = m.dtype.type(0), m.dtype.type(-np.inf)
    wide, high = m.dtype.type(width), m.dtype.type(height)
    last_u, last_v = m.dtype.type(width - 1), m.dtype.type(height - 1)
    row_length = np.int32(width)
    oa, ob, oc, oq = offset[0], offset[1], offset[2], offset[3]
    pa, pb, pc, pq = points[0], points[1], points[2], points[3]
    for i in range(texel.shape[0]):
        q = pq[i] + oq
        u = (pa[i] + oa) / q
        v = (pb[i] + ob) / q
        z = (pc[i] + oc) / q
        inside = (q > zero) & (u >= zero) & (u < wide) & (v >= zero) & (v < high)
        column = u if u > zero else zero
        column = column if column < last_u else last_u
        line = v if v > zero else zero
        line = line if line < last_v else last_v
        texel[i] = np.int32(np.int32(np.int32(line) * row_length) + np.int32(column))
        threshold[i] = z if inside else outside
