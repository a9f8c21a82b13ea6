"""Background is written around windows of any place in memory, in whole lines or not, and nowhere else."""

import numpy as np
import pytest

from lfssao.kernels import fills
from lfssao.window import Window

SEEN, BEYOND, BACKGROUND = np.uint32(7), np.uint32(5), np.uint32(0x7F800000)


@pytest.mark.parametrize("offset", [0, 1, 7, 15, 16, 21])
@pytest.mark.parametrize("row", [1, 16, 37, 200])
def test_all_but_the_window_is_filled(row, offset):
    """Rows that begin anywhere in a line of 16 numbers, with numbers of somebody else's before and behind."""
    rng = np.random.default_rng(row + offset)
    for height in (1, 5, 40):
        left, right = sorted(rng.integers(0, row + 1, 2).tolist())
        top, bottom = sorted(rng.integers(0, height + 1, 2).tolist())
        memory = np.full(offset + height * row + 40, BEYOND)
        texture = memory[offset : offset + height * row]
        texture[:] = SEEN
        expected = np.full((height, row), BACKGROUND)
        expected[top:bottom, left:right] = SEEN
        fills.fill_around(texture, row, left, right, top, bottom, BACKGROUND)
        assert texture.reshape(height, row).tolist() == expected.tolist()
        assert (memory[:offset] == BEYOND).all()
        assert (memory[offset + height * row :] == BEYOND).all()


@pytest.mark.parametrize(
    ("background", "dtype"), [(np.inf, np.float32), (0, np.float32), (-1, np.int32), (-0.0, np.float32)]
)
@pytest.mark.parametrize("channels", [(), (3,)])
def test_textures_of_a_window_have_their_background_around_it(background, dtype, channels):
    for window in (Window(3, 2, 30, 9), Window(0, 4, 41, 9), Window(0, 0, 41, 12), Window(0, 0, 0, 0)):
        texture = window.texture(background, (12, 41, *channels), dtype)
        assert (texture.dtype, texture.shape) == (dtype, (12, 41, *channels))
        around = np.ones((12, 41), bool)
        window.part(around)[:] = False
        bits = np.array(background, dtype).view(np.uint32)
        assert (texture.view(np.uint32)[around] == bits).all()
