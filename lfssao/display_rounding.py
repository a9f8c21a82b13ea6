"""How far rounding moves the rays and the images of any display: the code of its kernels, run on ``Rounded`` numbers.

So each operation of ``lfssao.kernels.display`` is bounded in the order in which the kernels do it, and a change there
is one here.
"""

from types import FunctionType
from typing import Any

import numpy as np

from lfssao.kernels import display
from lfssao.ranges import Flags, Numbers, Range, Rounded

# The arithmetic of the AO kernels and that of the ray caster.
SINGLE, DOUBLE = 2.0**-24, 2.0**-53

# How near to the lens, metres, the bounds of numbers flushed to zero hold.
_NEAREST = 2.0**-10

# The numbers of a module that bend its texels: k1 and k2.
_BENDS = (20, 21)


def _on_any_numbers(kernel: Any, **called: Any) -> FunctionType:
    """A kernel's Python function, which calls these instead of the compiled functions of their names."""
    return FunctionType(kernel.py_func.__code__, {**kernel.py_func.__globals__, **called})


_crossing = _on_any_numbers(display.circle_crossing)
_homography = _on_any_numbers(display.apply_homography)
_distort = _on_any_numbers(display.distort)


def _image(circle_crossing: Any) -> FunctionType:
    """physical_to_image with that function for crossings."""
    point = _on_any_numbers(display.screen_point, circle_crossing=circle_crossing)
    return _on_any_numbers(
        display.physical_to_image, screen_point=point, apply_homography=_homography, distort=_distort
    )


# How far a ray is defined is not asked for, so that it does not matter which of two ends comes first.
_ray = _on_any_numbers(display.display_ray, circle_crossing=_crossing, apply_homography=_homography, min=lambda a, _: a)


def rounded_points(lens: Numbers, u: Range, v: Range, z: Range, doubt: Flags) -> tuple[Rounded, Rounded]:
    """The x and y of the points at z on the rays through image points, as the ray caster computes them in float64.

    Parameters
    ----------
    lens : (32,) float64
        The module's numbers (``lfssao.kernels.display``); its optics are taken as undistorted.
    u, v : Range
        Undistorted texel coordinates.
    z : Range
        Metres.
    doubt : (n,) bool
        In and out: which parts of the ranges have an image point that may not have a ray.
    """
    numbers = [Rounded.constant(0.0 if number in _BENDS else value, 0.0, doubt) for number, value in enumerate(lens)]
    o_x, o_y, d_x, d_y, *_ = _ray(numbers, *(Rounded(n, 0.0, DOUBLE, doubt) for n in (u, v)))
    if not isinstance(d_x, Rounded):
        doubt[:] = True
        return Rounded(u, np.zeros(len(doubt))), Rounded(v, np.zeros(len(doubt)))
    depth = Rounded(z, 0.0, DOUBLE, doubt)
    return o_x + depth * d_x, o_y + depth * d_y


def rounded_image(lens: Numbers, sigma: Range, x: Range, y: Range, z: Range, doubt: Flags) -> tuple[Rounded, Rounded]:
    """The u and v of physical points, as the AO kernels compute them in float32 from float32 coordinates.

    Where a line crosses a circle depends on the line's direction (dx, dz) = far (sigma, -1) only, with the share t of
    it over far, and so do all bounds of rounding on the way there, the numbers flushed to zero left aside: it is
    computed for (sigma, -1), as ranges of dx and dz forget what they have in common.

    Parameters
    ----------
    lens : (32,) float64
        The module's numbers.
    sigma : Range
        (x - m_x) / (m_z - z).
    x, y, z : Range
        Metres.
    doubt : (n,) bool
        In and out: which parts of the ranges have a point that may not have an image.
    """
    far = z.times(-1.0).plus(float(lens[2]))
    doubt |= ~(far.low > _NEAREST)
    toward = Range.constant(-1.0, z)

    def crossing(curvature: Rounded, from_x: Rounded, from_z: Rounded, dx: Rounded, dz: Rounded) -> Any:
        scaled = (Rounded(n, d.error / far.low, SINGLE, doubt) for n, d in ((sigma, dx), (toward, dz)))
        t, discriminant = _crossing(curvature, from_x, from_z, *scaled)
        return Rounded(t.exact.over(far), t.error / far.low, SINGLE, doubt), discriminant

    numbers = [Rounded.constant(value, SINGLE, doubt) for value in lens]
    u, v, answer = _image(crossing)(numbers, *(Rounded(n, 0.0, SINGLE, doubt) for n in (x, y, z)))
    if answer != display.VALID:
        doubt[:] = True
    return u, v


def plain_image(lens: Numbers, x: float, y: float, z: float) -> tuple[float, float]:
    """The u and v of one physical point in float64, for which nothing is compiled; NaN where it has no image."""
    with np.errstate(all="ignore"):  # what has no image is computed too
        u, v, answer = _image(_crossing)(lens, *np.array([x, y, z]))
    return (u, v) if answer == display.VALID else (np.nan, np.nan)
