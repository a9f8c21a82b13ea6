"""The bytes of a multi-part OpenEXR file of float32 scan lines, zip-compressed (openexr.com, "OpenEXR File Layout").

OpenImageIO's packages for Python take six times the processor time to write them, OpenEXR's own four times: they change
the order of bytes one by one, and deflate with zlib's means. And what OpenEXR cannot write while it closes a file, on
a full disk, it loses without an error.
"""

import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import accumulate
from pathlib import Path
from typing import Any

import numpy as np
from isal import isal_zlib
from numpy.typing import NDArray

from lfssao.errors import InputError

_MAGIC, _VERSION, _LONG_NAMES, _MULTI_PART = 20000630, 2, 0x400, 0x1000
_FLOAT, _ZIP, _INCREASING_Y = 2, 3, 0
_LINES = 16  # in a chunk of compression 'zip'
_SHORT_NAME, _LONGEST_NAME = 31, 255  # bytes
_PREFIX = "lfssao:"  # of the names of our attributes
_BUFFER = 1 << 18  # bytes that are written at once, a few dozen chunks

# Deflate's level. ISA-L's takes a quarter of the time of zlib's fastest level, and its files are not larger.
_LEVEL = 1


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
    """Write parts to a file; the same parts make the same bytes on one processor.

    Parameters
    ----------
    path : Path
        The file.
    parts : sequence of Part
        At least one; names and shapes as ``lfssao.exr.write_exr`` checks them.

    Raises
    ------
    OSError
        If not all of it can be written.
    """
    counts = [-(-len(part.pixels) // _LINES) for part in parts]
    head = _head(parts, counts)
    with path.open("wb", buffering=_BUFFER) as stream:
        stream.write(head + bytes(8 * sum(counts)))  # the table of offsets is known at the end
        sizes = [
            stream.write(struct.pack("<iii", number, first - part.guard, len(data))) + stream.write(data)
            for number, part in enumerate(parts)
            for first, data in _chunks(part)
        ]
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


def _chunks(part: Part) -> Iterator[tuple[int, bytes]]:
    """The first line of each chunk, and its data: deflated, or as they are where that is no longer."""
    from lfssao.kernels.exr_lines import gather_lines, split_and_difference  # late: reading files needs no numba

    height, width, channels = part.pixels.shape
    pixels, order = np.ascontiguousarray(part.pixels).view(np.uint32), np.array(_order(part), np.int64)
    gathered = np.empty(_LINES * width * channels, np.uint32)
    packed = np.empty(4 * gathered.size, np.uint8)
    for first in range(0, height, _LINES):
        size = min(_LINES, height - first) * width * channels
        if channels == 1:  # as they are in memory
            words = pixels[first : first + _LINES].reshape(-1)
        else:
            words = gathered[:size]
            gather_lines(pixels, order, first, words)
        stored = words.astype("<u4", copy=False).view(np.uint8)
        split_and_difference(stored, packed[: 4 * size])
        data = isal_zlib.compress(packed[: 4 * size].data, _LEVEL)
        yield first, data if len(data) < 4 * size else stored.tobytes()
