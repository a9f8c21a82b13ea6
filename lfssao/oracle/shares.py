"""Bounds of ``point`` and ``hemisphere``: shares of points that lie behind the surface they land on.

The half ball's turn, the range check and the other form of line 7 are as in ``lfssao.oracle.points``.
"""

import numpy as np

from lfssao.kernels.rounding import FLUSHED, SAFETY
from lfssao.oracle.bounds import Bounds, FloatArray, Texture, down_to_single, fraction_bounds, up_to_single
from lfssao.oracle.error_model import ErrorModel
from lfssao.oracle.texels import Bools, Hides, Numbers, Sampling, Texels, flat


def fraction_behind(half: bool, asked: Sampling) -> Bounds:
    """Bounds of ``point``, or with ``half`` of ``hemisphere``."""
    model, options = asked.model, asked.options
    texels = Texels(asked.surfaces, model)
    offsets = asked.radius * asked.points
    low, high = _surface_depths(texels, options["surface"] == "positions")
    in_range = _range_check(texels, asked.radius) if options["range_check"] else None
    fewest, most = np.zeros(len(texels.at), np.int32), np.zeros(len(texels.at), np.int32)
    for offset in offsets:

        def outcome(which: Numbers, side: float | FloatArray, o: FloatArray = offset) -> tuple[Bools, Bools]:
            """Of the points numbered, the offset on one side or on the other."""
            turned = np.reshape(side, (-1, 1)) * o
            off = texels.rows_of(np.abs(texels.places[which]) + np.abs(o)) + model.offset * np.abs(o)
            image = texels.project(texels.places[which] + turned, off)

            def hides(number: Numbers, texel: Numbers) -> tuple[Bools, Bools]:
                z, e = image.z[number], image.doubt[number, 2]
                may, must = low[texel] < z + e, high[texel] < z - e
                if in_range is not None:
                    near, surely = in_range(which[number], texel)
                    may, must = may & near, must & surely
                return may, must

            return texels.decide(image, hides)

        everywhere = np.arange(len(texels.at))
        if not half:
            may, must = outcome(everywhere, 1.0)
        else:
            below, surely = _below(texels, offset, model.offset)
            may, must = outcome(everywhere, np.where(surely, -1.0, 1.0))
            either = np.flatnonzero(below & ~surely)
            other = outcome(either, -1.0)
            may[either] |= other[0]
            must[either] &= other[1]
        fewest += must
        most += may
    ends = fraction_bounds(len(offsets), model)
    if options.get("remap"):
        ends = _remapped(ends[0], model, -1), _remapped(ends[1], model, 1)
    return texels.bounds(ends[0][fewest], ends[1][most], most - fewest)


def _surface_depths(texels: Texels, forward: bool) -> tuple[FloatArray, FloatArray]:
    """Least and largest depth that a texel's surface may be compared with, (H * W,)."""
    depths = texels.given.depth.ravel().astype(np.float64)
    low, high = depths.copy(), depths.copy()
    if forward:
        image = texels.project(texels.places, np.zeros_like(texels.places))
        low[texels.at] = np.where(image.may, image.z - image.doubt[:, 2], np.inf)
        high[texels.at] = np.where(image.must, image.z + image.doubt[:, 2], np.inf)
    small = np.abs(depths) < 2.0**-126  # may be flushed to zero
    return np.where(small, np.minimum(low, 0), low), np.where(small, np.maximum(high, 0), high)


def _range_check(texels: Texels, radius: float) -> Hides:
    """Whether a texel's surface may be, and is for sure, no farther than R from the place of a texel, by its number.

    The sum of squares is rounded 5 times, R^2 3 times; if distances are compared, both have the error of a root more.
    """
    relative = (10 * texels.model.operation + 2 * texels.model.root) * SAFETY
    places = texels.given.positions.reshape(-1, 3).astype(np.float64)
    reach = float(radius) * float(radius)

    def check(which: Numbers, texel: Numbers) -> tuple[Bools, Bools]:
        x, y, z = (places[texel] - texels.places[which]).T
        square = (x * x + y * y) + z * z
        return square * (1 - relative) - FLUSHED <= reach, square * (1 + relative) + FLUSHED <= reach

    return check


def _below(texels: Texels, offset: FloatArray, relative: float) -> tuple[Bools, Bools]:
    """Whether an offset, relatively so far off, may and does for sure lie below each texel's surface."""
    normals = flat(texels.given.normals)[texels.at].astype(np.float64)
    parts = normals * offset
    above = (parts[:, 0] + parts[:, 1]) + parts[:, 2]
    size = (np.abs(parts[:, 0]) + np.abs(parts[:, 1])) + np.abs(parts[:, 2])
    r = texels.model.operation
    error = size * ((3 * r * (1 + 3 * r) + relative) * (1 + relative) * SAFETY) + np.where(size > 0, FLUSHED, 0.0)
    return above < error, above < -error


def _remapped(shares: Texture, model: ErrorModel, sign: int) -> Texture:
    """Ends of 2 max(0, share - 1/2), of which the difference is rounded."""
    above = shares.astype(np.float64) - 0.5
    moved = 2 * np.maximum(above + sign * model.operation * np.abs(above), 0)
    return down_to_single(moved) if sign > 0 else up_to_single(moved)
