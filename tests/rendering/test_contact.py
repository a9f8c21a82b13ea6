"""The contact sheet: which views it shows, how large, and in grey where there is no colour."""

import numpy as np
import pytest
from jobs import render
from PIL import Image

from lfssao.rendering.contact import contact_sheet, sheet_rows, strip


def test_contact_sheet_without_colour_has_one_channel_of_the_same_picture():
    random = np.random.default_rng(5)
    surface, blurred = random.random((24, 32)) < 0.5, random.random((24, 32), np.float32)
    white, shaded = (np.repeat(grey[..., None], 3, axis=2) for grey in (surface.astype(np.float32), blurred / 2))
    found, expected = (strip(color, surface, blurred, shaded) for color in (None, white))
    assert found.mode == contact_sheet([("one", found)] * 2).mode == "L"
    assert expected.mode == contact_sheet([("one", expected)]).mode == "RGB"
    np.testing.assert_array_equal(np.asarray(found.convert("RGB")), np.asarray(expected))


@pytest.mark.parametrize("size", ["1x900", "900x1", "1x1"])
def test_contact_sheet_of_a_thin_texture_stays_small(tmp_path, size):
    out = render(tmp_path / "out", "statue", "--display", "virtual", "--resolution", size)
    with Image.open(out / "contact.png") as sheet:
        width, height = sheet.size
    assert (width, height <= 480 + 22 + 12 + 2 * 22) == (3 * 480 + 4 * 12, True)


@pytest.mark.parametrize(
    ("count", "rows"), [(1, [0]), (5, [0, 1, 2, 3, 4]), (6, [0, 1, 2, 4, 5]), (21, [0, 5, 10, 15, 20])]
)
def test_contact_sheet_shows_a_handful_from_first_to_last(count, rows):
    assert sheet_rows(count) == rows
