"""EXR files: every bit kept, read back by OpenImageIO alone; what cannot be written is refused whole."""

import numpy as np
import OpenImageIO as oiio
import pytest

from lfssao.errors import InputError
from lfssao.exr import Part, read_exr, write_exr

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


def independent(path):
    """Part name -> channel name -> (H, W) array, by OpenImageIO alone."""
    source = oiio.ImageInput.open(str(path))
    assert source is not None, oiio.geterror()
    found = {}
    while source.seek_subimage(len(found), 0):
        spec = source.spec()
        data = source.read_image(len(found), 0, 0, spec.nchannels, oiio.UNKNOWN)
        assert data.dtype == np.float32
        found[spec["name"]] = {name: data[..., k] for k, name in enumerate(spec.channelnames)}
    source.close()
    return found


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


@pytest.mark.parametrize(
    ("part", "words"),
    [
        (Part("a", ("R",), np.zeros((2, 2, 1), np.float64)), "part a is of float64, expected float32"),
        (Part("a", ("R", "G"), np.zeros((2, 2, 1), np.float32)), r"expected \(H, W, 2\)"),
        (Part("a", ("R",), np.zeros((2, 2), np.float32)), r"has shape \(2, 2\)"),
        (Part("a", ("R",), np.zeros((0, 2, 1), np.float32)), r"has shape \(0, 2, 1\)"),
        (Part("depth", ("Z",), np.zeros((2, 2, 1), np.float32)), "names must differ"),
    ],
)
def test_what_would_change_bits_is_refused(tmp_path, part, words):
    good = Part("depth", ("Z",), np.zeros((2, 2, 1), np.float32))
    with pytest.raises(InputError, match=words):
        write_exr(tmp_path / "a.exr", [good, part])
    assert list(tmp_path.iterdir()) == []


def refuse_writing(monkeypatch, method, after):
    """Make OpenImageIO's n-th call of a method return False."""
    calls = []
    real = getattr(oiio.ImageOutput, method)

    def fail(output, *arguments):
        calls.append(method)
        return real(output, *arguments) if len(calls) <= after else False

    monkeypatch.setattr(oiio.ImageOutput, method, fail)


@pytest.mark.parametrize(("method", "after"), [("open", 0), ("open", 2), ("write_image", 0), ("write_image", 3)])
def test_failing_write_leaves_the_old_file_alone(tmp_path, monkeypatch, method, after):
    path = tmp_path / "a.exr"
    path.write_bytes(b"old")
    refuse_writing(monkeypatch, method, after)
    with pytest.raises(InputError, match=r"a\.exr: it cannot be written \(.+\)"):
        write_exr(path, parts_of())
    assert [file.name for file in tmp_path.iterdir()] == ["a.exr"]
    assert path.read_bytes() == b"old"


def test_failing_close_is_noticed(tmp_path, monkeypatch):
    refuse_writing(monkeypatch, "close", 0)
    with pytest.raises(InputError, match="cannot be written"):
        write_exr(tmp_path / "a.exr", parts_of())
    assert list(tmp_path.iterdir()) == []


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
