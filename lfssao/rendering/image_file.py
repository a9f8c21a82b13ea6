"""Image files of renderers, EXR, TIFF, PNG and NPY, read with the bits that they hold; hostile ones are refused."""

import json
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path
from typing import Any

import OpenImageIO as oiio
from numpy.typing import NDArray

from lfssao.core.files import check_file
from lfssao.core.memory import check_available
from lfssao.core.npy import read_npy
from lfssao.errors import InputError
from lfssao.optics.view import without_guard

ENDINGS = (".exr", ".tif", ".tiff", ".png", ".npy")
PREFIX = "lfssao:"  # begins the names of lfssao's attributes in EXR files
PARTS = "parts"  # the attribute of a part that holds several: name, channels, guard band and attributes of each
_FORMATS = ("openexr", "tiff", "png")

# A header may claim any size, and the reader allocates it before it decodes. Deflate, in EXR, TIFF and PNG, expands at
# most 1032 times; other compressions may expand a blank image more, so small images always pass.
_MOST_EXPANSION = 2048
_HARMLESS = 256 * 2**20

Keep = Callable[[str, tuple[str, ...]], bool]


@dataclass(frozen=True, eq=False)
class ImagePart:
    """One image of a file: the whole of a PNG, TIFF page or NPY array, one part of an EXR file."""

    name: str  # the part's name in an EXR file; '' where the format or the file has none
    channels: tuple[str, ...]  # 'Y', 'R', 'G', 'B', 'A' by their number where the format has no names
    planes: tuple[NDArray[Any], ...]  # the channels, (H, W), each in the file's own type
    origin: tuple[int, int] | None = None  # x and y of the data window; None where the format has none
    attributes: Mapping[str, Any] = field(default_factory=dict)  # metadata that lfssao wrote, strings and numbers


def read_image_file(path: Path, formats: tuple[str, ...] = _FORMATS, keep: Keep | None = None) -> list[ImagePart]:
    """All parts of a file, in its order, of the formats that are accepted, by OpenImageIO's names, or NPY.

    ``keep`` says by the names of a part and of its channels whether to read it; NPY is always read. The ending .npy
    means NPY; other formats are recognised by their content. Raises InputError if the file is missing, of another
    format, damaged, or claims to hold more than it can.
    """
    check_file(path)
    if path.suffix.lower() == ".npy":
        pixels = read_npy(path)
        if pixels.ndim not in (1, 2, 3) or pixels.size == 0:
            raise InputError(f"{path}: it holds {pixels.dtype} {pixels.shape}, expected numbers (H, W) or (H, W, C)")
        return [part_of(pixels)]
    try:
        return _read_with_oiio(path, formats, keep)
    except UnicodeDecodeError:  # OpenImageIO hands over names and messages as they are in the file
        raise InputError(f"{path}: it is damaged (a name in its header is not UTF-8)") from None
    except OSError as error:
        raise InputError(f"{path}: it cannot be read ({error.strerror or error})") from error


def _read_with_oiio(path: Path, formats: tuple[str, ...], keep: Keep | None) -> list[ImagePart]:
    plain = oiio.ImageSpec()
    plain.attribute("oiio:UnassociatedAlpha", 1)  # else colour comes multiplied by alpha
    source = oiio.ImageInput.open(utf8_name(path), plain)
    if source is None:
        kind = "an EXR file" if formats == ("openexr",) else "an image"
        raise InputError(f"{path}: it cannot be read as {kind} ({first_line(oiio.geterror())})")
    try:
        if source.format_name() not in formats:  # OpenImageIO reads whatever image it finds
            wanted = "an EXR file" if formats == ("openexr",) else "EXR, TIFF, PNG or NPY"
            raise InputError(f"{path}: it is of format {source.format_name()}, not {wanted}")
        specs: list[Any] = []
        while source.seek_subimage(len(specs), 0):
            specs.append(source.spec().copy())
        _check_sizes(path, specs)
        names = [str(spec.get_string_attribute("name")) for spec in specs]
        several = [spec.getattribute(PREFIX + PARTS) is not None for spec in specs]
        kept = [k for k, s in enumerate(specs) if keep is None or several[k] or keep(names[k], tuple(s.channelnames))]
        parts = [_read_part(path, source, k, specs[k]) for k in kept]
    finally:
        source.close()
    if len(set(names)) < len(names) and any(names):
        raise InputError(f"{path}: it is damaged (two of its parts have one name)")
    if not any(several):
        return parts
    apart = [each for part in parts for each in (_taken_apart(path, part) if PARTS in part.attributes else [part])]
    return [part for part in apart if keep is None or keep(part.name, part.channels)]


def _taken_apart(path: Path, joined: ImagePart) -> list[ImagePart]:
    """The parts that ``write_exr`` put into one, each with its own attributes, channels and guard band."""
    planes, own = dict(zip(joined.channels, joined.planes, strict=True)), dict(joined.attributes)
    band, parts = -joined.origin[0] if joined.origin else 0, []
    try:
        for name, channels, guard, attributes in json.loads(own.pop(PARTS)):
            cut = tuple(without_guard(planes[channel], band - guard) for channel in channels)
            if not 0 <= guard <= band or not cut or 0 in cut[0].shape:
                raise ValueError
            parts.append(ImagePart(str(name), tuple(channels), cut, (-guard, -guard), {**attributes, **own}))
            own = {}  # they are the first part's
    except (LookupError, TypeError, ValueError, RecursionError):
        raise InputError(f"{path}: it is damaged (its parts are not as its metadata say)") from None
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
    there = path.stat().st_size
    if claimed > max(_HARMLESS, _MOST_EXPANSION * there):
        most = max(specs, key=_bytes_in_memory)
        tiles = f" in tiles of {most.tile_width}x{most.tile_height}" if most.tile_width else ""
        size = f"{most.width}x{most.height} texels{tiles}, {claimed / 1e9:.3g} GB in all"
        raise InputError(f"{path}: its header claims {size}; a file of {there} bytes cannot hold that")
    check_available(f"{path}: its texels", claimed)


def _bytes_in_memory(spec: Any) -> int:
    """Bytes that reading a part takes; tiles are read whole, and a tile may be larger than its image."""
    columns, lines = max(spec.tile_width, 1), max(spec.tile_height, 1)
    texels = -(-spec.width // columns) * columns * -(-spec.height // lines) * lines
    return int(texels * spec.pixel_bytes(True))


def _read_part(path: Path, source: Any, number: int, spec: Any) -> ImagePart:
    """One part; successive channels of one type are read in that type, as conversion would normalise integers."""
    types = [str(t) for t in spec.channelformats] or [str(spec.format)] * spec.nchannels
    planes: list[NDArray[Any]] = []
    for kind, channels in groupby(types):
        begin = len(planes)
        pixels = source.read_image(number, 0, begin, begin + len(list(channels)), oiio.TypeDesc(kind))
        if pixels is None:
            raise InputError(f"{path}: part {number} cannot be read ({first_line(source.geterror())})")
        planes.extend(pixels[..., k] for k in range(pixels.shape[2]))
    if len(set(spec.channelnames)) < len(spec.channelnames):
        raise InputError(f"{path}: part {number} has two channels of one name")
    name, origin = spec.get_string_attribute("name"), (spec.x, spec.y) if source.format_name() == "openexr" else None
    own = {a.name.removeprefix(PREFIX): a.value for a in spec.extra_attribs if a.name.startswith(PREFIX)}
    return ImagePart(name, tuple(spec.channelnames), tuple(planes), origin, own)


def utf8_name(path: Path) -> str:
    """The path as text for OpenImageIO, or an ``InputError`` if its bytes are not UTF-8."""
    try:
        str(path).encode("utf-8")
    except UnicodeEncodeError:
        raise InputError(f"{path}: OpenImageIO needs names in UTF-8, which this is not") from None
    return str(path)


def first_line(message: str) -> str:
    """The first line of an error message of OpenImageIO, without the file's name; some come with a history."""
    first = message.strip().split("\n")[0]
    return re.sub(r"^EXR Error \(.*?\.exr\): ", "", first) or "OpenImageIO gives no reason"


def read_angles(path: Path, below: bool) -> NDArray[Any]:
    """The one channel of a file, (H, W), from the uppermost row on; below: whether the file begins with the lowest."""
    planes = [plane for part in read_image_file(path) for plane in part.planes]
    if len(planes) != 1:
        raise InputError(f"{path}: it has {len(planes)} channels, angles are one")
    return planes[0][::-1] if below else planes[0]


def part_of(array: NDArray[Any]) -> ImagePart:
    """The part that an NPY file of an array (W,), (H, W) or (H, W, C) holds."""
    height, width = (1, *array.shape)[-2:] if array.ndim < 3 else array.shape[:2]
    pixels = array.reshape(height, width, -1)
    channels = {1: ("Y",), 3: ("R", "G", "B"), 4: ("R", "G", "B", "A")}.get(pixels.shape[2])
    names = channels or tuple(f"channel{k}" for k in range(pixels.shape[2]))
    return ImagePart("", names, tuple(pixels[..., k] for k in range(pixels.shape[2])))
