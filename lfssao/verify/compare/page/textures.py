"""Textures of a page, small: previews of what conforms, full texels of what is wrong, as far as there is room."""

import zlib
from base64 import b64encode
from typing import Any

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from lfssao.files.pictures import image_png
from lfssao.verify.bounds.bounds import Bounds
from lfssao.verify.bounds.error_model import ErrorModel
from lfssao.verify.case import Arrays, Case
from lfssao.verify.compare.layers import Layer
from lfssao.verify.compare.metrics import difference
from lfssao.verify.compare.page.samples import draw_samples
from lfssao.verify.compare.picture import colors_of, largest, scale_of, step_of
from lfssao.verify.compare.reasons import texel_explainer
from lfssao.verify.compare.result import Result, stored_as
from lfssao.verify.judge import stage_inputs
from lfssao.verify.verdict import WRONG, Flags, Judgement, texels

# Bytes of a page: of full texels, and of everything, so that it opens in a moment and goes through mail.
FULL = 10_000_000
ALL = 18_000_000
# Most bytes of pictures of samples, and most pictures of one texture: the first wrong textures have them.
SAMPLES = 1_500_000
MOST_SAMPLES = 3

# Codes of a difference: 0 equal bits, then magnitudes inside and outside the interval, then NaN or infinity.
_STEPS = 120
_NOT_FINITE = 1 + 2 * _STEPS
_BARS = 24  # of a histogram
_EQUAL = "#22262b"
_INSIDE = ("#2b4c7e", "#a6d0ff")
_OUTSIDE = ("#b3261e", "#ffe08a")
_MISMATCH = "#ff00ff"
RAMPS = {
    "equal bits": [0],
    "differs, inside": list(range(1, 1 + _STEPS)),
    "outside": list(range(1 + _STEPS, _NOT_FINITE)),
    "NaN or infinity on one side": [_NOT_FINITE],
}


Codes = tuple[NDArray[np.uint8], float, float]  # of a difference, and the ends of their logarithmic scale


class Textures:
    """Both sides and the difference of each texture of a comparison, as a page's script reads them."""

    def __init__(self, exact: bool) -> None:
        self._exact = exact
        self._full = self._all = self._samples = 0  # bytes
        self.samples: dict[tuple[str, str, int, int], Markup] = {}  # pictures, by module, layer, column and row
        self.kept: dict[tuple[str, str], dict[str, Any]] = {}
        self.small: list[tuple[str, str]] = []  # wrong, but there was no room for full texels
        self.left_out: list[tuple[str, str]] = []  # no room for a preview

    def add(self, result: Result, mine: Layer, reference: Layer, judged: Judgement) -> None:
        """Keep a texture that was judged: full if it is wrong and there is room, else a preview, else nothing."""
        place = result.module, result.layer
        differing = texels(judged.differing)
        outside = texels(judged.outside)
        codes = _codes(difference(mine.planes, reference.planes), differing, outside)
        wrong = bool(outside.any() or (self._exact and differing.any()))
        room = ALL - self._all
        if wrong and self._full < FULL:
            made = _pictures(mine, reference, codes, 1)
            made |= _numbers(mine, reference, judged.bounds, result.interval, differing.astype(np.uint8) + outside)
            if self._keep(place, made, min(room, FULL - self._full)):
                self._full += _size(made)
                return
        if not self._keep(place, _pictures(mine, reference, codes, step_of(differing.shape)), room):
            self.left_out.append(place)
        elif wrong:
            self.small.append(place)

    def add_samples(self, result: Result, mine: Arrays, case: Case, model: ErrorModel) -> None:
        """Keep pictures of the samples of the worst texels of a wrong occlusion texture, if there is room."""
        if result.verdict not in WRONG:
            return
        depth = stage_inputs(mine, case).get("depth")
        explain = texel_explainer(result.layer, mine, case, model)
        if depth is None or explain is None:
            return
        for texel in result.blamed[:MOST_SAMPLES]:
            if self._samples < SAMPLES:
                place = texel.column, texel.row
                made = draw_samples(place, depth, explain(place), int(case.parameters["guard"]))
                self._samples += len(made)
                self.samples[(result.module, result.layer, *place)] = made

    def _keep(self, place: tuple[str, str], made: dict[str, Any], room: int) -> bool:
        if _size(made) > room:
            return False
        self._all += _size(made)
        self.kept[place] = made
        return True


def _size(made: dict[str, Any]) -> int:
    return sum(len(value) for value in made.values() if isinstance(value, str))


def _codes(error: NDArray[np.float64], differing: Flags, outside: Flags) -> Codes:
    low, high = scale_of(error)
    share = np.log(np.clip(error, low, high) / low) / (np.log(high / low) or 1.0)
    codes = 1 + np.rint(share * (_STEPS - 1)) + _STEPS * outside
    codes = np.where(np.isfinite(error), np.where(differing | outside, codes, 0), _NOT_FINITE)
    return codes.astype(np.uint8), low, high


def _pictures(mine: Layer, reference: Layer, difference: Codes, step: int) -> dict[str, Any]:
    """PNG files of both sides and of the difference; no mine where it looks as the reference does."""
    right, own = (colors_of(layer, reference, step) for layer in (reference, mine))
    codes, low, high = difference
    height, width = codes.shape
    overview = step_of(codes.shape)
    return {
        "width": width,
        "height": height,
        "step": step,
        "overview_step": overview,
        "low": low,
        "high": high,
        "counts": _counts(codes),
        "reference": _png(right),
        "mine": None if np.array_equal(right, own) else _png(own),
        "difference": code_png(largest(codes, step)),
        "overview": code_png(largest(codes, overview)) if overview > step else None,
    }


def _counts(codes: NDArray[np.uint8]) -> list[list[int]]:
    """Texels inside, and outside, whose difference is in each of _BARS equal parts of the logarithmic scale."""
    found = np.bincount(codes.ravel(), minlength=_NOT_FINITE + 1)[1:_NOT_FINITE]
    counts: list[list[int]] = found.reshape(2, _BARS, -1).sum(axis=2).tolist()
    return counts


def _numbers(
    mine: Layer, reference: Layer, bounds: Bounds | None, interval: bool, verdicts: NDArray[np.uint8]
) -> dict[str, Any]:
    """The exact values: reference, mine, lower, upper (H, W, C), and of each texel whether it differs and is outside.

    The reference is as it would be read if it were stored as mine. Sides are the reference's bits, then what the
    others' differ by, byte by byte: what is equal takes no room.
    """
    sides = [np.stack(planes, axis=-1) for planes in (stored_as(mine, reference), mine.planes)]
    if bounds is not None:
        sides += [ends.reshape(sides[0].shape) for ends in (bounds.lower, bounds.upper)]
    kind = np.result_type(sides[0].dtype, np.float32)  # float32, or float64 where that cannot hold the values
    bits = np.stack(sides).astype(kind).view(f"u{kind.itemsize}")
    bits[1:] ^= bits[0]
    right, wrong = ("inside the interval", "outside the interval") if interval else ("equal values", "different")
    return {
        "channels": len(mine.planes),
        "bytes": kind.itemsize,
        "sides": len(sides),
        "stored": mine.stored is not None,
        "words": ["equal bits", right, wrong],
        "values": _packed(bits.reshape(-1, 1).view(np.uint8).T),
        "verdicts": _packed(verdicts),
    }


def _packed(array: NDArray[np.uint8]) -> str:
    return b64encode(zlib.compress(array.tobytes())).decode()


def _png(picture: NDArray[np.uint8]) -> str:
    """A PNG file of codes (H, W, 3); grey where all three channels are equal."""
    from PIL import Image  # late: only pictures need it

    grey = (picture == picture[..., :1]).all()
    return b64encode(image_png(Image.fromarray(picture[..., 0] if grey else picture))).decode()


def code_png(codes: NDArray[np.uint8]) -> str:
    """A PNG file of a difference's codes (H, W), with their colours as its palette."""
    from PIL import Image, ImageColor

    image = Image.fromarray(codes)
    equal, mismatch = (np.array([ImageColor.getrgb(color)]) for color in (_EQUAL, _MISMATCH))
    ends = [[np.array(ImageColor.getrgb(color)) for color in ramp] for ramp in (_INSIDE, _OUTSIDE)]
    palette = np.concatenate([equal, *(np.linspace(first, last, _STEPS) for first, last in ends), mismatch])
    image.putpalette(np.rint(palette).astype(np.uint8).tobytes())
    return b64encode(image_png(image)).decode()
