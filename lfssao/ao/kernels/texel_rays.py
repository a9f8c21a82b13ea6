"""Rays of texels: the points that land on an image point, and the one of them at a depth (SAO equation 3).

The points that land on image point (u, v) are a straight ray in cast space, (x(z), y(z), z). Its numbers:

separable   x = (a + b U) + z (c + d U) with U = u - u_c: five numbers, u_c, a, b, c, d, then as many for y and v.
            Cameras, whose a = b = 0 (perspective, equation 3) or c = d = 0 (orthographic), and flat displays with the
            linear diffuser, where both parts are needed.
a table     four numbers a texel, a, b, c, d: x = a + b z, y = c + d z, NaN where it has no ray. Any display.

Equation 3 in these letters: (1 - P_02) / P_00 - 2 (x' + 1/2) / (w P_00) is -(c + d U), as the paper's z is negative.
Its y term has one minus too many; ours is that for which projecting the point gives the texel back.
"""

from typing import Any, NamedTuple

import numpy as np

from lfssao.core.intrinsics import memory_of
from lfssao.core.jit import formula
from lfssao.core.numbers import known, line, number, unless_none
from lfssao.core.places import affine
from lfssao.core.vectors import Vector


class TexelRays(NamedTuple):
    """The rays of a view's texels in cast space, arrays of the arithmetic's dtype.

    numbers: (10,) of separable rays. table: (4, H * W), or None of separable rays. world: (12,), rows of four of the
    affine map cast space -> world. units: (3,) float64, world length of a unit along each axis of cast space. origin: z
    of cast space from which distances from the viewer are counted, 0 for a camera, the observers' z for a module.
    """

    numbers: np.ndarray
    table: Any
    world: np.ndarray
    units: np.ndarray
    origin: float


@formula
def _bare(rays):
    return TexelRays(memory_of(rays.numbers), rays.table, memory_of(rays.world), memory_of(rays.units), rays.origin)


@formula
def bare_rays(rays: Any) -> Any:
    """Rays whose numbers are bare memory, or None of None."""
    return unless_none(rays, None, _bare, ())


@formula
def _separable(m, u, v):
    """The ray of an image point: x and y at cast z 0, and by how much they change with z."""
    start = line(m[1], m[2], u, m[0]), line(m[6], m[7], v, m[5])
    return start, (line(m[3], m[4], u, m[0]), line(m[8], m[9], v, m[5]))


@formula
def ray(table, numbers, column, row, texel, like):
    """A texel's ray: x and y at cast z 0, and by how much they change with z."""
    if table is None:
        u, v = known(number(column, like) + 0.5, column + 0.5), known(number(row, like) + 0.5, row + 0.5)
        return _separable(numbers, u, v)
    start = number(table[0, texel], like), number(table[2, texel], like)
    return start, (number(table[1, texel], like), number(table[3, texel], like))


@formula
def ray_of(view, texel, like):
    """``ray`` of a view's texel, numbers of the kind of another."""
    return ray(view.rays.table, view.rays.numbers, view.column(texel), view.row(texel), texel, like)


@formula
def _on(rays, line_of, z):
    """World coordinates of the point of a ray at cast z."""
    (a, b), (c, d) = line_of
    at = Vector(a + z * c, b + z * d, z)
    return Vector(affine(rays.world, 0, at), affine(rays.world, 1, at), affine(rays.world, 2, at))


@formula
def ray_point(rays, column, row, texel, z):
    """World coordinates of the point of a texel's ray at cast z (equation 3)."""
    return _on(rays, ray(rays.table, rays.numbers, column, row, texel, z), z)


@formula
def point_at(rays: Any, u: Any, v: Any, z: Any) -> Any:
    """World coordinates of the point at cast z on the ray through an image point; the rays are separable."""
    return _on(rays, _separable(rays.numbers, u, v), z)


@formula
def on_ray(view: Any, texel: Any, z: Any) -> Any:
    """``ray_point`` of a view's texel."""
    return ray_point(view.rays, view.column(texel), view.row(texel), texel, z)
