"""OFF: keywords, free form, colours, and what is refused."""

import numpy as np
import pytest
from mesh_files import CORNERS, area, colors, linear, loaded, rows, triangles

from lfssao.errors import InputError

RNG = np.random.default_rng(23)
SQUARE = rows(CORNERS)
PLAIN = f"OFF\n4 1 0\n{SQUARE}4 0 1 2 3\n"
TRIANGLES = "3 0 1 2{}\n3 0 2 3{}\n"
UP = np.tile([0, 0, 1.0], (4, 1))
RED = [[255, 0, 0]] * 4
ORANGE = [[255, 128, 0]] * 4


def four(values):
    """The same at each vertex."""
    return np.tile(values, (4, 1))


@pytest.mark.parametrize("content", [
    PLAIN, PLAIN.replace("\n", " "), PLAIN.replace("\n", "\r"), PLAIN.replace("\n", "\r\n\r\n"), PLAIN.encode("utf-16"),
    PLAIN + "\0\0", PLAIN.encode("utf-16-le"), PLAIN.encode("utf-16-be"), PLAIN.encode("utf-32"),
    "\ufeff" + PLAIN, PLAIN.replace(" ", "\t"), PLAIN.removeprefix("OFF\n"), PLAIN.replace("OFF\n", "off "),
    PLAIN.replace("4 1 0\n", "# one\n\n4 1 # two\n"), PLAIN.replace("4 1 0", "4\n1\n0"), PLAIN.replace(" 0\n", " 0 "),
    PLAIN.replace("1 2 3\n", "1\n2 3 # quad"), f"4OFF\n4 1 0\n{rows(CORNERS * 4, four(4))}4 0 1 2 3\n",
    PLAIN.replace("OFF\n4 1 0\n", "OFF 4 1 0 "),
])  # fmt: skip
def test_spellings(tmp_path, content):
    mesh = loaded(tmp_path, "a.off", content)
    assert np.array_equal(triangles(mesh), CORNERS[[[0, 1, 2], [2, 3, 0]]])
    assert (mesh.notes, mesh.paint) == ((), None)


def test_polygons_that_are_drawn_in_lines_of_any_length(tmp_path):
    for _ in range(20):
        corners = [int(count) for count in RNG.integers(3, 8, int(RNG.integers(1, 9)))]
        circles = []
        faces = []
        for k, count in enumerate(corners):
            angle = 2 * np.pi * (np.arange(count) + 0.3) / count
            faces.append([count, *range(sum(corners[:k]), sum(corners[: k + 1]))])
            circles.append(np.stack([np.cos(angle), np.sin(angle), np.full(count, k)], axis=1))
        words = [len(np.concatenate(circles)), len(faces), 0, *np.concatenate(circles).reshape(-1).tolist()]
        words += [word for face in faces for word in face]
        ends = RNG.choice([" ", "\n", "\t\n "], len(words))
        ends[0] = " "
        text = "OFF\n" + "".join(f"{word!r}{end}" for word, end in zip(words, ends, strict=True))
        wanted = sum(count / 2 * np.sin(2 * np.pi / count) for count in corners)
        assert area(loaded(tmp_path, "a.off", text.replace(" 0 ", " 0\n", 1))) == pytest.approx(wanted)


def test_concave_polygons(tmp_path):
    assert area(loaded(tmp_path, "a.off", f"OFF\n5 1 0\n{SQUARE}0 0 0\n5 0 1 2 3 4\n")) == 3
    assert area(loaded(tmp_path, "b.off", f"OFF\n5 1 0\n{SQUARE}0 0 0\n5\n1 2\n4 3 0\n")) == 3


@pytest.mark.parametrize(("content", "wanted", "note"), [
    (f"COFF\n4 1 0\n{rows(CORNERS, four([1, 0.5, 0, 1]))}4 0 1 2 3\n", [255, 127.5, 0], None),
    (f"COFF\n4 1 0\n{rows(CORNERS, ORANGE)}4 0 1 2 3\n", [255, 128, 0], None),
    (f"COFF\n4 1 0\n{rows(CORNERS, four([255, 128, 0, 255]))}".replace("\n", " ", 3) + "4 0 1\n2 3", [255, 128, 0],
     None),
    (f"OFF\n4 1 0\n{rows(CORNERS, ORANGE)}4 0 1 2 3\n", [255, 128, 0], None),
    (f"CNOFF\n4 1 0\n{rows(CORNERS, UP, four([1, 0, 0, 0.5]))}4 0 1 2 3\n", [255, 0, 0], "in part transparent"),
    (f"STCN4OFF\n4 1 0\n{rows(CORNERS, four(1), UP, RED, four([0, 1]))}4 0 1 2 3\n", [255, 0, 0], None),
    (PLAIN.replace("2 3\n", "2 3 255 128 0\n"), [255, 128, 0], None),
    (PLAIN.replace("2 3\n", "2 3 1.0 0.5 0 1\n"), [255, 127.5, 0], None),
    (f"OFF\n4 2 0\n{SQUARE}{TRIANGLES.format(' 255 0 0', ' 0 255 0')}", [[[255, 0, 0]], [[0, 255, 0]]], None),
    (f"OFF\n4 2 0\n{SQUARE}{TRIANGLES.format(' 255 0 0', '')}", [[[255, 0, 0]], [[255, 255, 255]]], None),
    (f"OFF\n4 2 0\n{SQUARE}{TRIANGLES.format(' 1.0 0 0', ' 0 1.0 0 1')}", [[[255, 0, 0]], [[0, 255, 0]]], None),
    (f"COFF\n4 1 0\n{rows(CORNERS, ORANGE)}4 0 1 2 3 255 0 0\n", [255, 128, 0], "colours of its faces are left out"),
    (f"COFF\n4 1 0\n{rows(CORNERS, four([300, 128, -5]))}4 0 1 2 3\n", [255, 128, 0], "clamped to 0 to 255"),
])  # fmt: skip
def test_colours(tmp_path, content, wanted, note):
    mesh = loaded(tmp_path, "a.off", content)
    assert colors(mesh) == pytest.approx(np.broadcast_to(linear(wanted), (2, 3, 3)), abs=1e-6)
    assert [note in each for each in mesh.notes] == ([True] if note else [])
    assert np.array_equal(triangles(mesh)[0], CORNERS[:3])


def test_normals_and_texture_coordinates(tmp_path):
    uv = CORNERS[:, :2] / 2
    mesh = loaded(tmp_path, "a.off", f"STNOFF\n4 1 0\n{rows(CORNERS, UP, uv)}4 0 1 2 3\n")
    assert np.array_equal(mesh.normals, UP)
    mesh = loaded(tmp_path, "a.off", f"STCOFF\n4 1 0\n{rows(CORNERS, RED, uv)}4 0 1 2 3\n")
    assert np.array_equal(mesh.paint.uv, uv)


@pytest.mark.parametrize(("content", "note"), [
    (f"OFF\n4 2 0\n{SQUARE}{TRIANGLES.format(' 5', '')}", "numbers of a colour map"),
    (PLAIN + "9 9\n", "2 numbers after its end"),
    (f"OFF\n4 1 0\n{rows(CORNERS, UP)}4 0 1 2 3\n", "3 numbers at each vertex are left out"),
    (PLAIN.replace("4 1", "4 2") + "2 0 1\n", "fewer than three corners"),
])  # fmt: skip
def test_notes(tmp_path, content, note):
    mesh = loaded(tmp_path, "a.off", content)
    assert (area(mesh), len(mesh.notes), note in mesh.notes[0]) == (4, 1, True)


@pytest.mark.parametrize(("content", "words"), [
    ("nOFF\n3\n" + PLAIN[4:], "any number of dimensions"),
    (b"OFF BINARY\n" + bytes(80), "a binary OFF"),
    ("PLY\n" + PLAIN, "it is no OFF file"),
    ("NC" + PLAIN, "its keyword is 'NCOFF', but OFF's has ST, C, N, 4 and n in this order"),
    ("OFF\n4\n", "does not say how many vertices"),
    (PLAIN.replace("4 1 0", "-4 1 0"), "ends too early"),
    (PLAIN.replace("3\n", ""), "ends too early, or holds more"),
    (PLAIN.replace("4 0 1", "-4 0 1"), "its numbers do not fit"),
    (PLAIN.replace("1 2 3", "1 2 4"), "face 0 names vertex 4"),
    (PLAIN.replace("1 2 3", "2 1 3"), "face 0 is a polygon of 4 corners that crosses itself"),
    (PLAIN.replace("1 2 3", "1 2 x"), "line 7: 'x' is no number"),
    (PLAIN.replace("1 2 3", "1 2 2.5"), "not whole"),
    (f"4OFF\n4 1 0\n{rows(CORNERS, [[1], [0], [1], [1]])}4 0 1 2 3\n", "vertex 1 has w = 0"),
    (f"COFF\n4 1 0\n{rows(CORNERS, four([np.nan, 0, 0]))}4 0 1 2 3\n", "a colour is not finite"),
])  # fmt: skip
def test_broken_files_are_refused(tmp_path, content, words):
    with pytest.raises(InputError, match=words):
        loaded(tmp_path, "a.off", content)
