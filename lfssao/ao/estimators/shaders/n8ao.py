"""N8AO of N8python for three.js: EffectShader.js and N8AOPass.js, version 2.0.0, 2026.

A texel's kernel turns about its normal by one number of noise, and another moves its points outwards, each to a length
of its own. The mean is of the points that the camera sees. A surface hides a point less, the farther it is before it;
four texels hide nothing: the point's own, and its neighbours right and above.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from lfssao.ao.estimators.estimator import FloatArray, Options, option
from lfssao.ao.estimators.oriented import cast_length
from lfssao.ao.formulas import summed
from lfssao.ao.textures import Buffers
from lfssao.core.elementary import PI, sincospi
from lfssao.core.jit import formula
from lfssao.core.numbers import larger, number, rounded, select, smaller, smoothstep, surely
from lfssao.core.vectors import Vector, cross, dot
from lfssao.errors import InputError

_ANGLE = 2.399963  # between points of the kernel
_CIRCLE = 2 * 3.1415962  # radians of noise 1, with its pi
RANGE_CHECKS = "smoothstep", "none"


@dataclass(frozen=True)
class N8Options(Options):
    """Options of ``n8ao``."""

    falloff: float = option(1.0, "distanceFalloff, in fifths of R, or in R of a radius in texels", limits=(0.0, 1e6))
    bias: float = option(0.0, "biasOffset, by how much a surface must be nearer, world units", limits=(0.0, 1e6))
    texels: bool = option(False, "screenSpaceRadius, whether R is a width in texels")
    range_check: str = option(
        "smoothstep", "weight of what is hidden: smoothstep(0, 1, falloff / (z_S - z_Q)), or 1", choices=RANGE_CHECKS
    )
    around: bool = option(True, "whether a texel and its neighbours right and above hide nothing")
    move: bool = option(True, "whether noise moves points outwards; else all lie at R")


class Kernel(NamedTuple):
    """Directions, (n, 3), and parts of n, (n,); R, or texels; the fall-off by R; bias; planes; the texture's size."""

    points: Any
    parts: Any
    radius: Any
    unit: Any  # world units of cast z
    falloff: Any
    bias: Any
    near: Any
    far: Any
    right: Any
    bottom: Any
    circle: Any
    texels: bool
    checked: bool
    anywhere: bool
    move: bool

    def start(self, view: Any, texel: Any) -> Any:
        """The share of a point, the fall-off, the part of R by noise, z, and the images of P and the turned frame."""
        p, n, z, (x, y) = view.position(texel), view.normal(texel), view.surface(texel), view.turn(texel)
        x, y = select(surely(x >= 1), number(0, x), x), select(surely(y >= 1), number(0, y), y)
        up, right = view.upward(), view.rightward()
        free = view.fork(dot(up, n) <= 0.99)
        t = cross(Vector(select(free, up.x, right.x), select(free, up.y, right.y), select(free, up.z, right.z)), n)
        t = (1 / np.sqrt(dot(t, t))) * t
        b, (cosine, sine) = cross(n, t), view.cosine_and_sine(x * rounded(self.circle, 1, x))
        aside = (number(view.column(texel), z) + 0.5) + self.radius, number(view.row(texel), z) + 0.5
        aside = view.apart(view.point_at(aside[0], aside[1], z), p)
        reach = select(self.texels, np.sqrt(dot(aside, aside)), rounded(self.radius, 0, z))
        axes = cosine * t - sine * b, sine * t + cosine * b
        frame = view.at(p), reach * view.along(axes[0]), reach * view.along(axes[1]), reach * view.along(n)
        seen = number(0, z)
        for s in range(self.points.shape[0]):
            place = _point(self, frame, y, s)
            u, v, valid = view.image(place)
            inside = (u > 0) & (u < self.right) & (v > 0) & (v < self.bottom) & valid
            seen = seen + select(inside & _between(self, view.depth_at(place)), number(1, z), 0)
        return 1 / larger(1, seen), reach * rounded(self.falloff, 2, z), y, z, frame

    def counts(self, view: Any, here: Any) -> Any:
        """Every texel with a surface has samples."""
        return True

    def place(self, view: Any, here: Any, s: Any) -> Any:
        """The image of P + R m (x t + y b + z n)."""
        return _point(self, here[4], here[2], s)

    def term(self, view: Any, here: Any, s: Any, z: Any, texel: Any, seen: Any) -> Any:
        """The share of a point that is hidden, by the range check."""
        deep, (share, falloff, _, own, _) = view.surface(seen), here
        column, row, before = view.column(seen), view.row(seen), z - deep
        other = (column != view.column(texel)) & (column != view.column(texel) + 1)
        other = other | ((row != view.row(texel)) & (row + 1 != view.row(texel))) | self.anywhere
        weight = smoothstep(smaller(1, larger(0, falloff / (before * rounded(self.unit, 0, z)))))
        weight = select(self.checked, weight, number(1, z))
        hidden = (before > 0) & (before >= rounded(self.bias, 0, z)) & ((deep < own) | (deep > own))
        return select(hidden & _between(self, z) & other, weight * share, 0)

    def background(self) -> Any:
        """The term of a point before background."""
        return 0

    def end(self, total: Any) -> Any:
        """The share of what is hidden."""
        return smaller(1, larger(0, total))


@formula
def _between(kernel: Any, z: Any) -> Any:
    """Whether a point lies between the planes."""
    return (z > rounded(kernel.near, 0, z)) & (z < rounded(kernel.far, 0, z))


@formula
def _point(kernel: Any, frame: Any, noise: Any, s: Any) -> Any:
    """The image of point s, at the part of R that lies so far after noise, from 0 to 1 and again from 0."""
    whole = select(surely(noise >= 1 - kernel.parts[s]), number(1, noise), 0)
    part = (noise + rounded(kernel.parts[s], kernel.points.shape[0], noise)) - whole
    part = select(kernel.move, part, number(1, noise))
    p, t, b, n = frame
    return p + part * (kernel.points[s, 0] * t + kernel.points[s, 1] * b + kernel.points[s, 2] * n)


def n8ao(buffers: Buffers, radius: float, points: FloatArray, weights: FloatArray | None, options: N8Options) -> Kernel:
    """Return the formulas' numbers, in the textures' dtype; points: the directions of the kernel."""
    if buffers.view.screen_to_world is None:
        raise InputError("estimator n8ao reads a camera's planes, and this view is of a display")
    kind, unit, lens = buffers.depth.dtype.type, cast_length(buffers.view, 1.0), buffers.view.lens.tolist()
    (height, width), n = buffers.depth.shape, len(points)
    return Kernel(
        points=np.ascontiguousarray(points, kind),
        parts=(np.arange(n) / n).astype(kind),
        radius=kind(radius),
        unit=kind(1 / unit),
        falloff=kind(options.falloff * (1.0 if options.texels else 0.2)),
        bias=kind(options.bias * unit),
        near=kind(lens[4]),
        far=kind(lens[5]),
        right=kind(width),
        bottom=kind(height),
        circle=kind(_CIRCLE),
        texels=options.texels,
        checked=options.range_check == "smoothstep",
        anywhere=not options.around,
        move=options.move,
    )


def directions(n: int) -> tuple[FloatArray, None]:
    """Return n unit vectors of the upper half on a golden spiral, whose heights are cosine-weighted."""
    turns = [sincospi(_ANGLE * k / PI)[::-1] for k in range(n)]
    disk = np.sqrt((np.arange(n) + 0.5) / n)[:, None] * np.array(turns)
    return np.column_stack([disk, np.sqrt(1 - (disk * disk).sum(axis=1))]), None


ENTRIES = (
    summed(
        "n8ao",
        n8ao,
        title="share of a turned kernel's points, moved by noise, that are hidden, by how far",
        source="N8AO, EffectShader.js",
        formula=(
            "ao = mean over points S in view of (z_S > z_Q + bias) smoothstep(0, 1, falloff R / 5 / (z_S - z_Q)), "
            "S = P + R m_i (x t + y b + z n)"
        ),
        options=N8Options,
        samples=directions,
        count=16,
        normals=True,
        texel_bytes=16,
        turns=True,
        rotation="tiles",
    ),
)
