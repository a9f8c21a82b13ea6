"""Bounds of the estimators that, as Algorithms 1 and 2, count decisions about points of a ball: one outcome a point.

``point``, ``hemisphere``, ``vo-points`` and ``vo-points-normal``. Each point is occluded, clear or undecided as in
``lfssao.verify.bounds.kernels.ssao_bounds``. These estimators decide more than the depth:

- The half ball's turn, offset . normal < 0. Where rounding may change the sign both sides are taken: the point is
  occluded if both are, clear if both are, else undecided. (VO's reflection by the tangent plane is no decision: its
  lift min(above, 0) has no jump, so an error of ``above`` is one of the place.)
- The range check, distance^2 <= reach, or distance <= R; and VO's thickness, z - z_Q <= reach. A point is occluded for
  sure if it lies behind and in range for sure, and may be if it may be both.
- Line 7's other form, and VO on cameras: the surface's depth is made from a position and has an error itself.

Occlusion grows with each decision, the remap 2 max(0, occlusion - 1/2) with the occlusion, and both ways of VO to make
one of two radii with each of the two: bounds go through. VO's points have weights, whose sum takes the place of the
count.

The other estimators are no counts: they sum distances, horizons and areas that jump where a look-up falls into another
texel, by as much as the surface there differs. No interval of them is known; they must have equal bits.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.estimator import Value
from lfssao.verify.bounds.bounds import Bounds, FloatArray, Texture, down_to_single, fraction_bounds, up_to_single
from lfssao.verify.bounds.error_model import ErrorModel, find_model
from lfssao.verify.bounds.kernels.pairs import FLUSHED, SAFETY
from lfssao.verify.bounds.texels import Bools, Hides, Numbers, Surfaces, Texels, dot, flat
from lfssao.verify.bounds.volumes import hidden_volume

# The estimators of which intervals are known, and those of them that read normals.
BOUNDED = ("point", "hemisphere", "vo-points", "vo-points-normal")
NORMALS = ("hemisphere", "vo-points-normal")


def point_bounds(
    name: str,
    surfaces: Surfaces,
    radius: float,
    points: NDArray[np.floating[Any]] | None,
    weights: NDArray[np.floating[Any]] | None,
    options: Mapping[str, Value],
    model: str | ErrorModel = "shader",
) -> Bounds | None:
    """Bounds of an estimator's occlusion.

    Parameters
    ----------
    name : str
        Name of the estimator.
    surfaces : Surfaces
        What it is given.
    radius : float
        R, world units.
    points : (n, 3) or None
        Offsets in the unit ball.
    weights : (n,) or None
        Their weights, read by VO's.
    options : mapping
        All of the estimator's parameters.
    model : str or ErrorModel
        What float32 arithmetic may do; not an exact one, under which there is one right value.

    Returns
    -------
    Bounds or None
        None where no interval is known: the estimator counts no points, or a texture that it reads is missing.

    Raises
    ------
    InputError
        If there is no such model, or weights are wrong.
    """
    if points is None or not is_bounded(name, options, surfaces.directions is not None):
        return None
    if name in NORMALS and surfaces.normals is None:
        return None
    texels, table = Texels(surfaces, find_model(model)), np.asarray(points, np.float64)
    if name in ("vo-points", "vo-points-normal"):
        return hidden_volume(texels, radius, table, weights, options, name in NORMALS)
    return _fraction_behind(texels, radius, table, options, name in NORMALS)


def is_bounded(name: str, options: Mapping[str, Value], directions: bool = False) -> bool:
    """Whether intervals of an estimator's occlusion are known; with a thickness those of known directions only."""
    return name in BOUNDED and (directions or not float(options.get("thickness", 0.0)) > 0)


def _fraction_behind(
    texels: Texels, radius: float, points: FloatArray, options: Mapping[str, Value], half: bool
) -> Bounds:
    """Bounds of ``point``, or with ``half`` of ``hemisphere``."""
    model = texels.model
    low, high = _surface_depths(texels, options["surface"] == "positions")
    in_range = range_check(texels, radius) if options["range_check"] else None
    everywhere = np.arange(len(texels.at))
    fewest, most = np.zeros(len(texels.at), np.int32), np.zeros(len(texels.at), np.int32)
    for offset in radius * points:

        def outcome(which: Numbers, side: float | FloatArray, o: FloatArray = offset) -> tuple[Bools, Bools]:
            """Whether the points numbered, on one side or the other, may be and are for sure behind a surface."""
            turned = np.reshape(side, (-1, 1)) * o
            off = texels.rows_of(np.abs(texels.places[which]) + np.abs(o)) + model.offset * np.abs(o)
            image = texels.project(texels.places[which] + turned, off)

            def hides(number: Numbers, texel: Numbers) -> tuple[Bools, Bools]:
                z, e = image.z[number], image.error[number, 2]
                may, must = low[texel] < z + e, high[texel] < z - e
                if in_range is not None:
                    near, surely = in_range(which[number], texel)
                    may, must = may & near, must & surely
                return may, must

            return texels.decide(image, hides)

        if not half:
            may, must = outcome(everywhere, 1.0)
        else:
            below, surely = below_surface(texels, offset, model.offset)
            may, must = outcome(everywhere, np.where(surely, -1.0, 1.0))
            either = np.flatnonzero(below & ~surely)
            other = outcome(either, -1.0)
            may[either] |= other[0]
            must[either] &= other[1]
        fewest += must
        most += may
    ends = fraction_bounds(len(points), model)
    if options.get("remap"):
        ends = _remapped(ends[0], model, -1), _remapped(ends[1], model, 1)
    return texels.bounds(ends[0][fewest], ends[1][most], most - fewest)


def _surface_depths(texels: Texels, forward: bool) -> tuple[FloatArray, FloatArray]:
    """Least and largest depth that a texel's surface may be compared with, (H * W,)."""
    depths = texels.given.depth.ravel().astype(np.float64)
    low, high = depths.copy(), depths.copy()
    if forward:
        image = texels.project(texels.places, np.zeros_like(texels.places))
        low[texels.at] = np.where(image.may, image.z - image.error[:, 2], np.inf)
        high[texels.at] = np.where(image.must, image.z + image.error[:, 2], np.inf)
    small = np.abs(depths) < 2.0**-126  # may be flushed to zero
    return np.where(small, np.minimum(low, 0), low), np.where(small, np.maximum(high, 0), high)


def range_check(texels: Texels, radius: float) -> Hides:
    """Whether a texel's surface may be, and is for sure, no farther than R from the place of a texel, by its number.

    The sum of squares is rounded 5 times, R^2 3 times; if distances are compared, both have the error of a root more.
    """
    relative = (10 * texels.model.operation + 2 * texels.model.root) * SAFETY
    places = texels.given.positions.reshape(-1, 3).astype(np.float64)
    reach = float(radius) * float(radius)

    def check(which: Numbers, texel: Numbers) -> tuple[Bools, Bools]:
        away = places[texel] - texels.places[which]
        square = dot(away, away)
        return square * (1 - relative) - FLUSHED <= reach, square * (1 + relative) + FLUSHED <= reach

    return check


def below_surface(texels: Texels, offset: FloatArray, relative: float) -> tuple[Bools, Bools]:
    """Whether an offset, relatively so far off, may and does for sure lie below each texel's surface."""
    normals = flat(texels.given.normals)[texels.at].astype(np.float64)
    above, size, r = dot(normals, offset), dot(np.abs(normals), np.abs(offset)), texels.model.operation
    error = size * ((3 * r * (1 + 3 * r) + relative) * (1 + relative) * SAFETY) + np.where(size > 0, FLUSHED, 0.0)
    return above < error, above < -error


def _remapped(fractions: Texture, model: ErrorModel, sign: int) -> Texture:
    """Ends of 2 max(0, fraction - 1/2), of which the difference is rounded."""
    above = fractions.astype(np.float64) - 0.5
    moved = 2 * np.maximum(above + sign * model.operation * np.abs(above), 0)
    return down_to_single(moved) if sign > 0 else up_to_single(moved)
