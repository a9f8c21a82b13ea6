"""Changes of the occlusion of an estimator that is written as formulas (``lfssao.ao.formulas``).

Its formulas run at the texels that are asked for, with a look-up that may be changed: by a matrix, by a rule for the
border or for background, with samples that are left out or count twice, or by ties. Else all is as of ``Estimated``.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from lfssao.ao.formulas import float_view, words_of
from lfssao.ao.kernels import look_up
from lfssao.ao.kernels.float_view import FloatView
from lfssao.ao.kernels.look_up import Look
from lfssao.ao.ssao import Occlusion
from lfssao.optics.kernels.projection import MATRIX
from lfssao.verify.bounds.bounds import Bounds, FloatArray
from lfssao.verify.diagnosis import look_ups
from lfssao.verify.diagnosis.change import INSIDE, Change, fixed
from lfssao.verify.diagnosis.estimated import Estimated
from lfssao.verify.diagnosis.kernels.texels import fold_texels, sum_texels

_MOST_SAMPLES = 256  # samples, and steps, each of which is left out in turn
_NEAREST, _CLEARED = "occludes", "cleared"  # surfaces that may stand where there is none
_NUMBERS = {_NEAREST: 0, _CLEARED: 1}  # of their texels, behind those of the texture
_ALL = slice(None)

# Fields on which the view and its textures do not depend.
_LATE = frozenset({
    "value", "store", "mine", "columns", "rows", "room", "off", "model", "radius", "points", "weights", "options",
    "image", "border", "background", "odd", "times", "factor",
})  # fmt: skip


@dataclass(frozen=True, eq=False, kw_only=True)
class Formulated(Estimated):
    """K texels of the occlusion of an estimator that is written as formulas; places include a guard band."""

    image: FloatArray = field(default_factory=lambda: np.eye(3))  # applied to (u, v, 1)
    background: str = ""  # the surface that stands where there is none, if there is one
    odd: tuple[Any, Any] = (slice(0), slice(0))  # samples or directions, and steps, that count more or less often
    times: float = 1.0  # how often these do
    factor: float = 1.0  # of the sum
    ties: int = 0  # ulps by which surfaces lie further away: -1 or 1 turns a tie

    whole: ClassVar[bool] = False
    kept: ClassVar = {"_view": _LATE, "_words": _LATE | {"ties", "buffers"}}

    def _numbers(self, radius: float) -> Any:
        """The formulas' numbers at a radius."""
        samples = self.points, self.weights
        if self.points is None:
            samples = self.estimator.default_samples()
        assert self.estimator.formulas is not None
        return self.estimator.formulas(self.buffers, radius, *samples, self.estimator.options(**self.options))

    @cached_property
    def samples(self) -> int:
        """Number of look-ups that a texel makes."""
        numbers = self._numbers(self.radius)
        return len(numbers.points) * getattr(numbers, "steps", 1)

    @cached_property
    def _words(self) -> set[str]:
        """Words by which the formulas read a view."""
        return words_of(self._numbers(self.radius))

    @cached_property
    def _view(self) -> FloatView:
        """The view as formulas read it, with the texels of ``_NUMBERS`` behind its own."""
        made = float_view(self.buffers, self._words)
        kind = made.depth.dtype.type
        cleared = made.rows[15] if made.kind == MATRIX else kind(0)
        surfaces = made.surfaces
        if surfaces is not None:
            nudged = np.nextafter(surfaces, kind(np.copysign(np.inf, self.ties))) if self.ties else surfaces
            surfaces = np.append(nudged, [kind(-np.inf), cleared])
        return made._replace(
            depth=np.append(made.depth, np.zeros(2, kind)),
            surfaces=surfaces,
            positions=np.append(made.positions, np.zeros(6, kind)),
            normals=np.append(made.normals, np.zeros(6, kind)),
        )

    def _look(self) -> Look:
        """The look-up."""
        dtype, texels = self.buffers.depth.dtype, self.buffers.depth.size
        return Look(
            matrix=np.ascontiguousarray(self.image[:2], dtype),
            border=INSIDE.get(self.border or "", look_up.VALUE),
            outside=texels + _NUMBERS[_NEAREST] if self.border == look_ups.OCCLUDED else look_up.NOTHING,
            empty=texels + _NUMBERS[self.background] if self.background else look_up.NOTHING,
        )

    def _weights(self, count: int, steps: int) -> FloatArray:
        """Weights of the terms, (count, steps)."""
        made = np.full((count, steps), self.factor)
        made[self.odd] *= self.times
        return made

    def _at(self, radius: float) -> Occlusion:
        """Occlusion of the texels, (1, K), at a radius."""
        numbers, (height, width) = self._numbers(radius), self.buffers.depth.shape
        steps = getattr(numbers, "steps", 0)
        kernel, dtype = (fold_texels if steps else sum_texels), self.buffers.depth.dtype
        weights = self._weights(len(numbers.points), steps or 1).astype(dtype)
        texels, made = self.rows * width + self.columns, np.empty(len(self.rows), dtype)
        kernel(self._view, numbers, self._look(), (height, width), texels, weights, made)
        return Occlusion(made[None], 0)

    def _values(self) -> FloatArray:
        """The estimator's occlusion of the texels."""
        made = self.estimator.at_radii(self._at, self.radius, self.estimator.options(**self.options)).texture
        return np.asarray(made[0], np.float64)

    def _bounds(self) -> Bounds | None:
        """Bounds of the estimator; None where a look-up is changed, of which none are known."""
        weighted = (self.times, self.factor) != (1, 1)
        changed = self.border or self.background or self.ties or weighted or (self.image != np.eye(3)).any()
        return None if changed else super()._bounds()

    def changes(self) -> list[Change]:
        """All changes that are tried, those without values first."""
        made = [*super().changes(), *look_ups.of_places(*self.buffers.depth.shape), *self._of_samples()]
        if "surface" in self._words:
            made += [
                look_ups.beyond_occluded(),
                fixed("a surface as deep as a sample hides it", ties=-1),
                fixed("a surface as deep as a sample does not hide it", ties=1),
                fixed("background counted as occluder", background=_NEAREST),
            ]
        made.append(fixed("background as if cleared to 0", background=_CLEARED))
        return [*made, *look_ups.of_shifts()]

    def _of_samples(self) -> Iterator[Change]:
        """Samples, directions or steps that are missing or count twice, and a number of them that is one off."""
        numbers = self._numbers(self.radius)
        count, steps = len(numbers.points), getattr(numbers, "steps", 1)
        weights = np.ones(count) if self.points is None or self.weights is None else np.asarray(self.weights)
        name, some = "direction" if hasattr(numbers, "steps") else "sample", 1 < count <= _MOST_SAMPLES
        for divisor in (count - 1, count + 1) if count > 1 else ():
            yield fixed(f"sum divided by {divisor} in place of {count}", factor=count / divisor)
        for words, times in (("dropped", 0.0), ("doubled", 2.0)):
            for k in range(count if some else 0):
                kind, left = f"{name} {k} {words}", 1 + (times - 1) * float(weights[k] / weights.sum())
                yield fixed(kind, odd=(k, _ALL), times=times)
                if left > 0:
                    yield fixed(f"{kind}, mean of those that count", odd=(k, _ALL), times=times, factor=1 / left)
            for k in range(steps if 1 < steps <= _MOST_SAMPLES else 0):
                yield fixed(f"step {k + 1} of each direction {words}", odd=(_ALL, k), times=times)
