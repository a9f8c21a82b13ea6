"""Images of diffuse colours, through Pillow: decoded from sRGB once, in float32."""

import functools
import io
import re
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from lfssao.core.memory import check_expansion
from lfssao.errors import InputError
from lfssao.files.srgb import decode, to_linear
from lfssao.files.whole import check_file
from lfssao.scene.assets import bytes_of, reason_of

_BYTE = 255  # the largest number of 8 bits
_BITS = 258  # tag of TIFF: bits of each number
_PLANES = 284  # tag of TIFF: 2 for colours in planes


def read_image(path: Path) -> NDArray[np.float32]:
    """Return an image file as (h, w, 3) linear RGB."""
    check_file(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # Pillow's of large images
            with Image.open(path) as image:
                check_expansion("its texels", bytes_of(image), path.stat().st_size)
                return texture(image)
    except Exception as error:  # each of Pillow's readers has errors of its own
        raise InputError(f"{path}: it cannot be read as an image ({reason_of(path, error)})") from error


def opacity(image: Any) -> NDArray[np.float32] | None:
    """Opacity of a Pillow image that is not loaded, (h, w), 0 to 1; None where it is opaque.

    ValueError for opacity of 16 bits: Pillow gives 8 of them.
    """
    if not image.has_transparency_data:
        return None
    layouts = [each.args if isinstance(each.args, str) else (each.args or ("",))[0] for each in image.tile]
    if any("16" in str(layout) for layout in layouts):
        raise ValueError("of its opacity of 16 bits only 8 can be read")
    alpha = np.asarray(image.convert("RGBA"))[..., 3]
    return None if (alpha == 255).all() else alpha.astype(np.float32) / np.float32(255)


def texture(image: Any) -> NDArray[np.float32]:
    """Return pixels of a Pillow image as (h, w, 3) linear RGB; transparency is left out.

    Images of 16 bits that are loaded already have 8 of them left. ValueError for pixels that Pillow gives only in part.
    """
    if image.mode in ("I", "F"):
        raise ValueError(f"pixels of mode {image.mode} have no known range")
    if image.mode.startswith("I;16"):
        grey: NDArray[np.uint16] = np.asarray(image, np.uint16)
        return _decode_16(np.repeat(grey[..., None], 3, axis=2))
    stored = [(each.codec_name, each.args) for each in getattr(image, "tile", ())]
    layouts = {str(given if isinstance(given, str) else (given or ("",))[0]) for _, given in stored}
    for decoder, given in stored:
        if decoder.startswith("ppm") and isinstance(given, tuple) and given[-1] > _BYTE:
            raise ValueError("of a PPM's pixels of more than 8 bits only 8 can be read")
    tags = getattr(image, "tag_v2", {})
    if max(tags.get(_BITS, (8,))) > 8 and tags.get(_PLANES) == 2:
        raise ValueError("of a TIFF's planes of more than 8 bits only 8 can be read")
    wide = [layout for layout in layouts if "16" in layout]
    return _decode_16(_codes(image, wide[0])) if wide else to_linear(np.asarray(image.convert("RGB")))


@functools.cache
def _table() -> NDArray[np.float32]:
    """Linear value of each 16-bit sRGB code."""
    return decode(np.arange(65536) / 65535)


def _decode_16(codes: NDArray[np.uint16]) -> NDArray[np.float32]:
    return np.asarray(_table()[codes])


def _codes(image: Any, layout: str) -> NDArray[np.uint16]:
    """Return colours of 16 bits, (h, w, 3). Pillow gives 8 bits, so a file is read twice, in both orders of bytes."""
    found = re.fullmatch(r"(RGB[AX]?);16([BLN])|LA;16B", layout)
    if not found:
        raise ValueError(f"of pixels stored as {layout} only 8 bits can be read")
    order = (found[2] or "B").replace("N", sys.byteorder[0].upper())
    image.fp.seek(0)
    data = image.fp.read()
    if not found[1]:  # grey and opacity, of two bytes each
        pixels = np.asarray(_as_stored(data, "RGBA")).astype(np.uint16)
        return np.repeat(pixels[..., :1] * np.uint16(256) + pixels[..., 1:2], 3, axis=2)
    high, low = (
        np.asarray(_as_stored(data, f"{found[1]};16{each}"))[..., :3].astype(np.uint16)
        for each in (order, {"B": "L", "L": "B"}[order])
    )
    return np.asarray(high * np.uint16(256) + low)


def _as_stored(data: bytes, layout: str) -> Any:
    """An image whose pixels are taken from another layout than its own."""
    image = Image.open(io.BytesIO(data))
    image.tile = [
        each._replace(args=(layout, *each.args[1:]) if isinstance(each.args, tuple) else layout) for each in image.tile
    ]
    image.load()
    return image
