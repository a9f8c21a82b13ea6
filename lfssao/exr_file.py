"""The bytes of a multi-part OpenEXR file of float32 scan lines, zip-compressed (openexr.com, "OpenEXR File Layout").

OpenImageIO takes 0.4 s of processor time for what takes a fifteenth here: it changes the order of bytes one by one, and
deflates with zlib's means. And what OpenEXR cannot write while it closes a file, on a full disk, it loses without an
error. Deflate is ours as well (``lfssao.kernels.deflate``): the fastest of libraries, ISA-L, takes twice the time, as
it looks for repeats everywhere, and its bytes differ between processors.
"""

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import accumulate
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from lfssao.errors import InputError

_MAGIC, _VERSION, _LONG_NAMES, _MULTI_PART = 20000630, 2, 0x400, 0x1000
_FLOAT, _ZIP, _INCREASING_Y = 2, 3, 0
_LINES = 16  # in a chunk of compression 'zip'
_SHORT_NAME, _LONGEST_NAME = 31, 255  # bytes
_PREFIX = "lfssao:"  # of the names of our attributes


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


def check_format(path: Path, part: Part) -> None:
    """Refuse what the format has no room for; the shape of the pixels must be right.

    Parameters
    ----------
    path : Path
        The file to be, for the message.
    part : Part
        The part.

    Raises
    ------
    InputError
        If a name is empty, too long or there twice, a chunk has 2 GiB or more, or an attribute a whole number
        beyond 32 bits.
    """
    names = [*part.channels, *(f"{_PREFIX}{name}" for name in part.attributes)]
    for name in names:
        if not 0 < len(name.encode()) <= _LONGEST_NAME or "\0" in name:
            raise InputError(f"{path}: part {part.name}: {name!r} is no name of a channel or an attribute")
    if len(set(part.channels)) < len(part.channels):
        raise InputError(f"{path}: part {part.name} has two channels of one name: {', '.join(part.channels)}")
    if 4 * _LINES * part.pixels[0].size >= 2**31:
        raise InputError(f"{path}: part {part.name} has {part.pixels.shape[1]} texels in a line, too many for OpenEXR")
    for name, value in part.attributes.items():
        if isinstance(value, int) and not -(2**31) <= value < 2**31:
            raise InputError(f"{path}: part {part.name}: attribute {name} is {value}, beyond 32 bits")


def write_parts(path: Path, parts: Sequence[Part]) -> None:
    """``write_to`` a file.

    Raises
    ------
    OSError
        If not all of it can be written.
    """
    with path.open("wb") as stream:
        write_to(stream, parts)


def write_to(stream: BinaryIO, parts: Sequence[Part]) -> None:
    """Write parts to an empty file that is open; the same parts make the same bytes on every machine.

    Parameters
    ----------
    stream : file
        Where to; it must be able to seek.
    parts : sequence of Part
        At least one; names and shapes as ``lfssao.exr.write_exr`` checks them.

    Raises
    ------
    OSError
        If not all of it can be written.
    """
    counts = [-(-len(part.pixels) // _LINES) for part in parts]
    head = _head(parts, counts)
    stream.write(head + bytes(8 * sum(counts)))  # the table of offsets is known at the end
    sizes: list[int] = []
    for number, (part, count) in enumerate(zip(parts, counts, strict=True)):
        chunks, some = _chunks(part, number, count)
        stream.write(chunks)
        sizes += some
    start = len(head) + 8 * sum(counts)
    stream.seek(len(head))
    stream.write(struct.pack(f"<{len(sizes)}Q", *accumulate(sizes[:-1], initial=start)))


def _head(parts: Sequence[Part], counts: Sequence[int]) -> bytes:
    """Everything before the table of offsets."""
    names = [name for part in parts for name in (*part.channels, *_attributes(part, 0))]
    flags = _MULTI_PART | (_LONG_NAMES if max(len(name.encode()) for name in names) > _SHORT_NAME else 0)
    headers = [_header(_attributes(part, count)) for part, count in zip(parts, counts, strict=True)]
    return struct.pack("<II", _MAGIC, _VERSION | flags) + b"".join(headers) + b"\0"


def _attributes(part: Part, chunk_count: int) -> dict[str, tuple[str, bytes]]:
    """Type and value of each attribute of a part's header."""
    height, width, _ = part.pixels.shape
    guard = part.guard
    own = {f"{_PREFIX}{name}": _value(value) for name, value in part.attributes.items()}
    return {
        "channels": ("chlist", _channel_list(part)),
        "chunkCount": ("int", struct.pack("<i", chunk_count)),
        "compression": ("compression", bytes([_ZIP])),
        "dataWindow": ("box2i", struct.pack("<4i", -guard, -guard, width - guard - 1, height - guard - 1)),
        "displayWindow": ("box2i", struct.pack("<4i", 0, 0, width - 2 * guard - 1, height - 2 * guard - 1)),
        **own,
        "lineOrder": ("lineOrder", bytes([_INCREASING_Y])),
        "name": _value(part.name),
        "pixelAspectRatio": _value(1.0),
        "screenWindowCenter": ("v2f", bytes(8)),
        "screenWindowWidth": _value(1.0),
        "type": _value("scanlineimage"),
    }


def _header(attributes: Mapping[str, tuple[str, bytes]]) -> bytes:
    """One part's header."""
    rows = [
        _text(name) + _text(kind) + struct.pack("<i", len(value)) + value for name, (kind, value) in attributes.items()
    ]
    return b"".join(rows) + b"\0"


def _value(value: str | float) -> tuple[str, bytes]:
    if isinstance(value, str):
        return "string", value.encode()
    if isinstance(value, int):
        return "int", struct.pack("<i", value)
    return "float", struct.pack("<f", value)


def _text(name: str) -> bytes:
    return name.encode() + b"\0"


def _order(part: Part) -> list[int]:
    """The part's channels in the file's order, that of their names' bytes."""
    return sorted(range(len(part.channels)), key=lambda channel: part.channels[channel].encode())


def _channel_list(part: Part) -> bytes:
    sampling = struct.pack("<iiii", _FLOAT, 0, 1, 1)
    return b"".join(_text(part.channels[channel]) + sampling for channel in _order(part)) + b"\0"


def _chunks(part: Part, number: int, count: int) -> tuple[memoryview, list[int]]:
    """A part's chunks behind each other, and how many bytes each takes."""
    from lfssao.kernels.deflate import SLACK  # late: reading files needs no numba
    from lfssao.kernels.exr_chunks import HEAD, write_chunks

    _, width, channels = part.pixels.shape
    texels = np.ascontiguousarray(part.pixels, "<f4").reshape(-1).view("<u4")
    gathered = np.empty(_LINES * width * channels, np.uint32)
    packed, repeats = np.empty(gathered.nbytes, np.uint8), np.empty((gathered.size + 2, 2), np.int32)
    sizes = np.empty(count, np.int64)
    out = np.empty(texels.nbytes + HEAD * count + gathered.nbytes + SLACK, np.uint8)
    size = write_chunks(
        texels, texels.view(np.uint16), width, np.argsort(_order(part)), number, -part.guard, gathered,
        gathered.view(np.uint16), packed, repeats, sizes, out,
    )  # fmt: skip
    return out[:size].data, sizes.tolist()
