"""Types of options: each reads a value from text and says in one sentence what is wrong with it."""

import argparse
import math
import re
from collections.abc import Callable
from pathlib import Path

from lfssao.core.threads import MOST_THREADS
from lfssao.errors import InputError
from lfssao.optics.view import MOST_GUARD

# Larger values are slips: a command would run for hours or fill the memory.
MOST_SAMPLES = 65_536
MOST_BLUR = 1024.0  # texels
LARGEST_RADIUS = 1e30  # as of coordinates (Mesh): sums of both are float32

PICTURES = (".png", ".svg", ".pdf")


def whole(least: int, most: int, most_text: str = "") -> Callable[[str], int]:
    """The type of whole numbers in a range; digits only, as int() would also take 1_0 and digits of other scripts."""

    def read(text: str) -> int:
        """Return the whole number of a text."""
        if not re.fullmatch(r"[+-]?[0-9]+", text, re.ASCII):
            raise argparse.ArgumentTypeError(f"'{_short(text)}' is not a whole number")
        # Python refuses to convert thousands of digits; forty are out of every range.
        digits = text.lstrip("+-").lstrip("0") or "0"
        number = int(digits[:40]) * (-1 if text.startswith("-") else 1)
        if not least <= number <= most:
            raise argparse.ArgumentTypeError(f"{_short(text)} is not from {least} to {most_text or most}")
        return number

    return read


def number(what: str, holds: Callable[[float], bool]) -> Callable[[str], float]:
    """Return the type of numbers for which ``holds`` is true; ``what`` says which these are."""

    def read(text: str) -> float:
        """Return the number of a text."""
        try:
            value = float(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"'{_short(text)}' is not a number") from None
        if not holds(value):
            raise argparse.ArgumentTypeError(f"{_short(text)} is not {what}")
        return value

    return read


def _short(text: str) -> str:
    return text if len(text) <= 40 else f"{text[:37]}..."


samples = whole(1, MOST_SAMPLES)
seed = whole(0, 2**64 - 1, "2**64 - 1")
guard = whole(0, MOST_GUARD)
neighbours = whole(0, 64)
threads = whole(1, MOST_THREADS)
blur = number(f"a sigma from 0 to {MOST_BLUR:g} texels", lambda value: 0 <= value <= MOST_BLUR)
radius = number(f"a radius from 0 to {LARGEST_RADIUS:g}", lambda value: 0 <= value <= LARGEST_RADIUS)
share = number("a share from 0 to 1", lambda value: 0 <= value <= 1)
positive = number("a number above 0", lambda value: 0 < value <= LARGEST_RADIUS)
finite = number("a finite number", math.isfinite)


def samples_or_file(text: str) -> int | Path:
    """Return a number of samples, or a file of them, whose name has an ending."""
    return Path(text) if re.search(r"\.[A-Za-z]+$", text) else samples(text)


def radii(text: str) -> tuple[tuple[float, bool], ...]:
    """Radii, and whether each is in per cent of the scene's diagonal."""
    return tuple((radius(word.removesuffix("%")), word.endswith("%")) for word in text.split(","))


def vector(text: str) -> tuple[float, float, float]:
    """Three numbers X,Y,Z."""
    words = text.split(",")
    if len(words) != 3:
        raise argparse.ArgumentTypeError(f"'{_short(text)}' is not three numbers X,Y,Z, such as 3,2,5")
    x, y, z = map(finite, words)
    return x, y, z


def module_range(text: str) -> range:
    """Return a range A:B of modules, or one of them."""
    found = re.fullmatch(r"([0-9]{1,9})(?::([0-9]{1,9}))?", text, re.ASCII)
    if not found:
        wanted = "a range A:B of two whole numbers, such as 0:3 for modules 0, 1 and 2, nor one number"
        raise argparse.ArgumentTypeError(f"'{_short(text)}' is not {wanted}")
    start = int(found[1])
    stop = start + 1 if found[2] is None else int(found[2])
    if start >= stop:
        raise argparse.ArgumentTypeError(f"'{text}' holds no module: A:B needs A < B")
    return range(start, stop)


def resolution(text: str) -> tuple[int, int]:
    """Return a resolution WxH in texels."""
    found = re.fullmatch(r"([0-9]{1,18})x([0-9]{1,18})", text, re.ASCII)
    if not found or int(found[1]) == 0 or int(found[2]) == 0:
        raise argparse.ArgumentTypeError(f"'{_short(text)}' is not WIDTHxHEIGHT in texels, such as 1024x768")
    return int(found[1]), int(found[2])


def parameter(text: str) -> tuple[str, str]:
    """Name and value of a parameter NAME=VALUE, as written."""
    name, sign, value = text.partition("=")
    if not (name and sign and value):
        raise argparse.ArgumentTypeError(f"'{_short(text)}' is not NAME=VALUE, such as sigma=2")
    return name, value


def pairs(option: str, words: list[str], form: str, key: int) -> list[list[str]]:
    """Return the two words of each use of an option; InputError if the one in place ``key`` is given twice."""
    pairs = [word.split("=", 1) for word in words]
    for word, pair in zip(words, pairs, strict=True):
        if len(pair) < 2 or not all(pair):
            raise InputError(f"{option}: '{word[:40]}' is not {form}")
        if [other[key] for other in pairs].count(pair[key]) > 1:
            raise InputError(f"{option}: '{pair[key][:40]}' is given twice")
    return pairs


def rules(words: list[str], form: str) -> dict[str, str]:
    """``--map``: layers and channels, each with the other renderer's name of it, '' for its own as in 1-ao_1."""
    turned = [word for word in words if word.startswith("1-") and "=" not in word]
    found = {layer: mine for mine, layer in pairs("--map", [word for word in words if word not in turned], form, 1)}
    for word in turned:
        if word in found:
            raise InputError(f"--map: '{word[:40]}' is given twice")
        found[word] = ""
    return found


def typed(text: str, kind: type) -> float | int | str | bool:
    """Return a value of a type: true or false, a whole number, a number, or the text itself."""
    if kind is bool:
        if text not in ("true", "false"):
            raise argparse.ArgumentTypeError(f"'{_short(text)}' is not true or false")
        return text == "true"
    if kind is int:
        return whole(-(2**63), 2**63 - 1)(text)
    return number("a number", lambda _: True)(text) if kind is float else text


def frames(text: str) -> int | Path:
    """Return a number of frames, or the name of a file of matrices."""
    if re.fullmatch(r"[+-]?[0-9.]+", text, re.ASCII):
        from lfssao.rendering.animation import MOST_FRAMES  # late: most jobs are of a still

        return whole(1, MOST_FRAMES)(text)
    return Path(text)


def scheduler(text: str) -> str:
    """Return address of a dask scheduler, a file in which it wrote that, or 'local'."""
    is_address = re.fullmatch(r"(tcp|tls|ws|wss|ucx)://[^\s/]+:[0-9]{1,5}", text)
    if text != "local" and not is_address and not (text and Path(text).is_file()):
        wanted = "local, nor an address such as tcp://host:8786, nor a scheduler's file"
        raise argparse.ArgumentTypeError(f"'{_short(text)}' is neither {wanted}")
    return text


def check_target(option: str, path: Path, endings: tuple[str, ...]) -> Path:
    """Return the path of a file to be; InputError, with the option's name, for another ending or a missing folder."""
    if path.suffix.lower() not in endings:
        raise InputError(f"{option}: {path} does not end in {' or '.join(endings)}")
    if not path.parent.is_dir():
        raise InputError(f"{option}: there is no folder {path.parent}")
    return path
