"""Textures in multi-part OpenEXR files: float32, lossless, channels by name."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from lfssao.errors import InputError
from lfssao.exr_file import Part, check_format, write_parts
from lfssao.files import write_whole
from lfssao.image_file import read_image_file, utf8_name


def use_threads(count: int) -> None:
    """Let OpenImageIO and OpenEXR read with so many threads, in all files of this process."""
    import OpenImageIO as oiio

    oiio.attribute("threads", count)
    oiio.attribute("exr_threads", count)


def write_exr(path: Path, parts: Sequence[Part]) -> None:
    """Write parts to one file, zip-compressed.

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
        parts, or channels of one, share a name, or the display windows differ, or a name or a number is none that the
        format has room for.
    """
    utf8_name(path)  # else nobody could read it
    _check_parts(path, parts)
    write_whole(path, lambda temporary: write_parts(temporary, parts))


def _check_parts(path: Path, parts: Sequence[Part]) -> None:
    for part in parts:
        shape, dtype = np.shape(part.pixels), part.pixels.dtype
        if dtype != np.float32:  # anything else would be rounded without a word
            raise InputError(f"{path}: part {part.name} is of {dtype}, expected float32")
        if len(shape) != 3 or shape[2] != len(part.channels) or 0 in shape:
            raise InputError(f"{path}: part {part.name} has shape {shape}, expected (H, W, {len(part.channels)})")
        check_format(path, part)
    windows = list(dict.fromkeys(_display_window(part) for part in parts))
    if len(windows) > 1:  # readers refuse such files
        raise InputError(f"{path}: the parts' display windows differ: {', '.join(f'{w}x{h}' for w, h in windows)}")
    names = [part.name for part in parts]
    if not names or len(set(names)) < len(names):
        raise InputError(f"{path}: the parts' names must differ, and one is needed: {', '.join(names)}")


def _display_window(part: Part) -> tuple[int, int]:
    height, width, _ = part.pixels.shape
    return width - 2 * part.guard, height - 2 * part.guard


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
