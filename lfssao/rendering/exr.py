"""Textures in multi-part OpenEXR files: float32, lossless, channels by name."""

import json
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import OpenImageIO as oiio
from numpy.typing import NDArray

from lfssao.core.arguments import check_unmasked, check_whole
from lfssao.core.files import write_whole
from lfssao.errors import InputError, check_choice, check_type, errors_of, shown
from lfssao.rendering.image_file import PARTS, PREFIX, first_line, guard_of, read_image_file, utf8_name

_KINDS = {"name": str, "channels": tuple | list, "pixels": np.ndarray, "attributes": Mapping}  # of a part
_LARGEST = float(np.finfo(np.float32).max)


@dataclass(frozen=True, eq=False)
class Part:
    """One part of an EXR file.

    Attributes
    ----------
    name : str
        The part's name, unique in its file.
    channels : tuple of str
        Name of each channel, ``layer.channel`` or a standard one (R G B, Z, P.X ...).
    pixels : (H, W, C) float32
        The channels in that order.
    attributes : mapping
        Further metadata, strings and numbers.
    guard : int
        Width of the guard band, texels: the data window is larger than the display window by it on each side.
    compression : str
        'zip' or 'rle', which takes 2/5 of the time, and as little room where noise leaves zip little to find.

    Examples
    --------
    >>> lfssao.Part("depth", ("Z",), np.zeros((48, 64, 1), np.float32)).guard
    0
    """

    name: str
    channels: tuple[str, ...]
    pixels: NDArray[np.float32]
    attributes: Mapping[str, Any] = field(default_factory=dict)
    guard: int = 0
    compression: str = "zip"


def use_one_thread_a_file() -> None:
    """Let OpenImageIO and OpenEXR read and write each file in the calling thread, in all of this process."""
    oiio.attribute("threads", 1)
    oiio.attribute("exr_threads", -1)


def write_exr(path: str | Path, parts: Sequence[Part], single_part: bool = False) -> None:
    """Write parts to one file, whole or not at all, zip-compressed; many viewers open part 0 alone.

    With ``single_part`` that holds all channels, whose names must differ, in a window with the widest guard band;
    ``read_exr`` gives the parts back.

    InputError if the file cannot be written, or would not hold what the parts hold: pixels that are not float32, names
    that are not unique or too long for the format, numbers beyond 32 bits, several display windows.

    >>> lfssao.write_exr("b.exr", [lfssao.Part("merged", ("merged.AO",), np.ones((3, 4, 1), np.float32))])
    """
    check_type("path", path, str | Path)
    check_type("parts", parts, Sequence)
    path = Path(path)
    name = utf8_name(path)  # else nobody could read it
    for part in parts:
        check_type(f"{name}: a part", part, Part)
        _check_part(f"{name}: part {part.name}", part)
    windows = {(part.pixels.shape[1] - 2 * part.guard, part.pixels.shape[0] - 2 * part.guard): None for part in parts}
    if len(windows) > 1:  # readers refuse such files
        raise InputError(f"{path}: the parts' display windows differ: {', '.join(f'{w}x{h}' for w, h in windows)}")
    names = [part.name for part in parts]
    if not names or len(set(names)) < len(names):
        raise InputError(f"{path}: the parts' names must differ, and one is needed: {', '.join(names)}")
    written = [_joined(parts)] if single_part else parts
    _check_part(name, written[0])
    write_whole(path, lambda temporary: write_parts(temporary, written))


def _joined(parts: Sequence[Part]) -> Part:
    """Parts as one, 0 where one has no guard band; its attributes are the first part's and a table of all parts."""
    guard = max(part.guard for part in parts)
    bands = [((guard - part.guard,) * 2,) * 2 for part in parts]
    pixels = [np.pad(part.pixels, (*band, (0, 0))) for part, band in zip(parts, bands, strict=True)]
    table = [(p.name, p.channels, p.guard, as_stored(p.attributes) if p is not parts[0] else {}) for p in parts]
    channels = tuple(channel for part in parts for channel in part.channels)
    attributes = {**parts[0].attributes, PARTS: json.dumps(table)}
    return Part("", channels, np.concatenate(pixels, axis=-1), attributes, guard)


def as_stored(attributes: Mapping[str, Any]) -> dict[str, Any]:
    """Attributes with their numbers as EXR has them, in 32 bits."""
    return {name: float(np.float32(v)) if isinstance(v, float) else v for name, v in attributes.items()}


def _check_part(label: str, part: Part) -> None:
    """Refuse a part that would be changed without an error."""
    for field_name, kind in _KINDS.items():
        check_type(f"{label}: {field_name}", getattr(part, field_name), kind)
    check_unmasked(label, part.pixels)
    shape, dtype = np.shape(part.pixels), part.pixels.dtype
    if dtype != np.float32:  # anything else would be rounded
        raise InputError(f"{label} is of {dtype}, expected float32")
    if len(shape) != 3 or shape[2] != len(part.channels) or 0 in shape:
        raise InputError(f"{label} has shape {shape}, expected (H, W, {len(part.channels)})")
    check_whole(f"{label}: guard", part.guard, 0, (min(shape[:2]) - 1) // 2)
    check_choice(f"compression ({label})", part.compression, ("zip", "rle"))
    for name in (*part.channels, *part.attributes):
        check_type(f"{label}: a name", name, str)
    if len(set(part.channels)) < len(part.channels):
        raise InputError(f"{label} has two channels of one name: {', '.join(part.channels)}")
    for name in (*part.channels, *(f"{PREFIX}{name}" for name in part.attributes)):
        if not 0 < len(name.encode()) <= 255 or "\0" in name:
            raise InputError(f"{label}: {name!r} is no name of a channel or an attribute")
    for name, value in part.attributes.items():
        check_type(f"{label}: attribute {name}", value, str | int | float | tuple)
        too_large = isinstance(value, float) and _LARGEST < abs(value) < inf
        if too_large or (isinstance(value, int) and not -(2**31) <= value < 2**31):
            raise InputError(f"{label}: attribute {name} is {value}, beyond 32 bits")


def write_parts(path: Path, parts: Sequence[Part]) -> None:
    """Write parts that ``write_exr`` has checked, and read the end of the file back; OSError if not all is there."""
    try:
        OpenEXR.File([_openexr_part(part) for part in parts]).write(str(path))
    except RuntimeError as error:
        raise OSError(str(error).rpartition('". ')[2]) from error  # without the file's name
    # On a full disk OpenEXR loses, without an error, pixels that it writes as it closes the file.
    source = oiio.ImageInput.open(str(path))
    if source is None:
        raise OSError(first_line(oiio.geterror()))
    end = parts[-1].pixels.shape[0] - parts[-1].guard
    if source.read_scanlines(len(parts) - 1, 0, end - 1, end, 0, 0, 1, oiio.FLOAT) is None:
        raise OSError(first_line(source.geterror()))


def _openexr_part(part: Part) -> Any:
    height, width, _ = part.pixels.shape
    low, high, guard = np.array([0, 0], np.int32), np.array([width, height], np.int32) - 1, int(part.guard)
    header = {
        "type": OpenEXR.scanlineimage,
        "compression": getattr(OpenEXR, f"{part.compression.upper()}_COMPRESSION"),
        "dataWindow": (low - guard, high - guard),
        "displayWindow": (low, high - 2 * guard),
        **{f"{PREFIX}{name}": value for name, value in part.attributes.items()},
    }
    # Channels one by one: OpenEXR takes an array for one without gaps, whatever its strides are.
    channels = {name: np.ascontiguousarray(part.pixels[..., k]) for k, name in enumerate(part.channels)}
    return OpenEXR.Part(header, channels, part.name)


def read_exr(path: str | Path, names: Collection[str] | None = None) -> dict[str, Part]:
    """The parts of a file by name, all or those of some ``names``, channels in the file's own order.

    InputError if the file is missing, is no EXR file or cannot be read.

    >>> lfssao.write_exr("a.exr", [lfssao.Part("depth", ("Z",), np.ones((3, 4, 1), np.float32))])
    >>> lfssao.read_exr("a.exr")["depth"].pixels.shape
    (3, 4, 1)
    """
    check_type("path", path, str | Path)
    if names is not None and not isinstance(names, Collection):
        raise InputError(f"names is {shown(names)}, it must be a list of names of parts")
    parts: dict[str, Part] = {}
    for image in read_image_file(Path(path), ("openexr",), lambda name, _: names is None or name in names):
        pixels = np.stack(image.planes, axis=-1).astype(np.float32, copy=False)
        with errors_of(f"{path}: part {image.name}"):
            guard = guard_of(image.margins)
        parts[image.name] = Part(image.name, image.channels, pixels, image.attributes, guard)
    return parts
