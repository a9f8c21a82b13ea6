"""The cleared value of a depth texture, where it is not one that its kind of depth has for the background.

More texels share such a value than a surface has at one depth. A buffer is cleared to one value alone, so a buffer with
a background of its kind has no other.
"""

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from lfssao.rendering.decoding import DISTANCES, Double, Single, along_axis, decoded, distances, lengths, points_of
from lfssao.rendering.view_file import Description

_FEWEST = 4  # texels
_SHARED = 0.01  # of the texels; chance gives fewer texels one value
_ALIKE = 0.05  # of the texels; a surface has fewer at one distance from the eye
_SPREAD = 2.0**-8  # relative distance of these along the axis, which rounding to halves does not explain
_STRIKING = 0.1  # of the texels; a value that fewer share is not mentioned
_FAR = 10.0  # a background is this many times as far away as all surfaces
_ENOUGH = 0.9  # share of the texels beyond the far plane, or without a depth, that have the cleared value
_UNIT = 0.05  # largest difference of a normal's length from 1
_AT_FAR = 1e-3  # largest distance of a background from the far plane, in distances of that plane


def cleared_value(from_above: Mapping[str, Single], description: Description) -> float | None:
    """Return the cleared value as it is stored; None if none is found, or the description gives it.

    from_above: the textures, row 0 above.
    """
    depth = from_above["depth"]
    if description.background is not None:
        return None
    z = distances(depth, description)
    for texels in (_beyond(depth, z, description), np.isnan(z) & np.isfinite(depth)):
        if texels.any():
            value, count = _commonest(depth[texels])
            least = max(_FEWEST, _SHARED * depth.size)
            return value if count >= least and count >= _ENOUGH * np.count_nonzero(texels) else None
    if not np.isfinite(z).all():
        return None
    value, count = _commonest(depth)
    flags = depth == np.float32(value)
    if count < max(_FEWEST, _SHARED * depth.size) or flags.all():
        return None
    return value if _has_witness(flags, from_above, description) or _is_far(flags, z, depth, description) else None


def surface_or_sky(from_above: Mapping[str, Single], description: Description, value: float | None) -> Iterator[str]:
    """Yield a sentence on the cleared ``value``; without one, a sentence on a value that may be the background's."""
    depth = from_above["depth"]
    if value is not None:
        count = np.count_nonzero(depth == np.float32(value))
        some = f"{count} of {depth.size} texels"
        yield f"depth: {_text(value)} at {some} is taken for no surface, as if background = {_text(value)} were given"
        return
    z = distances(depth, description)
    if description.background is not None or not np.isfinite(z).all():
        return
    value, shared = _commonest(depth)
    flags = depth == np.float32(value)
    if (
        shared >= _STRIKING * depth.size
        and not flags.all()
        and (value == 0 or z[flags].max() <= z.min() or z[flags].min() >= z.max())
    ):
        share = f"{100 * shared / depth.size:.3g} % of the texels"
        yield f"depth: {_text(value)} at {share} is taken for a surface: background = {_text(value)} would make it none"


def beyond_far(depth: Single, z: Double, description: Description) -> str:
    """Return a sentence on surfaces beyond the far plane, or ''; one value that most texels share is the background."""
    beyond = _beyond(depth, z, description)
    if not beyond.any():
        return ""
    lost = np.count_nonzero(beyond) - _commonest(depth[beyond])[1]
    share = lost / (lost + np.count_nonzero(np.isfinite(z)))
    return (
        f"depth: {100 * share:.3g} % of it lies beyond the far plane, at {description.view.lens[5]:g}"
        if share > 0.1
        else ""
    )


def _beyond(depth: Single, z: Double, description: Description) -> NDArray[np.bool_]:
    """Return flags of texels whose distance is finite and lies beyond the far plane, not on it."""
    if description.view.screen_to_world is None or description.depth_kind not in DISTANCES:
        return np.zeros(depth.shape, np.bool_)
    known: NDArray[np.bool_] = np.isfinite(depth) & (z == np.inf)
    if description.background is not None:
        known &= depth != np.float32(description.background)
    if not known.any():
        return known
    beyond = along_axis(depth.astype(np.float64), description) > float(description.view.lens[5]) * (1 + _AT_FAR)
    return np.asarray(known & beyond)


def _has_witness(flags: NDArray[np.bool_], from_above: Mapping[str, Single], description: Description) -> bool:
    """Whether positions or normals show that the texels have no surface: one point, nothing finite, no unit length."""
    if "positions" in from_above:
        points = points_of(from_above["positions"][flags], description)
        if not np.isfinite(points).any() or (points == points[0]).all():
            return True
    if "normals" in from_above:
        off = np.abs(lengths(decoded(from_above["normals"][flags], description.normals_kind)) - 1)
        return not bool((off <= _UNIT).any())
    return False


def _is_far(flags: NDArray[np.bool_], z: Double, depth: Single, description: Description) -> bool:
    """Whether the texels of one value are too far away, or too many at one radial distance, for a surface."""
    if description.view.screen_to_world is None:
        return False
    if description.depth_kind == "radial" and z[flags].max() > z[flags].min() * (1 + _SPREAD):
        return int(np.count_nonzero(flags)) >= _ALIKE * depth.size
    return not description.view.lens[6] and float(z[flags].min()) > _FAR * float(z[~flags].max())


def _text(value: float) -> str:
    """Return a float32 in the fewest digits that tell it from all others."""
    return str(np.float32(value))


def _commonest(values: Single) -> tuple[float, int]:
    """Return the value that most texels share, and the number of these texels."""
    each, counts = np.unique(values, return_counts=True)
    most = int(counts.argmax())
    return float(each[most]), int(counts[most])
