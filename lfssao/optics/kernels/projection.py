"""World -> image: the place and the depth at which a point lands in a texture (LF sections 3 and 4).

A projection is a kind and its numbers, so that a kernel is compiled once for all displays and cameras. The numbers are
the rows of M, then ``Slits`` or ``lfssao.optics.kernels.display.DisplayModule``; ``lfssao.optics.view.WorldToImage``
has the equations.

CROSSED_SLITS is the flat display with the linear diffuser, defined for z_o < Z < z_m. One ray of it passes through two
slits, the module's vertical line and the observer line, so the two coordinates have different denominators and no 4x4
matrix does it. MATRIX is a camera, defined for q > 0; DISPLAY any module of any display.

Image space: u right and v down in texels, texel (i, j) covers [i, i+1) x [j, j+1); z grows away from the viewer.
"""

from typing import Any, NamedTuple

import numpy as np

from lfssao.core.jit import formula, kernel
from lfssao.optics.kernels.display import VALID, display_module, display_to_image, physical_to_image

CROSSED_SLITS = 0
MATRIX = 1
DISPLAY = 2


class Projection(NamedTuple):
    """A mapping world -> image."""

    kind: int  # CROSSED_SLITS, MATRIX or DISPLAY
    numbers: Any  # the kind's parameters, (16,) or (44,); their dtype is that of the arithmetic


class Slits(NamedTuple):
    """Parameters 12 to 15 of CROSSED_SLITS."""

    z_m: Any
    z_o: Any
    u_0: Any
    v_0: Any


@formula
def slits_of(m: Any) -> Any:
    """Parameters 12 to 15 of CROSSED_SLITS by their names."""
    return Slits(m[12], m[13], m[14], m[15])


@formula
def affine_row(m: Any, row: Any, x: Any, y: Any, z: Any) -> Any:
    """Row of M (x, y, z, 1): ((m0 x + m1 y) + m2 z) + m3, m a flat array of rows of four."""
    k = 4 * row
    return ((m[k] * x + m[k + 1] * y) + m[k + 2] * z) + m[k + 3]


@formula
def linear_row(m, row, x, y, z):
    """Row of M (x, y, z, 0): (m0 x + m1 y) + m2 z, m a flat array of rows of four."""
    k = 4 * row
    return (m[k] * x + m[k + 1] * y) + m[k + 2] * z


@formula
def project_crossed_slits(slits: Any, a: Any, b: Any, c: Any) -> Any:
    """The half of CROSSED_SLITS that is not affine, of (X, Y, Z) = (a, b, c): u, v, image z, whether it is defined."""
    u, v = slits.u_0 + a / (slits.z_m - c), slits.v_0 + b / (slits.z_o - c)
    return u, v, c, (c < slits.z_m) & (c > slits.z_o)


@formula
def project_matrix(a: Any, b: Any, c: Any, q: Any) -> Any:
    """The half of MATRIX that is not affine: u, v, image z, whether it is defined."""
    return a / q, b / q, c / q, q > 0


@formula
def last_below(size):
    """The largest number below a size in texels: size (1 - 2^-24) in float32, which rounds to it for every size."""
    one = type(size)(1)
    below = one - type(size)(2.0**-53)  # 1 in float32; numba takes a tenth of a second to look up a dtype's own
    return size * (below if below < one else one - type(size)(2.0**-24))


@formula
def hold_inside(u, last):
    """An image coordinate held between 0 and ``last``, the last number inside; u where it is inside, 0 for NaN.

    Loops that shall become vectors call this in place of nearest_texel: LLVM branches on a bool out of a tuple.
    """
    return min(last, max(type(last)(0), u))


@formula
def signed_texel_number(column, row, width):
    """Row * width + column, int32, of image coordinates inside the texture (64 bits would halve the speed)."""
    return np.int32(np.int32(np.int32(row) * np.int32(width)) + np.int32(column))


@formula
def texel_number(column, row, width):
    """Row * width + column, uint32, of image coordinates inside the texture (a known sign doubles the speed)."""
    return np.uint32(signed_texel_number(column, row, width)) & np.uint32(0x7FFFFFFF)


@formula
def nearest_texel(u, v, width, height):
    """Whether image point (u, v) lies in the texture, and the number of its texel, uint32; of the nearest outside."""
    column, row = hold_inside(u, last_below(width)), hold_inside(v, last_below(height))
    return (column == u) & (row == v), texel_number(column, row, width)


@formula
def image_of(kind, lens, a, b, q, z):
    """Image point u, v of a point with rows a, b and divisor q at cast z, and whether the mapping is defined there."""
    if kind == CROSSED_SLITS:
        return lens[2] + a / (lens[0] - z), lens[3] + b / (lens[1] - z), (z < lens[0]) & (z > lens[1])
    if kind == MATRIX:
        return a / q, b / q, q > 0
    return display_to_image(display_module(lens), a, b, z)


@kernel
def project(projection, a, b, c, q):
    """The half of a mapping that is not affine, from rows 0 to 3 of M (x, y, z, 1); q is read for kind MATRIX alone."""
    kind, m = projection
    if kind == CROSSED_SLITS:
        return project_crossed_slits(slits_of(m), a, b, c)
    if kind == DISPLAY:
        u, v, status = physical_to_image(display_module(m[12:]), a, b, c)
        return u, v, c, status == VALID
    return project_matrix(a, b, c, q)


@kernel
def world_to_image(projection, x, y, z):
    """Image coordinates u and v, texels, and image z of a world point, and whether the mapping is defined there.

    The three mean nothing if it is not; if it is, the point may still lie outside the texture.
    """
    kind, m = projection
    a, b, c = affine_row(m, 0, x, y, z), affine_row(m, 1, x, y, z), affine_row(m, 2, x, y, z)
    return project(projection, a, b, c, affine_row(m, 3, x, y, z) if kind == MATRIX else type(x)(0))


@kernel
def land(projection, points, image):
    """Image coordinates of (n, 3) world points into image (n, 3), same dtype; NaN outside the mapping's domain."""
    for k in range(points.shape[0]):
        u, v, z, valid = world_to_image(projection, points[k, 0], points[k, 1], points[k, 2])
        image[k, 0] = u if valid else np.nan
        image[k, 1] = v if valid else np.nan
        image[k, 2] = z if valid else np.nan
