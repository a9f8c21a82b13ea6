"""SSAO2 of Babylon.js: ssao2.fragment.fx and ssao2RenderingPipeline, 2026.

Directions and lengths of a kernel are taken from another number on in each texel, by the noise. View space, and with it
the frame, is left-handed. Near the camera R is smaller. A surface hides a point less, the farther it is before it, and
occlusion fades out far away.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from lfssao.ao.estimators.estimator import FloatArray, option
from lfssao.ao.estimators.look_ups import LookUps
from lfssao.ao.formulas import summed
from lfssao.ao.textures import Buffers
from lfssao.core.jit import formula
from lfssao.core.numbers import larger, number, rounded, select, smaller, smoothstep, surely
from lfssao.core.vectors import Vector, cross, dot
from lfssao.errors import InputError
from lfssao.samples import make_samples

SAMPLES = 16  # directions and lengths of the shader's tables
RANGE_CHECKS = "smoothstep", "none"
SHIFTS = {"both": (1, 1), "directions": (1, 0), "lengths": (0, 1), "none": (0, 0)}


@dataclass(frozen=True)
class BabylonOptions(LookUps):
    """Options of ``babylon-ssao2``."""

    strength: float = option(1.0, "totalStrength", limits=(0.0, 100.0))
    base: float = option(0.0, "added to the visibility", limits=(0.0, 1.0))
    max_z: float = option(100.0, "maxZ, distance along the axis at which occlusion ends", limits=(0.0, 1e12))
    min_z_aspect: float = option(0.2, "R is at most so many times distance over near plane", limits=(0.0, 1e6))
    range_check: str = option(
        "smoothstep", "weight of what is hidden: 1 - smoothstep(R / 2, R, z_S - z_Q), or 1", choices=RANGE_CHECKS
    )
    shifts: str = option("both", "tables that a texel takes from another number on", choices=tuple(SHIFTS))


class Kernel(NamedTuple):
    """Directions, (16, 3), and lengths, (16,); R; R at distance 1; the factor of the sum; base; where AO fades.

    checked: whether there is a range check. by_y, by_x: 1 where noise shifts directions and lengths, else 0.
    """

    points: Any
    lengths: Any
    radius: Any
    slope: Any
    scale: Any
    base: Any
    far: Any
    checked: bool
    by_y: int
    by_x: int

    def start(self, view: Any, texel: Any) -> Any:
        """The noise, R there, its fading, and the images of C and of the frame's axes."""
        n, c, (x, y), z = view.normal(texel), view.position(texel), view.turn(texel), view.surface(texel)
        r, right = view.noise(texel), view.rightward()
        other = x * cross(view.upward(), right) - y * right
        free = view.fork(1 - abs(dot(r, n)) > 0.01)
        r = Vector(select(free, r.x, other.x), select(free, r.y, other.y), select(free, r.z, other.z))
        t = r - dot(r, n) * n
        t = (1 / np.sqrt(dot(t, t))) * t
        radius, far = smaller(rounded(self.radius, 0, z), rounded(self.slope, 0, z, 1) * z), rounded(self.far, 0, z)
        fading = 1 - _step(0.75 * far, far, z)
        return (x, y), radius, fading, (view.at(c), view.along(t), view.along(cross(t, n)), view.along(n))

    def counts(self, view: Any, here: Any) -> Any:
        """Whether there is a radius."""
        return self.radius > 0

    def place(self, view: Any, here: Any, s: Any) -> Any:
        """The image of C + R l (x t + y b + z n)."""
        (x, y), radius, _, (c, t, b, n) = here
        k, m = _taken(self, self.by_y, y, s), _taken(self, self.by_x, x, s)
        length = radius * number(self.lengths[m], radius)
        return c + length * (self.points[k, 0] * t + self.points[k, 1] * b + self.points[k, 2] * n)

    def term(self, view: Any, here: Any, s: Any, z: Any, texel: Any, seen: Any) -> Any:
        """1 - smoothstep(R / 2, R, z_S - z_Q) of a point that is hidden."""
        before, radius = z - view.surface(seen), here[1]
        weight = select(self.checked, 1 - _step(0.5 * radius, radius, before), number(1, before))
        return select(before >= 0, weight * here[2], 0)

    def background(self) -> Any:
        """The term of a point before background."""
        return 0

    def end(self, total: Any) -> Any:
        """The sum times strength / n, less base."""
        return smaller(1, larger(0, rounded(self.scale, 1, total, 1) * total - rounded(self.base, 0, total)))


@formula
def _step(low: Any, high: Any, x: Any) -> Any:
    """The smooth step from 0 at one number to 1 at another."""
    return smoothstep(smaller(1, larger(0, (x - low) / (high - low))))


@formula
def _taken(kernel: Any, shift: Any, noise: Any, s: Any) -> Any:
    """The number in a table of sample s, shifted (1) by a coordinate of the noise, exact, from -1 to 1, or not (0)."""
    on = 0
    for k in range(1, SAMPLES + 1):
        on = on + select(surely(noise >= k / 8 - 1), shift, 0)
    return (s + on) % SAMPLES


def babylon_ssao2(
    buffers: Buffers, radius: float, points: FloatArray, weights: FloatArray | None, options: BabylonOptions
) -> Kernel:
    """Return the formulas' numbers, in the textures' dtype; points: the 16 directions of the kernel."""
    if buffers.view.screen_to_world is None:
        raise InputError("estimator babylon-ssao2 reads a camera's near plane, and this view is of a display")
    if len(points) != SAMPLES:
        raise InputError(f"estimator babylon-ssao2 has {SAMPLES} samples, given are {len(points)}")
    kind, near = buffers.depth.dtype.type, float(buffers.view.lens[4])
    steps, (by_y, by_x) = (np.arange(1, SAMPLES + 1) / SAMPLES) ** 2, SHIFTS[options.shifts]
    with np.errstate(over="ignore", divide="ignore"):
        return Kernel(
            points=np.ascontiguousarray(points, kind),
            lengths=np.where(np.arange(SAMPLES) > 0, 0.1 + 0.9 * steps, 0.1).astype(kind),
            radius=kind(radius),
            slope=kind(np.float64(options.min_z_aspect) / near),
            scale=kind(options.strength / SAMPLES),
            base=kind(options.base),
            far=kind(options.max_z),
            checked=options.range_check == "smoothstep",
            by_y=by_y,
            by_x=by_x,
        )


def directions(n: int) -> tuple[FloatArray, None]:
    """Return n directions of the upper half."""
    points = make_samples("latin", n, r_min=1.0)
    return np.where([False, False, True], np.abs(points), points), None


ENTRIES = (
    summed(
        "babylon-ssao2",
        babylon_ssao2,
        title="share of a kernel's points that are hidden, less by what is far before them",
        source="Babylon.js ssao2.fragment.fx",
        formula=(
            "ao = (strength / n) sum of (z_S >= z_Q) (1 - smoothstep(R / 2, R, z_S - z_Q)) - base, S = C + R l_i (x t "
            "+ y t x n + z n)"
        ),
        options=BabylonOptions,
        samples=directions,
        count=SAMPLES,
        normals=True,
        texel_bytes=16,
        turns=True,
        rotation="tiles",
    ),
)
