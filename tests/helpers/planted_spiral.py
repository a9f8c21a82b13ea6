from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from lfssao.ao.estimators.estimator import Options, option
from lfssao.ao.formulas import summed
from lfssao.core.elementary import sincospi
from lfssao.core.functions import exponential
from lfssao.core.numbers import larger, number, rounded, select, smaller
from lfssao.core.vectors import cross, dot


@dataclass(frozen=True)
class SpiralOptions(Options):
    decay: float = option(2.0, "of the falloff exp(-decay d^2 / R^2)", limits=(0.0, 50.0))


class Spiral(NamedTuple):
    points: Any
    radius: Any
    slope: Any

    def start(self, view, texel):
        c, n = view.position(texel), view.normal(texel)
        t = view.rightward() - dot(view.rightward(), n) * n
        t = (1 / np.sqrt(dot(t, t))) * t
        return c, n, view.at(c), self.radius * view.along(t), self.radius * view.along(cross(n, t))

    def counts(self, view, here):
        return True

    def place(self, view, here, s):
        x, y = view.sine_of_angle(self.points[s, 0]), view.sine_of_angle(self.points[s, 1])
        return here[2] + x * here[3] + y * here[4]

    def term(self, view, here, s, z, texel, seen):
        v = view.position(seen) - here[0]
        d, above = dot(v, v), larger(0, dot(v, here[1]))
        return select(d > 0, above / np.sqrt(d) * exponential(-rounded(self.slope, 3, d) * d), number(0, z))

    def background(self):
        return 0

    def end(self, total):
        return smaller(1, total / self.points.shape[0])


def turns(n):
    return np.array([np.sqrt((k + 0.5) / n) * np.array(sincospi(0.7639320225 * k)[::-1]) for k in range(n)]), None


def spiral(buffers, radius, points, weights, options):
    kind = buffers.depth.dtype.type
    return Spiral(points.astype(kind), kind(radius), kind(options.decay / radius**2))


ENTRIES = (summed("spiral", spiral, options=SpiralOptions, samples=turns, dimensions=2, count=12, normals=True),)
