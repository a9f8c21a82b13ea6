"""Textures in multi-part OpenEXR files: float32, lossless, channels by name."""

import hashlib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from lfssao.core.arguments import check_unmasked, check_whole
from lfssao.errors import InputError, check_choice, check_type, errors_of, shown
from lfssao.files.image_file import PREFIX, first_line, guard_of, read_image_file, utf8_name
from lfssao.files.whole import write_whole
from lfssao.summary import Arrayed, Table, size_of

_KINDS = {"name": str, "channels": tuple | list, "pixels": np.ndarray, "attributes": Mapping}  # of a part
_LARGEST = float(np.finfo(np.float32).max)
_CHUNK_LINES = {"zip": 16, "rle": 1}  # lines of texels in a chunk
_SEAL = "file_sha256"  # the attribute of a file's first part that ``is_sealed`` looks at
_BLANK = "0" * 64


@dataclass(frozen=True, eq=False, repr=False)
class Part(Arrayed, Table):
    """One part of an EXR file; NumPy takes it for its pixels.

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

    def _array(self) -> NDArray[np.float32]:
        return self.pixels

    def _facts(self) -> dict[str, object]:
        named = {"name": self.name, "channels": " ".join(self.channels), "texels": size_of(self.pixels)}
        return {**named, "guard": self.guard, "attributes": len(self.attributes)}


def use_one_thread_a_file() -> None:
    """Let OpenImageIO read and write each file in the calling thread, in all of this process."""
    oiio.attribute("threads", 1)
    oiio.attribute("exr_threads", -1)


def write_exr(path: str | Path, parts: Sequence[Part], sealed: bool = False) -> None:
    """Write parts to one file, whole or not at all, zip-compressed; many viewers open part 0 alone.

    With ``sealed`` the file holds a digest of its own bytes (``is_sealed``).
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
    write_whole(path, lambda temporary: write_parts(temporary, parts, sealed))


def _check_part(label: str, part: Part) -> None:
    """Refuse a part that would be changed without an error."""
    for field_name, kind in _KINDS.items():
        check_type(f"{label}: {field_name}", getattr(part, field_name), kind)
    check_unmasked(label, part.pixels)
    shape = np.shape(part.pixels)
    dtype = part.pixels.dtype
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


def write_parts(path: Path, parts: Sequence[Part], sealed: bool = False) -> None:
    """Write parts that ``write_exr`` has checked, and read headers and chunk tables back; OSError if one is lost."""
    if sealed:
        parts = [replace(parts[0], attributes={**parts[0].attributes, _SEAL: _BLANK}), *parts[1:]]
    specs = tuple(_spec(part) for part in parts)
    output: Any = oiio.ImageOutput.create("openexr")
    for number, part in enumerate(parts):
        opened = output.open(str(path), specs[number], "AppendSubimage") if number else output.open(str(path), specs)
        if not opened or not output.write_image(np.ascontiguousarray(part.pixels)):
            raise OSError(first_line(output.geterror()))
    if not output.close():
        raise OSError(first_line(output.geterror()))
    data = path.read_bytes()
    _check_headers(path, specs)
    _check_chunks(data, parts)
    if sealed:
        with path.open("rb+") as stream:
            stream.seek(_seal_place(data))
            stream.write(_digest_but_seal(data).encode())


def _spec(part: Part) -> Any:
    height, width, channels = part.pixels.shape
    spec = oiio.ImageSpec(width, height, channels, oiio.FLOAT)
    spec.channelnames = part.channels
    spec.x = spec.y = -part.guard
    spec.full_width = width - 2 * part.guard
    spec.full_height = height - 2 * part.guard
    spec.attribute("name", part.name)
    spec.attribute("compression", part.compression)
    spec.attribute("DateTime", "")  # else the bytes depend on the time
    for name, value in part.attributes.items():
        spec.attribute(f"{PREFIX}{name}", value)
    return spec


def _check_headers(path: Path, specs: Sequence[Any]) -> None:
    """Read each part's header; OSError if one does not say what was written."""
    source = oiio.ImageInput.open(str(path))
    if source is None:
        raise OSError(first_line(oiio.geterror()))
    try:
        for number, spec in enumerate(specs):
            found = source.spec(number, 0)
            windows = (found.roi, found.roi_full) == (spec.roi, spec.roi_full)
            if not windows or sorted(found.channelnames) != sorted(spec.channelnames):
                raise OSError(f"the header of part {number} was lost")
    finally:
        source.close()


def _check_chunks(data: bytes, parts: Sequence[Part]) -> None:
    """Follow the chunk tables; OSError unless each part's chunks fill the file to its end, as they were written."""
    # OpenEXR loses, without an error, tables that it cannot write as it closes a file. Its readers mend such files.
    starts = [np.arange(0, part.pixels.shape[0], _CHUNK_LINES[part.compression]) - part.guard for part in parts]
    numbers = [np.full(len(lines), number) for number, lines in enumerate(starts)]
    head = np.stack([np.concatenate(numbers), np.concatenate(starts)], axis=1)[:, int(len(parts) == 1) :]
    try:
        place = _end_of_headers(data, len(parts) > 1)
        offsets = np.frombuffer(data, "<u8", len(head), place)
        words = np.frombuffer(data, np.uint8)[offsets[:, None] + np.arange(4 * (head.shape[1] + 1), dtype=np.uint64)]
        found = words.view("<i4")
        ends = offsets + np.uint64(words.shape[1]) + found[:, -1].astype(np.uint64)
        begins = np.append(offsets, len(data)).astype(np.uint64)
        whole = begins[0] == place + 8 * len(head) and (begins[1:] == ends).all() and (found[:, :-1] == head).all()
    except (IndexError, ValueError):
        whole = False
    if not whole:
        raise OSError("its chunk tables were lost")


def _end_of_headers(data: bytes, several: bool) -> int:
    """Return the place at which the chunk tables begin; ValueError or IndexError if the headers do not end."""
    place = 8  # after magic number and version
    while data[place]:  # a header of attributes
        while data[place]:  # an attribute: name, type, size, value
            size = data.index(0, data.index(0, place) + 1) + 1
            place = size + 4 + int.from_bytes(data[size : size + 4], "little")
        place += 1
        if not several:
            return place
    return place + 1


def is_sealed(path: Path) -> bool:
    """Whether every bit of a file is as ``write_exr`` left it with ``sealed``; OSError if it cannot be read."""
    data = path.read_bytes()
    try:
        place = _seal_place(data)
    except ValueError:
        return False
    return data[place : place + len(_BLANK)] == _digest_but_seal(data).encode()


def _seal_place(data: bytes) -> int:
    """Return the place of a file's own digest; ValueError if it holds none."""
    label = f"{PREFIX}{_SEAL}\0string\0".encode() + len(_BLANK).to_bytes(4, "little")
    return data.index(label) + len(label)


def _digest_but_seal(data: bytes) -> str:
    """Return the SHA-256 of a file's bytes, zeros in the place of its own digest."""
    place = _seal_place(data)
    sha = hashlib.sha256(data[:place] + _BLANK.encode())
    sha.update(memoryview(data)[place + len(_BLANK) :])
    return sha.hexdigest()


def read_exr(path: str | Path, names: Collection[str] | None = None) -> dict[str, Part]:
    """Return the parts of a file by name, all or those of some ``names``, channels in the file's own order.

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
