"""Slices through the viewing direction: what estimators by them (GTAO, visibility bitmask) have in common.

A slice is the plane of w, the texel's viewing direction, and of a direction e_k at right angles to it; slices turn from
texel to texel as the directions of ``hbao`` do. Each has two sides, e_k and -e_k, which are directions 2 k and 2 k + 1.
On a side angles count from the direction to the viewer, -w. The normal's part in the slice has the length N and the
angle n: N cos n is its part along -w, which is held above 0, N sin n that along e_k. So n is less than pi / 2; the
other side's is -n.

Bent normals (``lfssao.bent_normals``) are made of the same steps. With an axis of the world, 0 to 2, a tuple of numbers
sums that component of B, the integral of V W omega over the directions omega, V their visibility, W their weight: N
cos(t - n) of the angle t, or 1. A slice's directions have the solid angle |sin t| dt.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from lfssao.ao.estimators.estimator import FloatArray, option
from lfssao.ao.estimators.horizon import axes_around
from lfssao.ao.estimators.look_ups import LookUps
from lfssao.ao.estimators.vo.local_frame import TILE, disk_mirrors
from lfssao.core.elementary import PI, sincospi
from lfssao.core.jit import formula
from lfssao.core.numbers import larger, number, power, rounded, select, smaller, unless_none, where_none

# Lagarde 2014, 'Inverse trigonometric functions GPU optimization for AMD GCN architecture', of degree 1: within 0.0091.
_SLOPE = -0.156583
ANGLES = "exact", "polynomial"
WEIGHTINGS = "cosine", "uniform"
_POW = 9  # roundings that pow(x, 2) is off by: the ball of a part is off by a quotient's error of 1 in any case


@dataclass(frozen=True)
class SliceOptions(LookUps):
    """Options of estimators by slices."""

    slices: int = option(4, "slices through the viewing direction, each of two sides", limits=(1, 512))
    steps: int = option(8, "steps along each side", limits=(1, 1024))
    start: float = option(1.0, "part of a step at which the first one lies, 0.5 for half steps", limits=(0.0, 1.0))
    distribution: str = option(
        "even", "distances of steps: 'even', or their squares, more of them near", choices=("even", "squared")
    )
    jitter: bool = option(
        False, "whether a texel's steps begin at one of four parts of a step, by (column - row) mod 4"
    )
    weighting: str = option("cosine", "weights of directions", choices=WEIGHTINGS)
    acos: str = option(
        "exact", "arc cosine: 'exact', or Lagarde's polynomial of degree 1, off by 0.0091", choices=ANGLES
    )
    power: float = option(1.0, "power of the visibility", limits=(0.0, 16.0))
    randomize: bool = option(True, "whether the slices are reflected differently over tiles of 4 x 4 texels")
    seed: int = option(0, "of those reflections", limits=(0, 2**53))


@formula
def part_of_step(slices: Any, view: Any, texel: Any, k: Any) -> Any:
    """Return the part of the way at which step k lies: x or x^2, x = (k - 1 + the texel's start) / steps."""
    turn = number((view.column(texel) + 3 * view.row(texel)) % 4, k)
    x = ((k - 1) + (slices.first + slices.quarter * turn)) / slices.steps
    return rounded(x * (slices.linear + slices.quadratic * x), _POW, k)


@formula
def tilt(slices: Any, normal: Any, s: Any) -> Any:
    """Return N sin n and N of a side, of the normal along e, f and -w."""
    e = slices.points[s, 0] * normal[0] + slices.points[s, 1] * normal[1]
    return e, np.sqrt(normal[2] * normal[2] + e * e)


@formula
def polynomial_angle(x: Any) -> Any:
    """Return the angle of a cosine by Lagarde's polynomial."""
    size = abs(x)
    near = np.sqrt(larger(0, 1 - size)) * (0.5 * PI + _SLOPE * size)
    return select(x < 0, PI - near, near)


@formula
def arc(cosine: Any, h: Any, towards: Any, e: Any) -> Any:
    """Return N a(h, n) of ``gtao``, of cos h, h, N cos n and N sin n."""
    square = larger(0, 1 - cosine * cosine)
    return 0.5 * (square * towards + (h - cosine * np.sqrt(square)) * e)


@formula
def occlusion_of(slices: Any, total: Any) -> Any:
    """Return 1 - visibility^power, of the sum of all slices' visibility, 0 without a radius; along an axis the sum."""
    visibility = smaller(1, larger(0, total / (slices.points.shape[0] // 2)))
    occlusion = select(slices.radius > 0, 1 - power(visibility, slices.exponent), number(0, visibility))
    return where_none(slices.axis, occlusion, total)


@formula
def with_axes(slices: Any, view: Any, texel: Any, here: Any) -> Any:
    """Return a texel's numbers, as of ``disk_around``, and e, f and -w along the axis, if there is one."""
    return unless_none(slices.axis, here, _with_axes, (slices, view, texel, here))


@formula
def _with_axes(axis: Any, slices: Any, view: Any, texel: Any, here: Any) -> Any:
    p, w, images, normal = here
    e, f = axes_around(slices, view, texel, w)
    return p, w, images, normal, (_coordinate(e, axis), _coordinate(f, axis), -_coordinate(w, axis))


@formula
def _coordinate(v: Any, axis: Any) -> Any:
    return v.x if axis == 0 else v.y if axis == 1 else v.z


@formula
def in_side(slices: Any, here: Any, s: Any) -> Any:
    """Return a side's direction, x e + y f, and -w along the axis; here: as of ``with_axes``."""
    e, f, ahead = here[4]
    return slices.points[s, 0] * e + slices.points[s, 1] * f, ahead


def sides(slices: int) -> FloatArray:
    """Return x and y of both sides of slices, (2 n, 2), unit length."""
    ahead = np.array([sincospi((2 * k + 1) / (2 * slices))[::-1] for k in range(slices)])
    return np.stack([ahead, -ahead], axis=1).reshape(-1, 2)


def in_common(radius: float, options: SliceOptions, dtype: Any) -> dict[str, Any]:
    """Return the numbers that tuples of estimators by slices have, of a dtype.

    points: (2 n, 2), ``sides``. steps: how many along each. radius: world units. mirrors: as of ``Horizons``. first,
    quarter: steps at which the first one lies, and that it lies further in the next column. linear, quadratic: the part
    of the way is linear x + quadratic x^2. exact: whether angles are. exponent: of the visibility.
    """
    squared = options.distribution == "squared"
    return {
        "points": sides(options.slices).astype(dtype),
        "steps": options.steps,
        "radius": dtype.type(radius),
        "mirrors": np.ascontiguousarray(disk_mirrors(options.randomize, options.seed, dtype)[:, :, :TILE]),
        "first": dtype.type(options.start / 4 if options.jitter else options.start),
        "quarter": dtype.type(0.25 if options.jitter else 0.0),
        "linear": dtype.type(not squared),
        "quadratic": dtype.type(squared),
        "exact": options.acos == "exact",
        "exponent": options.power,
    }
