"""The contact sheet: which views it shows, how large, and in white where there is no colour."""

import numpy as np
import pytest
from jobs import render
from PIL import Image, ImageSequence

from lfssao.rendering.contact import contact_sheet, sheet_rows, strip, white, write_animation


def test_a_mesh_without_colour_is_white():
    assert white(np.array([[0.5, np.inf]])).tolist() == [[[1, 1, 1], [0, 0, 0]]]


@pytest.mark.parametrize("size", ["1x900", "900x1", "1x1"])
def test_contact_sheet_of_a_thin_texture_stays_small(tmp_path, size):
    out = render(tmp_path / "out", "statue", "--display", "virtual", "--resolution", size)
    with Image.open(out / "contact.png") as sheet:
        width, height = sheet.size
    assert (width, height <= 480 + 22 + 12 + 2 * 22) == (3 * 480 + 4 * 12, True)


def test_titles_stand_over_the_pictures():
    sheet = np.asarray(contact_sheet([("seen", Image.new("RGB", (3 * 480 + 24, 5)))] * 2))
    for top in (0, 22 + 5 + 12):
        assert not sheet[top + 22 : top + 27, 12:-12].any()
        assert (sheet[top + 27 : top + 39] == 255).all()
        ink = (sheet[top : top + 22] < 255).any(axis=(0, 2))
        for column in range(3):
            first = np.flatnonzero(ink[column * 492 :])[0]
            assert 11 <= first <= 14


def test_numbers_stand_under_the_ends_of_the_bar_and_its_words_between():
    sheet = np.asarray(contact_sheet([("seen", Image.new("RGB", (3 * 480 + 24, 5)))]))
    bar = sheet[22 + 5 + 12 :, 12:-12]
    below = 22
    assert bar[0, 0].tolist() == [0, 0, 0]
    assert bar[below - 1, -1].tolist() == [255, 255, 255]
    ink = (bar[below:] < 255).any(axis=2)
    tops = [np.flatnonzero(part.any(axis=1))[0] for part in (ink[:, :20], ink[:, 400:-400], ink[:, -20:])]
    assert tops[0] == tops[2]
    assert abs(tops[1] - tops[0]) <= 1 < tops[1]  # a stroke is higher than digits
    columns = np.flatnonzero(ink.any(axis=0))
    assert (columns[0], ink.shape[1] - columns[-1]) == pytest.approx((0, 2), abs=1)
    middle = columns[(columns > 20) & (columns < ink.shape[1] - 20)]
    assert (middle[0] + middle[-1]) / 2 == pytest.approx(ink.shape[1] / 2, abs=2)


def test_pixels_are_means_of_light_and_not_of_codes():
    texture = np.zeros((4, 960), np.float32)
    texture[:, ::2] = 1
    row = np.asarray(strip(np.stack([texture] * 3, axis=-1), texture, np.stack([texture] * 3, axis=-1)))
    half = 188  # sRGB's code of linear 1/2
    assert [np.unique(row[:, first : first + 480]).tolist() for first in (0, 492, 984)] == [[half]] * 3


@pytest.mark.parametrize(("count", "milliseconds"), [(4, 750), (30, 100), (200, 30)])
def test_an_animation_takes_three_seconds_or_more(tmp_path, count, milliseconds):
    write_animation(tmp_path / "a.png", [Image.new("L", (2, 2), k) for k in range(count)])
    with Image.open(tmp_path / "a.png") as file:
        assert [frame.info["duration"] for frame in ImageSequence.Iterator(file)] == count * [milliseconds]


@pytest.mark.parametrize(
    ("count", "rows"), [(1, [0]), (5, [0, 1, 2, 3, 4]), (6, [0, 1, 2, 4, 5]), (21, [0, 5, 10, 15, 20])]
)
def test_contact_sheet_shows_a_handful_from_first_to_last(count, rows):
    assert sheet_rows(count) == rows
