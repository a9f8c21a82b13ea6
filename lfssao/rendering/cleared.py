"""The value that a depth texture was cleared to, where that is none of its kind's: more texels share it than a surface.

A buffer is cleared to one value: one that has a background of its kind has no other.
"""

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from lfssao.rendering.decoding import DISTANCES, Double, Single, along_axis, decoded, distances, lengths, points_of
from lfssao.rendering.view_file import Description

_FEWEST = 4  # texels
_SHARED = 0.01  # of the texels, more than have one value by chance
_ALIKE = 0.05  # of the texels, more than a surface has at one distance from the eye
_SPREAD = 2.0**-8  # by which these are apart along the axis, so that it is not the rounding of halves
_STRIKING = 0.1  # of the texels, so that a value is mentioned
_FAR = 10.0  # times as far as all the rest
_ENOUGH = 0.9
_UNIT = 0.05  # by which a normal's length may be off 1
_AT_FAR = 1e-3  # share of the far plane's distance by which a background may be off it


def cleared_value(there: Mapping[str, Single], said: Description) -> float | None:
    """The value, as it is stored; None if there is none, or it is known. The textures ``there`` begin above."""
    depth = there["depth"]
    if said.background is not None:
        return None
    z = distances(depth, said)
    for texels in (_beyond(depth, z, said), np.isnan(z) & np.isfinite(depth)):
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
    return value if _has_witness(flags, there, said) or _is_far(flags, z, depth, said) else None


def surface_or_sky(there: Mapping[str, Single], said: Description, value: float | None) -> Iterator[str]:
    """Sentences on what was taken for the background, the ``value``, and on what may be one and was taken for none."""
    depth = there["depth"]
    if value is not None:
        count = np.count_nonzero(depth == np.float32(value))
        some = f"{count} of {depth.size} texels"
        yield f"depth: {_text(value)} at {some} is taken for no surface, as if background = {_text(value)} were given"
        return
    z = distances(depth, said)
    if said.background is not None or not np.isfinite(z).all():
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


def beyond_far(depth: Single, z: Double, said: Description) -> str:
    """A sentence on distances beyond the far plane that are of surfaces, not of one background, or ''."""
    beyond = _beyond(depth, z, said)
    if not beyond.any():
        return ""
    lost = np.count_nonzero(beyond) - _commonest(depth[beyond])[1]
    share = lost / (lost + np.count_nonzero(np.isfinite(z)))
    return (
        f"depth: {100 * share:.3g} % of it lies beyond the far plane, at {said.view.lens[5]:g}" if share > 0.1 else ""
    )


def _beyond(depth: Single, z: Double, said: Description) -> NDArray[np.bool_]:
    """Texels of a finite distance beyond the far plane, not on it."""
    if said.view.screen_to_world is None or said.depth_kind not in DISTANCES:
        return np.zeros(depth.shape, np.bool_)
    known: NDArray[np.bool_] = np.isfinite(depth) & (z == np.inf)
    if said.background is not None:
        known &= depth != np.float32(said.background)
    if not known.any():
        return known
    beyond = along_axis(depth.astype(np.float64), said) > float(said.view.lens[5]) * (1 + _AT_FAR)
    return np.asarray(known & beyond)


def _has_witness(flags: NDArray[np.bool_], there: Mapping[str, Single], said: Description) -> bool:
    """Whether positions of these texels are one point, or not finite, or their normals of another length than 1."""
    if "positions" in there:
        points = points_of(there["positions"][flags], said)
        if not np.isfinite(points).any() or (points == points[0]).all():
            return True
    if "normals" in there:
        off = np.abs(lengths(decoded(there["normals"][flags], said.normals_kind)) - 1)
        return not bool((off <= _UNIT).any())
    return False


def _is_far(flags: NDArray[np.bool_], z: Double, depth: Single, said: Description) -> bool:
    """Whether these texels of one value are so far away, or so alike, that they are of no surface."""
    if said.view.screen_to_world is None:
        return False
    if said.depth_kind == "radial" and z[flags].max() > z[flags].min() * (1 + _SPREAD):
        return int(np.count_nonzero(flags)) >= _ALIKE * depth.size
    return not said.view.lens[6] and float(z[flags].min()) > _FAR * float(z[~flags].max())


def _text(value: float) -> str:
    """A float32 in as few digits as tell it from all others."""
    return str(np.float32(value))


def _commonest(values: Single) -> tuple[float, int]:
    """The value that most texels share, and how many do."""
    each, counts = np.unique(values, return_counts=True)
    most = int(counts.argmax())
    return float(each[most]), int(counts[most])
