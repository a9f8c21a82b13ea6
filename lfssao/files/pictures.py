"""Textures as PNG pictures, which is how objects show themselves in a notebook."""

from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lfssao.files.srgb import to_codes

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from PIL.Image import Image

Codes = NDArray[np.uint8]

_MARGIN = 8
_NEAR = 235
_FAR = 40
_NOTHING = 255


def figure_png(figure: "Figure") -> bytes:
    """Return a figure as a PNG file."""
    file = BytesIO()
    figure.savefig(file, format="png", dpi=100, bbox_inches="tight")
    return file.getvalue()


def image_png(image: "Image") -> bytes:
    """Return a Pillow image as a PNG file."""
    file = BytesIO()
    image.save(file, "PNG")
    return file.getvalue()


def row_png(pictures: list[Codes], width: int = 360) -> bytes:
    """A row of pictures of one size, 8-bit codes (H, W, 3), as a PNG file; ``width``: the longer side of each."""
    from PIL import Image  # late: only pictures need it

    rows, columns = pictures[0].shape[:2]
    scale = width / max(rows, columns)
    size = max(1, round(scale * columns)), max(1, round(scale * rows))
    row = Image.new("RGB", (len(pictures) * (size[0] + _MARGIN) - _MARGIN, size[1]), "white")
    for number, picture in enumerate(pictures):
        row.paste(Image.fromarray(picture).resize(size, Image.Resampling.BOX), (number * (size[0] + _MARGIN), 0))
    return image_png(row)


def visibility_codes(occlusion: NDArray[np.floating[Any]]) -> Codes:
    """Visibility 1 - ao, (H, W, 3), 0 black and 1 white, without gamma."""
    return _grey(np.clip(1 - occlusion, 0, 1) * 255)


def depth_codes(depth: NDArray[np.floating[Any]]) -> Codes:
    """Depth, (H, W, 3): light near the viewer, dark far away, white where there is no surface."""
    surface = np.isfinite(depth)
    codes = np.full(depth.shape, float(_NOTHING))
    if surface.any():
        near = float(depth[surface].min())
        far = float(depth[surface].max())
        relative = (depth[surface].astype(np.float64) - near) / ((far - near) or 1.0)
        codes[surface] = _NEAR + (_FAR - _NEAR) * relative
    return _grey(codes)


def normal_codes(normals: NDArray[np.floating[Any]]) -> Codes:
    """Normals, (H, W, 3): x, y, z from -1 to 1 as red, green, blue from 0 to 255; white where there is no surface."""
    codes: Codes = (np.clip(0.5 + 0.5 * normals, 0, 1) * 255 + 0.5).astype(np.uint8)
    codes[(normals == 0).all(axis=2)] = _NOTHING
    return codes


def light_codes(image: NDArray[np.floating[Any]]) -> Codes:
    """Linear light (H, W, C) as sRGB codes (H, W, 3): its three channels, or else its first as grey."""
    return to_codes(image if image.shape[2] == 3 else np.repeat(image[..., :1], 3, axis=2))


def _grey(codes: NDArray[np.floating[Any]]) -> Codes:
    return np.repeat((codes + 0.5).astype(np.uint8)[..., None], 3, axis=2)
