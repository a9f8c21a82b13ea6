"""Text of mesh files: its encoding, the ends of its lines, its numbers, and colours written as numbers."""

import codecs
import re
import warnings
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from lfssao.files.srgb import decode

_MARKS = {  # bytes with which a text may begin; those of UTF-32 begin as one of UTF-16
    **{codecs.BOM_UTF8: "utf-8", codecs.BOM_UTF32_LE: "utf-32-le", codecs.BOM_UTF32_BE: "utf-32-be"},
    **{codecs.BOM_UTF16_LE: "utf-16-le", codecs.BOM_UTF16_BE: "utf-16-be"},
}
_ZEROS = {(0, 1, 0, 1): "utf-16-le", (1, 0, 1, 0): "utf-16-be"}  # of two ASCII letters
_NUMBER = re.compile(rb"[-+]?(\d+\.?\d*([eE][-+]?\d+)?|\.\d+([eE][-+]?\d+)?|nan|inf|infinity)", re.IGNORECASE)
_FULL = 255.0  # the largest code of 8 bits
_LEAST_CODE = 2.0  # colours up to a value below it are fractions that exceed 1


def is_unicode(data: bytes) -> bool:
    """Whether data begin with a byte order mark, or as UTF-16 does without one."""
    return _encoding(data) is not None


def _encoding(data: bytes) -> tuple[bytes, str] | None:
    """Return the byte order mark and the encoding that data begin with; None if they may be any."""
    for mark, encoding in _MARKS.items():
        if data.startswith(mark):
            return mark, encoding
    for zeros, encoding in _ZEROS.items():
        if zeros == tuple(byte == 0 for byte in data[:4]):
            return b"", encoding
    return None


def as_text(data: bytes) -> str:
    """Text with a line feed at each line's end, in the encoding that it begins with, else UTF-8, else Latin-1.

    Zeros and the end-of-file character of DOS are left out at its end.
    """
    found = _encoding(data)
    if found is not None:
        mark, encoding = found
        text = data[len(mark) :].decode(encoding, "replace")
    else:
        try:
            text = data.decode("utf-8")
        except UnicodeDecodeError:  # as old exporters write names and comments
            text = data.decode("latin-1")
    text = text.rstrip("\0\x1a")
    return text.replace("\r\n", "\n").replace("\r", "\n") if "\r" in text else text


def numbers(text: bytes, line: int, unit: str = "line") -> NDArray[np.float64]:
    """Return words of a text as float64, each correctly rounded; ValueError with the line of one that is no number.

    line: the number of its first line. unit: the word for a line of it.
    """
    values: NDArray[np.float64] = np.zeros(0)
    with warnings.catch_warnings(), suppress(ValueError, DeprecationWarning):
        warnings.simplefilter("error")  # where a word is no number, older NumPy only warns
        values = np.fromstring(text, np.float64, sep=" ")
    blank = np.concatenate([[True], np.frombuffer(text, np.uint8) <= ord(" ")])
    if len(values) == np.count_nonzero(blank[:-1] & ~blank[1:]):
        return values
    for word in re.finditer(rb"\S+", text):
        if not _NUMBER.fullmatch(word[0]):
            place = line + text.count(b"\n", 0, word.start())
            raise ValueError(f"{unit} {place}: '{word[0].decode(errors='replace'):.40}' is no number")
    raise ValueError("a word is no number")


def whole(values: NDArray[np.generic]) -> NDArray[np.int64]:
    """Return numbers of any type as int64; ValueError if one is not whole."""
    wide = values.astype(np.float64)
    if not (np.abs(wide) < 2.0**53).all() or (wide != np.floor(wide)).any():
        raise ValueError("a number of a list is not whole")
    return wide.astype(np.int64)


def color_values(colors: NDArray[np.float64], most: float | None = None) -> tuple[NDArray[np.float32], str]:
    """Linear RGB, (N, 3) float32, of sRGB colours, and a sentence if their range had to be guessed.

    most: the value that means 1; without it, it is 1, or 255 if a colour is at least 2 and none is above 255. Values
    outside 0 to ``most`` are clamped. ValueError if one is not finite.
    """
    if not np.isfinite(colors).all():
        raise ValueError("a colour is not finite")
    largest = float(colors.max(initial=0.0))
    note = ""
    if most is None:
        most = _FULL if _LEAST_CODE <= largest <= _FULL else 1.0
        if most == _FULL:
            note = f"its colours reach {largest:g}: they are read as 0 to 255"
    if largest > most or float(colors.min(initial=0.0)) < 0:
        note = f"its colours reach from {float(colors.min()):g} to {largest:g}: they are clamped to 0 to {most:g}"
    colors = np.clip(colors, 0.0, most)
    codes = colors.astype(np.int64)
    if most > 1 and (codes == colors).all():
        return decode(np.arange(int(most) + 1) / most)[codes], note
    return decode(colors / most), note
