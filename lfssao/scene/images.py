"""Images of diffuse colours, through Pillow: decoded from sRGB once, in float32."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from lfssao.core.files import check_file
from lfssao.core.memory import check_expansion
from lfssao.core.srgb import to_linear
from lfssao.errors import InputError
from lfssao.scene.assets import bytes_of, reason_of


def read_image(path: Path) -> NDArray[np.float32]:
    """An image file as (h, w, 3) linear RGB."""
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
    """Opacity of a Pillow image, (h, w), 0 to 1; None where it is opaque."""
    if not image.has_transparency_data:
        return None
    alpha = np.asarray(image.convert("RGBA"))[..., 3]
    return None if (alpha == 255).all() else alpha.astype(np.float32) / np.float32(255)


def texture(image: Any) -> NDArray[np.float32]:
    """Pixels of a Pillow image as (h, w, 3) linear RGB; transparency is left out."""
    if image.mode in ("I", "F"):
        raise ValueError(f"pixels of mode {image.mode} have no known range")
    if image.mode.startswith("I;16"):  # Pillow would clip 16-bit grey at 255
        grey = (np.asarray(image).astype(np.uint32) * 255 + 32767) // 65535
        return to_linear(np.repeat(grey.astype(np.uint8)[..., None], 3, axis=2))
    return to_linear(np.asarray(image.convert("RGB")))
