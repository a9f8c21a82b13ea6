"""Changes of the occlusion of an estimator that is written as formulas (``lfssao.ao.formulas``).

Its formulas run at some texels, with changed look-ups: another matrix, another rule for the border or the background,
samples that are dropped or count twice, other answers to ties, or other depths. Otherwise ``Estimated`` applies.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from lfssao.ao.estimators.estimator import Options
from lfssao.ao.estimators.look_ups import cleared_z, look_of
from lfssao.ao.formulas import float_view, words_of
from lfssao.ao.kernels import look_up
from lfssao.ao.kernels.float_view import FloatView
from lfssao.ao.kernels.look_up import Look
from lfssao.ao.ssao import Occlusion
from lfssao.ao.textures import Texture
from lfssao.core.distinct import distinct
from lfssao.optics.kernels.projection import MATRIX
from lfssao.verify.bounds.bounds import Bounds, FloatArray
from lfssao.verify.diagnosis import look_ups
from lfssao.verify.diagnosis.change import INSIDE, Axis, Change, Places, fixed, late, scaled
from lfssao.verify.diagnosis.estimated import OCCLUDES, TOLERANCE, Estimated
from lfssao.verify.diagnosis.kernels.texels import Reading, fold_texels, sum_texels
from lfssao.verify.diagnosis.signs import other_signs
from lfssao.verify.diagnosis.views import Sight
from lfssao.verify.verdict import Flags

_MOST_SAMPLES = 256  # largest number of samples, or steps, that are dropped in turn
# Extra texels after those of the view, whose surfaces may replace the background: nearest, or cleared to 0; or none.
NEAREST = 0
_CLEARED = 1
_NONE = -1
_LEAST_DIFFERING = 0.1  # share of the texels at which changes differ
_LEAST_REACH = 0.5  # texels
_MOST_REACH = 500.0
_HALF = 2**13 + 1  # splits a float32 into half precision and the rest

# Fields that do not change the view and its textures.
_LATE = frozenset({
    "value", "store", "mine", "columns", "rows", "interval_width", "excess", "model", "radius", "points", "weights",
    "options", "image", "reach", "border", "background", "reweighted", "weight_factor", "linear", "factor", "split",
    "sample_factors",
})  # fmt: skip
# Further fields that do not change the names in the formulas.
_EARLY = {"ties", "buffers", "sight", "surface_points", "depth_scale", "depth_bias", "sign"}


@dataclass(frozen=True, eq=False, kw_only=True)
class Formulated(Estimated):
    """K texels of the occlusion of an estimator with formulas; rows and columns include a guard band."""

    image: FloatArray = field(default_factory=lambda: np.eye(3))  # applied to (u, v, 1)
    look_ups: Options = field(default_factory=Options)  # the reference's, which determine the view
    linear: bool = False  # whether all look-ups use a linear filter
    background: int | None = None  # the extra texel whose surface replaces the background, or ``_NONE``
    reweighted: tuple[Any, Any] = (slice(0), slice(0))  # indices of samples or directions, and of steps
    weight_factor: float = 1.0  # of the reweighted samples and steps
    factor: float = 1.0  # of the sum
    ties: int = 0  # ulps added to the surfaces' depths: -1 or 1 decides ties
    depth_scale: float = 1.0  # factor on the surfaces' depths in comparisons
    depth_bias: float = 0.0  # added to the surfaces' depths in comparisons
    sign: int = 1  # of surfaces' and of samples' depths
    split: int = 0  # constant that rounds u and v to half precision (``Reading``)
    sample_factors: FloatArray = field(default_factory=lambda: np.ones(1))  # of coordinates, (n, 3) or (1,)
    reach: FloatArray = field(default_factory=lambda: np.ones(1))  # (K,) or (1,), of the distances of texels' samples
    surface_points: FloatArray | None = None  # (K, 3), in place of the points of the buffers
    # Textures with two extra texels at their end, by the identity of the original textures
    padded_textures: Mapping[int, Texture] = field(default_factory=dict)

    whole: ClassVar[bool] = False
    # Texts for the sum of the terms, and for a sum without some of them: divided as before, and divided anew
    total: ClassVar[str] = "sum"
    as_before: ClassVar[str] = ""
    anew: ClassVar[str] = ", mean of those that count"
    independent_fields: ClassVar = {"_view": _LATE, "_words": _LATE | _EARLY}

    def _numbers(self, radius: float) -> Any:
        """The formulas at a radius, with their numbers."""
        samples = self.points, self.weights
        if self.points is None:
            samples = self.estimator.default_samples()
        assert self.estimator.formulas is not None
        options = self.estimator.options(**self.options)
        numbers = distinct(self.estimator.formulas(self.buffers, radius, *samples, options))
        if (self.sample_factors == 1).all():
            return numbers
        return numbers._replace(points=numbers.points * self.sample_factors.astype(numbers.points.dtype))

    @cached_property
    def samples(self) -> int:
        """Number of look-ups of a texel."""
        numbers = self._numbers(self.radius)
        return len(numbers.points) * getattr(numbers, "steps", 1)

    @property
    def has_ball(self) -> bool:
        """Whether samples are points of a ball."""
        return self.points is not None and self.points.shape[1] == 3

    @property
    def table(self) -> FloatArray:
        """The samples in the formulas."""
        return np.asarray(self._numbers(self.radius).points)

    @cached_property
    def _words(self) -> set[str]:
        """Names of a view that the formulas read."""
        return words_of(self._numbers(self.radius))

    @property
    def _texels(self) -> Places:
        """Indices of the texels, row by row."""
        return np.asarray(self.rows * self.buffers.depth.shape[1] + self.columns)

    @cached_property
    def _view(self) -> FloatView:
        """The view as formulas read it, with two extra texels at its end."""
        floats = float_view(self.buffers, self._words, self.look_ups)
        buffers = self.buffers
        dtype = floats.depth.dtype.type
        cleared = floats.rows[15] if floats.kind == MATRIX else dtype(0)
        surfaces = floats.surfaces
        if surfaces is not None:
            surfaces = surfaces * dtype(self.sign * self.depth_scale) + dtype(self.sign * self.depth_bias)
            if self.ties:
                surfaces = np.nextafter(surfaces, dtype(np.copysign(np.inf, self.sign * self.ties)))
            surfaces = np.append(surfaces, [dtype(-np.inf), cleared])
        normals = buffers.positions if buffers.normals is None else buffers.normals
        depth = self._padded_texture(buffers.depth)
        positions = self._padded_texture(buffers.positions)
        normals = self._padded_texture(normals)
        if floats.look is not None:  # the view has other textures than the buffers
            depth = with_extra_texels(floats.depth)
            positions = with_extra_texels(floats.positions, 3)
            normals = with_extra_texels(floats.normals, 3)
        can_mark_surfaces = (
            not self.ties and self.sign * self.depth_scale > 0 and not (floats.look and floats.look.cleared)
        )
        if surfaces is not None and can_mark_surfaces:
            depth = surfaces  # infinite without a surface, so look-ups need one texture only
        if self.surface_points is not None:
            positions = np.zeros_like(positions)
            positions.reshape(-1, 3)[self._texels] = self.surface_points
        return floats._replace(depth=depth, surfaces=surfaces, positions=positions, normals=normals)

    def _padded_texture(self, texture: Texture) -> Texture:
        """A texture, row by row, with two extra texels at its end."""
        padded = self.padded_textures.get(id(texture))
        return with_extra_texels(texture, texture.size // self.buffers.depth.size) if padded is None else padded

    def with_sight(self, sight: Sight) -> Estimated | None:
        """Occlusion with another sight."""
        if not sight.pinhole or "image_z" not in self._words:
            return super().with_sight(sight)
        view = replace(sight.view, world_to_image=sight.mapping)
        depth = sight.to_image_z(self.buffers.depth).astype(self.buffers.depth.dtype)
        return self.changed(sight=sight, buffers=replace(self.buffers, view=view, depth=depth))

    def _reading(self) -> Reading:
        """The arguments of look-ups."""
        dtype = self.buffers.depth.dtype
        count = self._view.depth.size - 2
        look = look_of(self.estimator.options(**self.options), self.buffers.depth.size) or Look()
        if self.border is not None:
            outside = count + NEAREST if self.border == look_ups.OCCLUDED else look_up.NOTHING
            look = look._replace(border=INSIDE.get(self.border, look_up.VALUE), outside=outside)
        look = look._replace(
            empty=look_up.NOTHING if self.background in (None, _NONE) else count + self.background,
            cleared=look.cleared and self.background is None,
            linear=True if self.linear else look.linear,
            matrix=tuple(tuple(row) for row in self.image[:2].astype(dtype)),
        )
        reach = np.array(np.broadcast_to(self.reach, self.rows.shape), dtype)
        return Reading(look, dtype.type(self.sign), dtype.type(self.split), reach)

    def _weights(self, count: int, steps: int) -> FloatArray:
        """Weights of the terms, (count, steps)."""
        weights = np.full((count, steps), self.factor)
        weights[self.reweighted] *= self.weight_factor
        return weights

    def _occlusion_at(self, radius: float) -> Occlusion:
        """Occlusion of the texels, (1, K), at a radius."""
        numbers = self._numbers(radius)
        size = self.buffers.depth.shape
        steps = getattr(numbers, "steps", 0)
        kernel = fold_texels if steps else sum_texels
        dtype = self.buffers.depth.dtype
        weights = self._weights(len(numbers.points), steps or 1).astype(dtype)
        occlusion = np.empty(len(self.rows), dtype)
        kernel(self._view._replace(look=None), numbers, self._reading(), size, self._texels, weights, occlusion)
        return Occlusion(occlusion[None], 0)

    def values(self) -> FloatArray:
        """The estimator's occlusion of the texels."""
        occlusion = self.estimator.at_radii(
            self._occlusion_at, self.radius, self.estimator.options(**self.options)
        ).texture
        return np.asarray(occlusion[0], np.float64)

    def _bounds(self) -> Bounds | None:
        """Bounds of the estimator; None if a look-up is changed."""
        look_up = self.border, self.linear, self.background, self.ties, self.split, self.sign
        changed = self.surface_points is not None or (self.sample_factors != 1).any() or (self.image != np.eye(3)).any()
        changed |= bool((self.reach != 1).any())
        if look_up != (None, False, None, 0, 0, 1) or changed:
            return None
        numbers = self.weight_factor, self.factor, self.depth_scale, self.depth_bias
        return super()._bounds() if numbers == (1, 1, 1, 0) else None

    def changes(self) -> list[Change]:
        """All changes to try, changes without values first."""
        changes = [*super().changes(), *look_ups.place_changes(*self.buffers.depth.shape), *self._sample_changes()]
        if cleared_z(self.look_ups) is not None:
            changes.append(fixed("background adds nothing", background=_NONE))
        changes.append(fixed("background as if cleared to 0", background=_CLEARED))
        if self.options.get("filter") == "nearest" and "coarse_z" not in self._words:  # late: it compiles a kernel
            change = late(fixed("textures read between texels, by a linear filter", linear=True))
            changes.append(replace(change, hint="--parameter filter=linear"))
        changes += [*look_ups.shift_changes(), fixed("u and v of half precision", split=_HALF)]
        changes += [*self._factor_changes(), *self._reach_changes()]
        return [*changes, *self._depth_changes()] if self._words & {"surface", "image_z"} else changes

    def _factor_changes(self) -> Iterator[Change]:
        """Yield factors of samples and of the sum, unless a radius or a strength has the same effect."""

        def differ(one: Estimated, values: FloatArray) -> bool:
            return bool(np.mean(np.abs(one.values() - values) > TOLERANCE) > _LEAST_DIFFERING)

        if self.has_ball and differ(_stretched(self, 2.0), self.changed(radius=2 * self.radius).values()):
            yield scaled("length of samples", _stretched, words="samples x {}, and not the range check's radius,")
        if differ(self.changed(factor=self.factor / 2), self.values() / 2):
            yield scaled(self.total, lambda p, f: p.changed(factor=p.factor * f))

    def _reach_changes(self) -> Iterator[Change]:
        """Yield a radius of constant size in texels, for cameras whose distance changes that size."""
        if self._texels_of_radius() is None or not {"at", "position"} <= self._words or "image_place" in self._words:
            return
        axis = Axis(_LEAST_REACH, _MOST_REACH, signs=(1,), number=25, signed=False)
        words = "radius of {} texels in place of world units"
        yield scaled("radius in texels", lambda p, r: p.changed(reach=r / p._texels_of_radius()), axis, words)

    def _texels_of_radius(self) -> FloatArray | None:
        """The radius in texels across the view at each texel's surface, (K,); None for all but perspective cameras."""
        view = self.buffers.view
        depth = self.buffers.depth[self.rows, self.columns].astype(np.float64)
        if view.screen_to_world is None or view.lens[6] or not self.radius:
            return None
        return np.asarray(self.radius * view.lens[0] / view.cast_z(depth))

    def solved(self, wrong: Flags) -> Iterator[Change]:
        """Changes of samples that are solved for from the texture's numbers."""
        return other_signs(self, wrong)

    def _depth_changes(self) -> Iterator[Change]:
        """Yield changes of the compared depths."""
        yield from self._tie_changes()
        yield look_ups.occluding_border()
        if "occludes" not in self.estimator.said("choices").get("background", ()):
            yield fixed(OCCLUDES, background=NEAREST)
        yield fixed("depth with the other sign", depth_scale=-1.0, background=NEAREST)
        surfaces = self._view.surfaces[:-2]
        reach = self._depth_reach()
        finite = surfaces[np.isfinite(surfaces)]
        size = float(np.median(np.abs(finite))) if finite.size else 0.0
        most = min(max(2 * reach / size, 1e-3), 2.0) if size else 1.0
        bias = Axis(1e-5 * reach, 2 * reach)
        scale = Axis(1e-5 * most, most, factor=True)
        yield scaled("depth bias", lambda p, b: p.changed(depth_bias=p.depth_bias + b), bias, "depth {}")
        yield scaled("depth scale", lambda p, s: p.changed(depth_scale=p.depth_scale * s), scale)

    def _tie_changes(self) -> Iterator[Change]:
        """Yield other answers to ties, where a surface is as deep as a sample."""
        yield fixed("a surface as deep as a sample hides it", ties=-1)
        yield fixed("a surface as deep as a sample does not hide it", ties=1)

    def _depth_reach(self) -> float:
        """Median extent of a texel's ball in the compared depths; 1 if it is not known."""
        reach = self._ball_extent()[:, 2] / np.sqrt(2)
        if "image_z" not in self._words:
            reach = np.array([self.radius * np.linalg.norm(self.sight.view.cast_from_world[2, :3])])
        finite = reach[np.isfinite(reach)]
        return (float(np.median(finite)) if finite.size else 0.0) or 1.0

    def _sample_changes(self) -> Iterator[Change]:
        """Yield samples, directions or steps that are dropped or count twice, and other divisors of the sum."""
        numbers = self._numbers(self.radius)
        count = len(numbers.points)
        steps = getattr(numbers, "steps", 0)
        for divisor in [d for d in range(1, 3 * count) if d != count][:_MOST_SAMPLES]:
            yield fixed(f"{self.total} divided by {divisor} in place of {count}", factor=count / divisor)
        weights = np.ones(count) if self.points is None or self.weights is None else np.asarray(self.weights)
        name = "direction" if steps else "sample"
        reweightings = ((0.0, "dropped"), (2.0, "doubled"))
        variants = [
            (f"{name} {k} {words}", slice(k, k + 1), weight) for weight, words in reweightings for k in range(count)
        ]
        variants += [(f"the first {m} {name}s alone", slice(m, count), 0.0) for m in range(1, count - 1)]
        for kind, selected, weight in variants if 1 < count <= _MOST_SAMPLES else ():
            remaining = 1 + (weight - 1) * float(weights[selected].sum() / weights.sum())
            count_left = count + round(weight - 1) * (selected.stop - selected.start)
            for words, factor in ((self.as_before, 1.0), (self.anew, 1 / remaining if remaining > 0 else 0.0)):
                if factor:
                    text = kind + words.format(count=count, rest=count_left)
                    yield fixed(text, reweighted=(selected, slice(None)), weight_factor=weight, factor=factor)
        for weight, words in reweightings:
            for k in range(steps if 1 < steps <= _MOST_SAMPLES else 0):
                yield fixed(
                    f"step {k + 1} of each direction {words}", reweighted=(slice(None), k), weight_factor=weight
                )


def _stretched(problem: Formulated, factor: float) -> Formulated:
    """The problem with samples scaled by a factor."""
    return problem.changed(sample_factors=problem.sample_factors * factor)


def with_extra_texels(texture: Texture, channels: int = 1) -> Texture:
    """A texture, row by row, with two extra texels of 0 at its end."""
    return np.append(texture, np.zeros(2 * channels, texture.dtype))
