"""A marble bust in drapery on a turned socle, from implicit surfaces."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from assembly import Piece, merged, sky_lit, vertex_normals
from implicit import Array, Part, Triple, both_sides, capsule, ellipsoid, field_at, groove, intersection, sphere, wave
from numpy.typing import NDArray

from lfssao.core.elementary import sincospi
from lfssao.scene.mesh import Mesh

FloatArray = NDArray[np.float64]

_MARBLE = (0.88, 0.85, 0.79)
_CLOTH = (0.80, 0.66, 0.50)
_SOCLE = (0.36, 0.33, 0.31)
COLUMNS = 36  # of the bust's net; with _STATIONS and the socle's sizes 5,010 faces: a closed surface has an
# even number, and the paper's statue has 5,011
# The net's rows: number; height on the axis from which the rays start; their elevation in degrees, and by how
# much it is less in front, so that the cloth's rows sag from shoulder to shoulder.
_STATIONS = (
    (0, 1.64, 78.0, 0.0), (4, 1.66, 38.0, 0.0), (8, 1.66, 14.0, 0.0), (10, 1.65, 4.0, 0.0),
    (18, 1.55, 0.0, 0.0), (26, 1.44, -3.0, 0.0), (33, 1.36, -6.0, 0.0), (36, 1.32, -12.0, 0.0),
    (38, 1.33, -38.0, 0.0), (40, 1.20, -8.0, 0.0), (41, 1.10, 8.0, 0.0), (44, 1.00, 32.0, 48.0),
    (45, 1.00, 30.0, 48.0), (59, 0.82, -50.0, 0.0), (62, 0.62, -75.0, 0.0),
)  # fmt: skip
_CLOTH_ROWS = (45, 59)
_FOLD = (0.045, 0.026, 0.004)  # how far a fold's three rows stand out from the body, scene units
_ENDS: tuple[Triple, Triple] = ((0.0, 1.64, 0.0), (0.0, 0.60, 0.0))
_SEGMENTS = 21
# Radius and height of the turned socle's rings, from its foot up into the bust.
_PROFILE = (
    (0.30, 0.09), (0.30, 0.15), (0.285, 0.17), (0.22, 0.19), (0.175, 0.24), (0.16, 0.31),
    (0.17, 0.36), (0.21, 0.39), (0.215, 0.42), (0.19, 0.44), (0.15, 0.50),
)  # fmt: skip


def statue() -> Mesh:
    """Bust that faces +Z on a socle that stands on y = 0.

    Returns
    -------
    Mesh
        5,010 faces with linear RGB at the vertices, 2 scene units high: three closed surfaces (bust, turned
        socle, plinth) that reach into each other.
    """
    parts = [*_torso(), *_neck(), *_head(), *_face(), *_hair()]
    rows, front, starts, directions = _net_rays()
    reach = _way_out(parts, starts, directions) + _folds(rows, front)
    vertices = starts + reach[:, None] * directions
    faces = _net_faces(vertices)
    clothed = (rows >= _CLOTH_ROWS[0]) & (rows <= _CLOTH_ROWS[1])
    albedo = np.where(clothed[:, None], np.array(_CLOTH), np.array(_MARBLE))
    bust = vertices, faces, sky_lit(albedo, vertex_normals(vertices, faces))
    return merged([bust, _turned_socle(), _plinth()], "statue")


def _net_rays() -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Rays from the bust's axis, row by row from the crown down, then one to either end.

    Few faces go further on such a net than with marching cubes: it is dense in the face and runs along folds.

    Returns
    -------
    rows, front : (V,) float64
        Row of each ray (-1 for the ends); cosine of its direction from +Z about the axis.
    starts, directions : (V, 3) float64
        Scene units; unit vectors.
    """
    columns = [k / COLUMNS if 2 * k <= COLUMNS else k / COLUMNS - 1.0 for k in range(COLUMNS)]
    # Columns are 2.5 times as dense in front as on average.
    sides = np.array([sincospi(2.0 * u * (0.40 + 2.4 * u * u)) for u in columns])
    sag = np.maximum(sides[:, 1], 0.0) * np.maximum(sides[:, 1], 0.0)
    starts = []
    directions = []
    for height, elevation, drop in _rows():
        tilt = np.array([sincospi((elevation - drop * s) / 180.0) for s in sag.tolist()])
        starts.append(np.broadcast_to(np.array([0.0, height, 0.0]), (COLUMNS, 3)))
        across = sides[:, 0] * tilt[:, 1]
        forward = sides[:, 1] * tilt[:, 1]
        directions.append(np.stack([across, tilt[:, 0], forward], axis=1))
    rows = np.repeat(np.arange(len(starts), dtype=np.float64), COLUMNS)
    front = np.tile(sides[:, 1], len(starts))
    starts.append(np.array(_ENDS))
    directions.append(np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]]))
    rows = np.concatenate([rows, [-1.0, -1.0]])
    front = np.concatenate([front, [0.0, 0.0]])
    return rows, front, np.concatenate(starts), np.concatenate(directions)


def _rows() -> list[tuple[float, float, float]]:
    """Height, elevation and sag of every row, linear between the stations."""
    rows = []
    for (first, *low), (last, *high) in pairwise(_STATIONS):
        for row in range(first, last):
            share = (row - first) / (last - first)
            height, elevation, drop = (a + share * (b - a) for a, b in zip(low, high, strict=True))
            rows.append((height, elevation, drop))
    return [*rows, _STATIONS[-1][1:]]


def _way_out(parts: Sequence[Part], starts: FloatArray, directions: FloatArray) -> FloatArray:
    """Distance at which each ray first leaves the solid, to 1/2**20: steps of 1/32, then halving."""
    steps = np.arange(28) / 32.0
    points = starts[:, None] + steps[:, None] * directions[:, None]
    outside = field_at(parts, points[..., 0], points[..., 1], points[..., 2]) > 0.0
    high: FloatArray = np.argmax(outside, axis=1) / 32.0
    low = high - 1.0 / 32.0
    for _ in range(15):
        middle = (low + high) / 2.0
        beyond = field_at(parts, *(starts + middle[:, None] * directions).T) > 0.0
        low = np.where(beyond, low, middle)
        high = np.where(beyond, middle, high)
    return high


def _folds(rows: FloatArray, front: FloatArray) -> FloatArray:
    """How far the cloth stands out: each third row a crest, which swells and fades on its way."""
    below = rows - _CLOTH_ROWS[0]
    fold = np.floor(below / 3.0)
    height = np.array(_FOLD)[(below - 3.0 * fold).astype(np.int64)]
    fading = 0.78 + 0.22 * wave(0.45 * front + 0.37 * fold)
    clothed = (rows >= _CLOTH_ROWS[0]) & (rows <= _CLOTH_ROWS[1])
    return np.where(clothed, height * fading + 0.006, 0.0)


def _net_faces(vertices: FloatArray) -> NDArray[np.int64]:
    """Two triangles a cell, parted along its shorter diagonal, and a fan at either end."""
    rows = len(vertices) // COLUMNS
    k = np.arange(COLUMNS)
    following = (k + 1) % COLUMNS
    first = np.arange(rows - 1)[:, None] * COLUMNS
    a = (first + k).ravel()
    b = (first + following).ravel()
    c = b + COLUMNS
    d = a + COLUMNS
    across = vertices[c] - vertices[a]
    along = vertices[d] - vertices[b]
    ac = across[:, 0] * across[:, 0] + across[:, 1] * across[:, 1] + across[:, 2] * across[:, 2]
    bd = along[:, 0] * along[:, 0] + along[:, 1] * along[:, 1] + along[:, 2] * along[:, 2]
    one = np.where((ac < bd)[:, None], np.stack([a, d, c], axis=1), np.stack([a, d, b], axis=1))
    two = np.where((ac < bd)[:, None], np.stack([a, c, b], axis=1), np.stack([b, d, c], axis=1))
    top = rows * COLUMNS
    foot = rows * COLUMNS + 1
    last = (rows - 1) * COLUMNS
    crown = np.stack([k, following, np.full(COLUMNS, top)], axis=1)
    base = np.stack([last + following, last + k, np.full(COLUMNS, foot)], axis=1)
    return np.concatenate([one, two, crown, base])


def _torso() -> list[Part]:
    chest = ellipsoid((0.0, 0.84, -0.02), (0.50, 0.28, 0.26))
    waist = capsule((0.0, 0.56, -0.01), (0.0, 0.78, -0.01), 0.17, 0.26)
    shoulder = capsule((0.18, 0.98, -0.05), (0.44, 0.86, -0.05), 0.14, 0.16)
    return [chest, waist.joined(0.15), *both_sides([shoulder.joined(0.1)])]


def _neck() -> list[Part]:
    muscle = capsule((0.125, 1.44, -0.04), (0.035, 1.07, 0.13), 0.035, 0.03)
    return [
        capsule((0.0, 0.98, -0.06), (0.0, 1.42, -0.03), 0.165, 0.135).joined(0.12),
        *both_sides([muscle.joined(0.05)]),
        *both_sides([capsule((0.04, 1.045, 0.15), (0.26, 1.07, 0.07), 0.025, 0.03).joined(0.06)]),
    ]


def _head() -> list[Part]:
    return [
        ellipsoid((0.0, 1.70, -0.05), (0.235, 0.25, 0.29)).joined(0.08),
        ellipsoid((0.0, 1.53, 0.06), (0.19, 0.28, 0.205)).joined(0.06),
        ellipsoid((0.0, 1.38, 0.05), (0.155, 0.12, 0.17)).joined(0.06),
        sphere((0.0, 1.285, 0.185), 0.055).joined(0.09),
    ]


def _face() -> list[Part]:
    halves = [
        ellipsoid((0.088, 1.590, 0.260), (0.060, 0.040, 0.035)).cutting(0.05),
        capsule((0.028, 1.655, 0.252), (0.150, 1.650, 0.180), 0.024, 0.022).joined(0.03),
        sphere((0.115, 1.490, 0.165), 0.055).joined(0.06),
        ellipsoid((0.086, 1.588, 0.200), (0.054, 0.034, 0.040)).joined(0.005),
        capsule((0.038, 1.606, 0.222), (0.088, 1.624, 0.232), 0.010, 0.013).joined(0.008),
        capsule((0.088, 1.624, 0.232), (0.140, 1.602, 0.190), 0.013, 0.010).joined(0.008),
        sphere((0.040, 1.478, 0.265), 0.024).joined(0.03),
        capsule((0.010, 1.384, 0.252), (0.082, 1.364, 0.195), 0.018, 0.013).joined(0.015),
        ellipsoid((0.235, 1.560, -0.02), (0.035, 0.085, 0.055)).joined(0.03),
    ]
    return [
        capsule((0.0, 1.645, 0.240), (0.0, 1.485, 0.305), 0.022, 0.032).joined(0.03),
        *both_sides(halves),
        ellipsoid((0.0, 1.335, 0.215), (0.070, 0.020, 0.042)).joined(0.02),
        ellipsoid((0.0, 1.359, 0.250), (0.105, 0.007, 0.030)).cutting(0.012),
    ]


def _hair() -> list[Part]:
    cap = ellipsoid((0.0, 1.735, -0.075), (0.265, 0.265, 0.32)).with_relief(_curls, 0.04)
    reach = ellipsoid((0.0, 1.86, -0.16), (0.36, 0.42, 0.375))
    return [intersection(cap, reach, 0.04).joined(0.02)]


def _curls(x: Array, y: Array, z: Array) -> Array:
    """Wavy locks combed from the crown outwards."""
    strands = wave((y - 0.8 * z) / 0.13 + 0.35 * wave(x / 0.17))
    return 0.018 * strands - 0.012 * groove(x / 0.5 + 0.5, 0.06)


def _turned_socle() -> Piece:
    """Surface of revolution of _PROFILE, closed by fans: vertices, faces, colours."""
    around = np.array([sincospi(2.0 * k / _SEGMENTS) for k in range(_SEGMENTS)])
    radius, height = np.array(_PROFILE).T
    x = radius[:, None] * around[:, 0]
    z = radius[:, None] * around[:, 1]
    rings = np.stack([x, np.broadcast_to(height[:, None], x.shape), z], axis=2).reshape(-1, 3)
    vertices = np.concatenate([rings, [[0.0, height[0], 0.0], [0.0, height[-1], 0.0]]])

    k = np.arange(_SEGMENTS)
    following = (k + 1) % _SEGMENTS
    faces = []
    for ring in range(len(radius) - 1):
        a = ring * _SEGMENTS + k
        b = ring * _SEGMENTS + following
        faces += [
            np.stack([a, b, b + _SEGMENTS], axis=1),
            np.stack([a, b + _SEGMENTS, a + _SEGMENTS], axis=1),
        ]
    top = (len(radius) - 1) * _SEGMENTS
    faces.append(np.stack([following, k, np.full(_SEGMENTS, len(rings))], axis=1))
    faces.append(np.stack([top + k, top + following, np.full(_SEGMENTS, len(rings) + 1)], axis=1))
    joined = np.concatenate(faces)
    return vertices, joined, sky_lit(np.array(_SOCLE), vertex_normals(vertices, joined))


def _plinth() -> Piece:
    """Square slab under the socle: vertices, faces, colours."""
    x, y, z = (np.array(v) for v in zip(*_corners((-0.34, 0.0, -0.34), (0.34, 0.10, 0.34)), strict=True))
    vertices = np.stack([x, y, z], axis=1)
    faces = np.array(
        [
            [0, 3, 2], [0, 1, 3], [4, 7, 5], [4, 6, 7], [0, 5, 1], [0, 4, 5],
            [2, 7, 6], [2, 3, 7], [0, 6, 4], [0, 2, 6], [1, 7, 3], [1, 5, 7],
        ]
    )  # fmt: skip
    return vertices, faces, sky_lit(np.array(_SOCLE), vertex_normals(vertices, faces))


def _corners(low: Triple, high: Triple) -> list[Triple]:
    return [(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
