"""First hits by the texels that each triangle can cover (``lfssao.kernels.footprints``), where that is little work."""

import numpy as np
from numpy.typing import NDArray

from lfssao.kernels import footprints
from lfssao.kernels.rays import DISPLAY
from lfssao.tree import TriangleTree
from lfssao.view import View
from lfssao.window import Window

# Beyond so many tries a texel the tree is faster, by measurement.
TRIES_A_TEXEL = 8.0

# Shares of the triangles for threads: enough to be even, few enough that their counts cost nothing.
_CHUNKS = 64

Hits = tuple[NDArray[np.int32], NDArray[np.float64], NDArray[np.float64]]


def hits_by_footprint(
    view: View,
    tree: TriangleTree,
    tries: float,
    window: Window | None = None,
    triangle: NDArray[np.int32] | None = None,
) -> Hits | None:
    """The first triangle of every texel's ray, if no more than so many tries a texel find it.

    Parameters
    ----------
    view : View
        Where from.
    tree : TriangleTree
        The triangles, cast space.
    tries : float
        How many tries a texel, on average, are worth it.
    window : Window, optional
        Which texels; all by default.
    triangle : (n,) int32, optional
        Where to write the triangles.

    Returns
    -------
    triangle, z, weights : (n,) int32, (n,) float64, (n, 2) float64, or None
        As ``lfssao.kernels.visibility.first_hits`` has them; None where it takes more tries, or where rays do not fall
        into a half for columns and a half for rows (curved screens, conical diffusers, calibrated optics).
    """
    if view.ray_kind == DISPLAY:
        return None
    left, top, _, _ = window = window or Window.whole(view)
    columns, rows = np.empty((window.width, 2)), np.empty((window.height, 2))
    near, far = footprints.ray_tables(view.ray_kind, view.lens, columns, rows, left, top)
    bands = -(-window.height // footprints.BAND)
    reaches, boxes = np.empty((len(tree.vertices), 4), np.int32), np.empty((len(tree.faces), 4), np.int32)
    counts, tests = np.empty((_CHUNKS, bands), np.int64), np.empty(_CHUNKS, np.int64)
    footprints.bound_triangles(
        view.ray_kind, view.lens, window.width, window.height, *_scales(tree.bounds, columns, rows, far),
        tree.vertices, tree.faces, reaches, boxes, counts, tests, left, top,
    )  # fmt: skip
    size = window.texels
    if tests.sum() > tries * size:
        return None
    ends = np.cumsum(counts.T).reshape(bands, _CHUNKS)
    starts = np.ascontiguousarray((ends - counts.T).T)
    members = np.empty(ends[-1, -1], np.int32)
    footprints.sort_into_bands(boxes, starts, members)
    triangle = np.empty(size, np.int32) if triangle is None else triangle
    z, weights = np.empty(size), np.empty((size, 2))
    footprints.first_hits_by_footprint(
        columns, rows, near, far, tree.corners, tree.order, boxes, members, ends[:, -1].copy(), triangle, z, weights
    )
    return triangle, z, weights


def _scales(
    bounds: NDArray[np.float64], columns: NDArray[np.float64], rows: NDArray[np.float64], far: float
) -> tuple[float, float]:
    """Bounds of the numbers that x and y are made of: the corners', the rays', and the lens' and observers' places.

    These places are within |o| + |d| far of the rays', and rounding of o counts |z| / far times in d z.
    """
    x, y, z = np.abs(bounds).max(axis=0).tolist()
    (o_x, d_x), (o_y, d_y) = np.abs(columns).max(axis=0).tolist(), np.abs(rows).max(axis=0).tolist()
    return x + 2 * (o_x * (1 + z / far) + d_x * (z + far)), y + 2 * (o_y * (1 + z / far) + d_y * (z + far))
