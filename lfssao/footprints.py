"""First hits by the texels that each triangle can cover (``lfssao.kernels.footprints``), where that is little work."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lfssao.kernels import footprints
from lfssao.kernels.coverage import UNITS
from lfssao.kernels.rays import DISPLAY, FLAT_LINEAR, PERSPECTIVE
from lfssao.kernels.tries import first_hits_by_tries
from lfssao.tree import TriangleTree
from lfssao.view import View
from lfssao.window import Window

# Beyond so many tries a texel the tree is faster, by measurement.
TRIES_A_TEXEL = 8.0

# Shares of the triangles for threads: enough to be even, few enough that their counts cost nothing.
_CHUNKS = 16

# Where r = 1 / (alpha + beta z) is bounded, and so rounding is: no nearer to a singular plane than 2^-8 of the way from
# the screen to it, and all that rounding may do a quarter of a unit (``lfssao.kernels.footprints``).
_LARGEST_R = 2.0**8
_ROUNDING = 2.0**-41
_LARGEST_OFFSET = 2.0**30

Hits = tuple[NDArray[np.int32], NDArray[np.float64], NDArray[np.float64]]


def ray_halves(view: View, window: Window) -> tuple[NDArray[np.float64], NDArray[np.float64], float, float]:
    """Rays that fall into a half for columns and a half for rows: of no DISPLAY.

    Parameters
    ----------
    view : View
        Whose rays.
    window : Window
        Which columns and rows.

    Returns
    -------
    columns, rows : (2 W,) float64, (2 H,) float64
        o of x = o + d z of each column of the window, then d; of y of each row.
    near, far : float
        Where the rays begin and end.
    """
    columns, rows = np.empty((2, window.width)), np.empty((2, window.height))
    near, far = footprints.ray_tables(view.ray_kind, view.lens, columns, rows, window.left, window.top)
    return columns.reshape(-1), rows.reshape(-1), near, far


def hits_by_footprint(
    view: View,
    tree: TriangleTree,
    tries: float,
    window: Window | None = None,
    triangle: NDArray[np.int32] | None = None,
    weighted: bool = True,
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
    weighted : bool
        Whether weights are asked for.

    Returns
    -------
    triangle, z, weights : (n,) int32, (n,) float64, (n, 2) float64, or None
        As ``lfssao.kernels.visibility.first_hits`` has them, weights (0, 2) where none are asked for; None where it
        takes more tries, or where rays do not fall into a half for columns and a half for rows (curved screens, conical
        diffusers, calibrated optics).
    """
    window = window or Window.whole(view)
    bounded = _bounded(view, tree, window)
    if bounded is None or bounded.tests > tries * window.texels:
        return None
    columns, rows, near, far, found, counts, kept, _ = bounded
    ends = np.cumsum(counts.T).reshape(counts.T.shape)
    starts = np.ascontiguousarray((ends - counts.T).T)
    members = np.empty((ends[-1, -1], 4), np.int32)
    footprints.sort_into_bands(len(tree.faces), found, kept, starts, members)
    size = window.texels
    triangle = np.empty(size, np.int32) if triangle is None else triangle
    z, weights = np.empty(size), np.empty((size if weighted else 0, 2))
    first_hits_by_tries(
        columns, rows, near, far, tree.corners.reshape(-1), tree.nearest, tree.order, members,
        ends[1:-2:2, -1].copy(), triangle, z, weights.reshape(-1),
    )  # fmt: skip
    return triangle, z, weights


class _Bounded(NamedTuple):
    """The rays of a window, and the triangles by the rows and columns that they can cover."""

    columns: NDArray[np.float64]
    rows: NDArray[np.float64]
    near: float
    far: float
    found: NDArray[np.int32]
    counts: NDArray[np.int64]
    kept: NDArray[np.int64]
    tests: int


def _bounded(view: View, tree: TriangleTree, window: Window) -> _Bounded | None:
    """None where triangles cannot be bounded so."""
    if view.ray_kind == DISPLAY or max(window.width, window.height) > footprints.LARGEST:
        return None
    columns, rows, near, far = ray_halves(view, window)
    u_axis, v_axis = image_axes(view, window, *_scales(tree.bounds, columns, rows, far))
    n_faces, bands = len(tree.faces), -(-window.height // footprints.BAND)
    places, found = np.empty(len(tree.vertices), np.int64), np.empty((n_faces + _CHUNKS, 4), np.int32)
    counts, (kept, tests) = np.empty((_CHUNKS, 2 * bands + 2), np.int64), np.empty((2, _CHUNKS), np.int64)
    footprints.bound_triangles(
        window.width, window.height, u_axis, v_axis, tree.vertices.reshape(-1), tree.faces.reshape(-1), tree.deep,
        bend(view, tree.bounds), places, found, counts, kept, tests,
    )  # fmt: skip
    return _Bounded(columns, rows, near, far, found, counts, kept, int(tests.sum()))


def bend(view: View, bounds: NDArray[np.float64]) -> np.float32:
    """By how much, at most, a unit of z changes kappa of two corners on a triangle (``lfssao.kernels.coverage``).

    log((1 - z / m_z) / (1 - z / z_o)) rises by 1 / (z_o - z) - 1 / (m_z - z), of which both parts are at most what they
    are at the ends of the bounds; a twentieth more than that holds e^s - 1 as long as s is below 1/16, and rounding.
    """
    if view.ray_kind != FLAT_LINEAR:
        return np.float32(0)
    low, high = bounds[:, 2].tolist()
    gaps = [max(low - pole, pole - high) for pole in view.lens[[1, 3]].tolist()]
    return np.float32(1.05 * sum(1 / gap for gap in gaps)) if min(gaps) > 0 else np.float32(np.inf)


def _scales(
    bounds: NDArray[np.float64], columns: NDArray[np.float64], rows: NDArray[np.float64], far: float
) -> tuple[float, float]:
    """Bounds of the numbers that x and y are made of: the corners', the rays', and the lens' and observers' places.

    These places are within |o| + |d| far of the rays', and rounding of o counts |z| / far times in d z.
    """
    x, y, z = np.abs(bounds).max(axis=0).tolist()
    (o_x, d_x), (o_y, d_y) = (np.abs(table).reshape(2, -1).max(axis=1).tolist() for table in (columns, rows))
    return x + 2 * (o_x * (1 + z / far) + d_x * (z + far)), y + 2 * (o_y * (1 + z / far) + d_y * (z + far))


def image_axes(view: View, window: Window, scale_x: float, scale_y: float) -> list[NDArray[np.float64]]:
    """How x, and y, of a corner becomes its place in the image.

    Parameters
    ----------
    view : View
        Of no DISPLAY.
    window : Window
        Whose first column and row places are counted from.
    scale_x, scale_y : float
        Upper bounds of all numbers that x, and y, of corners and rays are made of, cast space.

    Returns
    -------
    list of two (6,) float64
        What ``lfssao.kernels.footprints.bound_triangles`` takes.
    """
    lens, largest = view.lens.tolist(), np.inf
    if view.ray_kind == FLAT_LINEAR:
        m_x, m_z, y_o, z_o, u_scale, u_0, v_scale, v_0 = lens
        u, v = (1.0, -1.0 / m_z, m_x, u_scale, u_0), (1.0, -1.0 / z_o, y_o, v_scale, v_0)
        largest = _LARGEST_R
    else:
        alpha, beta = (0.0, 1.0) if view.ray_kind == PERSPECTIVE else (1.0, 0.0)
        u, v = (alpha, beta, 0.0, lens[0], lens[2]), (alpha, beta, 0.0, -lens[1], lens[3])
    axes = []
    for (alpha, beta, c, a, b), first, scale in ((u, window.left, scale_x), (v, window.top, scale_y)):
        limit = min(largest, 0.25 / (_ROUNDING * scale * abs(a) * UNITS))
        if not abs(a * c) + abs(b) + first < _LARGEST_OFFSET:
            limit = 0.0
        offset = ((a * c + b) - first) - 0.5
        axes.append(np.array([alpha, beta, c, a * UNITS, offset * UNITS, limit]))
    return axes
