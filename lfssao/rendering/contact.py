"""The contact sheet, a picture of up to five views, laid out as LF's figure 10, and animations."""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from lfssao.ao.post import Light, shade
from lfssao.files.pictures import Codes, light_codes
from lfssao.files.srgb import to_codes
from lfssao.files.whole import write_whole

FloatTexture = NDArray[np.float32]

_TITLES = ("without AO", "1 - ao", "with AO")
_MARGIN = 12
_CAPTION = 22
_SECONDS = 3.0  # of an animation
_LEAST = 30  # milliseconds of one of its pictures


def sheet_rows(count: int, most: int = 5) -> list[int]:
    """Indices of the views that are shown, at most ``most`` of ``count``, evenly spread from the first to the last."""
    rows: list[int] = np.linspace(0, count - 1, min(count, most)).round().astype(int).tolist()
    return rows


def white(depth: FloatTexture) -> FloatTexture:
    """Return the image of a mesh without colours, (H, W, 3), from its depth texture: white on the surface."""
    return np.repeat((depth < np.inf)[..., None].astype(np.float32), 3, axis=2)


def without_ao(image: FloatTexture, normals: FloatTexture | None, light: Light | None) -> FloatTexture:
    """Return the image, (H, W, 3), as the light alone shows it; as it is without a light or normals."""
    if light is None or normals is None:
        return image
    return shade(image, np.zeros(image.shape[:2], np.float32), normals, light)


def strip(image: FloatTexture, blurred: FloatTexture, shaded: FloatTexture, width: int = 480) -> Image.Image:
    """One row of the sheet: a view without AO, its visibility 1 - ao, and with AO, side by side, all in sRGB's curve.

    Image and shaded are linear RGB, (H, W, 3). ``width`` is that of each column, pixels, and the greatest height.
    """
    scale = width / max(blurred.shape)
    size = max(1, round(scale * blurred.shape[1])), max(1, round(scale * blurred.shape[0]))
    row = Image.new("RGB", (3 * width + 2 * _MARGIN, size[1]), "white")
    for column, texture in enumerate((image, (1 - blurred)[..., None], shaded)):
        planes = [Image.fromarray(np.ascontiguousarray(plane)) for plane in np.moveaxis(texture, 2, 0)]
        light = np.stack([np.asarray(plane.resize(size, Image.Resampling.BOX)) for plane in planes], axis=-1)
        row.paste(Image.fromarray(light_codes(light)), (column * (width + _MARGIN), 0))
    return row


def side_by_side(pictures: Mapping[str, Codes]) -> Image.Image:
    """Return pictures of one size, 8-bit sRGB, in a row under their titles, which can be read at half the size."""
    height, width = next(iter(pictures.values())).shape[:2]
    letters = max(10, width // 32)
    caption = letters + _MARGIN
    row = Image.new("RGB", (len(pictures) * (width + _MARGIN) - _MARGIN, height + caption), "white")
    for column, (title, picture) in enumerate(pictures.items()):
        left = column * (width + _MARGIN)
        ImageDraw.Draw(row).text((left, _MARGIN // 3), title, fill="black", font_size=letters)
        row.paste(Image.fromarray(picture), (left, caption))
    return row


def contact_sheet(strips: Sequence[tuple[str, Image.Image]]) -> Image.Image:
    """Return strips of one width below each other, each under its view's name and the columns' titles, and a bar."""
    width = strips[0][1].width
    height = sum(picture.height + _CAPTION + _MARGIN for _, picture in strips) + 2 * _CAPTION
    sheet = Image.new("RGB", (width + 2 * _MARGIN, height), "white")
    draw = ImageDraw.Draw(sheet)
    column = (width + _MARGIN) // 3
    top = 0
    for name, picture in strips:
        for k, title in enumerate((f"{name}: {_TITLES[0]}", *_TITLES[1:])):
            draw.text((_MARGIN + k * column, top + 6), title, fill="black")
        sheet.paste(picture, (_MARGIN, top + _CAPTION))
        top += picture.height + _CAPTION + _MARGIN
    bar = to_codes(np.linspace(0, 1, width, dtype=np.float32))
    sheet.paste(Image.fromarray(np.tile(bar, (_CAPTION, 1))), (_MARGIN, top))
    caption = "linear values 0 to 1 of all pictures, in sRGB's curve; 1/2 is in the middle"
    for place, text, anchor in ((0, "0", "la"), (width // 2, caption, "ma"), (width, "1", "ra")):
        draw.text((_MARGIN + place, top + _CAPTION + 4), text, fill="black", anchor=anchor)
    return sheet


def write_animation(path: Path, pictures: Sequence[Image.Image]) -> None:
    """Write pictures of one size as an animation of some seconds that begins again; InputError if it cannot be."""
    first, *rest = pictures
    duration = max(_LEAST, round(_SECONDS * 1000 / len(pictures)))
    save = partial(first.save, save_all=True, append_images=rest, loop=0, duration=duration)
    write_whole(path, save)


def with_ao(row: Image.Image) -> Image.Image:
    """Return the last picture of a strip."""
    return row.crop((row.width - (row.width - 2 * _MARGIN) // 3, 0, row.width, row.height))
