"""Triangles of polygons: a fan where it is right, else ears."""

from collections.abc import Callable
from typing import NamedTuple

import mapbox_earcut
import numpy as np
from numpy.typing import NDArray

from lfssao.errors import InputError
from lfssao.scene.mesh import FloatArray

IntArray = NDArray[np.int64]

# Largest difference between the area of a polygon and that of its triangles, relative to its bounding rectangle; a
# part of an area that is as small is rounding.
_AREA_ERROR = 1e-6


class Polygons(NamedTuple):
    """Faces with any number of corners: their vertices one after another, and the number of corners of each."""

    corners: IntArray
    counts: IntArray

    def followed_by(self, triangles: IntArray) -> "Polygons":
        """These and then triangles (T, 3)."""
        counts = np.concatenate([self.counts, np.full(len(triangles), 3)])
        return Polygons(np.concatenate([self.corners, triangles.reshape(-1)]), counts)


def triangulate(name_of: Callable[[int], str], vertices: FloatArray, faces: Polygons) -> tuple[IntArray, IntArray]:
    """Return the corners of triangles, (T, 3) places in ``faces.corners``, and the face of each, (T,), in their order.

    A convex polygon is a fan around its first corner; the second half of a quad begins at its third one. Another is cut
    by ears along the largest component of its normal. Faces of fewer than three corners have none. InputError, which
    ``name_of`` a face begins, if a polygon crosses itself or names a vertex that does not exist.
    """
    outside = (faces.corners < 0) | (faces.corners >= len(vertices))
    if outside.any():
        place = int(outside.argmax())
        face = int(np.searchsorted(np.cumsum(faces.counts), place, side="right"))
        named = f"{name_of(face)} names vertex {faces.corners[place]}"
        raise InputError(f"{named}, but there are {len(vertices)} vertices")
    pieces = np.maximum(faces.counts - 2, 0)
    owner = np.repeat(np.arange(len(pieces)), pieces)
    starts = np.cumsum(faces.counts) - faces.counts
    begins = np.cumsum(pieces) - pieces
    step = np.arange(len(owner)) - begins[owner]
    first = starts[owner]
    triangles = np.stack([first, first + step + 1, first + step + 2], axis=1)
    halves = (faces.counts[owner] == 4) & (step == 1)
    triangles[halves] = triangles[halves][:, [1, 2, 0]]
    for count in np.unique(faces.counts[faces.counts > 3]):
        alike = np.flatnonzero(faces.counts == count)
        corners = vertices[faces.corners[starts[alike, None] + np.arange(count)]]
        finite = np.isfinite(corners).all(axis=(1, 2))
        flat = _flattened(corners[finite])
        alike = alike[finite]
        for number in np.flatnonzero(~_convex(flat)):
            face = int(alike[number])
            ears = _ears(name_of(face), flat[number])
            # Ears leave out corners between two others of one line.
            triangles[begins[face] : begins[face] + pieces[face]] = starts[face]
            triangles[begins[face] : begins[face] + len(ears)] += ears
    cut = triangles[:, 0] != triangles[:, 1]
    return triangles[cut], owner[cut]


def _flattened(corners: FloatArray) -> FloatArray:
    """Corners of polygons, (F, n, 3), along the largest components of their normals: (F, n, 2), counterclockwise."""
    # Polygons of any size in any place keep their areas' digits.
    corners = corners - corners[:, :1]
    size = np.abs(corners).max(axis=(1, 2))
    corners = corners / np.where((size > 0) & np.isfinite(size), size, 1.0)[:, None, None]
    normal, areas = np.zeros((2, len(corners), 3))
    for k in range(1, corners.shape[1] - 1):
        triangle = np.cross(corners[:, k], corners[:, k + 1])
        normal += triangle
        areas += np.abs(triangle)
    # The normal of a polygon that crosses itself may be zero.
    axis = (np.abs(normal) + _AREA_ERROR * areas).argmax(axis=1)
    rows = np.arange(len(corners))
    across = np.stack([(axis + 1) % 3, (axis + 2) % 3], axis=1)
    across = np.where(normal[rows, axis][:, None] < 0, across[:, ::-1], across)
    return np.take_along_axis(corners, across[:, None, :], axis=2)


def _convex(flat: FloatArray) -> NDArray[np.bool_]:
    """Whether each polygon, (F, n, 2) counterclockwise, turns left at every corner, once around in all."""
    edges = np.roll(flat, -1, axis=1) - flat
    following = np.roll(edges, -1, axis=1)
    left = (edges[..., 0] * following[..., 1] - edges[..., 1] * following[..., 0] >= 0).all(axis=1)
    once = np.ones(len(flat), np.bool_)
    for direction in (edges[..., 0], edges[..., 1]):
        # An edge across counts as the one before it.
        sign = np.sign(direction)
        for _ in range(flat.shape[1]):
            if sign.all():
                break
            sign = np.where(sign == 0, np.roll(sign, 1, axis=1), sign)
        once &= (sign != np.roll(sign, 1, axis=1)).sum(axis=1) <= 2
    return left & once


def _ears(name: str, flat: FloatArray) -> IntArray:
    """Return triangles, at most (n - 2, 3), of one polygon (n, 2) counterclockwise."""
    found = mapbox_earcut.triangulate_float64(np.ascontiguousarray(flat), np.array([len(flat)], np.uint32))
    ears = found.astype(np.int64).reshape(-1, 3)
    sizes = _areas(flat[ears])
    ears[sizes < 0] = ears[sizes < 0][:, ::-1]
    fan = np.stack([np.zeros(len(flat) - 2, np.int64), np.arange(1, len(flat) - 1), np.arange(2, len(flat))], axis=1)
    whole, cut = (float(np.cumsum(np.append(0.0, each))[-1]) for each in (_areas(flat[fan]), np.abs(sizes)))
    if not abs(cut - whole) <= _AREA_ERROR * float(np.ptp(flat, axis=0).prod()):
        raise InputError(f"{name} is a polygon of {len(flat)} corners that crosses itself")
    return ears


def _areas(triangles: FloatArray) -> FloatArray:
    """Twice the signed areas of triangles, (T, 3, 2)."""
    a = triangles[:, 1] - triangles[:, 0]
    b = triangles[:, 2] - triangles[:, 0]
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
