"""The background, where there is no surface: a value that is not the reference's is judged apart, and named."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.optics.view import without_guard
from lfssao.verify.case import VIEW, Array, Case
from lfssao.verify.compare.layers import Layer
from lfssao.verify.verdict import FAILED, Flags, Judgement, Verdict

INFINITE_BACKGROUND = ("depth", "positions")  # whose background is infinity; 0 is that of all others
_LEAST_SHARE = 0.99  # of the texels without surface that share a value


def background_value(name: str, mine: NDArray[Any], depth: NDArray[Any]) -> float | None:
    """The value that another renderer has where the reference's depth sees nothing, if nearly all have one.

    None if it is the reference's own, the texture has no such texels, or the values differ.
    """
    empty = np.flatnonzero(~np.isfinite(without_guard(depth, (len(depth) - len(mine)) // 2)))
    if not len(empty):
        return None
    texels = np.reshape(mine, (mine.shape[0] * mine.shape[1], -1))
    value = float(texels[empty[len(empty) // 2], 0])
    if value == (np.inf if name in INFINITE_BACKGROUND else 0.0) or np.isnan(value):
        return None
    values = texels[empty]
    return value if np.mean(np.all(values == values.dtype.type(value), axis=1)) >= _LEAST_SHARE else None


def with_infinity(mine: NDArray[Any], value: float) -> tuple[NDArray[Any], Flags]:
    """Depth or positions with infinity in place of a value, and the texels (H, W) that have it."""
    flags = np.all(np.reshape(mine == mine.dtype.type(value), (*mine.shape[:2], -1)), axis=2)
    texture = mine.copy()
    texture[flags] = np.inf
    return texture, flags


def replace_backgrounds(
    mine: dict[str, Array], layers: dict[str, Layer], case: Case, accepted: float | None
) -> dict[str, tuple[float, Flags]]:
    """Give the renderer's depth and positions the reference's background; return what stood there otherwise.

    Returned are, by the textures' names, a value that all texels without surface share and the user does not
    accept, and the texels of depth and positions that have it. Occlusion keeps its own, as later stages read it.
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
    """The judgement of a texture whose background was replaced in some texels: these are wrong."""
    if not judged.outside.size or not flags.any():
        return judged
    shape = judged.outside.shape
    wrong = np.broadcast_to(flags.reshape((*flags.shape, *[1] * (len(shape) - 2))), shape)
    verdict = judged.verdict if judged.verdict.code >= FAILED else Verdict.OUTSIDE
    return replace(judged, verdict=verdict, differing=judged.differing | wrong, outside=judged.outside | wrong)
