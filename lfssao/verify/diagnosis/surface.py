"""Changes of the G-buffer: depth and colour against the reference's, positions against depth."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import correlate1d

from lfssao.core.affine import Matrix
from lfssao.gbuffer.caster import RayCaster
from lfssao.verify.bounds.bounds import FloatArray
from lfssao.verify.bounds.depth import ROUNDINGS
from lfssao.verify.bounds.error_model import ErrorModel
from lfssao.verify.bounds.ssao import project_positions
from lfssao.verify.diagnosis.change import (
    FLIPS,
    Axis,
    Change,
    Function,
    Problem,
    apply_border,
    cut,
    fixed,
    plain,
    scaled,
    shifts,
)
from lfssao.verify.diagnosis.post import decode, encode, half
from lfssao.verify.diagnosis.views import Sight, view_changes

_SCALES = Axis(1e-5, 8.0, factor=True, number=16)


@dataclass(frozen=True, eq=False, kw_only=True)
class Image(Problem):
    """K texels of a texture whose reference's interval is known: depth or colour."""

    lower: FloatArray  # (H, W) or (H, W, C)
    upper: FloatArray
    second_differences: FloatArray  # limits of the deviation from a plane between texels
    shift: tuple[float, float] = (0.0, 0.0)

    def ends(self) -> tuple[FloatArray, FloatArray]:
        """The reference's interval at the texels."""
        return self._interpolated_interval(self.columns + self.shift[0], self.rows + self.shift[1])

    def _interpolated_interval(self, u: NDArray[Any], v: NDArray[Any]) -> tuple[FloatArray, FloatArray]:
        """The reference's interval, interpolated between four texels, and widened by second differences."""
        height, width = self.lower.shape[:2]
        i = np.floor(u).astype(np.int64)
        j = np.floor(v).astype(np.int64)
        # Twice the deviation of a parabola with the same second differences from a plane.
        curvature = (u - i) * (1 - (u - i)) + (v - j) * (1 - (v - j))
        low: Any = np.zeros(self.mine.shape)
        high = low
        margin = low
        for b, a in ((0, 0), (0, 1), (1, 0), (1, 1)):
            texel = apply_border(j + b, height, "clamp"), apply_border(i + a, width, "clamp")
            weight = np.abs((1 - a) - (u - i)) * np.abs((1 - b) - (v - j))
            weight_here, curvature_here = (x.reshape(-1, *[1] * (low.ndim - 1)) for x in (weight, curvature))
            low = low + np.where(weight_here > 0, weight_here * self.lower[texel], 0.0)
            high = high + np.where(weight_here > 0, weight_here * self.upper[texel], 0.0)
            counts = (weight_here > 0) & (curvature_here > 0)
            margin = np.fmax(margin, np.where(counts, curvature_here * self.second_differences[texel], 0.0))
        return np.where(np.isinf(margin), -np.inf, low - margin), np.where(np.isinf(margin), np.inf, high + margin)

    def changes(self) -> list[Change]:
        """Changes that depth and colour have in common."""
        height, width = self.lower.shape[:2]
        changes = [
            plain("u flipped", lambda p: p.changed(columns=width - 1 - p.columns)),
            plain("v flipped", lambda p: p.changed(rows=height - 1 - p.rows)),
            plain("u and v flipped", lambda p: p.changed(columns=width - 1 - p.columns, rows=height - 1 - p.rows)),
            plain("half precision", lambda p: p.then(half)),
            *cut(self),
            *shifts(lambda p, u, v: p.changed(shift=(u, v))),
        ]
        if height == width:
            changes.append(plain("u and v transposed", lambda p: p.changed(columns=p.rows, rows=p.columns)))
        return changes


@dataclass(frozen=True, eq=False, kw_only=True)
class Depth(Image):
    """K texels of depth."""

    model: ErrorModel
    others: Mapping[str, Sight]  # of other modules, by name
    textures: Callable[[str], Mapping[str, NDArray[Any]]]  # of other modules, by the module, of a layer
    sight: Sight  # the reference's
    centre: FloatArray | None = None  # of the region of interest, metres
    caster: RayCaster | None = None  # of the mesh, in the reference's cast space, where it is at hand
    other_sight: Sight | None = None  # a wrong renderer's, if it sees the scene otherwise

    independent_fields: ClassVar = {
        name: frozenset({"other_sight", "value", "store", "shift"})
        for name in ("_reference_depths", "_below", "_above")
    }

    def ends(self) -> tuple[FloatArray, FloatArray]:
        """The reference's interval; for another sight, or between texels, depths of rays into the mesh.

        Without a mesh the reference's surface must contain the points that the other sight sees; the interval moves by
        the difference of their depths.
        """
        sight = self.other_sight or self.sight
        du, dv = self.shift
        if self.other_sight is None and (self.caster is None or (du, dv) == (0.0, 0.0)):
            return super().ends()
        if self.caster is not None:
            cast = self.sight.view.cast_from_world
            depths = sight.cast(self.caster, cast, self.columns + du, self.rows + dv)
            return depths - self._below, depths + self._above
        u, v, z = self.sight.view.world_to_image(sight.points(self.columns, self.rows, self.mine)).T
        offset = self.mine - self.sight.from_image_z(z)
        low, high = self._interpolated_interval(np.nan_to_num(u - 0.5, nan=-1e6), np.nan_to_num(v - 0.5, nan=-1e6))
        height, width = self.lower.shape
        inside = (u >= 0) & (u < width) & (v >= 0) & (v < height)  # the surface beyond is not known
        return np.where(inside, low + offset, -np.inf), np.where(inside, high + offset, np.inf)

    @cached_property
    def _reference_depths(self) -> FloatArray:
        """Depths of the reference's rays."""
        assert self.caster is not None
        return self.sight.cast(self.caster, self.sight.view.cast_from_world, self.columns, self.rows)

    @cached_property
    def _below(self) -> FloatArray:
        """Distance of the interval's lower end from the reference's depth; the median without a surface."""
        return _filled_margin(self._reference_depths - self._interpolated_interval(self.columns, self.rows)[0])

    @cached_property
    def _above(self) -> FloatArray:
        """Distance of the interval's upper end from the reference's depth; the median without a surface."""
        return _filled_margin(self._interpolated_interval(self.columns, self.rows)[1] - self._reference_depths)

    def with_sight(self, sight: Sight) -> "Depth":
        """Depth with another sight."""
        return self.changed(other_sight=sight)

    def changes(self) -> list[Change]:
        """All changes of depth, and depths of other modules with a margin for rounding."""
        finite = self.lower[np.isfinite(self.lower)]
        size = float(np.ptp(finite)) if finite.size else 1.0
        bias = Axis(1e-5 * (size or 1.0), 2 * (size or 1.0))
        return [
            plain("depth with the other sign", lambda p: p.then(np.negative)),
            *super().changes(),
            plain("1 / depth", lambda p: p.then(lambda z: 1 / np.where(z == 0, np.nan, z))),
            plain("1 - depth", lambda p: p.then(lambda z: 1 - z)),
            *(
                self._other_depth_change(f"the depth of {module}", depth)
                for module, depth in self.textures("depth").items()
            ),
            *view_changes(self.sight, self.centre, self.others),
            scaled("depth bias", lambda p, b: p.then(lambda z: z + b), bias, "depth {}"),
            scaled("depth scale", lambda p, s: p.then(lambda z: z * s), _SCALES, "depth x {}"),
        ]

    def _other_depth_change(self, words: str, depth: NDArray[Any]) -> Change:
        values = depth.astype(np.float64)
        margin = np.where(np.isfinite(values), 16 * self.model.operation * np.abs(values), 0.0)
        return fixed(words, lower=values - margin, upper=values + margin)


@dataclass(frozen=True, eq=False, kw_only=True)
class Color(Image):
    """K texels of colour."""

    def changes(self) -> list[Change]:
        """All changes of colour."""
        power = "colour to the power of {}"
        return [
            plain("stored in sRGB", lambda p: p.then(encode)),
            plain("sRGB taken for linear light twice", lambda p: p.then(decode)),
            plain("red and blue exchanged", lambda p: p.changed(mine=p.mine[:, ::-1])),
            plain("1 - colour", lambda p: p.then(lambda x: 1 - x)),
            *super().changes(),
            scaled("strength", lambda p, s: p.then(lambda x: x * s), _SCALES, "colour x {}"),
            scaled("power", lambda p, s: p.then(lambda x: np.clip(x, 0, 1) ** s), _SCALES, power),
        ]


def _filled_margin(margin: FloatArray) -> FloatArray:
    """Margins of texels, the median in place of NaN."""
    finite = margin[np.isfinite(margin)]
    return np.where(np.isnan(margin), np.median(finite) if finite.size else 0.0, np.maximum(margin, 0.0))


def second_differences(texture: FloatArray) -> FloatArray:
    """Sums of a texture's absolute second differences along rows and columns; infinite next to the background."""
    total = sum(np.abs(correlate1d(texture, (1.0, -2.0, 1.0), axis, mode="nearest")) for axis in (0, 1))
    return np.where(np.isnan(total), np.inf, total)


@dataclass(frozen=True, eq=False, kw_only=True)
class Positions(Problem):
    """Positions of K texels, (K, 3), whose image points are compared with the texels' centres and depth."""

    depth: FloatArray  # (K,)
    sight: Sight
    centre: FloatArray | None  # of the region of interest, metres
    others: Mapping[str, Sight]  # of other modules, by name
    model: ErrorModel
    cast_from_world: Matrix
    size: tuple[int, int]  # width and height of the texture
    shift: tuple[float, float] = (0.0, 0.0)
    rounded: Function | None = None  # applied to right positions; the interval is then theirs

    independent_fields: ClassVar = {
        "image_points": frozenset({"columns", "rows", "depth", "shift"}),
        "_size": frozenset({"columns", "rows", "depth", "shift", "mine", "sight", "rounded"}),
    }

    @cached_property
    def _size(self) -> float:
        """The largest coordinate of right positions: one of the renderer's own may be any number."""
        points = self.sight.points(self.columns, self.rows, self.depth)
        return float(np.abs(points[np.isfinite(points)]).max(initial=0.0))

    @cached_property
    def image_points(self) -> tuple[FloatArray, FloatArray]:
        """Image points of the positions, u, v in texels and image z, (K, 3), and their errors."""
        coordinate_error = np.full(self.mine.shape, ROUNDINGS * self.model.operation * self._size)
        points, error, _ = project_positions(self.mine, coordinate_error, self.sight.mapping, self.model)
        return np.where(error[:, :1] > -np.inf, points, np.nan), np.maximum(error, 0.0)

    def interval(self) -> tuple[FloatArray, FloatArray]:
        """The positions plus the distances of their image points from the texels' middles and depth, with margins."""
        if self.rounded is not None:
            half_width = self.model.centre
            columns = self.columns
            rows = self.rows
            corners = [(a, b) for a in (-half_width, half_width) for b in (-half_width, half_width)]
            corner_values = [self.rounded(self.sight.points(columns + a, rows + b, self.depth)) for a, b in corners]
            return np.min(corner_values, axis=0), np.max(corner_values, axis=0)
        points, error = self.image_points
        depth = self.sight.to_image_z(self.depth)
        middle = self.sight.middle
        u = self.columns + middle + self.shift[0]
        v = self.rows + middle + self.shift[1]
        margin = error + np.array([self.model.centre, self.model.centre, 0.0])
        shows_surface = np.isfinite(self.depth)  # a flipped texture shows none at some texels
        margin[:, 2] += ROUNDINGS * self.model.operation * float(np.abs(depth[shows_surface]).max(initial=0.0))
        positions = self.mine + (np.stack([u, v, depth], axis=-1) - points)
        low, high = (np.where(shows_surface[:, None], end, np.inf) for end in (positions - margin, positions + margin))
        return low, high

    def with_sight(self, sight: Sight) -> "Positions":
        """Positions with another sight."""
        return self.changed(sight=sight)

    def changes(self) -> list[Change]:
        """All changes of positions."""
        width, height = self.size
        axes = tuple(zip("xyz", np.eye(3), strict=True))
        changes = [
            _mapping_change(f"{axis} with the other sign", np.diag(1.0 - 2.0 * direction)) for axis, direction in axes
        ]
        for words, order in (("x and y", [1, 0, 2]), ("y and z", [0, 2, 1]), ("x and z", [2, 1, 0])):
            changes.append(_mapping_change(f"{words} exchanged", np.eye(3)[order]))
        changes.append(
            _mapping_change("z up in place of y up", np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]))
        )
        inverse = np.linalg.inv(self.cast_from_world[:, :3]).astype(np.float64)
        changes.append(_mapping_change("positions in physical space", inverse, -inverse @ self.cast_from_world[:, 3]))
        changes += [
            plain("u flipped", lambda p: p.changed(columns=width - 1 - p.columns)),
            plain("v flipped", lambda p: p.changed(rows=height - 1 - p.rows)),
            *FLIPS,
            plain("depth of half precision", lambda p: p.changed(depth=half(p.depth))),
            plain("positions of half precision", lambda p: p.changed(rounded=half)),
            *shifts(lambda p, u, v: p.changed(shift=(u, v))),
            *view_changes(self.sight, self.centre, self.others),
            scaled("scale", lambda p, s: p.changed(mine=p.mine / s), _SCALES, "positions x {}"),
        ]
        largest = float(np.abs(self.mine[np.isfinite(self.mine)]).max(initial=1.0))
        for axis, direction in axes:
            without_bias = partial(lambda direction, p, b: p.changed(mine=p.mine - b * direction), direction)
            changes.append(scaled(f"bias of {axis}", without_bias, Axis(1e-6 * largest, largest), f"{axis} {{}}"))
        return changes


def _mapping_change(kind: str, matrix: FloatArray, shift: FloatArray | float = 0.0) -> Change:
    """The change whose inverse is a map of positions as rows."""
    return plain(kind, lambda p: p.changed(mine=p.mine @ matrix.T + shift))
