"""A start for an estimator that sums a term of each sample. 'lfssao estimators FILE' checks it."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from lfssao.ao.estimators.estimator import option
from lfssao.ao.estimators.look_ups import LookUps
from lfssao.ao.formulas import summed
from lfssao.core.numbers import number, select, smaller
from lfssao.core.vectors import Vector
from lfssao.samples import make_samples


@dataclass(frozen=True)
class MyOptions(LookUps):  # with border, background and filter of look-ups
    """Parameters on the command line; power=1 counts them in radii."""

    bias: float = option(0.0, "by how much a surface must be nearer, in radii", limits=(0.0, 10.0), power=1)


class Mine(NamedTuple):  # numbers of the arithmetic's dtype, which the formulas below read
    """Offsets of samples, (n, 3), world units, and the bias in units of z along the view."""

    points: Any
    bias: Any

    def start(self, view: Any, texel: Any) -> Any:  # once a texel; position, normal, direction, turn: words of views
        """The image of the texel's point."""
        return (view.at(view.position(texel)),)

    def counts(self, view: Any, here: Any) -> Any:
        """Whether a texel with a surface has samples."""
        return True

    def place(self, view: Any, here: Any, s: Any) -> Any:  # the image of a point and of offsets, multiplied and added
        """The place at which sample s is looked up."""
        x, y, z = self.points[s, 0], self.points[s, 1], self.points[s, 2]
        return here[0] + view.along(Vector(view.sample_offset(x), view.sample_offset(y), view.sample_offset(z)))

    def term(self, view: Any, here: Any, s: Any, z: Any, texel: Any, seen: Any) -> Any:  # select(), not if
        """The term of sample s at z, whose place is looked up in ``seen``, which shows a surface."""
        return select(z - view.surface(seen) > self.bias, number(1, z), 0)

    def background(self) -> Any:
        """The term of a sample that sees none."""
        return 0

    def end(self, total: Any) -> Any:  # 0 open, 1 covered
        """The occlusion that the sum of the terms makes."""
        return smaller(1, total / self.points.shape[0])


def mine(buffers: Any, radius: float, points: Any, weights: Any, options: MyOptions) -> Mine:
    """Return the numbers above for a view; ``buffers.depth.dtype`` is the arithmetic's."""
    kind, deep = buffers.depth.dtype.type, float(np.linalg.norm(buffers.view.cast_from_world[2, :3]))
    return Mine(np.ascontiguousarray(radius * points, kind), kind(options.bias * radius * deep))


ENTRIES = (summed("mine", mine, options=MyOptions, samples=lambda n: (make_samples("latin", n), None), count=16),)
