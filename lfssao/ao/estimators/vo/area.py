"""VO by areas of the disk, ``vo-area`` (Loos and Sloan 2010, section 4.2, with 4.3 and 4.5).

A line at (x, y) of the disk (``vo.lines``) stands for an area, which sees a distribution of depths: of a fraction V of
its texels a surface, with the mean mu and the standard deviation sigma of its depth, from first and second moments,

    mu = M1 / V,   sigma = sqrt(max(M2 / V - mu^2, 0))

They are read from a prefiltered pyramid (``ao.kernels.moments``) at the level whose texels have the area's size: log2
of the square root of pi |J| times the area's share of the disk, J the area that the images of R e and R f span. Taken
to the unit ball the surface is a box of half-width ``half_width`` sigma about mu. Hidden is, of the line from -z_s to
z_s, ``hidden_length``, less the same of the box moved back by the thickness (4.3), all times V.

Differences to VO, which leaves the first two open: an area whose middle lies outside the texture or has no image is
open, and a texel whose viewing direction does not lead away from the viewer has occlusion 0. Lines do not end at the
tangent plane (4.4): its slope would count as variance within the box, and ao errs by 0.34 in place of 0.13.

The limits are those of ``lfssao.ao.estimators.vo.volume``.
"""

from dataclasses import dataclass
from functools import partial
from math import sqrt
from typing import Any, NamedTuple

import numpy as np

from lfssao.ao.estimators.estimator import Estimator, FloatArray, option
from lfssao.ao.estimators.vo.local_frame import disk_frame
from lfssao.ao.estimators.vo.volume import (
    VolumeOptions,
    Weights,
    make_disk,
    sample_set,
    sum_at_radii,
    thickness_in_radii,
)
from lfssao.ao.formulas import cast_depth
from lfssao.ao.moments import moment_pyramid
from lfssao.ao.ssao import Occlusion
from lfssao.ao.textures import Buffers
from lfssao.core.elementary import PI
from lfssao.core.jit import formula
from lfssao.core.numbers import (
    alternatives,
    double,
    is_number,
    larger,
    least,
    log2,
    middle_of,
    most,
    number,
    rounded,
    select,
    smaller,
    spread_of,
    within,
)

FAR = 2.0**100  # boxes end here, in units of R, so that no width is infinite; a thickness of 4 FAR has no end
_NO_IMAGE = 512  # a level beyond every other


@dataclass(frozen=True)
class AreaOptions(VolumeOptions):
    """Options of VO by areas; VO's footnote wants the variance of the box, sqrt(3), its a and b imply 1."""

    half_width: float = option(
        sqrt(3.0), "half-width of the box of depths that an area sees, in standard deviations", limits=(0.0, 100.0)
    )
    prefilter: bool = option(False, "whether each level is blurred by [1 2 1] / 4, against visible squares")


@formula
def mean_and_deviation(share: Any, first: Any, second: Any) -> Any:
    """Return mean and standard deviation of depth, by the share of an area that has one, and means over all of it."""
    mean = first / share
    return mean, np.sqrt(larger(0, second / share - mean * mean))


@formula
def hidden_length(low: Any, high: Any, bottom: Any, top: Any) -> Any:
    """Return the length of [bottom, top] that lies behind a surface whose depth is spread evenly over [low, high].

    The fraction hidden at t, F(t) = (t - low) / (high - low) held between 0 and 1, integrated: its constant part and
    its linear one, as VO's V_c(z_min, z_max) and V_c(z_0, z_1, a, b), with the sign turned (hidden, not visible) and
    written so that nothing cancels: (top - t_1) + (t_1 - t_0) (F(t_0) + F(t_1)) / 2. A box of no width is a step.
    """
    start, end = smaller(top, larger(low, bottom)), smaller(top, larger(high, bottom))
    width = high - low
    first = select(start <= low, 0, select(start < high, (start - low) / width, 1))
    last = select(end <= low, 0, select(end < high, (end - low) / width, 1))
    return (top - end) + (end - start) * (0.5 * (first + last))


@formula
def _hidden(middle: Any, reach: Any, back: Any, bottom: Any, top: Any) -> Any:
    """Return ``hidden_length`` of the box middle +- reach, moved back; of balls by their ends.

    It grows with top, and falls with middle. The derivative by reach is at most 1/4: F changes by (middle - t) / (2
    reach^2), whose integral over half of the box is that.
    """
    centre, off = middle_of(reach), spread_of(reach)
    low, high = _end(most(middle) - centre, top) + back, _end(most(middle) + centre, top) + back
    fewest = hidden_length(low, larger(high, low), bottom, least(top))
    low, high = _end(least(middle) - centre, top) + back, _end(least(middle) + centre, top) + back
    return alternatives(fewest, hidden_length(low, larger(high, low), bottom, most(top))) + 0.25 * off


@formula
def _end(x: Any, like: Any) -> Any:
    """Return an end of a box, held where it is far."""
    return number(smaller(FAR, larger(-FAR, x)), like)


class Areas(NamedTuple):
    """Areas of the unit disk, arrays and scalars of the arithmetic's dtype.

    points: (n, 2), x and y of their middles. half: (n,), z_s. weights: (n,), of a unit of hidden length, so that a ball
    hidden whole gives 1. finer: (n,) float64, half the log2 of each area's share of the disk. mirrors: (2, TILE, ..),
    cosines and sines. radius: R, world units. thickness: T, in radii, 4 FAR where surfaces hide all that is behind
    them. half_width: float64.
    """

    points: Any
    half: Any
    weights: Any
    finer: Any
    mirrors: Any
    radius: Any
    thickness: Any
    half_width: Any

    def start(self, view: Any, texel: Any) -> Any:
        """``disk_frame``, and log2 of the square root of the disk's area in texels."""
        (p, e, f), deep, steep, _ = disk_frame(view, texel, self.radius, self.mirrors)
        u, v, there = view.image(p)
        u_e, v_e, there_e = view.image(p + e)
        u_f, v_f, there_f = view.image(p + f)
        area = (u_e - u) * (v_f - v) - (v_e - v) * (u_f - u)
        level = select(there & there_e & there_f, 0.5 * log2(PI * abs(double(area))), _NO_IMAGE)
        return (p, e, f), deep, steep, number(level, deep)

    def counts(self, view: Any, here: Any) -> Any:
        """Whether the texel looks away from the viewer."""
        return here[1] > 0

    def place(self, view: Any, here: Any, s: Any) -> Any:
        """The image of P + R (x e + y f)."""
        p, e, f = here[0]
        return p + self.points[s, 0] * e + self.points[s, 1] * f

    def term(self, view: Any, here: Any, s: Any, z: Any, texel: Any, seen: Any) -> Any:
        """The hidden length, weighted."""
        _, _, steep, level = here
        top = number(self.half[s], z)
        level = double(level)
        share, first, second = view.moments(seen, level + rounded(self.finer[s], 4, level))
        mean, sigma = mean_and_deviation(share, first, second)
        middle, reach = (mean - double(z)) * double(steep), (self.half_width * sigma) * double(steep)
        bottom, thickness = -top, rounded(self.thickness, 6, z)
        whole = _hidden(middle, reach, 0, bottom, top)
        length = within(whole - _hidden(middle, reach, thickness, bottom, top), 0, 2)
        there = (share > 0) & (top > bottom) & is_number(middle - reach) & is_number(middle + reach)
        return select(there, (rounded(self.weights[s], 5, z) * number(share, z)) * length, 0)

    def background(self) -> Any:
        """The term of an area that sees nothing."""
        return 0

    def end(self, total: Any) -> Any:
        """The hidden share."""
        return smaller(1, larger(0, total))


def areas_of(buffers: Buffers, radius: float, points: FloatArray, weights: Weights, options: AreaOptions) -> Areas:
    """Return the formulas' numbers, in the textures' dtype.

    points: (n, 2), middles of the areas in the unit disk. weights: integrals of the ball's extent in z over the areas
    (4.5), by default z_s; an area is in proportion to its weight over z_s there. Raises InputError if a weight is
    negative or none is positive.
    """
    number_of, disk = buffers.depth.dtype.type, make_disk(points, weights, options, False, buffers.depth.dtype)
    return Areas(
        points=disk.places,
        half=disk.half,
        weights=disk.weights,
        finer=disk.finer,
        mirrors=disk.mirrors,
        radius=number_of(radius),
        thickness=number_of(min(thickness_in_radii(options, radius), 4 * FAR)),
        half_width=np.float64(options.half_width),
    )


def by_areas(buffers: Buffers, radius: float, points: FloatArray, weights: Weights, options: AreaOptions) -> Occlusion:
    """Return occlusion of a view by areas, ``Estimator.run`` of them."""
    pyramid = moment_pyramid(cast_depth(buffers), options.prefilter)
    return sum_at_radii(areas_of, buffers, radius, points, weights, options, moments=pyramid)


ENTRIES = (
    Estimator(
        name="vo-area",
        title="hidden share of the ball, by mean and variance of depth",
        source="VO section 4.2",
        run=by_areas,
        formulas=areas_of,
        formula="ao as of vo-lines, depths z_Q spread evenly over mean +- half_width sigma of an area",
        options=AreaOptions,
        samples=partial(sample_set, "disk", middle=True),
        dimensions=2,
        count=1,
        texel_bytes=69,
        filtered=True,
        turns=True,
        whole_ball=True,
    ),
)
