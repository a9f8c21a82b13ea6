"""EXR files: every bit kept, read back by OpenImageIO alone; what cannot be written is refused whole."""

import os

import exr_twin
import numpy as np
import OpenImageIO as oiio
import pytest
from exr_parts import by_channel, read_parts
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as st_numpy

from lfssao.errors import InputError
from lfssao.exr import read_exr, write_exr
from lfssao.exr_file import Part
from lfssao.kernels import exr_chunks, exr_lines

ODD = np.array(
    [np.inf, -np.inf, 0.0, -0.0, 1e-45, -1e-40, 3.4028235e38, 1.1754942e-38, 1 / 3, 1 + 2**-23], np.float32
)  # infinities, zeros, subnormals, the largest number, and ones that half floats lose


def bits(array):
    return np.ascontiguousarray(array, np.float32).view(np.uint32)


def pixels(height, width, channels):
    return np.resize(ODD, height * width * channels).reshape(height, width, channels)


def parts_of():
    return [
        Part("shaded", ("R", "G", "B"), pixels(3, 4, 3), {"depth": "metres"}),
        Part("depth", ("Z",), pixels(3, 4, 1)),
        Part("positions", ("P.X", "P.Y", "P.Z"), pixels(3, 4, 3)[::-1]),
        Part("color", ("color.R", "color.G", "color.B"), pixels(3, 4, 3)),
        Part("ao_1", ("ao_1.AO",), pixels(3, 4, 1), {"radius": 0.25}),
    ]


@pytest.fixture(params=[0, 1], ids=["OpenEXR in C++", "OpenEXR in C"])
def reader(request):
    """Both of OpenEXR's readers: they share little."""
    before = oiio.get_int_attribute("openexr:core")
    oiio.attribute("openexr:core", request.param)
    yield
    oiio.attribute("openexr:core", before)


def independent(path):
    """Part name -> channel name -> (H, W) array, by OpenImageIO alone."""
    parts = read_parts(path)
    assert all(pixels.dtype == np.float32 for _, pixels in parts)
    return {spec["name"]: by_channel(spec, pixels) for spec, pixels in parts}


@pytest.mark.usefixtures("reader")
def test_every_bit_and_name_is_kept(tmp_path):
    write_exr(tmp_path / "a.exr", parts_of())
    found = independent(tmp_path / "a.exr")
    assert list(found) == ["shaded", "depth", "positions", "color", "ao_1"]
    for part in parts_of():
        assert set(found[part.name]) == set(part.channels)
        for k, channel in enumerate(part.channels):
            assert np.array_equal(bits(found[part.name][channel]), bits(part.pixels[..., k])), channel


def test_read_exr_gives_parts_back(tmp_path):
    write_exr(tmp_path / "a.exr", parts_of())
    found = read_exr(tmp_path / "a.exr")
    assert found["shaded"].attributes == {"depth": "metres"}
    assert found["ao_1"].attributes == {"radius": 0.25}
    for part in parts_of():
        order = [found[part.name].channels.index(channel) for channel in part.channels]
        assert np.array_equal(bits(found[part.name].pixels[..., order]), bits(part.pixels))


def test_equal_parts_make_equal_files(tmp_path):
    for name in ("a.exr", "b.exr"):
        write_exr(tmp_path / name, parts_of())
    assert (tmp_path / "a.exr").read_bytes() == (tmp_path / "b.exr").read_bytes()


def test_file_is_lossless_float(tmp_path):
    write_exr(tmp_path / "a.exr", parts_of())
    spec = oiio.ImageInput.open(str(tmp_path / "a.exr")).spec()
    assert (spec["compression"], str(spec.format)) == ("zip", "float")


@given(
    pixels=st_numpy.arrays(np.uint32, st.tuples(st.integers(1, 5), st.integers(1, 4), st.integers(1, 4))),
    data=st.data(),
)
def test_lines_are_those_of_the_twin(pixels, data):
    height, width, channels = pixels.shape
    order = data.draw(st.permutations(range(channels)))
    first = data.draw(st.integers(0, height - 1))
    words = np.empty((height - first) * width * channels, np.uint32)
    packed = np.empty(4 * words.size, np.uint8)
    exr_lines.gather_lines(pixels[first:].reshape(-1), width, np.argsort(order), words)
    halves = words.astype("<u4").view("<u2")
    exr_lines.split_and_difference(halves, packed)
    stored = exr_twin.lines_as_stored(pixels.tolist(), order, first, height - first)
    assert halves.tobytes() == stored
    assert packed.tobytes() == exr_twin.before_deflate(stored)


@pytest.mark.parametrize("order", [(0,), (1, 0), (0, 1, 2), (2, 0, 1), (2, 1, 0), (1, 3, 0, 2)], ids=str)
@pytest.mark.parametrize("width", [1, 2, 3, 15, 16, 17, 63, 64, 65, 200])
def test_lines_as_wide_as_vectors_are_those_of_the_twin(order, width):
    """What the step of three channels, and vectors with what is left behind them, make of random bits, -0 and NaN."""
    channels = len(order)
    pixels = np.random.default_rng(width).integers(0, 2**32, (3, width, channels), np.uint32)
    pixels[1, width // 3 :] = bits(np.float32(-0.0))
    pixels[2, : width // 2] = 0xFFC00001  # a NaN
    words = np.full(pixels.size + 64, 0xA5A5A5A5, np.uint32)
    exr_lines.gather_lines(pixels.reshape(-1), width, np.argsort(order), words[: pixels.size])
    assert (words[pixels.size :] == 0xA5A5A5A5).all()
    packed = np.empty(4 * pixels.size, np.uint8)
    exr_lines.split_and_difference(words[: pixels.size].astype("<u4").view("<u2"), packed)
    stored = exr_twin.lines_as_stored(pixels.tolist(), order, 0, 3)
    assert words[: pixels.size].astype("<u4").tobytes() == stored
    assert packed.tobytes() == exr_twin.before_deflate(stored)


@pytest.mark.usefixtures("reader")
@pytest.mark.parametrize("height", [1, 15, 16, 17, 48, 50])
def test_any_number_of_lines_and_what_deflate_makes_longer(tmp_path, height):
    """Random bits are stored as they are, constants in a few bytes; chunks are of 16 lines."""
    rng = np.random.default_rng(height)
    noise = rng.integers(0, 2**32, (height, 7, 2), np.uint32).view(np.float32)
    parts = [
        Part("noise", ("b.X", "a.X"), noise),
        Part("one channel", ("Y",), noise[..., :1]),
        Part("flat", ("Y",), np.full((height, 7, 1), np.inf, np.float32)),
    ]
    write_exr(tmp_path / "a.exr", parts)
    found = independent(tmp_path / "a.exr")
    for part in parts:
        for k, channel in enumerate(part.channels):
            assert np.array_equal(bits(found[part.name][channel]), bits(part.pixels[..., k]))


@pytest.mark.usefixtures("reader")
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


def test_the_version_says_whether_names_are_long(tmp_path):
    """Bit 10, and bit 12 for several parts; not every reader looks."""
    for length, flags in ((31, 0x1000), (32, 0x1400)):
        write_exr(tmp_path / "a.exr", [Part("p", ("x" * length,), pixels(1, 1, 1))])
        assert int.from_bytes((tmp_path / "a.exr").read_bytes()[4:8], "little") == 2 | flags


def test_the_table_of_offsets_is_right(tmp_path):
    """Readers mend a wrong table without a word: here it is walked by hand."""
    path = tmp_path / "a.exr"
    write_exr(path, [Part(name, ("Z",), pixels(33, 4, 1), guard=1) for name in ("a", "b")])
    data = path.read_bytes()
    places = [k for k in range(len(data)) if data[k : k + 8] == b"\0\0\0\0\xff\xff\xff\xff"]  # part 0, line -1
    table = np.frombuffer(data, "<u8", 6, places[0] - 48)
    assert table[0] == places[0]
    for k, offset in enumerate(table.tolist()):
        part, line, size = np.frombuffer(data, "<i4", 3, offset).tolist()
        assert (part, line) == (k // 3, 16 * (k % 3) - 1)
        assert offset + 12 + size == (table[k + 1] if k < 5 else len(data))


@pytest.mark.parametrize(
    ("part", "words"),
    [
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
        (Part("a", ("Z",), np.broadcast_to(np.float32(0), (1, 2**25, 1))), "too many for OpenEXR"),
    ],
)
def test_what_would_change_bits_is_refused(tmp_path, part, words):
    good = Part("depth", ("Z",), np.zeros((2, 2, 1), np.float32))
    with pytest.raises(InputError, match=words):
        write_exr(tmp_path / "a.exr", [good, part])
    assert list(tmp_path.iterdir()) == []


def fail_at(monkeypatch, module, name, after):
    """Let a function raise a disk's error once it was called so often."""
    calls = []
    real = getattr(module, name)

    def fail(*arguments):
        calls.append(name)
        if len(calls) > after:
            raise OSError(5, "Input/output error")
        return real(*arguments)

    monkeypatch.setattr(module, name, fail)


def test_parts_of_several_display_windows_are_refused(tmp_path):
    """OpenEXR's reader in C++ does not open them."""
    parts = [Part("a", ("Z",), pixels(8, 9, 1), guard=2), Part("b", ("Z",), pixels(4, 6, 1))]
    with pytest.raises(InputError, match="display windows differ: 5x4, 6x4"):
        write_exr(tmp_path / "a.exr", parts)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("module", "name", "after"), [(exr_chunks, "write_chunks", 0), (exr_chunks, "write_chunks", 1), (os, "fsync", 0)]
)
def test_failing_write_leaves_the_old_file_alone(tmp_path, monkeypatch, module, name, after):
    path = tmp_path / "a.exr"
    path.write_bytes(b"old")
    fail_at(monkeypatch, module, name, after)
    with pytest.raises(InputError, match=r"a\.exr: it cannot be written \(Input/output error\)"):
        write_exr(path, parts_of())
    assert [file.name for file in tmp_path.iterdir()] == ["a.exr"]
    assert path.read_bytes() == b"old"


def test_folder_that_is_not_there(tmp_path):
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
    for name in ("half.exr", "garbage.exr"):
        with pytest.raises(InputError, match=f"{name}: .*cannot be read"):
            read_exr(tmp_path / name)


def test_other_formats_are_not_exr(tmp_path):
    from PIL import Image

    Image.new("RGB", (2, 2)).save(tmp_path / "a.png")
    with pytest.raises(InputError, match="of format png, not an EXR file"):
        read_exr(tmp_path / "a.png")
