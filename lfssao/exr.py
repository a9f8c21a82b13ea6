"""Textures in multi-part OpenEXR files: float32, lossless, channels by name."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.errors import InputError
from lfssao.files import write_whole
from lfssao.image_file import read_image_file, utf8_name


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
        How many texels on each side lie outside the display window: the data window is larger by so much.
    """

    name: str
    channels: tuple[str, ...]
    pixels: NDArray[np.float32]
    attributes: Mapping[str, Any] = field(default_factory=dict)
    guard: int = 0


def use_threads(count: int) -> None:
    """Let OpenImageIO and OpenEXR compress with so many threads, in all files of this process."""
    import OpenImageIO as oiio

    oiio.attribute("threads", count)
    oiio.attribute("exr_threads", count)


def write_exr(path: Path, parts: Sequence[Part]) -> None:
    """Write parts to one file, zip-compressed, and read it back: it gets its name if it holds their very bits.

    Parameters
    ----------
    path : Path
        The file to be, whole or not at all.
    parts : sequence of Part
        Part 0 is what image viewers show.

    Raises
    ------
    InputError
        If the file cannot be written, or a part is not float32 or not of as many channels as it has names, or two
        parts share a name.
    """
    _check_parts(path, parts)

    def write(part_path: Path) -> None:
        _write(part_path, parts)
        _check_written(part_path, parts)

    write_whole(path, write)


def _check_parts(path: Path, parts: Sequence[Part]) -> None:
    for part in parts:
        shape, dtype = np.shape(part.pixels), part.pixels.dtype
        if dtype != np.float32:  # anything else would be rounded without a word
            raise InputError(f"{path}: part {part.name} is of {dtype}, expected float32")
        if len(shape) != 3 or shape[2] != len(part.channels) or 0 in shape:
            raise InputError(f"{path}: part {part.name} has shape {shape}, expected (H, W, {len(part.channels)})")
    names = [part.name for part in parts]
    if not names or len(set(names)) < len(names):
        raise InputError(f"{path}: the parts' names must differ, and one is needed: {', '.join(names)}")


def _write(path: Path, parts: Sequence[Part]) -> None:
    import OpenImageIO as oiio  # late: only files need it

    specs = [_spec(oiio, part) for part in parts]
    file = utf8_name(path)
    output = oiio.ImageOutput.create(file)
    if output is None:
        raise OSError(oiio.geterror())
    try:
        opened = output.open(file, tuple(specs))
        for number, part in enumerate(parts):
            if number:
                opened = output.open(file, specs[number], "AppendSubimage")
            # OpenImageIO says what went wrong in a return value only.
            if not opened or not output.write_image(np.ascontiguousarray(part.pixels)):
                raise OSError(output.geterror())
    finally:
        closed = output.close()
    if not closed:
        raise OSError(output.geterror())


def _check_written(path: Path, parts: Sequence[Part]) -> None:
    """Read a file back: what OpenEXR writes as it closes a file on a full disk is lost without an error."""
    import OpenImageIO as oiio

    source = oiio.ImageInput.open(utf8_name(path))
    if source is None:
        raise OSError(f"it cannot be read back: {oiio.geterror()}")
    try:
        for number, part in enumerate(parts):
            pixels = source.read_image(number, 0, 0, len(part.channels), oiio.FLOAT)
            if pixels is None:
                raise OSError(f"part {part.name} cannot be read back: {source.geterror()}")
            names = source.spec(number, 0).channelnames
            if tuple(names) != part.channels:
                pixels = pixels[..., [names.index(name) for name in part.channels]]
            if not _same_bits(pixels, part.pixels):
                raise OSError(f"part {part.name} is not read back as it was written")
    finally:
        source.close()


def _same_bits(a: NDArray[np.float32], b: NDArray[np.float32]) -> bool:
    return np.array_equal(np.ascontiguousarray(a).view(np.uint32), np.ascontiguousarray(b).view(np.uint32))


def _spec(oiio: Any, part: Part) -> Any:
    height, width, channels = part.pixels.shape
    spec = oiio.ImageSpec(width, height, channels, oiio.FLOAT)
    spec.channelnames = part.channels
    spec.x = spec.y = -part.guard
    spec.full_width, spec.full_height = width - 2 * part.guard, height - 2 * part.guard
    spec.attribute("name", part.name)
    spec.attribute("compression", "zip")
    # A fixed date: two runs that make equal textures make equal files.
    spec.attribute("DateTime", "2017:05:29 00:00:00")
    for key, value in part.attributes.items():
        spec.attribute(f"lfssao:{key}", value)
    return spec


def read_exr(path: Path) -> dict[str, Part]:
    """All parts of a file by name, channels in the file's own order.

    Raises
    ------
    InputError
        If the file is missing, is no EXR file or cannot be read.
    """
    parts: dict[str, Part] = {}
    for image in read_image_file(path, ("openexr",)):
        pixels = np.stack(image.planes, axis=-1).astype(np.float32, copy=False)
        guard = -image.origin[0] if image.origin else 0
        parts[image.name] = Part(image.name, image.channels, pixels, image.attributes, guard)
    return parts
