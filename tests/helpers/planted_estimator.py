"""A new estimator as somebody would add it: Crytek's sphere (Mittring 2007) with a smooth range check.

C is a texel's point. Each point s of the unit ball lies at S = C + R s, turned about world z. The surface that the
texel of its image shows, at z_Q, hides S if z_Q < z_S, with the weight smoothstep(R / |z_C - z_Q|).
"""

from dataclasses import dataclass
from functools import partial
from math import sqrt
from typing import Any, NamedTuple

import numpy as np

from lfssao.ao.estimators.estimator import Estimator, FloatArray, Options, option
from lfssao.ao.formulas import sum_formulas
from lfssao.ao.textures import Buffers
from lfssao.core.numbers import number, rounded, select, smoothstep
from lfssao.core.vectors import Vector
from lfssao.samples import make_samples


@dataclass(frozen=True)
class SphereOptions(Options):
    """Options of ``crytek-sphere``."""

    reach: float = option(1.0, "difference of depths from which a weight falls, in radii", limits=(0, 100), power=1)


class Sphere(NamedTuple):
    """Numbers of the formulas: points (n, 3) in the unit ball; radius; reach, in units of cast z."""

    points: Any
    radius: Any
    reach: Any

    def start(self, view: Any, texel: Any) -> Any:
        """z_C, the image of C, and the texel's turn."""
        c = view.at(view.position(texel))
        return view.depth_at(c), c, view.turn(texel)

    def counts(self, view: Any, here: Any) -> Any:
        """Every texel with a surface has samples."""
        return True

    def place(self, view: Any, here: Any, s: Any) -> Any:
        """The image of C + R s."""
        _, c, (cosine, sine) = here
        x, y, z = (number(self.points[s, 0], sine), number(self.points[s, 1], sine), number(self.points[s, 2], sine))
        turned = Vector(x * cosine - y * sine, x * sine + y * cosine, z)
        return c + self.radius * view.along(turned)

    def term(self, view: Any, here: Any, s: Any, z: Any, texel: Any, seen: Any) -> Any:
        """The weight of a point that the surface hides."""
        z_q, reach = view.surface(seen), rounded(self.reach, 4, z)
        d = abs(here[0] - z_q)
        return select(z_q < z, smoothstep(select(d > reach, reach / d, 1)), 0)

    def background(self) -> Any:
        """The weight of a point that looks at background."""
        return 0

    def end(self, total: Any) -> Any:
        """The mean weight."""
        return total / self.points.shape[0]


def sphere(buffers: Buffers, radius: float, points: FloatArray, weights: None, options: SphereOptions) -> Sphere:
    """Return the formulas' numbers, in the textures' dtype."""
    a, b, c, _ = buffers.view.cast_from_world[2].tolist()
    dtype, deep = buffers.depth.dtype.type, float(radius) * sqrt((a * a + b * b) + c * c)
    return Sphere(np.ascontiguousarray(points, dtype), dtype(radius), dtype(options.reach * deep))


ENTRIES = (
    Estimator(
        name="crytek-sphere",
        title="share of points in the ball that are hidden, with a smooth range check",
        source="Mittring 2007",
        formula="ao = mean of smoothstep(R / |z_C - z_Q|) over the points S = C + R s with z_Q < z_S",
        run=partial(sum_formulas, sphere),
        formulas=sphere,
        options=SphereOptions,
        samples=lambda n: (make_samples("latin", n), None),
        count=16,
        whole_ball=True,
        texel_bytes=16,
        turns=True,
        rotation="hash",
    ),
)
