"""Pictures of all views of a quilt, view 0 below on the left, as programs for displays behind lenses read them."""

import re
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from lfssao.core.memory import check_available
from lfssao.files.srgb import to_codes
from lfssao.files.whole import write_whole
from lfssao.rendering.folder import read_layer


def place_of(index: int, columns: int, rows: int, size: tuple[int, int]) -> tuple[slice, slice]:
    """Return rows and columns of pixels of a view, a number from 0, each view of ``size`` (width, height)."""
    row = rows - 1 - index // columns
    column = index % columns
    return slice(row * size[1], (row + 1) * size[1]), slice(column * size[0], (column + 1) * size[0])


def layout_of(stem: str) -> tuple[str, int, int] | None:
    """First word, columns and rows of a picture's name such as ``merged_qs8x6a0.75``; None if it is none."""
    found = re.fullmatch("(.*)_qs([0-9]{1,4})x([0-9]{1,4})(a[0-9.]+)?", stem, re.DOTALL)
    return None if found is None else (found[1], int(found[2]), int(found[3]))


def write_quilts(
    folder: Path, pictures: Mapping[str, str], entries: Sequence[Mapping[str, Any]], columns: int, rows: int
) -> None:
    """Write a PNG file of each layer, by its name in ``pictures``, from the files of all views.

    Colours are 8-bit sRGB, occlusion linear codes, 0 open and 255 covered. ``entries`` are the manifest's, in the order
    of the views. InputError if a file is not what its entry describes, or one cannot be written.
    """
    for layer, name in pictures.items():
        picture: NDArray[np.uint8] | None = None
        for index, entry in enumerate(entries):
            texture = read_layer(folder / Path(entry["file"]).name, layer, entry["textures"][layer])
            height, width, channels = texture.shape
            if picture is None:
                check_available(f"{folder / name}", 2 * len(entries) * texture.size)
                picture = np.empty((rows * height, columns * width, channels), np.uint8)
            codes = to_codes(texture) if channels == 3 else np.rint(255 * texture).astype(np.uint8)
            picture[place_of(index, columns, rows, (width, height))] = codes
        if picture is not None:
            image = Image.fromarray(picture if picture.shape[2] == 3 else picture[..., 0])
            write_whole(folder / name, partial(image.save, compress_level=1))
