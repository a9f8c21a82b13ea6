"""EXR files: every bit kept, read back by OpenImageIO alone; what cannot be written is refused whole."""

from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from exr_parts import by_channel, read_parts
from PIL import Image

from lfssao.errors import InputError
from lfssao.files.exr import Part, is_sealed, read_exr, write_exr

ODD = np.array(
    [np.inf, -np.inf, 0.0, -0.0, 1e-45, -1e-40, 3.4028235e38, 1.1754942e-38, 1 / 3, 1 + 2**-23], np.float32
)  # infinities, zeros, subnormals, the largest number, and ones that half floats lose


def bits(array):
    return np.ascontiguousarray(array, np.float32).view(np.uint32)


def pixels(height, width, channels):
    return np.resize(ODD, height * width * channels).reshape(height, width, channels)


def parts_of(height=3):
    """Odd numbers, random bits and a constant, in channels whose order is not that of their names."""
    noise = np.random.default_rng(height).integers(0, 2**32, (height, 4, 2), np.uint32).view(np.float32)
    return [
        Part("shaded", ("R", "G", "B"), pixels(height, 4, 3), {"depth": "metres"}),
        Part("depth", ("Z",), pixels(height, 4, 1)),
        Part("positions", ("P.X", "P.Y", "P.Z"), pixels(height, 4, 3)[::-1]),
        Part("noise", ("b.X", "a.X"), noise),
        Part("one channel", ("Y",), noise[..., :1]),
        Part("flat", ("Y",), np.full((height, 4, 1), np.inf, np.float32), {"radius": 0.25}, compression="rle"),
    ]


@pytest.mark.parametrize("height", [1, 15, 16, 17, 48, 50])  # chunks are of 16 lines
def test_every_bit_and_name_is_kept(tmp_path, height):
    """By OpenImageIO alone, and by read_exr."""
    write_exr(tmp_path / "a.exr", parts_of(height))
    alone = read_parts(tmp_path / "a.exr")
    ours = read_exr(tmp_path / "a.exr")
    assert [spec["name"] for spec, _ in alone] == list(ours) == [part.name for part in parts_of()]
    for part, (spec, found) in zip(parts_of(height), alone, strict=True):
        assert (found.dtype, spec["compression"]) == (np.float32, part.compression)
        channels = by_channel(spec, found)
        again = ours[part.name]
        assert set(channels) == set(part.channels) == set(again.channels)
        assert again.attributes == part.attributes
        for k, name in enumerate(part.channels):
            assert np.array_equal(bits(channels[name]), bits(part.pixels[..., k])), name
            assert np.array_equal(bits(again.pixels[..., again.channels.index(name)]), bits(part.pixels[..., k])), name


def test_windows_long_names_and_attributes_are_read_as_written(tmp_path):
    long = "a channel whose name has more than thirty-one letters, \u03b1"
    attributes = {"text": "\u03b2 = 1", "whole": -(2**31), "part": 0.5}
    write_exr(tmp_path / "a.exr", [Part("p", (long,), pixels(20, 9, 1), attributes, guard=3)])
    source = oiio.ImageInput.open(str(tmp_path / "a.exr"))
    spec = source.spec()
    assert spec.channelnames == (long,)
    assert (spec.x, spec.y, spec.width, spec.height) == (-3, -3, 9, 20)
    assert (spec.full_x, spec.full_y, spec.full_width, spec.full_height) == (0, 0, 3, 14)
    assert {name: spec[f"lfssao:{name}"] for name in attributes} == attributes
    assert np.array_equal(bits(source.read_image(0, 0, 0, 1, oiio.FLOAT)), bits(pixels(20, 9, 1)))
    assert source.close()


def some_parts():
    """Parts of one file, one with a guard band and numbers that EXR rounds."""
    attributes = {"text": "\u03b2 = 1", "whole": -(2**31), "part": 0.1}
    return [
        Part("shaded", ("R", "G", "B"), pixels(5, 4, 3), {"said": "here"}),
        Part("depth", ("Z",), pixels(9, 8, 1), attributes, guard=2),
        Part("sum", ("b.X", "a.X"), pixels(7, 6, 2), {"part": 0.25}, guard=1),
    ]


@pytest.mark.parametrize(("part", "words"), [
    (Part("a", ("R",), np.zeros((2, 2, 1), np.float64)), "part a is of float64, expected float32"),
    (Part("a", ("R", "G"), np.zeros((2, 2, 1), np.float32)), r"expected \(H, W, 2\)"),
    (Part("a", ("R",), np.zeros((2, 2), np.float32)), r"has shape \(2, 2\)"),
    (Part("a", ("R",), np.zeros((0, 2, 1), np.float32)), r"has shape \(0, 2, 1\)"),
    (Part("depth", ("Z",), np.zeros((2, 2, 1), np.float32)), "names must differ"),
    (Part("a", ("Z", "Z"), np.zeros((2, 2, 2), np.float32)), "two channels of one name: Z, Z"),
    (Part("a", ("",), np.zeros((2, 2, 1), np.float32)), "'' is no name"),
    (Part("a", ("x" * 256,), np.zeros((2, 2, 1), np.float32)), "'x+' is no name"),
    (Part("a", ("a\0b",), np.zeros((2, 2, 1), np.float32)), "is no name"),
    (Part("a", ("Z",), np.zeros((2, 2, 1), np.float32), {"n": 2**31}), "attribute n is 2147483648, beyond 32 bits"),
    # OpenEXR's reader in C++ does not open parts of several display windows.
    (Part("a", ("Z",), np.zeros((8, 9, 1), np.float32), guard=2), "display windows differ: 2x2, 5x4"),
])  # fmt: skip
def test_what_would_change_bits_is_refused(tmp_path, part, words):
    good = Part("depth", ("Z",), np.zeros((2, 2, 1), np.float32))
    with pytest.raises(InputError, match=words):
        write_exr(tmp_path / "a.exr", [good, part])
    assert list(tmp_path.iterdir()) == []


def cut(data, lost):
    return data[: len(data) - lost]


def without_table(data, number):
    """A file of ``parts_of()`` with zeros for a number of its chunk tables: five of one chunk, one of three."""
    place = data.rindex(b"scanlineimage\0\0") + len("scanlineimage..") + 8 * number
    return data[:place] + bytes(8) + data[place + 8 :]


@pytest.mark.parametrize(("damage", "argument"), [
    *((cut, lost) for lost in (1, 100, 2000)), *((without_table, number) for number in range(8)),
])  # fmt: skip
def test_what_is_lost_while_the_file_is_closed_is_missed(tmp_path, monkeypatch, damage, argument):
    """As OpenEXR loses it on a full disk, without an error."""
    real = oiio.ImageOutput.create

    class Losing:
        def __init__(self, name):
            self.output = real(name)

        def __getattr__(self, name):
            return getattr(self.output, name)

        def open(self, path, *more):
            self.path = Path(path)
            return self.output.open(path, *more)

        def close(self):
            assert self.output.close()
            data = damage(self.path.read_bytes(), argument)
            self.path.write_bytes(data)
            return True

    monkeypatch.setattr(oiio.ImageOutput, "create", Losing)
    with pytest.raises(InputError, match=r"a\.exr: it cannot be written \("):
        write_exr(tmp_path / "a.exr", parts_of())
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("count", [3, 1])
def test_a_sealed_file_has_the_same_bytes_again_and_no_other_bit(tmp_path, count):
    path = tmp_path / "a.exr"
    made = []
    for _ in range(2):
        write_exr(path, some_parts()[:count], sealed=True)
        made.append(path.read_bytes())
    data = made[0]
    assert made[1] == data
    assert is_sealed(path)
    random = np.random.default_rng(7)
    headers = data.rindex(b"screenWindowWidth")
    for place in [*range(headers), *random.integers(headers, len(data), 200)]:
        path.write_bytes(data[:place] + bytes([data[place] ^ 1 << random.integers(8)]) + data[place + 1 :])
        assert not is_sealed(path), place
    write_exr(path, some_parts()[:count])
    assert not is_sealed(path)


def test_a_line_that_openimageio_does_not_read_and_a_missing_folder_are_refused(tmp_path):
    with pytest.raises(InputError, match="1048577x1 exceeds"):
        write_exr(tmp_path / "a.exr", [Part("a", ("Z",), np.zeros((1, 2**20 + 1, 1), np.float32))])
    with pytest.raises(InputError, match="cannot be written"):
        write_exr(tmp_path / "no" / "a.exr", parts_of())
    assert list(tmp_path.iterdir()) == []


def test_unreadable_files_are_refused(tmp_path):
    with pytest.raises(InputError, match="there is no such file"):
        read_exr(tmp_path / "a.exr")
    write_exr(tmp_path / "a.exr", parts_of())
    whole = (tmp_path / "a.exr").read_bytes()
    (tmp_path / "half.exr").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "garbage.exr").write_bytes(b"garbage" * 99)
    Image.new("RGB", (2, 2)).save(tmp_path / "a.png")
    damaged = "cannot be read"
    for name, words in (("half.exr", damaged), ("garbage.exr", damaged), ("a.png", "of format png, not an EXR file")):
        with pytest.raises(InputError, match=f"{name}: .*{words}"):
            read_exr(tmp_path / name)
