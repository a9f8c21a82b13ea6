"""The background, where there is no surface: a value other than the reference's is judged apart and reported."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.optics.view import without_guard
from lfssao.verify.case import VIEW, Array, Case
from lfssao.verify.compare.layers import Layer
from lfssao.verify.verdict import FAILED, Flags, Judgement, Verdict

INFINITE_BACKGROUND = ("depth", "positions")  # textures whose background is infinity; others have 0
_LEAST_SHARE = 0.99  # of the texels without surface that share a value


def background_value(name: str, mine: NDArray[Any], depth: NDArray[Any]) -> float | None:
    """Another renderer's value of the texels without a surface in the reference's depth, if nearly all have the same.

    None if the value is the reference's own, if there are no such texels, or if their values differ.
    """
    empty = np.flatnonzero(~np.isfinite(without_guard(depth, (len(depth) - len(mine)) // 2)))
    if not len(empty):
        return None
    texels = np.reshape(mine, (mine.shape[0] * mine.shape[1], -1))
    value = float(texels[empty[len(empty) // 2], 0])
    if value == (np.inf if name in INFINITE_BACKGROUND else 0.0):
        return None
    return value if np.mean(_has_value(texels[empty], value)) >= _LEAST_SHARE else None


def _has_value(texels: NDArray[Any], value: float) -> Flags:
    """Flags of the texels, (N, C), all of whose numbers are a value; NaN is itself here."""
    flags: Flags = np.all(np.isnan(texels) if np.isnan(value) else texels == texels.dtype.type(value), axis=1)
    return flags


def with_infinity(mine: NDArray[Any], value: float) -> tuple[NDArray[Any], Flags]:
    """Depth or positions with infinity in place of a value, and flags of the texels, (H, W), that had the value."""
    flags = _has_value(mine.reshape(mine.shape[0] * mine.shape[1], -1), value).reshape(mine.shape[:2])
    texture = mine.copy()
    texture[flags] = np.inf
    return texture, flags


def replace_backgrounds(
    mine: dict[str, Array], layers: dict[str, Layer], case: Case, accepted: float | None
) -> dict[str, tuple[float, Flags]]:
    """Give the renderer's depth and positions the reference's background; return the wrong backgrounds.

    For each texture, by its name, that is a value that the user does not accept and nearly all texels without a surface
    share, and flags of the texels of depth and positions with the value. Occlusion keeps its background, as later
    stages read it.
    """
    depth = case.outputs.get("depth")
    backgrounds = {}
    if case.stage != VIEW or depth is None:
        return {}
    for name in list(mine):
        is_infinite = name in INFINITE_BACKGROUND
        value = accepted if is_infinite else None
        if value is None:
            value = background_value(name, mine[name], depth)
        if value is None:
            continue
        flags = np.zeros(0, np.bool_)
        if is_infinite:
            mine[name], flags = with_infinity(mine[name], value)
        if accepted is None or not is_infinite:
            backgrounds[name] = value, flags
        else:
            planes = np.moveaxis(mine[name].reshape(*flags.shape, -1), -1, 0)
            layers[name] = replace(layers[name], planes=tuple(planes))
    return backgrounds


def with_wrong_background(judged: Judgement, flags: Flags) -> Judgement:
    """The judgement of a texture in which texels with a replaced background count as wrong."""
    if not judged.outside.size or not flags.any():
        return judged
    shape = judged.outside.shape
    wrong = np.broadcast_to(flags.reshape((*flags.shape, *[1] * (len(shape) - 2))), shape)
    verdict = judged.verdict if judged.verdict.code >= FAILED else Verdict.OUTSIDE
    return replace(judged, verdict=verdict, differing=judged.differing | wrong, outside=judged.outside | wrong)
