"""Files of a rotation's angles or vectors, images of one to three channels, from the uppermost row on."""

from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.errors import InputError, errors_of
from lfssao.files.image_file import Size, read_image_file
from lfssao.samples.rotation import MOST_TILE, check_tile


def read_noise(path: Path, below: bool, sizes: Collection[Size] | None = None) -> NDArray[Any]:
    """Return the angles of a file of one channel, (h, w), or its vectors, (h, w, 2 or 3), from the uppermost row on.

    below: whether the file, or each tile of it, begins with the lowest row. InputError if it is of neither one of the
    sizes nor a tile's, or tiles that begin below end differently at the top of textures of several heights.
    """
    tiles = [(side, side) for side in range(1, MOST_TILE + 1)]
    decoded = None if sizes is None else [*sizes, *tiles]
    planes = [plane for part in read_image_file(path, sizes=decoded) for plane in part.planes]
    if not 1 <= len(planes) <= 3:
        raise InputError(f"{path}: it has {len(planes)} channels, angles are one, vectors two or three")
    rows = len(planes[0])
    wanted = {(height, width) for width, height in sizes or ()}
    with errors_of(str(path)):
        check_tile(planes[0].shape, wanted)
        if below and len({height % rows for height, _ in wanted}) > 1:
            raise InputError("its tiles begin with the lowest row, and textures have different heights")
    noise = planes[0] if len(planes) == 1 else np.stack(planes, axis=-1)
    height = max(wanted)[0] if wanted else rows
    return noise[(height - 1 - np.arange(rows)) % rows] if below else noise
