"""A start for an estimator that takes steps along directions. 'lfssao estimators FILE' checks it."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from lfssao.ao.estimators.estimator import option
from lfssao.ao.estimators.look_ups import LookUps
from lfssao.ao.formulas import folded
from lfssao.core.elementary import sincospi
from lfssao.core.numbers import larger, number, rounded, select, smaller, within
from lfssao.core.vectors import dot


@dataclass(frozen=True)
class MyOptions(LookUps):  # with border, background and filter of look-ups
    """Parameters on the command line."""

    directions: int = option(4, "directions around each texel", limits=(1, 256))
    steps: int = option(4, "steps along each", limits=(1, 256))


class Mine(NamedTuple):  # numbers of the arithmetic's dtype, which the formulas below read
    """Directions in the image, (n, 2), steps along each, and the radius."""

    points: Any
    steps: int
    sides: int  # 1: what is kept begins anew at each direction; 2: the second of a pair goes on with it
    radius: Any

    def start(self, view: Any, texel: Any) -> Any:  # once a texel; position, normal, direction, turn: words of views
        """The texel's point and normal, and the images of the point and of the view's axes at length R."""
        p = view.position(texel)
        axes = self.radius * view.along(view.rightward()), self.radius * view.along(view.upward())
        return p, view.normal(texel), (view.at(p), *axes)

    def counts(self, view: Any, here: Any) -> Any:
        """Whether a texel with a surface has samples."""
        return True

    def place(self, view: Any, here: Any, s: Any) -> Any:
        """The end of direction s; steps lie between the texel's centre and its image."""
        p, right, up = here[2]
        return p + self.points[s, 0] * right + self.points[s, 1] * up

    def begin(self, view: Any, here: Any, s: Any) -> Any:
        """The number that is kept along a direction, before the first step: the sine of the highest surface."""
        return number(0, here[0].x)

    def part(self, view: Any, texel: Any, k: Any) -> Any:
        """The part of the way to the end at which step k lies, 0 to 1."""
        return k / self.steps

    def step(self, view: Any, here: Any, s: Any, k: Any, state: Any, texel: Any, seen: Any) -> Any:  # select(), not if
        """The number that a step adds, which sees ``seen``, and the one that is kept after it."""
        d = view.position(seen) - here[0]
        length = np.sqrt(dot(d, d))
        sine = within(dot(d, here[1]) / length, -1.0001, 1.0001)  # no renderer's is larger, however it rounds
        near = (length < rounded(self.radius, 4, length)) & view.other(seen, texel)
        return select(near, larger(0, sine - state), 0), select(near, larger(state, sine), state)

    def leave(self, view: Any, here: Any, s: Any, state: Any) -> Any:
        """The number that a direction adds after its last step, by the number that is kept."""
        return 0

    def end(self, total: Any) -> Any:  # 0 open, 1 covered
        """The occlusion that the sum of all steps makes."""
        return smaller(1, larger(0, total / self.points.shape[0]))


def mine(buffers: Any, radius: float, points: Any, weights: Any, options: MyOptions) -> Mine:
    """Return the numbers above for a view; ``buffers.depth.dtype`` is the arithmetic's."""
    kind, count = buffers.depth.dtype, options.directions
    around = np.array([sincospi(2 * k / count) for k in range(count)], kind)
    return Mine(np.ascontiguousarray(around), options.steps, 1, kind.type(radius))


ENTRIES = (folded("mine", mine, options=MyOptions, normals=True),)
