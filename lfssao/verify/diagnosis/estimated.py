"""Run any estimator with other options, turns, samples, normals or textures, to find a change that explains occlusion.

The reference's kernels compute each changed texture as a whole, in some hundred runs; the estimator only has to be
registered. A texel is inside if it differs from the changed kernels' value by at most ``TOLERANCE`` and a quarter of
its error. Else a quarter of the reference's interval is added, as renderers are far nearer than their bounds, and at
last the bounds of the changed estimator count; texels that only these wider intervals hold are mostly undecided.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cache, lru_cache, partial
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.estimator import Estimator, Value
from lfssao.ao.estimators.registry import estimate
from lfssao.ao.textures import Buffers
from lfssao.verify.bounds.bounds import Bounds, FloatArray
from lfssao.verify.bounds.error_model import ErrorModel
from lfssao.verify.bounds.points import point_bounds
from lfssao.verify.diagnosis.buffers import (
    changed_turns,
    face_normals,
    padded_buffers,
    physical_positions,
    remake_buffers,
    shifted_view,
    unturned,
    view_axes,
    with_far_texels,
    with_view,
)
from lfssao.verify.diagnosis.change import (
    FACTOR,
    OUTSIDE,
    SUM_TOLERANCE,
    Axis,
    Change,
    Places,
    Problem,
    fixed,
    late,
    no_textures,
    plain,
    scaled,
)
from lfssao.verify.diagnosis.hints import parameter_option, rotation_option, scaled_parameter_option
from lfssao.verify.diagnosis.look_ups import border_changes
from lfssao.verify.diagnosis.post import half, texture_changes
from lfssao.verify.diagnosis.sampling import (
    other_noise,
    other_tables,
    other_turns,
    stretched_tiles,
    table_seeds,
    turn_seeds,
)
from lfssao.verify.diagnosis.spiral import tap_changes
from lfssao.verify.diagnosis.views import Sight, view_changes
from lfssao.verify.verdict import Flags

TOLERANCE = SUM_TOLERANCE
_OPTION = replace(FACTOR, most=3.5)  # lengths in texels or in another unit may be farther off than radii
_SAME_AXES = 1e-6  # largest difference of the axes of parallel views
_MOST_COUNT = 40  # of taps, turns and other whole numbers
REMAPPED = "2 max(0, ao - 1/2) in place of ao"
OCCLUDES = "background counted as occluder"
# Texts of options with another value that have a name of their own.
_WORDS = {
    ("remap", True): REMAPPED,
    ("remap", False): "flat surfaces hide themselves, ao in place of 2 max(0, ao - 1/2)",
    ("range_check", True): "a range check",
    ("range_check", False): "no range check",
    ("background", "occludes"): OCCLUDES,
    ("border", "open"): f"{OUTSIDE} add nothing",
    ("filter", "nearest"): "textures read in the nearest texel",
}


@dataclass(frozen=True, eq=False, kw_only=True)
class Estimated(Problem):
    """K texels of an estimator's occlusion; rows and columns include a guard band."""

    estimator: Estimator
    buffers: Buffers
    radius: float
    points: FloatArray | None
    weights: FloatArray | None
    options: Mapping[str, Any]
    sight: Sight
    others: Mapping[str, Sight]  # of other modules, by name
    centre: FloatArray | None  # of the region of interest, metres
    sampling: Mapping[str, Any]  # method and seed of the points; empty where they are not known
    rotation: str  # the reference's, and its seed
    seed: int
    has_interval: bool  # whether the reference's interval is known; without one, rounding counts as an error
    # Textures of a layer of other modules, by the module, and this module's place in one texture of all modules
    textures: Callable[[str], Mapping[str, NDArray[Any]]] = field(default_factory=lambda: no_textures)
    places: Mapping[str, tuple[int, int]] = field(default_factory=dict)
    neighbour_names: tuple[str, ...] = ()  # names of the modules of ``buffers.neighbours``
    border: str | None = None  # a rule of ``INSIDE`` for texels beyond the border
    model: ErrorModel | None = None  # of the bounds, if they are used
    # ``remake(buffers, makers)``: buffers with textures by functions of the buffers; the last results are cached
    remake: Callable[..., Buffers] = field(default_factory=lambda: lru_cache(maxsize=2)(remake_buffers))

    whole: ClassVar[bool] = True

    def ends(self) -> tuple[FloatArray, FloatArray]:
        """The estimator's occlusion with a margin for rounding: the narrowest one that holds the renderer's number."""
        values = self.values()
        is_small = (self.excess > 0) & self.has_interval
        rounding = np.where(is_small, np.minimum(TOLERANCE, self.excess / 4), TOLERANCE)
        margin = self.interval_width / 4 + rounding
        intervals = [(values - rounding, values + rounding), (values - margin, values + margin)]
        bounds = None if self.model is None else self._bounds()
        if bounds is not None:
            low, high = intervals[-1]
            intervals.append((np.minimum(low, bounds.lower), np.maximum(high, bounds.upper)))
        *narrow, (low, high) = intervals
        for ends in reversed(narrow):
            is_near = self._holds(*ends)
            low, high = (np.where(is_near, end, wide) for end, wide in zip(ends, (low, high), strict=True))
        return low, high

    def _holds(self, low: FloatArray, high: FloatArray) -> Flags:
        """Flags of the texels whose number lies in an interval of right values, (K,)."""
        first = self.value(low)
        second = self.value(high)
        return (self.mine >= np.minimum(first, second)) & (self.mine <= np.maximum(first, second))

    def values(self) -> FloatArray:
        """The estimator's occlusion of the texels, (K,), from a whole texture."""
        buffers, texels = self._padded_textures()
        occlusion = estimate(self.estimator, buffers, self.radius, self.points, self.weights, **self.options)
        return occlusion.texture[texels].astype(np.float64)

    def _bounds(self) -> Bounds | None:
        """Bounds of the estimator's occlusion of the texels, (K,), if they are known."""
        buffers, texels = self._padded_textures()
        samples = (self.points, self.weights)
        options = self.options
        assert self.model is not None
        bounds = point_bounds(self.estimator.name, buffers, self.radius, *samples, options, self.model)
        return bounds and Bounds(bounds.lower[texels], bounds.upper[texels])

    def _padded_textures(self) -> tuple[Buffers, tuple[Places, Places]]:
        """The textures, padded by the border's rule, and the rows and columns of the texels in them."""
        guard = 0 if self.border is None else self._guard
        buffers = self.buffers if self.border is None else padded_buffers(self.buffers, guard, self.border)
        return buffers, (self.rows + guard, self.columns + guard)

    @property
    def _guard(self) -> int:
        """Width of the band beyond the border that samples reach, texels, at most the texture's size."""
        reach = self._ball_extent()[:, :2]
        finite = reach[np.isfinite(reach)]
        return int(np.clip(np.ceil(finite.max(initial=0.0)) + 2, 2, max(self.buffers.depth.shape)))

    def _ball_extent(self) -> FloatArray:
        """Extent of each texel's ball along u and v, texels, and sqrt(2) times the extent in image z, (K, 3)."""
        positions = self.buffers.positions[self.rows, self.columns].astype(np.float64)
        steps = self.radius * np.concatenate([np.eye(3), -np.eye(3)])
        differences = (
            self.sight.view.world_to_image(positions[:, None] + steps)
            - self.sight.view.world_to_image(positions)[:, None]
        )
        return np.asarray(np.sqrt((differences**2).sum(axis=1)))

    def leaves_texture(self) -> Flags:
        """Flags of texels whose ball reaches beyond the texture."""
        extent = self._ball_extent() + 1
        height, width = self.buffers.depth.shape
        u = self.columns + 0.5
        v = self.rows + 0.5
        is_inside = (
            (u - extent[:, 0] > 0) & (u + extent[:, 0] < width) & (v - extent[:, 1] > 0) & (v + extent[:, 1] < height)
        )
        return np.asarray(~is_inside)

    def with_sight(self, sight: Sight) -> "Estimated | None":
        """Occlusion with another sight."""
        if sight.pinhole:
            return None
        if sight.middle != self.sight.middle:  # positions are inputs: only the texels of samples change
            view = shifted_view(self.buffers.view, self.sight.middle - sight.middle)
            return self.changed(buffers=with_view(self.buffers, view))
        return self.changed(sight=sight, buffers=with_view(self.buffers, sight.view))

    def changes(self) -> list[Change]:
        """All changes to try, changes without values first."""
        changes = [*texture_changes(self), *self._option_changes(), *view_changes(self.sight, self.centre, self.others)]
        changes += border_changes("border" in self.options)
        changes += [*self._neighbour_changes(), *self._other_view_changes(), *tap_changes(self)]
        changes.append(with_buffers("positions of half precision", positions=lambda b: half(b.positions)))
        changes.append(with_buffers("depth of half precision", depth=lambda b: half(b.depth)))
        changes.append(with_buffers("positions in physical space", positions=physical_positions))
        if self.estimator.turns:
            changes += self._turn_changes()
        if self.buffers.normals is not None and self.estimator.reads_normals(self.options):
            changes += self._normal_changes()
        if self.points is not None:
            changes += [fixed(words, points=table) for words, table in other_tables(self.points)]
            seeds = table_seeds(self.points, self.sampling)
            changes += [late(fixed(words, points=table)) for words, table in seeds.items()]
        return [*changes, scaled("radius", lambda p, f: p.changed(radius=p.radius * f))]

    def _option_changes(self) -> Iterator[Change]:
        """Yield each option with other choices, nearby integers, 0, and times a factor."""
        limits = {**dict.fromkeys(self.options, (-np.inf, np.inf)), **self.estimator.said("limits")}
        choices = self.estimator.said("choices")
        for name, value in self.options.items():
            if name == "cleared":  # the textures already include it
                continue
            alternatives: list[Value] = [
                alternative for alternative in choices.get(name, ()) if alternative != "cleared"
            ]
            if name in ("border", "filter"):  # the others have changes of their own
                alternatives = ["open" if name == "border" else "nearest"]
            elif isinstance(value, bool):
                alternatives = [not value]
            elif isinstance(value, int) and name != "seed":
                low, high = limits[name]
                alternatives = list(range(int(max(low, 0)), int(min(high, max(2 * value, _MOST_COUNT))) + 1))
            elif isinstance(value, float) and value != 0.0 and limits[name][0] <= 0.0:
                signed = name in self.estimator.said("power") and self.estimator.reads_texels
                alternatives = [0.0, -value] if signed else [0.0]
            for alternative in alternatives:
                needs_normals = self.buffers.normals is None and self.estimator.reads_normals({name: alternative})
                if alternative != value and not needs_normals:
                    words = _option_text(name, alternative, value)
                    change = partial(_with_option, name, value=alternative)
                    yield plain(words, change, hint=parameter_option(name, alternative))
            if name == "reach":
                for factor, reason in ((2.0, "without its 1/2"), (0.5, "with one 1/2 too many")):
                    words = f"radius in texels x {factor:.3f}, as of a projection scale {reason},"
                    change = partial(_with_option, name, value=value * factor)
                    yield plain(words, change, hint=parameter_option(name, value * factor))
            if isinstance(value, float) and value != 0.0:
                words = f"{'radius in texels' if name == 'reach' else name} x {{}}"
                hint = partial(scaled_parameter_option, name, value, limits[name])
                yield scaled(name, partial(_scaled_option, name, limits[name]), _OPTION, words, hint=hint)
            elif isinstance(value, float) and limits[name][1] < np.inf:
                most = limits[name][1]
                words = f"{name} {{}} in place of {value:g}"
                axis = Axis(1e-6 * most, most, signs=(1,), number=25)
                yield scaled(name, partial(_with_option, name), axis, words, hint=partial(parameter_option, name))

    def _neighbour_changes(self) -> Iterator[Change]:
        """Yield the removal of one neighbour or of all."""
        for k, name in enumerate(self.neighbour_names if len(self.neighbour_names) > 1 else ()):
            yield plain(f"{name} is not asked", partial(_without_neighbours_in, removed=slice(k, k + 1)))
        if self.neighbour_names:
            yield plain("no other module is asked", partial(_without_neighbours_in, removed=slice(None)))

    def _other_view_changes(self) -> Iterator[Change]:
        """Yield changes to textures and axes of other views."""
        for view, depth in self.textures("depth").items():
            yield with_buffers(f"the depth of {view}", depth=partial(with_far_texels, other=depth))
        reads_normals = self.buffers.normals is not None and self.estimator.reads_normals(self.options)
        for view, normals in self.textures("normals").items() if reads_normals else ():
            yield with_buffers(f"the normals of {view}", normals=lambda b, normals=normals: normals)  # type: ignore[misc]
        own = view_axes(self.sight.view)
        for view, sight in self.others.items() if reads_normals else ():
            matrix = view_axes(sight.view).T @ own
            if not np.allclose(matrix, np.eye(3), atol=_SAME_AXES):
                yield _turned_normals(f"normals in the view space of {view} taken for its own", matrix)
                yield _turned_normals(f"normals in its own view space taken for that of {view}", matrix.T)

    def _normal_changes(self) -> Iterator[Change]:
        """Yield normals of another sign, space, precision or source."""
        yield with_buffers("normals with the other sign", normals=lambda b: -np.asarray(b.normals))
        if min(self.buffers.depth.shape) > 1:  # a line of texels has no differences across it
            yield with_buffers("normals made from positions", normals=cache(face_normals))
        yield with_buffers("normals of half precision", normals=lambda b: half(np.asarray(b.normals)))
        axes = view_axes(self.sight.view)
        for name, axis in zip("xyz", axes, strict=True):
            matrix = np.eye(3) - 2 * np.outer(axis, axis)
            yield _turned_normals(f"{name} of normals in view space with the other sign", matrix)
        for space, frame in (("view space", axes), ("left-handed view space", axes * [[1], [1], [-1]])):
            yield _turned_normals(f"normals of world space taken for {space}", frame)
            yield _turned_normals(f"normals of {space} taken for world space", frame.T)

    def _turn_changes(self) -> Iterator[Change]:
        """Yield samples with other turns, or without."""
        turns = self.buffers.turns
        shape = self.buffers.depth.shape
        if turns is not None:
            signs = np.array([1, -1, 1][: len(turns)], turns.dtype)[:, None, None]
            yield replace(with_buffers("samples are not turned", turns=unturned), hint="--rotate none")
            inverted = partial(changed_turns, change=lambda turns: turns * signs)
            yield with_buffers("samples turned the other way", turns=inverted)
            noise = other_noise(len(turns), self.estimator.vectors) if self.rotation == "none" else ()
            for words, change in (*noise, *stretched_tiles(turns)):
                yield with_buffers(words, turns=partial(changed_turns, change=change))
        for words, make in other_turns(self.rotation, self.seed, shape[0], shape[1], self.places):
            change = with_buffers(words, turns=lambda b, make=make: make())  # type: ignore[misc]
            yield replace(change, hint=rotation_option(words))
        for words, number in turn_seeds(self.rotation, self.seed):
            turned = partial(Buffers.turned, rotation=self.rotation, seed=number)
            yield late(with_buffers(words, turns=lambda b, turned=turned: turned(b).turns))  # type: ignore[misc]


def _turned_normals(kind: str, matrix: FloatArray) -> Change:
    """The change of normals, as rows, by a matrix."""
    return with_buffers(kind, normals=lambda b: np.asarray(b.normals, np.float64) @ matrix)


def with_buffers(kind: str, **makers: Callable[[Buffers], Any]) -> Change:
    """A change of the problem's textures by functions of its buffers, called at the trial."""
    return plain(kind, lambda p: p.changed(buffers=p.remake(p.buffers, tuple(makers.items()))))


def _without_neighbours_in(problem: Estimated, removed: slice) -> Estimated:
    neighbours = list(problem.buffers.neighbours)
    del neighbours[removed]
    return problem.changed(buffers=replace(problem.buffers, neighbours=neighbours))


def _with_option(name: str, problem: Estimated, value: Value) -> Estimated:
    return problem.changed(options={**problem.options, name: value})


def _option_text(name: str, other: Value, value: Value) -> str:
    """Text of an option's other value in place of its own."""
    if isinstance(value, float) and other == -value:
        return f"{name} with the other sign"
    return _WORDS.get((name, other), f"{name} {_formatted(other)} in place of {_formatted(value)}")


def _formatted(value: Value) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value).lower()


def _scaled_option(name: str, limits: tuple[float, float], problem: Estimated, factor: float) -> Estimated:
    return _with_option(name, problem, float(np.clip(problem.options[name] * factor, *limits)))
