"""Changes of any estimator's occlusion, found by running it: with other options, turns, samples, normals or textures.

The reference's own kernels make each changed texture whole. That asks nothing of an estimator but to be registered, and
costs some hundred runs. The search takes the interval of a changed texel to be as wide as that of the reference there;
the share of the best changes is counted by bounds of their own.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.estimator import Estimator, Value
from lfssao.ao.estimators.registry import estimate
from lfssao.ao.textures import Buffers, Texture
from lfssao.samples import ROTATIONS, texel_turns
from lfssao.verify.bounds.bounds import FloatArray
from lfssao.verify.bounds.error_model import ErrorModel
from lfssao.verify.bounds.points import point_bounds
from lfssao.verify.diagnosis.occlusion import other_tables
from lfssao.verify.diagnosis.post import VALUES
from lfssao.verify.diagnosis.search import FACTORS, Change, Problem, fixed, plain, scaled

ROOM = 2e-5  # by which sums of a renderer in float32 are off, at least
_SMALL = np.geomspace(1e-6, 1.0, 25)  # of an option's largest value, in place of 0
_MOST_COUNT = 40  # of taps, turns and other whole numbers


@dataclass(frozen=True, eq=False, kw_only=True)
class Estimated(Problem):
    """K texels of an estimator's occlusion of somebody's textures; places include a guard band."""

    estimator: Estimator
    buffers: Buffers
    radius: float
    points: FloatArray | None
    weights: FloatArray | None
    options: Mapping[str, Any]
    rotation: str  # the reference's, and its seed
    seed: int
    model: ErrorModel | None = None  # bounds of this model, where some are known, in place of the room

    def ends(self) -> tuple[FloatArray, FloatArray]:
        """The estimator's occlusion, with room for rounding."""
        samples = self.points, self.weights
        if self.model is not None:
            found = point_bounds(self.estimator.name, self.buffers, self.radius, *samples, self.options, self.model)
            if found is not None:
                low, high = (end[self.rows, self.columns].astype(np.float64) for end in (found.lower, found.upper))
                return low - ROOM, high + ROOM
        made = estimate(self.estimator.name, self.buffers, self.radius, *samples, **self.options).texture
        values = made[self.rows, self.columns].astype(np.float64)
        return values - (self.room + ROOM), values + (self.room + ROOM)

    def changes(self) -> list[Change]:
        """All changes that are tried, those without values first."""
        height, width = self.buffers.depth.shape
        made = [
            *VALUES,
            plain("rows from below", lambda p: p.changed(rows=height - 1 - p.rows)),
            plain("columns from the right", lambda p: p.changed(columns=width - 1 - p.columns)),
            *self._of_options(),
        ]
        if self.estimator.turns:
            made += self._of_turns()
        normals = self.buffers.normals
        if normals is not None:
            made.append(_with_buffers("normals with the other sign", normals=lambda: -normals))
            made.append(_with_buffers("normals made from positions", normals=lambda: face_normals(self.buffers)))
        if self.points is not None:
            made += [fixed(words, points=table) for words, table in other_tables(self.points)]
        return [*made, scaled("radius", lambda p, f: p.changed(radius=p.radius * f))]

    def _of_options(self) -> Iterator[Change]:
        """Each option with its other choices and nearby whole numbers, forgotten, and by a factor."""
        limits, choices = self.estimator.said("limits"), self.estimator.said("choices")
        for name, value in self.options.items():
            others: list[Value] = list(choices.get(name, ()))
            if isinstance(value, bool):
                others = [not value]
            elif isinstance(value, int) and name != "seed":
                low, high = limits[name]
                others = list(range(max(int(low), 0), min(int(high), max(2 * value, _MOST_COUNT)) + 1))
            elif isinstance(value, float) and value != 0.0 and limits[name][0] <= 0.0:
                others = [0.0]
            for other in others:
                blind = self.buffers.normals is None and self.estimator.reads_normals({name: other})
                if other != value and not blind:
                    words = f"{name} {_said(other)} in place of {_said(value)}"
                    yield plain(words, partial(_with_option, name, value=other))
            if name == "reach":
                for factor, reason in ((2.0, "without its 1/2"), (0.5, "with one 1/2 too many")):
                    words = f"radius in texels x {factor:.3f}, as of a projection scale {reason},"
                    yield plain(words, partial(_with_option, name, value=value * factor))
            if isinstance(value, float) and value != 0.0:
                words = f"{'radius in texels' if name == 'reach' else name} x {{:.4f}}"
                yield scaled(name, partial(_scaled_option, name, limits[name]), FACTORS, words)
            elif isinstance(value, float) and limits[name][1] < np.inf:
                words = f"{name} {{:.6g}} in place of {value:g}"
                yield scaled(name, partial(_with_option, name), limits[name][1] * _SMALL, words)

    def _of_turns(self) -> Iterator[Change]:
        """Samples that turn from texel to texel otherwise, or not."""
        turns, shape = self.buffers.turns, self.buffers.depth.shape
        if turns is not None:
            way = np.array([1, -1], turns.dtype)[:, None, None]
            yield _with_buffers("samples are not turned", turns=lambda: None)
            yield _with_buffers("samples turned the other way", turns=lambda: turns * way)
            yield _with_buffers("turns of rows from below", turns=lambda: turns[:, ::-1])
        for name in ROTATIONS:
            if name not in ("none", self.rotation):
                make = partial(texel_turns, name, *shape, self.seed, self.buffers.depth.dtype)
                yield _with_buffers(f"samples turned by '{name}'", turns=make)
                below = partial(lambda make: make()[:, ::-1], make)
                yield _with_buffers(f"samples turned by '{name}' of rows from below", turns=below)


def _with_buffers(kind: str, **made: Callable[[], Texture | None]) -> Change:
    """A change that gives the problem other textures, made when it is tried."""
    return plain(kind, lambda p: p.changed(buffers=replace(p.buffers, **{name: make() for name, make in made.items()})))


def _with_option(name: str, problem: Estimated, value: Value) -> Estimated:
    return problem.changed(options={**problem.options, name: value})


def _said(value: Value) -> str:
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
