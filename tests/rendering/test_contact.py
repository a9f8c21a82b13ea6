"""The contact sheet: which views it shows, how large, and in white where there is no colour."""

import numpy as np
import pytest
from jobs import render
from PIL import Image

from lfssao.rendering.contact import sheet_rows, white


def test_a_mesh_without_colour_is_white():
    assert white(np.array([[0.5, np.inf]])).tolist() == [[[1, 1, 1], [0, 0, 0]]]


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
