"""Values of options: checked as they are read, each with one sentence on what is wrong."""

import argparse
import re
from pathlib import Path

# Beyond these a command would run for hours or fill the memory, and nobody means it.
MOST_SAMPLES = 65_536
MOST_BLUR = 1024.0  # texels
MOST_THREADS = 1024
MOST_GUARD = 4096  # texels
MOST_FRAMES = 10_000
MOST_NEIGHBOURS = 64
LARGEST_RADIUS = 1e30  # as of coordinates (Mesh): sums of both are float32


def _whole(text: str, least: int, most: int, most_text: str = "") -> int:
    """A whole number in a range; digits only, as int() would also take 1_0 and digits of other scripts."""
    if not re.fullmatch(r"[+-]?[0-9]+", text, re.ASCII):
        raise argparse.ArgumentTypeError(f"'{_short(text)}' is not a whole number")
    # Python refuses to convert thousands of digits; forty are out of every range.
    digits = text.lstrip("+-").lstrip("0") or "0"
    number = int(digits[:40]) * (-1 if text.startswith("-") else 1)
    if not least <= number <= most:
        raise argparse.ArgumentTypeError(f"{_short(text)} is not from {least} to {most_text or most}")
    return number


def _short(text: str) -> str:
    return text if len(text) <= 40 else f"{text[:37]}..."


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{_short(text)}' is not a number") from None


def samples(text: str) -> int:
    """A number of samples."""
    return _whole(text, 1, MOST_SAMPLES)


def seed(text: str) -> int:
    """A seed."""
    return _whole(text, 0, 2**64 - 1, "2**64 - 1")


def guard(text: str) -> int:
    """A guard band, texels."""
    return _whole(text, 0, MOST_GUARD)


def neighbours(text: str) -> int:
    """A number of neighbouring modules."""
    return _whole(text, 0, MOST_NEIGHBOURS)


def threads(text: str) -> int:
    """A number of threads."""
    return _whole(text, 1, MOST_THREADS)


def blur(text: str) -> float:
    """A sigma of the blur, texels."""
    sigma = _number(text)
    if not 0 <= sigma <= MOST_BLUR:
        raise argparse.ArgumentTypeError(f"{_short(text)} is not a sigma from 0 to {MOST_BLUR:g} texels")
    return sigma


def layers(text: str) -> tuple[str, ...]:
    """Names of layers, which ``Settings`` checks."""
    return tuple(text.split(","))


def positive(text: str) -> float:
    """A number above 0."""
    number = _number(text)
    if not 0 < number <= LARGEST_RADIUS:
        raise argparse.ArgumentTypeError(f"{_short(text)} is not a number above 0")
    return number


def module_range(text: str) -> range:
    """A range A:B of modules."""
    found = re.fullmatch(r"([0-9]{1,9}):([0-9]{1,9})", text, re.ASCII)
    if not found:
        raise argparse.ArgumentTypeError(
            f"'{_short(text)}' is not a range A:B of two whole numbers, such as 0:3 for modules 0, 1 and 2"
        )
    start, stop = int(found[1]), int(found[2])
    if start >= stop:
        raise argparse.ArgumentTypeError(f"'{text}' holds no module: A:B needs A < B")
    return range(start, stop)


def resolution(text: str) -> tuple[int, int]:
    """A resolution WxH in texels."""
    found = re.fullmatch(r"([0-9]{1,18})x([0-9]{1,18})", text, re.ASCII)
    if not found or int(found[1]) == 0 or int(found[2]) == 0:
        raise argparse.ArgumentTypeError(f"'{_short(text)}' is not WIDTHxHEIGHT in texels, such as 1024x768")
    return int(found[1]), int(found[2])


def radius(text: str) -> float:
    """A radius."""
    number = _number(text)
    if not 0 <= number <= LARGEST_RADIUS:
        raise argparse.ArgumentTypeError(f"{_short(text)} is not a radius from 0 to {LARGEST_RADIUS:g}")
    return number


def radii(text: str) -> tuple[tuple[float, bool], ...]:
    """Each radius with whether it is a share, in per cent, of the scene's diagonal."""
    radii = []
    for word in text.split(","):
        number = _number(word.removesuffix("%"))
        if not 0 <= number <= LARGEST_RADIUS:
            raise argparse.ArgumentTypeError(f"{_short(word)} is not a radius from 0 to {LARGEST_RADIUS:g}")
        radii.append((number, word.endswith("%")))
    return tuple(radii)


def parameter(text: str) -> tuple[str, str]:
    """A parameter NAME=VALUE: both as they are written."""
    name, sign, value = text.partition("=")
    if not (name and sign and value):
        raise argparse.ArgumentTypeError(f"'{_short(text)}' is not NAME=VALUE, such as sigma=2")
    return name, value


def typed(text: str, kind: type) -> float | int | str | bool:
    """A value of a type: true or false, a whole number, a number, or the text itself."""
    if kind is bool:
        if text not in ("true", "false"):
            raise argparse.ArgumentTypeError(f"'{_short(text)}' is not true or false")
        return text == "true"
    if kind is int:
        return _whole(text, -(2**63), 2**63 - 1)
    return _number(text) if kind is float else text


def frames(text: str) -> int | Path:
    """A number of frames, or the name of a file of matrices."""
    if re.fullmatch(r"[+-]?[0-9.]+", text, re.ASCII):
        return _whole(text, 1, MOST_FRAMES)
    path = Path(text)
    if path.suffix.lower() not in (".json", ".npy"):
        raise argparse.ArgumentTypeError(f"'{_short(text)}' is neither a number of frames nor a .json or .npy file")
    return path


def scheduler(text: str) -> str:
    """Where dask's scheduler is."""
    if text != "local" and not re.fullmatch(r"(tcp|tls|ws|wss|ucx)://[^\s/]+:[0-9]{1,5}", text):
        raise argparse.ArgumentTypeError(f"'{_short(text)}' is neither local nor an address such as tcp://host:8786")
    return text
