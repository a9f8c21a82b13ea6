"""Image files of renderers, EXR, TIFF, PNG and NPY, read with the bits that they hold; hostile ones are refused."""

import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from lfssao.core.memory import check_available
from lfssao.errors import InputError
from lfssao.files.whole import check_file

ENDINGS = (".exr", ".tif", ".tiff", ".png", ".npy")
PREFIX = "lfssao:"  # begins the names of lfssao's attributes in EXR files
_NAMES = {"openexr": "EXR", "tiff": "TIFF", "png": "PNG"}
_DTYPES = {"half": "float16", "float": "float32", "int": "int32", "uint": "uint32"}  # that NumPy calls otherwise

# A header may claim any size, and the reader allocates it before it decodes. Deflate, in EXR, TIFF and PNG, expands at
# most 1032 times; other compressions may expand a blank image more, so small images always pass.
_MOST_EXPANSION = 2048
_HARMLESS = 256 * 2**20

Keep = Callable[[str, tuple[str, ...]], bool]
Margins = tuple[int, int, int, int]
Size = tuple[int, int]  # width and height, texels


@dataclass(frozen=True, eq=False)
class ImagePart:
    """One image of a file: the whole of a PNG, TIFF page or NPY array, one part of an EXR file."""

    name: str  # the part's name in an EXR file; '' where the format or the file has none
    channels: tuple[str, ...]  # 'Y', 'R', 'G', 'B', 'A' by their number where the format has no names
    planes: tuple[NDArray[Any], ...]  # the channels, (H, W), each in the file's own type
    # texels that the data window has beyond the display window: left, above, right, below; None: there are no windows
    margins: Margins | None = None
    attributes: Mapping[str, Any] = field(default_factory=dict)  # metadata that lfssao wrote, strings and numbers


def read_image_file(
    path: Path, formats: tuple[str, ...] = (*_NAMES,), keep: Keep | None = None, sizes: Collection[Size] | None = None
) -> list[ImagePart]:
    """All parts of a file, in its order, of the formats that are accepted, by OpenImageIO's names, or NPY.

    Row 0 is the upper one and column 0 the left one, for any Orientation of the file. ``keep`` says by the names of a
    part and of its channels whether to read it; NPY is always read. Parts of other sizes than ``sizes`` are not
    decoded: their planes are 0 and take no memory. The ending .npy means NPY; other formats are recognised by their
    content. Raises InputError if the file is missing, of another format, damaged, or claims to hold more than it can.
    """
    check_file(path)
    if path.suffix.lower() == ".npy":
        from lfssao.files.npy import read_npy  # late: few textures are stored so

        pixels = read_npy(path)
        if pixels.ndim not in (1, 2, 3) or pixels.size == 0:
            raise InputError(f"{path}: it holds {pixels.dtype} {pixels.shape}, expected numbers (H, W) or (H, W, C)")
        return [part_of(np.moveaxis(pixels, 0, -1) if _has_channels_first(pixels, sizes) else pixels)]
    try:
        return _read_with_oiio(path, formats, keep, sizes)
    except UnicodeDecodeError:  # OpenImageIO hands over names and messages as they are in the file
        raise InputError(f"{path}: it is damaged (a name in its header is not UTF-8)") from None
    except OSError as error:
        raise InputError(f"{path}: it cannot be read ({error.strerror or error})") from error


def _has_channels_first(pixels: NDArray[Any], sizes: Collection[Size] | None) -> bool:
    """Whether an array is (C, H, W) and not (H, W, C): of one of the sizes alone, or with 1 to 4 and then more."""
    if pixels.ndim != 3 or pixels.shape[0] > 4:
        return False
    height, width, deep = pixels.shape
    return deep > 4 if sizes is None else (width, height) not in sizes and (deep, width) in sizes


def _read_with_oiio(
    path: Path, formats: tuple[str, ...], keep: Keep | None, sizes: Collection[Size] | None
) -> list[ImagePart]:
    plain = oiio.ImageSpec()
    plain.attribute("oiio:UnassociatedAlpha", 1)  # else colour comes multiplied by alpha
    source = oiio.ImageInput.open(utf8_name(path), plain)
    if source is None:
        kind = "an EXR file" if formats == ("openexr",) else "an image"
        raise InputError(f"{path}: it cannot be read as {kind} ({first_line(oiio.geterror())})")
    try:
        if source.format_name() not in formats:  # OpenImageIO reads images of any format
            known = [_NAMES[each] for each in formats]
            wanted = "an EXR file" if known == ["EXR"] else f"{', '.join(known)} or NPY"
            raise InputError(f"{path}: it is of format {source.format_name()}, not {wanted}")
        specs: list[Any] = []
        while source.seek_subimage(len(specs), 0):
            specs.append(source.spec().copy())
        source.geterror()  # that of the search for one more part
        _check_sizes(path, specs)
        names = [str(spec.get_string_attribute("name")) for spec in specs]
        kept = [k for k, spec in enumerate(specs) if keep is None or keep(names[k], tuple(spec.channelnames))]
        decoded = [sizes is None or _seen_size(path, specs[k]) in sizes for k in kept]
        needed = sum(_bytes_in_memory(specs[k]) for k, wanted in zip(kept, decoded, strict=True) if wanted)
        check_available(f"{path}: its texels", 2 * needed)  # once in the decoder
        parts = [_read_part(path, source, k, specs[k], wanted) for k, wanted in zip(kept, decoded, strict=True)]
    finally:
        source.close()
    if len(set(names)) < len(names) and any(names):
        raise InputError(f"{path}: it is damaged (two of its parts have one name)")
    return parts


def _check_sizes(path: Path, specs: list[Any]) -> None:
    """Refuse images that are not textures, and sizes that a file of this length cannot hold."""
    claimed = 0
    for spec in specs:
        if spec.deep or spec.depth > 1:
            raise InputError(f"{path}: it holds a {'deep image' if spec.deep else 'volume'}, not a texture")
        if spec.width < 1 or spec.height < 1 or spec.nchannels < 1:
            raise InputError(f"{path}: it is damaged (a part of {spec.width}x{spec.height})")
        claimed += _bytes_in_memory(spec)
    file_bytes = path.stat().st_size
    if claimed > max(_HARMLESS, _MOST_EXPANSION * file_bytes):
        most = max(specs, key=_bytes_in_memory)
        tiles = f" in tiles of {most.tile_width}x{most.tile_height}" if most.tile_width else ""
        size = f"{most.width}x{most.height} texels{tiles}, {claimed / 1e9:.3g} GB in all"
        raise InputError(f"{path}: its header claims {size}; a file of {file_bytes} bytes cannot hold that")


def _bytes_in_memory(spec: Any) -> int:
    """Return bytes that reading a part takes; tiles are read whole, and a tile may be larger than its image."""
    columns = max(spec.tile_width, 1)
    lines = max(spec.tile_height, 1)
    texels = -(-spec.width // columns) * columns * -(-spec.height // lines) * lines
    return int(texels * spec.pixel_bytes(True))


def _read_part(path: Path, source: Any, number: int, spec: Any, decoded: bool) -> ImagePart:
    """One part; successive channels of one type are read in that type, as conversion would normalise integers."""
    types = [str(t) for t in spec.channelformats] or [str(spec.format)] * spec.nchannels
    planes: list[NDArray[Any]] = []
    for kind, channels in groupby(types):
        begin = len(planes)
        count = len(list(channels))
        if not decoded:
            planes += [np.broadcast_to(np.zeros(1, _DTYPES.get(kind, kind)), (spec.height, spec.width))] * count
            continue
        pixels = source.read_image(number, 0, begin, begin + count, oiio.TypeDesc(kind))
        if pixels is None:
            raise InputError(f"{path}: part {number} cannot be read ({first_line(source.geterror())})")
        planes.extend(pixels[..., k] for k in range(pixels.shape[2]))
    if len(set(spec.channelnames)) < len(spec.channelnames):
        raise InputError(f"{path}: part {number} has two channels of one name")
    turned, mirrored, upwards = _orientation(path, spec)
    planes = [(p.T if turned else p)[:: -1 if upwards else 1, :: -1 if mirrored else 1] for p in planes]
    own = {a.name.removeprefix(PREFIX): a.value for a in spec.extra_attribs if a.name.startswith(PREFIX)}
    margins = _margins(spec, turned, mirrored, upwards)
    windows = source.format_name() == "openexr" or any(margins)
    name = spec.get_string_attribute("name")
    return ImagePart(name, tuple(spec.channelnames), tuple(planes), margins if windows else None, own)


def _orientation(path: Path, spec: Any) -> tuple[bool, bool, bool]:
    """Whether columns are stored as rows, and then whether from the right, and from below (TIFF 6, Orientation)."""
    number = spec.getattribute("Orientation")
    if number is None:
        return False, False, False
    if number not in range(1, 9):
        raise InputError(f"{path}: its Orientation is {number!r:.40}, expected 1 to 8")
    return number > 4, number in (2, 3, 6, 7), number in (3, 4, 7, 8)


def _seen_size(path: Path, spec: Any) -> Size:
    """Width and height of a part as it is seen."""
    return (spec.height, spec.width) if _orientation(path, spec)[0] else (spec.width, spec.height)


def _margins(spec: Any, turned: bool, mirrored: bool, upwards: bool) -> Margins:
    """Return texels that the data window has beyond the display window on each side, as it is seen."""
    left = spec.full_x - spec.x
    above = spec.full_y - spec.y
    right = spec.width - spec.full_width - left
    below = spec.height - spec.full_height - above
    if turned:
        left, above, right, below = above, left, below, right
    left, right = (right, left) if mirrored else (left, right)
    above, below = (below, above) if upwards else (above, below)
    return left, above, right, below


def guard_of(margins: Margins | None) -> int:
    """Width of the guard band, texels; InputError if the data window is of another form."""
    guard, *others = margins or (0,)
    if guard < 0 or {*others} - {guard}:
        beyond = f"its data window reaches beyond its display window by {', '.join(map(str, (guard, *others)))} texels"
        raise InputError(f"{beyond} (left, above, right, below), expected 0, or the same on all, a guard band")
    return guard


def utf8_name(path: Path) -> str:
    """Return the path as text for OpenImageIO, or an ``InputError`` if its bytes are not UTF-8."""
    try:
        str(path).encode("utf-8")
    except UnicodeEncodeError:
        raise InputError(f"{path}: OpenImageIO needs names in UTF-8, which this is not") from None
    return str(path)


def first_line(message: str) -> str:
    """Return the first line of an error message of OpenImageIO, without the file's name; some come with a history."""
    first = message.strip().split("\n")[0]
    return re.sub(r"^EXR Error \(.*?\.exr\): ", "", first) or "OpenImageIO gives no reason"


def part_of(array: NDArray[Any]) -> ImagePart:
    """Return the part that an NPY file of an array (W,), (H, W) or (H, W, C) holds."""
    height, width = (1, *array.shape)[-2:] if array.ndim < 3 else array.shape[:2]
    pixels = array.reshape(height, width, -1)
    channels = {1: ("Y",), 3: ("R", "G", "B"), 4: ("R", "G", "B", "A")}.get(pixels.shape[2])
    names = channels or tuple(f"channel{k}" for k in range(pixels.shape[2]))
    return ImagePart("", names, tuple(pixels[..., k] for k in range(pixels.shape[2])))
