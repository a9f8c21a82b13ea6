"""PNG files of our own, as Pillow reads them."""

import io

import numpy as np
import pytest
from PIL import Image

from lfssao.png import png


@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (9, 1), (40, 300), (1, 1, 3), (5, 6, 3), (60, 50, 3)])
def test_the_picture_is_read_back(shape):
    noise = np.random.default_rng(3).integers(0, 256, shape, np.uint8)
    half = np.where(np.arange(noise.size).reshape(shape) % 7 < 5, np.uint8(255), noise)
    for picture in (noise, half, noise[::-1]):
        with Image.open(io.BytesIO(png(picture))) as image:
            image.verify()  # the sums of its chunks
        with Image.open(io.BytesIO(png(picture))) as image:
            assert (image.format, image.mode) == ("PNG", "L" if len(shape) == 2 else "RGB")
            np.testing.assert_array_equal(np.asarray(image), picture)


def test_what_repeats_takes_no_room():
    stripes = np.repeat(np.arange(256, dtype=np.uint8)[None], 500, axis=0)
    assert len(png(stripes)) < stripes.size / 50
