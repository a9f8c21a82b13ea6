"""First hits by conservative rasterisation, for separable rays (``lfssao.gbuffer.kernels.rasterize``)."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lfssao.gbuffer.kernels import rasterize
from lfssao.gbuffer.trees import TriangleTree
from lfssao.optics.kernels.projection import CROSSED_SLITS, DISPLAY
from lfssao.optics.kernels.rays import FlatModule, Pinhole
from lfssao.optics.view import View

# The tree is as fast or faster with more candidate pairs a texel, by measurement.
MOST_PAIRS = 64.0

# Bounds of rounding (``lfssao.gbuffer.kernels.rasterize``).
_ROUNDING = 2.0**-41
_LARGEST_R = 2.0**8
_LARGEST_OFFSET = 2.0**30


class Candidates(NamedTuple):
    """The rays of some rows, and the texels in which each triangle can be hit."""

    rays: rasterize.SeparableRays
    bounds: NDArray[np.int32]  # (F, 4): first and last column, first and last row
    in_band: NDArray[np.int64]  # number of triangles of each band of rows
    pairs: int  # of a triangle and a texel


def candidate_pairs(view: View, tree: TriangleTree, rows: range) -> Candidates | None:
    """Return texels of some rows in which each triangle can be hit; None on displays whose rays are not separable."""
    if view.rays.kind == DISPLAY:
        return None
    columns = np.empty((2, view.width))
    lines = np.empty((2, len(rows)))
    near, far = rasterize.separable_rays(view.rays, columns, lines, rows.start)
    # Bounds of the numbers that x and y are made of: the corners', the rays', and the lens' and observers' places.
    # These are within |o| + |d| far of the rays'; rounding of o counts |z| / far times in d z.
    *places, z = np.abs(tree.bounds).max(axis=0).tolist()
    rays = (np.abs(table).max(axis=1).tolist() for table in (columns, lines))
    scales = (x + 2 * (o * (1 + z / far) + d * (z + far)) for x, (o, d) in zip(places, rays, strict=True))
    axes = image_axes(view, rows, *scales)
    corner_texels = np.empty((len(tree.vertices), 4), np.int32)
    bounds = np.empty((len(tree.faces), 4), np.int32)
    size = view.width, len(rows)
    rasterize.bound_corners(*size, *axes, tree.vertices, corner_texels)
    rasterize.bound_triangles(*size, tree.faces, corner_texels, bounds)
    in_band = np.zeros(-(-len(rows) // rasterize.BAND), np.int64)
    pairs = rasterize.count_candidates(bounds, in_band)
    return Candidates(rasterize.SeparableRays(columns, lines, near, far), bounds, in_band, pairs)


def first_hits(candidates: Candidates, tree: TriangleTree, triangle: NDArray[np.int32], z: NDArray[np.float64]) -> None:
    """Write the first triangle, int32, -1 for none, and z, float64, of every texel's ray among its candidates."""
    ends = np.cumsum(candidates.in_band)
    members = np.empty(ends[-1], np.int32)
    rasterize.sort_into_bands(candidates.bounds, ends - candidates.in_band, members)
    rasterize.first_hits(candidates.rays, tree.arrays, candidates.bounds, members, ends, triangle, z)


def image_axes(view: View, rows: range, scale_x: float, scale_y: float) -> list[NDArray[np.float64]]:
    """Return numbers that take x, and y, of a corner to its image, two of (6,) float64 (``bound_corners``).

    scale_x, scale_y: upper bounds of all numbers that x, and y, of corners and rays are made of, cast space.
    """
    largest = np.inf
    if view.rays.kind == CROSSED_SLITS:
        m_x, m_z, y_o, z_o, u_scale, u_0, v_scale, v_0 = FlatModule(*view.lens.tolist())
        u = (1.0, -1.0 / m_z, m_x, u_scale, u_0)
        v = (1.0, -1.0 / z_o, y_o, v_scale, v_0)
        largest = _LARGEST_R
    else:
        camera = Pinhole(*view.lens.tolist())
        alpha, beta = (1.0, 0.0) if camera.orthographic else (0.0, 1.0)
        u = (alpha, beta, 0.0, camera.f_u, camera.c_u)
        v = (alpha, beta, 0.0, -camera.f_v, camera.c_v)
    axes = []
    for (alpha, beta, c, a, b), first, scale in ((u, 0, scale_x), (v, rows.start, scale_y)):
        limit = min(largest, 2.0**-12 / (_ROUNDING * scale * abs(a)))
        if not abs(a * c) + abs(b) + first < _LARGEST_OFFSET:
            limit = 0.0
        axes.append(np.array([alpha, beta, c, a, ((a * c + b) - first) - 0.5, limit]))
    return axes
