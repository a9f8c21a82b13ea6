"""The background, where there is no surface: values other than the reference's are judged apart and reported."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.optics.view import without_guard
from lfssao.verify.case import VIEW, Array, Case
from lfssao.verify.compare.layers import Layer
from lfssao.verify.verdict import FAILED, Flags, Judgement, Verdict

INFINITE_BACKGROUND = ("depth", "positions")  # textures whose background is infinity; others have 0
_LEAST_SHARE = 0.99  # of the texels without surface that have one of the values
_MOST_VALUES = 3
_LEAST_OF_SEVERAL = 0.05  # of these texels that have each of several values: those at edges may show a surface


def background_values(name: str, mine: NDArray[Any], depth: NDArray[Any]) -> dict[float, int]:
    """Another renderer's wrong values of the texels without a surface in the reference's depth, with numbers of texels.

    Nearly all of these texels have the same value, or one of a few. Empty if that is the reference's own, or if values
    differ. Beside the reference's own, a wrong value of depth or positions is one that no surface has.
    """
    is_empty = ~np.isfinite(without_guard(depth, (len(depth) - len(mine)) // 2)).ravel()
    texels = np.reshape(mine, (is_empty.size, -1))
    empty = texels[is_empty]
    is_infinite = name in INFINITE_BACKGROUND
    own = np.inf if is_infinite else 0.0
    enough = _LEAST_SHARE * len(empty)
    if np.count_nonzero(_has_value(empty, own)) >= enough:
        return {}
    has_one_value = (empty == empty[:, :1]).all(axis=1) | np.isnan(empty).all(axis=1)
    values, numbers = np.unique(empty[has_one_value, 0], return_counts=True)
    order = np.argsort(-numbers, kind="stable")[:_MOST_VALUES]
    most = next((k for k in range(1, len(order) + 1) if numbers[order[:k]].sum() >= enough), 0)
    found = {float(values[k]): int(numbers[k]) for k in sorted(order[:most])}
    if most > 1 and min(found.values()) < _LEAST_OF_SEVERAL * len(empty):
        return {}
    if found.pop(own, 0) and not (is_infinite and not any(_has_value(texels[~is_empty], v).any() for v in found)):
        return {}
    return found


def _has_value(texels: NDArray[Any], value: float) -> Flags:
    """Flags of the texels, (N, C), all of whose numbers are a value; NaN is itself here."""
    flags: Flags = np.all(np.isnan(texels) if np.isnan(value) else texels == texels.dtype.type(value), axis=1)
    return flags


def with_infinity(mine: NDArray[Any], values: Iterable[float]) -> tuple[NDArray[Any], Flags]:
    """Depth or positions with infinity in place of values, and flags of the texels, (H, W), that had one of them."""
    texels = mine.reshape(mine.shape[0] * mine.shape[1], -1)
    flags = np.any([_has_value(texels, value) for value in values], axis=0).reshape(mine.shape[:2])
    texture = mine.copy()
    texture[flags] = np.inf
    return texture, flags


def replace_backgrounds(
    mine: dict[str, Array], layers: dict[str, Layer], case: Case, accepted: float | None
) -> dict[str, tuple[Mapping[float, int], Flags]]:
    """Give the renderer's depth and positions the reference's background; return the wrong backgrounds.

    For each texture, by its name, these are values that the user does not accept, with numbers of texels, and flags of
    the texels of depth and positions with one of the values. Occlusion keeps its background, as later stages read it.
    """
    depth = case.outputs.get("depth")
    backgrounds: dict[str, tuple[Mapping[float, int], Flags]] = {}
    if case.stage != VIEW or depth is None:
        return {}
    for name in list(mine):
        is_infinite = name in INFINITE_BACKGROUND
        if is_infinite and accepted is not None:
            mine[name], _ = with_infinity(mine[name], [accepted])
            planes = np.moveaxis(mine[name].reshape(*mine[name].shape[:2], -1), -1, 0)
            layers[name] = replace(layers[name], planes=tuple(planes))
        values = background_values(name, mine[name], depth)
        if not values:
            continue
        flags = np.zeros(0, np.bool_)
        if is_infinite:
            mine[name], flags = with_infinity(mine[name], values)
        backgrounds[name] = values, flags
    return backgrounds


def with_wrong_background(judged: Judgement, flags: Flags) -> Judgement:
    """The judgement of a texture in which texels with a replaced background count as wrong."""
    if not judged.outside.size or not flags.any():
        return judged
    shape = judged.outside.shape
    wrong = np.broadcast_to(flags.reshape((*flags.shape, *[1] * (len(shape) - 2))), shape)
    verdict = judged.verdict if judged.verdict.code >= FAILED else Verdict.OUTSIDE
    return replace(judged, verdict=verdict, differing=judged.differing | wrong, outside=judged.outside | wrong)
