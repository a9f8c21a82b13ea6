"""Changes of the reference, and the problems that they change.

A problem holds some texels of the renderer's texture, and their interval according to the reference or a change of it.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import exp, floor, log, log10
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.kernels import look_up
from lfssao.ao.kernels.look_up import hold_place
from lfssao.verify.bounds.bounds import FloatArray
from lfssao.verify.verdict import Flags

Places = NDArray[np.int64]
Values = tuple[float, ...]
Function = Callable[[FloatArray], FloatArray]


SUM_TOLERANCE = 2e-5  # largest difference of another renderer's sums in float32
_COMPARE_OPTIONS = "--map", "--background", "--stored"  # advised options of ``compare``; others are of ``render``
OUTSIDE = "samples outside the texture"  # begins the names of changes of the border
_AND = " and "  # between the names of a pair
# Border rules that replace a texel outside by one inside.
INSIDE = {
    "clamp": look_up.CLAMP,
    "mirror": look_up.MIRROR,
    "wrap": look_up.WRAP,
    "mirror without the edge": look_up.MIRROR_INSIDE,
}


def apply_border(places: Places, size: int, border: str) -> Places:
    """Columns or rows inside 0 to size - 1, by a rule of ``INSIDE``; any other rule clamps."""
    rule = INSIDE.get(border, look_up.CLAMP)
    # Nearly all look-ups clamp: one function of NumPy in place of two.
    return np.clip(places, 0, size - 1) if rule == look_up.CLAMP else np.asarray(hold_place(places, size, rule))


def no_textures(layer: str) -> Mapping[str, NDArray[Any]]:
    """No textures of a layer of other views."""
    return {}


@dataclass(frozen=True, eq=False, kw_only=True)
class Problem:
    """K texels of a texture, and their intervals according to the reference or a change of it."""

    mine: FloatArray  # (K,) or (K, C)
    columns: Places  # (K,)
    rows: Places
    interval_width: FloatArray  # width of the reference's interval, of the shape of ``mine``
    excess: FloatArray  # distance of each number from its interval or, without one, from the reference
    cost: int = 16  # work for a texel, such as its number of samples or taps
    value: Function = np.asarray  # applied to the right values; monotone
    store: Callable[[FloatArray, FloatArray], Any] | None = None  # the interval after storing, if it is stored
    floored: Callable[[FloatArray, FloatArray], Any] | None = None  # the same with truncated codes
    # ``flipped(across, down)``: the same numbers, compared with the texels from the right, or from below
    flipped: Callable[[bool, bool], Any] | None = None
    # Other views' values at the same texels, of the shape of ``mine``, by the view
    other_views: Callable[[], Mapping[str, FloatArray]] = dict
    replacement: FloatArray | None = None  # right values, of the shape of ``mine``, in place of ``ends``
    whole: ClassVar[bool] = False  # whether each trial computes a whole texture
    counts: ClassVar[bool] = False  # whether values are counts, so that costs have steps
    # Least number of wrong texels that an explanation decides, for each value: fewer agree with many changes by chance
    fewest: ClassVar[int] = 6
    # Cached properties, and the fields that they do not depend on.
    independent_fields: ClassVar[Mapping[str, frozenset[str]]] = {}

    def changes(self) -> "list[Change]":
        """All changes to try."""
        raise NotImplementedError

    def solved(self, wrong: Flags) -> "Iterable[Change]":
        """Changes that are solved for from the texture's numbers; ``wrong`` are flags, (K,)."""
        return ()

    def ends(self) -> tuple[FloatArray, FloatArray]:
        """Smallest and largest values that are right, of the shape of ``mine``, before ``value``."""
        raise NotImplementedError

    def interval(self) -> tuple[FloatArray, FloatArray]:
        """Smallest and largest values that are right."""
        ends = (
            self.ends()
            if self.replacement is None
            else (self.replacement - SUM_TOLERANCE, self.replacement + SUM_TOLERANCE)
        )
        first, second = (self.value(end) for end in ends)
        return np.minimum(first, second), np.maximum(first, second)

    def with_sight(self, sight: Any) -> "Problem | None":
        """The problem of a renderer with another sight; None if it does not depend on the sight."""
        return None

    def leaves_texture(self) -> Flags:
        """Flags of texels with a sample that may leave the texture, (K,)."""
        return np.zeros(len(self.columns), np.bool_)

    def changed(self, **fields: Any) -> Self:
        """A copy with other fields; it keeps cached properties that do not depend on them."""
        copy = object.__new__(type(self))
        outdated = [name for name, independent in self.independent_fields.items() if not independent.issuperset(fields)]
        copy.__dict__.update({name: value for name, value in self.__dict__.items() if name not in outdated} | fields)
        return copy

    def then(self, function: Function) -> Self:
        """A copy whose right values are mapped by a function."""
        before = self.value
        return self.changed(value=lambda x: function(before(x)))


@dataclass(frozen=True)
class Axis:
    """Values that a change may have, each by a signed step from no change."""

    least: float  # sizes of a step, positive
    most: float
    factor: bool = False  # whether the value is exp(step) and not the step itself
    signs: tuple[int, ...] = (1, -1)
    number: int = 9  # number of the first sizes
    more: tuple[float, ...] = ()  # further sizes
    signed: bool = True  # whether a value that is no factor is printed as '+ 1' or '- 1'

    @property
    def steps(self) -> FloatArray:
        """The steps to try first."""
        sizes = np.concatenate([np.geomspace(self.least, self.most, self.number), self.more])
        return np.concatenate([sign * sizes for sign in self.signs])

    @property
    def ratio(self) -> float:
        """The ratio of a size to the one before."""
        return float((self.most / self.least) ** (1 / (self.number - 1)))

    def value(self, step: float) -> float:
        """The value of a step."""
        return exp(step) if self.factor else step

    def step(self, value: float) -> float:
        """The step of a value."""
        return float(np.log(value)) if self.factor else value

    def text(self, step: float) -> str:
        """The value with enough digits to differ from no change."""
        digits = 2 - floor(log10(abs(step))) if step else 0
        if self.factor:
            return f"{exp(step):.{max(digits, 4)}f}"
        if not self.signed:
            return f"{step:.{max(digits, 3)}f}"
        return f"{'-' if step < 0 else '+'} {abs(step):.4g}"


@dataclass(frozen=True)
class Change:
    """One way in which a renderer may differ from the reference."""

    kind: str  # its name, such as 'radius'
    apply: Callable[[Any, Values], Any]  # returns the changed problem of a problem and values; None if there is none
    words: str  # the change in a report, with braces for its values
    axes: tuple[Axis, ...] = ()  # of its values
    shared: bool = False  # whether it changes the view, and so all stages and modules alike
    first: bool = False  # whether it must precede others, as it creates a new problem
    late: bool = False  # whether it is tried only if no other change explains the texture: such changes are many
    hint: str | Callable[..., str] = ""  # an option that makes the texture right, or a function of the values

    def option(self, steps: Values) -> str:
        """The option, with the values of steps, that makes the texture right; '' without one."""
        return self.hint if isinstance(self.hint, str) else self.hint(*self.values(steps))

    def values(self, steps: Values) -> Values:
        """The values of steps."""
        return tuple(axis.value(step) for axis, step in zip(self.axes, steps, strict=True))

    def text(self, steps: Values) -> str:
        """The change with its values."""
        return self.words.format(*(axis.text(step) for axis, step in zip(self.axes, steps, strict=True)))


def literal(name: str) -> str:
    """A name as words of a change: folders of other views may have braces in their names."""
    return name.replace("{", "{{").replace("}", "}}")


def plain(kind: str, apply: Callable[[Any], Any], **more: Any) -> Change:
    """A change without values."""
    return Change(kind, lambda problem, _: apply(problem), literal(kind), **more)


def fixed(kind: str, **fields: Any) -> Change:
    """A change without values that gives the problem other fields."""
    return plain(kind, lambda problem: problem.changed(**fields))


def purpose(option: str) -> str:
    """Return the words before an advised option: the command that takes it."""
    return "compare again with" if option.startswith(_COMPARE_OPTIONS) else "render the reference with"


def advice(option: str) -> str:
    """Return the end of a sentence that advises an option; '' without one."""
    return option and f"; {purpose(option)} {option}"


def late(change: Change) -> Change:
    """The change, to be tried only if no other explains the texture."""
    return replace(change, late=True)


def pair(first: Change, second: Change) -> Change:
    """Two changes, one after the other; the values are those of the first, then those of the second."""
    split = len(first.axes)

    def apply(problem: Problem, values: Values) -> Problem | None:
        changed = first.apply(problem, values[:split])
        result: Problem | None = None if changed is None else second.apply(changed, values[split:])
        return result

    kind = f"{first.kind}{_AND}{second.kind}"
    words = f"{first.words}{_AND}{second.words}"
    return Change(kind, apply, words, (*first.axes, *second.axes), first.shared and second.shared)


def named_change(kind: str, changes: Mapping[str, Change]) -> Change | None:
    """The change of that name among changes by their names, or the pair of two of them; None if there is none."""
    if kind in changes:
        return changes[kind]
    words = kind.split(_AND)
    parts = ((_AND.join(words[:k]), _AND.join(words[k:])) for k in range(1, len(words)))
    return next((pair(changes[a], changes[b]) for a, b in parts if a in changes and b in changes), None)


FACTOR = Axis(1e-5, 2.3, factor=True, more=(log(2.0),))  # halves and doubles are common, and far from the others


def scaled(
    kind: str, apply: Callable[[Any, float], Any], axis: Axis = FACTOR, words: str | None = None, **more: Any
) -> Change:
    """A change with one value, a factor by default."""
    return Change(kind, lambda problem, v: apply(problem, v[0]), words or f"{kind} x {{}}", (axis,), **more)


def shifts(apply: Callable[[Any, float, float], Any]) -> list[Change]:
    """Shifts by texels along u, along v and along both."""
    axis = Axis(3e-4, 6.0, signed=False)
    coarse = Axis(0.01, 6.0, number=5, signed=False)
    words = "shifted by {} texels"
    return [
        Change("shift of u", lambda p, s: apply(p, s[0], 0.0), f"u {words}", (axis,)),
        Change("shift of v", lambda p, s: apply(p, 0.0, s[0]), f"v {words}", (axis,)),
        Change("shift of u and v", lambda p, s: apply(p, *s), "u and v shifted by {} and {} texels", (coarse, coarse)),
    ]


# Rows and columns of a whole texture in reverse order.
FLIPS = (
    plain("rows from below", lambda p: p.flipped(False, True), first=True),
    plain("columns from the right", lambda p: p.flipped(True, False), first=True),
    plain("rows from below and columns from the right", lambda p: p.flipped(True, True), first=True),
)


def cut(problem: Problem) -> list[Change]:
    """The change to truncated codes, if the format has codes."""
    if problem.floored is None:
        return []
    return [plain("codes cut, not rounded", lambda p: p.changed(store=p.floored))]


@dataclass(frozen=True)
class Candidate:
    """A change after its trial."""

    kind: str  # the change's name; of two, both, joined by ' and '
    values: Values  # in the order in which ``words`` has them
    words: str  # the change with its values
    share: float  # share of the surface's texels, 0 to 1, inside the interval of the changed reference
    decided: float  # share of the wrong texels that the change decides
    explained: float  # share of the wrong texels that it decides, and that are inside
    shared: bool = False  # whether it is a number of the display or camera, one for all stages and modules
    hint: str = ""  # an option that makes the texture right
    in_all: str = ""  # words of a background in several textures, in place of those with numbers of texels


def one_of(candidates: Sequence[Candidate]) -> str:
    """Return the subject of a sentence on changes, any of which it may be: 'a', 'a, or b,', 'a, or b, or c,'."""
    return ", or ".join(candidate.words for candidate in candidates) + "," * (len(candidates) > 1)


def percent(share: float) -> str:
    """A share in percent, never rounded up to 100."""
    return f"{min(100 * share, 99.99) if share < 1 else 100:.2f} %"


def share_of(share: float) -> str:
    """A share of texels: 'all', or in percent."""
    return "all" if share == 1 else percent(share)


def without(left_out: int) -> str:
    """Words of wrong texels that were left out; empty if none were."""
    return f"without {left_out} of which a sample leaves the texture" if left_out else ""
