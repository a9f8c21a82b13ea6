"""Changes of any estimator's occlusion, found by running it: with other options, turns, samples, normals or textures.

The reference's kernels compute each changed texture as a whole, in some hundred runs; the estimator only has to be
registered. A changed texel agrees if it differs from the kernels' value by at most a quarter of the reference's
interval, plus ``TOLERANCE``: renderers are far nearer than their bounds. A texel that is off by more, but inside the
bounds of the changed estimator, is undecided.
"""

from collections.abc import Callable, Iterator, Mapping
from copy import copy
from dataclasses import dataclass, field, replace
from functools import cache, lru_cache, partial
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.estimator import Estimator, Value
from lfssao.ao.estimators.registry import estimate
from lfssao.ao.textures import Buffers, Texture
from lfssao.core.affine import transform_points
from lfssao.optics.kernels.projection import CROSSED_SLITS, MATRIX
from lfssao.optics.view import View, WorldToImage
from lfssao.verify.bounds.bounds import Bounds, FloatArray
from lfssao.verify.bounds.depth import displaced
from lfssao.verify.bounds.error_model import ErrorModel
from lfssao.verify.bounds.points import point_bounds
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

TOLERANCE = SUM_TOLERANCE  # of a small error beyond the interval a quarter of it
_OPTION = replace(FACTOR, most=3.5)  # lengths in texels or of another unit are farther off than radii
_SAME_AXES = 1e-6  # difference of axes of views that are parallel
_MOST_COUNT = 40  # of taps, turns and other whole numbers
REMAPPED, OCCLUDES = "2 max(0, ao - 1/2) in place of ao", "background counted as occluder"
# Names of options with another value, where they have one of their own.
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
    """K texels of an estimator's occlusion of somebody's textures; places include a guard band."""

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
    has_interval: bool  # whether the reference's interval is known: if not, any rounding is off
    # Textures of a layer of other modules, by the module, and the place of this one in one texture of all
    textures: Callable[[str], Mapping[str, NDArray[Any]]] = field(default_factory=lambda: no_textures)
    places: Mapping[str, tuple[int, int]] = field(default_factory=dict)
    neighbour_names: tuple[str, ...] = ()  # names of the modules that ``buffers.neighbours`` are of
    border: str | None = None  # a rule of ``INSIDE`` by which texels inside stand for those beyond the border
    model: ErrorModel | None = None  # of the bounds, where they are asked for
    # ``remake(buffers, makers)``: textures of others by functions of them, by name; the last ones are kept
    remake: Callable[..., Buffers] = field(default_factory=lambda: lru_cache(maxsize=2)(_remake_buffers))

    whole: ClassVar[bool] = True

    def ends(self) -> tuple[FloatArray, FloatArray]:
        """The estimator's occlusion, with room for rounding."""
        values, is_small = self.values(), (self.excess > 0) & self.has_interval
        margin = self.interval_width / 4 + np.where(is_small, np.minimum(TOLERANCE, self.excess / 4), TOLERANCE)
        low, high = values - margin, values + margin
        bounds = None if self.model is None else self._bounds()
        if bounds is None:
            return low, high
        is_near = (self.mine >= low) & (self.mine <= high)
        return np.where(is_near, low, np.minimum(low, bounds.lower)), np.where(
            is_near, high, np.maximum(high, bounds.upper)
        )

    def values(self) -> FloatArray:
        """The estimator's occlusion of the texels, (K,), from that of a whole texture."""
        buffers, texels = self._padded_textures()
        occlusion = estimate(self.estimator, buffers, self.radius, self.points, self.weights, **self.options)
        return occlusion.texture[texels].astype(np.float64)

    def _bounds(self) -> Bounds | None:
        """Bounds of the estimator's occlusion of the texels, (K,), if they are known."""
        buffers, texels = self._padded_textures()
        samples, options = (self.points, self.weights), self.options
        assert self.model is not None
        bounds = point_bounds(self.estimator.name, buffers, self.radius, *samples, options, self.model)
        return bounds and Bounds(bounds.lower[texels], bounds.upper[texels])

    def _padded_textures(self) -> tuple[Buffers, tuple[Places, Places]]:
        """Textures with what the border's rule puts beyond it, and the rows and columns of the texels there."""
        guard = 0 if self.border is None else self._guard
        buffers = self.buffers if self.border is None else _padded(self.buffers, guard, self.border)
        return buffers, (self.rows + guard, self.columns + guard)

    @property
    def _guard(self) -> int:
        """Texels beyond the border that samples reach, at most as many as the texture has."""
        reach = self._ball_extent()[:, :2]
        finite = reach[np.isfinite(reach)]
        return int(np.clip(np.ceil(finite.max(initial=0.0)) + 2, 2, max(self.buffers.depth.shape)))

    def _ball_extent(self) -> FloatArray:
        """How far each texel's ball reaches from it along u and v, texels, and by root 2 further in image z, (K, 3)."""
        positions = self.buffers.positions[self.rows, self.columns].astype(np.float64)
        steps = self.radius * np.concatenate([np.eye(3), -np.eye(3)])
        differences = (
            self.sight.view.world_to_image(positions[:, None] + steps)
            - self.sight.view.world_to_image(positions)[:, None]
        )
        return np.asarray(np.sqrt((differences**2).sum(axis=1)))

    def leaves_texture(self) -> Flags:
        """Whether a texel's ball reaches beyond the texture."""
        extent, (height, width) = self._ball_extent() + 1, self.buffers.depth.shape
        u, v = self.columns + 0.5, self.rows + 0.5
        is_inside = (
            (u - extent[:, 0] > 0) & (u + extent[:, 0] < width) & (v - extent[:, 1] > 0) & (v + extent[:, 1] < height)
        )
        return np.asarray(~is_inside)

    def seen_by(self, sight: Sight) -> "Estimated | None":
        """Occlusion by another sight."""
        if sight.pinhole:
            return None
        if sight.middle != self.sight.middle:  # positions are given: a sample's texel is the one around its middle
            view = _shifted_view(self.buffers.view, self.sight.middle - sight.middle)
            return self.changed(buffers=with_view(self.buffers, view))
        return self.changed(sight=sight, buffers=with_view(self.buffers, sight.view))

    def changes(self) -> list[Change]:
        """All changes that are tried, those without values first."""
        changes = [*texture_changes(self), *self._option_changes(), *view_changes(self.sight, self.centre, self.others)]
        changes += border_changes("border" in self.options)
        changes += [*self._neighbour_changes(), *self._other_view_changes(), *tap_changes(self)]
        changes.append(with_buffers("positions of half precision", positions=lambda b: half(b.positions)))
        changes.append(with_buffers("depth of half precision", depth=lambda b: half(b.depth)))
        changes.append(with_buffers("positions in physical space", positions=_physical_positions))
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
        """Each option with its other choices and nearby whole numbers, forgotten, and by a factor."""
        limits = {**dict.fromkeys(self.options, (-np.inf, np.inf)), **self.estimator.said("limits")}
        choices = self.estimator.said("choices")
        for name, value in self.options.items():
            if name == "cleared":  # textures are made with it
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
                    yield plain(_option_text(name, alternative, value), partial(_with_option, name, value=alternative))
            if name == "reach":
                for factor, reason in ((2.0, "without its 1/2"), (0.5, "with one 1/2 too many")):
                    words = f"radius in texels x {factor:.3f}, as of a projection scale {reason},"
                    yield plain(words, partial(_with_option, name, value=value * factor))
            if isinstance(value, float) and value != 0.0:
                words = f"{'radius in texels' if name == 'reach' else name} x {{}}"
                yield scaled(name, partial(_scaled_option, name, limits[name]), _OPTION, words)
            elif isinstance(value, float) and limits[name][1] < np.inf:
                most = limits[name][1]
                words = f"{name} {{}} in place of {value:g}"
                yield scaled(name, partial(_with_option, name), Axis(1e-6 * most, most, signs=(1,), number=25), words)

    def _neighbour_changes(self) -> Iterator[Change]:
        """Modules that are not asked, one or all."""
        for k, name in enumerate(self.neighbour_names if len(self.neighbour_names) > 1 else ()):
            yield plain(f"{name} is not asked", partial(_without_neighbours_in, removed=slice(k, k + 1)))
        if self.neighbour_names:
            yield plain("no other module is asked", partial(_without_neighbours_in, removed=slice(None)))

    def _other_view_changes(self) -> Iterator[Change]:
        """Textures of other views."""
        for view, depth in self.textures("depth").items():
            yield with_buffers(f"the depth of {view}", depth=partial(_with_far_texels, other=depth))
        reads_normals = self.buffers.normals is not None and self.estimator.reads_normals(self.options)
        for view, normals in self.textures("normals").items() if reads_normals else ():
            yield with_buffers(f"the normals of {view}", normals=lambda b, normals=normals: normals)  # type: ignore[misc]
        own = _view_axes(self.sight.view)
        for view, sight in self.others.items() if reads_normals else ():
            matrix = _view_axes(sight.view).T @ own
            if not np.allclose(matrix, np.eye(3), atol=_SAME_AXES):
                yield _turned_normals(f"normals in the view space of {view} taken for its own", matrix)
                yield _turned_normals(f"normals in its own view space taken for that of {view}", matrix.T)

    def _normal_changes(self) -> Iterator[Change]:
        """Normals of another sign, space, precision or source."""
        yield with_buffers("normals with the other sign", normals=lambda b: -np.asarray(b.normals))
        yield with_buffers("normals made from positions", normals=cache(face_normals))
        yield with_buffers("normals of half precision", normals=lambda b: half(np.asarray(b.normals)))
        axes = _view_axes(self.sight.view)
        for name, axis in zip("xyz", axes, strict=True):
            matrix = np.eye(3) - 2 * np.outer(axis, axis)
            yield _turned_normals(f"{name} of normals in view space with the other sign", matrix)
        for space, frame in (("view space", axes), ("left-handed view space", axes * [[1], [1], [-1]])):
            yield _turned_normals(f"normals of world space taken for {space}", frame)
            yield _turned_normals(f"normals of {space} taken for world space", frame.T)

    def _turn_changes(self) -> Iterator[Change]:
        """Samples that turn from texel to texel otherwise, or not."""
        turns, shape = self.buffers.turns, self.buffers.depth.shape
        if turns is not None:
            signs = np.array([1, -1, 1][: len(turns)], turns.dtype)[:, None, None]
            yield with_buffers("samples are not turned", turns=_unturned)
            inverted = partial(_changed_turns, change=lambda turns: turns * signs)
            yield with_buffers("samples turned the other way", turns=inverted)
            noise = other_noise(len(turns), self.estimator.vectors) if self.rotation == "none" else ()
            for words, change in (*noise, *stretched_tiles(turns)):
                yield with_buffers(words, turns=partial(_changed_turns, change=change))
        for words, make in other_turns(self.rotation, self.seed, shape[0], shape[1], self.places):
            yield with_buffers(words, turns=lambda b, make=make: make())  # type: ignore[misc]
        for words, number in turn_seeds(self.rotation, self.seed):
            turned = partial(Buffers.turned, rotation=self.rotation, seed=number)
            yield late(with_buffers(words, turns=lambda b, turned=turned: turned(b).turns))  # type: ignore[misc]


def _changed_turns(buffers: Buffers, change: Callable[[Any], Any]) -> Any:
    """The turns after a change; None without turns."""
    return None if buffers.turns is None else change(buffers.turns)


def _with_far_texels(buffers: Buffers, other: Texture) -> Texture:
    """Depth of another view, far away at texels whose own surface is none there."""
    view = buffers.view
    farthest = np.finfo(other.dtype).max if view.screen_to_world is None or view.linear else 1.0
    return np.where(np.isinf(other) & np.isfinite(buffers.depth), other.dtype.type(farthest), other)


def _view_axes(view: View) -> FloatArray:
    """Unit vectors to the right, up and towards the viewer, (3, 3), in world space."""
    axes = view.world_from_cast[:, :3].T * [[1], [1], [-1]]
    return np.asarray(axes / np.linalg.norm(axes, axis=1, keepdims=True))


def _turned_normals(kind: str, matrix: FloatArray) -> Change:
    """The change of normals by a matrix, of normals as rows."""
    return with_buffers(kind, normals=lambda b: np.asarray(b.normals, np.float64) @ matrix)


def _unturned(buffers: Buffers) -> Any:
    """Turns by an angle of 0: none, or the third numbers of noise alone."""
    turns = buffers.turns
    if turns is None or len(turns) == 2:
        return None
    return np.stack([np.ones_like(turns[2]), np.zeros_like(turns[2]), turns[2]])


def with_buffers(kind: str, **makers: Callable[[Buffers], Any]) -> Change:
    """A change that gives the problem other textures, made of its own when it is tried."""
    return plain(kind, lambda p: p.changed(buffers=p.remake(p.buffers, tuple(makers.items()))))


def _remake_buffers(buffers: Buffers, makers: tuple[tuple[str, Callable[[Buffers], Any]], ...]) -> Buffers:
    textures = {name: make(buffers) for name, make in makers}
    single: dict[str, Any] = {
        n: None if t is None else np.ascontiguousarray(t, buffers.depth.dtype) for n, t in textures.items()
    }
    return replace(buffers, **single)


def with_view(buffers: Buffers, view: View) -> Buffers:
    """The same textures of another view of their size; to check them once more would take longer than a trial."""
    other = copy(buffers)
    other.__dict__.pop("directions", None)
    other.__dict__.update(view=view)
    return other


def _without_neighbours_in(problem: Estimated, removed: slice) -> Estimated:
    neighbours = list(problem.buffers.neighbours)
    del neighbours[removed]
    return problem.changed(buffers=replace(problem.buffers, neighbours=neighbours))


def _padded(buffers: Buffers, guard: int, border: str) -> Buffers:
    """Textures with texels beyond the border, by a rule of ``INSIDE``."""
    mode = {"clamp": "edge", "mirror": "symmetric", "wrap": "wrap"}.get(border, "reflect")

    def padded(texture: Texture | None, first: int = 0) -> Any:
        if texture is None:
            return None
        widths = [(guard * (k in (first, first + 1)),) * 2 for k in range(texture.ndim)]
        return np.ascontiguousarray(np.pad(texture, widths, mode=mode))  # type: ignore[call-overload]

    textures = padded(buffers.depth), padded(buffers.positions), padded(buffers.normals), padded(buffers.turns, 1)
    return Buffers(_widened_view(buffers.view, guard), *textures, neighbours=buffers.neighbours)


def _widened_view(view: View, guard: int) -> View:
    """A view with as many texels more on each side."""
    return replace(_shifted_view(view, guard), width=view.width + 2 * guard, height=view.height + 2 * guard)


def _physical_positions(buffers: Buffers) -> FloatArray:
    """Positions in the space of rays, a display's physical space; infinite where there is no surface."""
    with np.errstate(all="ignore"):
        points = buffers.positions.reshape(-1, 3).astype(np.float64)
        physical = transform_points(buffers.view.cast_from_world, points)
    return np.where(np.isnan(physical), np.inf, physical).reshape(buffers.positions.shape)


def _shifted_view(view: View, texels: float) -> View:
    """A view whose image lies so many texels further right and down."""
    shifted = displaced(view, -texels, -texels)
    numbers, inverse = view.world_to_image.numbers.copy(), view.screen_to_world
    if view.rays.kind == CROSSED_SLITS:
        numbers[14:16] += texels
    elif view.rays.kind == MATRIX:
        numbers[0:8] += texels * np.tile(numbers[12:16], 2)
        assert inverse is not None
        inverse = np.column_stack([inverse[:, :3], inverse[:, 3] - texels * (inverse[:, 0] + inverse[:, 1])])
    else:
        numbers[12:] = shifted.lens
        for row in (0, 3):
            numbers[20 + row : 23 + row] += texels * numbers[26:29]
    return replace(shifted, world_to_image=WorldToImage(view.rays.kind, numbers), screen_to_world=inverse)


def _with_option(name: str, problem: Estimated, value: Value) -> Estimated:
    return problem.changed(options={**problem.options, name: value})


def _option_text(name: str, other: Value, value: Value) -> str:
    """Words for an option's other value in place of its own."""
    if isinstance(value, float) and other == -value:
        return f"{name} with the other sign"
    return _WORDS.get((name, other), f"{name} {_formatted(other)} in place of {_formatted(value)}")


def _formatted(value: Value) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value).lower()


def _scaled_option(name: str, limits: tuple[float, float], problem: Estimated, factor: float) -> Estimated:
    return _with_option(name, problem, float(np.clip(problem.options[name] * factor, *limits)))


def face_normals(buffers: Buffers) -> NDArray[Any]:
    """Unit normals of the differences of the next positions, towards the viewer; 0 where there is no surface."""
    with np.errstate(all="ignore"):
        down, across = (np.gradient(buffers.positions.astype(np.float64), axis=axis) for axis in (0, 1))
        normal = np.cross(down, across)
        normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
        normal *= -np.sign(np.einsum("ijk,ijk->ij", normal, buffers.directions))[..., None]
    return np.where(np.isfinite(normal), normal, 0).astype(buffers.depth.dtype)
