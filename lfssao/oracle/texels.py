"""The texels whose points an estimator decides about: their image points, and the surfaces that may hide them.

How a place may be off. Its coordinates P + o are summed in any order with the mapping's rows, which is as if each
coordinate were off by T r (abs(p) + abs(o)), T = 7 the roundings of a row (``lfssao.kernels.outcomes``).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.estimators.estimator import Value
from lfssao.kernels.mapping import MATRIX
from lfssao.kernels.rounding import FLUSHED, SAFETY
from lfssao.matrix import Matrix
from lfssao.oracle.bounds import Bounds, FloatArray, Texture, project_positions
from lfssao.oracle.error_model import ErrorModel
from lfssao.view import WorldToImage

Bools = NDArray[np.bool_]
Numbers = NDArray[np.int64]
Hides = Callable[[Numbers, Numbers], tuple[Bools, Bools]]

_ROW = 7  # roundings of a term of a mapping's row


@dataclass(frozen=True, eq=False)
class Surfaces:
    """The textures and the mapping that points are decided by.

    Attributes
    ----------
    depth : (H, W) float32
        Image z, +infinity where there is no surface.
    positions : (H, W, 3) float32
        World coordinates.
    world_to_image : WorldToImage
        The mapping; renderers have its numbers rounded to float32.
    cast_from_world : (3, 4)
        World -> cast space; its last row is read by VO, rounded likewise.
    normals : (H, W, 3) float32 or None
        Unit normals, for estimators that read them.
    directions : (H, W, 3) float32 or None
        Unit viewing directions, for VO's thickness.
    """

    depth: Texture
    positions: Texture
    world_to_image: WorldToImage
    cast_from_world: Matrix
    normals: Texture | None = None
    directions: Texture | None = None


@dataclass(frozen=True, eq=False)
class Sampling:
    """One call of an estimator of points.

    Attributes
    ----------
    surfaces : Surfaces
        What it is given.
    radius : float
        R, world units.
    points : (n, 3) float64
        Offsets in the unit ball.
    weights : (n,) or None
        Their weights, read by VO's.
    options : mapping
        All of the estimator's parameters.
    model : ErrorModel
        What float32 arithmetic may do.
    """

    surfaces: Surfaces
    radius: float
    points: FloatArray
    weights: NDArray[np.floating[Any]] | None
    options: Mapping[str, Value]
    model: ErrorModel


@dataclass(frozen=True, eq=False)
class Projected:
    """Image points of one point of each texel that sees a surface, (n,), and how far they may be off, (n, 3)."""

    u: FloatArray
    v: FloatArray
    z: FloatArray
    doubt: FloatArray
    may: Bools
    must: Bools


@dataclass(frozen=True, eq=False)
class Texels:
    """The texels that see a surface, and the surfaces that points are compared with."""

    given: Surfaces
    model: ErrorModel
    at: Numbers = field(init=False)
    places: FloatArray = field(init=False)
    axis: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        at = np.flatnonzero(self.given.depth.ravel() < np.inf)
        object.__setattr__(self, "at", at)
        object.__setattr__(self, "places", self.given.positions.reshape(-1, 3)[at].astype(np.float64))
        object.__setattr__(self, "axis", self.given.cast_from_world[2].astype(np.float32).astype(np.float64))

    @property
    def is_camera(self) -> bool:
        """Whether the mapping is a matrix."""
        return self.given.world_to_image.kind == MATRIX

    def project(self, points: FloatArray, doubt: FloatArray) -> Projected:
        """Image points of points (n, 3) whose coordinates are off by ``doubt``."""
        image, error, sure = project_positions(points, doubt, self.given.world_to_image, self.model)
        may = ~(error[:, 0] == -np.inf)
        error = error * SAFETY + np.array([self.model.coordinate, self.model.coordinate, 0.0])
        return Projected(image[:, 0], image[:, 1], image[:, 2], error, may, sure)

    def rows_of(self, sizes: FloatArray) -> FloatArray:
        """By how much coordinates may be off that stand for the rounding of rows, of their terms' sizes."""
        t = _ROW * self.model.operation
        return t * (1 + t) * sizes

    def axis_depth(self, points: FloatArray, doubt: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Cast z of points (n, 3) and its error, by the last row of ``cast_from_world``."""
        a, b, c, d = self.axis
        z = (a * points[:, 0] + b * points[:, 1] + c * points[:, 2]) + d
        sizes = np.abs(points) + doubt
        off = self.rows_of(sizes) + doubt
        error = (abs(a) * off[:, 0] + abs(b) * off[:, 1] + abs(c) * off[:, 2]) + self.rows_of(np.array(abs(d)))
        return z, error * SAFETY + FLUSHED * (4 + abs(a) + abs(b) + abs(c))

    def decide(self, points: Projected, hides: Hides) -> tuple[Bools, Bools]:
        """Whether points may be, and are for sure, occluded.

        Parameters
        ----------
        points : Projected
            One of each texel.
        hides : callable
            ``hides(which, texels)``: whether a texel's surface may hide, and hides for sure, the point of a number.
        """
        height, width = self.given.depth.shape
        with np.errstate(invalid="ignore"):  # at the mapping's singularity
            u_low, u_high = points.u - points.doubt[:, 0], points.u + points.doubt[:, 0]
            v_low, v_high = points.v - points.doubt[:, 1], points.v + points.doubt[:, 1]
        near = points.may & ~(u_high < 0) & ~(u_low >= width) & ~(v_high < 0) & ~(v_low >= height)
        known = near & np.isfinite(points.doubt[:, 2])
        for end in (u_low, u_high, v_low, v_high):
            known &= np.isfinite(end)
        first, last = (
            [np.where(known, np.clip(low, 0, size - 1), 0).astype(np.int64) for low, size in ends]
            for ends in (((u_low, width), (v_low, height)), ((u_high, width), (v_high, height)))
        )
        known &= (last[0] - first[0] <= 1) & (last[1] - first[1] <= 1)  # else next to the mapping's singularity
        may, must = near & ~known, known & points.must
        must &= (u_low >= 0) & (u_high < width) & (v_low >= 0) & (v_high < height)
        for down, right in product((0, 1), repeat=2):
            touched = np.flatnonzero(known & (first[0] + right <= last[0]) & (first[1] + down <= last[1]))
            hit, sure = hides(touched, (first[1][touched] + down) * width + first[0][touched] + right)
            may[touched] |= hit
            must[touched] &= sure
        return may, must

    def bounds(self, lower: Texture, upper: Texture, opened: NDArray[np.int32]) -> Bounds:
        """Bounds of textures from those of the texels that see a surface; 0 elsewhere."""
        shape = self.given.depth.shape
        low, high, some = np.zeros(shape, np.float32), np.zeros(shape, np.float32), np.zeros(shape, np.int32)
        low.flat[self.at], high.flat[self.at], some.flat[self.at] = lower, upper, opened
        return Bounds(low, high, some)


def flat(texture: Texture | None) -> Texture:
    """A texture of vectors as (H * W, 3)."""
    assert texture is not None  # whoever asks has looked
    return texture.reshape(-1, 3)


def dot(a: FloatArray, b: FloatArray) -> FloatArray:
    """Dot products of vectors (n, 3) with one or as many."""
    product_ = a * b
    return (product_[:, 0] + product_[:, 1]) + product_[:, 2]
