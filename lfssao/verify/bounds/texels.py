"""The texels whose points an estimator decides about: their image points, and the surfaces that may hide them.

How a place may be off. Its coordinates P + o are summed in any order with the mapping's rows, which is as if each
coordinate were off by T r (abs(p) + abs(o)), T = 7 the roundings of a row (``kernels.ssao_bounds``).
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from lfssao.core.affine import Matrix
from lfssao.optics.kernels.projection import MATRIX
from lfssao.optics.view import WorldToImage
from lfssao.verify.bounds.bounds import Bounds, FloatArray, Texture, project_positions
from lfssao.verify.bounds.error_model import ErrorModel
from lfssao.verify.bounds.kernels.pairs import FLUSHED, SAFETY

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
class Projected:
    """Image points of one point of each texel that sees a surface, (n,), and how far they may be off, (n, 3)."""

    u: FloatArray
    v: FloatArray
    z: FloatArray
    error: FloatArray
    may: Bools
    must: Bools


class Texels:
    """The texels that see a surface, and the surfaces that points are compared with.

    Parameters
    ----------
    given : Surfaces
        The textures.
    model : ErrorModel
        What float32 arithmetic may do.
    """

    def __init__(self, given: Surfaces, model: ErrorModel) -> None:
        self.given, self.model = given, model
        self.at: Numbers = np.flatnonzero(given.depth.ravel() < np.inf)
        self.places: FloatArray = given.positions.reshape(-1, 3)[self.at].astype(np.float64)
        self.axis: FloatArray = given.cast_from_world[2].astype(np.float32).astype(np.float64)

    @property
    def is_camera(self) -> bool:
        """Whether the mapping is a matrix."""
        return self.given.world_to_image.kind == MATRIX

    def project(self, points: FloatArray, allowance: FloatArray) -> Projected:
        """Image points of points (n, 3) whose coordinates are off by ``allowance``."""
        image, error, sure = project_positions(points, allowance, self.given.world_to_image, self.model)
        may = ~(error[:, 0] == -np.inf)
        error = error * SAFETY + np.array([self.model.coordinate, self.model.coordinate, 0.0])
        return Projected(image[:, 0], image[:, 1], image[:, 2], error, may, sure)

    def rows_of(self, sizes: FloatArray) -> FloatArray:
        """The rounding of rows of terms of these sizes, as an error of coordinates."""
        t = _ROW * self.model.operation
        return t * (1 + t) * sizes

    def axis_depth(self, points: FloatArray, allowance: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Cast z of points (n, 3) and its error, by the last row of ``cast_from_world``."""
        axis, sizes = self.axis[:3], np.abs(self.axis)
        off = self.rows_of(np.abs(points) + allowance) + allowance
        error = dot(off, sizes[:3]) + self.rows_of(sizes[3])
        flushed = FLUSHED * (4 + sizes[0] + sizes[1] + sizes[2])
        return dot(points, axis) + self.axis[3], error * SAFETY + flushed

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
            u_low, u_high = points.u - points.error[:, 0], points.u + points.error[:, 0]
            v_low, v_high = points.v - points.error[:, 1], points.v + points.error[:, 1]
        near = points.may & ~(u_high < 0) & ~(u_low >= width) & ~(v_high < 0) & ~(v_low >= height)
        known = near & np.isfinite(points.error[:, 2])
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

    def bounds(self, lower: Texture, upper: Texture, undecided: NDArray[np.int32]) -> Bounds:
        """Bounds of textures from those of the texels that see a surface; 0 elsewhere."""
        shape = self.given.depth.shape
        low, high, some = np.zeros(shape, np.float32), np.zeros(shape, np.float32), np.zeros(shape, np.int32)
        low.flat[self.at], high.flat[self.at], some.flat[self.at] = lower, upper, undecided
        return Bounds(low, high, some)


def flat(texture: Texture | None) -> Texture:
    """A texture of vectors as (H * W, 3)."""
    assert texture is not None  # the caller has looked
    return texture.reshape(-1, 3)


def dot(a: FloatArray, b: FloatArray) -> FloatArray:
    """Dot products of vectors (n, 3) with one or as many."""
    parts = a * b
    return (parts[:, 0] + parts[:, 1]) + parts[:, 2]
