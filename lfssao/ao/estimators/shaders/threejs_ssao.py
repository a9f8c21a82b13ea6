"""SSAO of three.js: examples/jsm/shaders/SSAOShader.js and postprocessing/SSAOPass.js, 2026.

Depth is linear from 0 at the near to 1 at the far plane, on displays metres behind the screen. A point is hidden where
the surface is nearer by more than one distance and less than another. The kernel is not folded; the frame is made of a
noise vector (r, r, r). Depth outside the texture is that of its border; background is at 1, and hides nothing.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from lfssao.ao.estimators.estimator import FloatArray, option
from lfssao.ao.estimators.look_ups import LookUps
from lfssao.ao.estimators.oriented import in_frame, tangent_frame
from lfssao.ao.formulas import summed
from lfssao.ao.textures import Buffers
from lfssao.core.numbers import larger, number, rounded, select, smaller
from lfssao.samples import make_samples


@dataclass(frozen=True)
class ThreeOptions(LookUps):
    """Options of ``threejs-ssao``; depth is counted in distances from the near to the far plane."""

    min_distance: float = option(0.005, "depth by which a surface that hides a point is nearer, at least")
    max_distance: float = option(0.1, "depth by which it is nearer, at most")


class ThreeSsao(NamedTuple):
    """The kernel, (n, 3), R, the near plane and the distance of the planes, and the two distances."""

    points: Any
    radius: Any
    near: Any
    planes: Any
    low: Any
    high: Any

    def start(self, view: Any, texel: Any) -> Any:
        """z_C, and the images of C and of R t, R b and R n."""
        return tangent_frame(self, view, texel)

    def counts(self, view: Any, here: Any) -> Any:
        """Every texel with a surface has samples."""
        return True

    def place(self, view: Any, here: Any, s: Any) -> Any:
        """The image of C + R (x t + y b + z n)."""
        return in_frame(self, here, s)

    def term(self, view: Any, here: Any, s: Any, z: Any, texel: Any, seen: Any) -> Any:
        """1 of a point that is hidden."""
        planes = rounded(self.planes, 1, z)
        delta = (z - self.near) / planes - (view.surface(seen) - self.near) / planes
        return select((delta > self.low) & (delta < self.high), number(1, z), 0)

    def background(self) -> Any:
        """The term of a point before background."""
        return 0

    def end(self, total: Any) -> Any:
        """The share of hidden points."""
        return smaller(1, larger(0, total / self.points.shape[0]))


def three_ssao(
    buffers: Buffers, radius: float, points: FloatArray, weights: FloatArray | None, options: ThreeOptions
) -> ThreeSsao:
    """Return the formulas' numbers, in the textures' dtype."""
    kind, lens = buffers.depth.dtype.type, buffers.view.lens
    near, far = (0.0, 1.0) if buffers.view.screen_to_world is None else lens[4:6].tolist()
    table, limits = np.ascontiguousarray(points, kind), (kind(options.min_distance), kind(options.max_distance))
    return ThreeSsao(table, kind(radius), kind(near), kind(far - near), *limits)


def upper_half(n: int) -> tuple[FloatArray, None]:
    """Return n points of the upper half ball."""
    points = make_samples("latin", n, r_min=0.0)
    return np.where([False, False, True], np.abs(points), points), None


ENTRIES = (
    summed(
        "threejs-ssao",
        three_ssao,
        title="share of a kernel's points that lie behind the surface, but not far behind",
        source="three.js SSAOShader",
        formula="ao = (points with min_distance < d_S - d_Q < max_distance) / (number of points), d depth of 0 to 1",
        options=ThreeOptions,
        samples=upper_half,
        count=32,
        normals=True,
        texel_bytes=16,
        turns=True,
        rotation="tiles",
        vectors=True,
    ),
)
