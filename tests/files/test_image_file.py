"""Image files that are refused: damaged, of other formats, with headers that claim too much."""

import struct
import zlib

import numpy as np
import OpenImageIO as oiio
import pytest
from exr_parts import write_tiled
from PIL import Image

from lfssao.errors import InputError
from lfssao.files import image_file
from lfssao.files.image_file import read_image_file


@pytest.mark.parametrize(("shape", "names"), [
    ((1,), "Y"), ((3,), "Y"), ((2, 3), "Y"), ((2, 3, 3), "RGB"), ((2, 3, 4), "RGBA"),
    ((2, 3, 2), ("channel0", "channel1")),
])  # fmt: skip
def test_an_arrays_channels_are_named_by_their_number(tmp_path, shape, names):
    np.save(tmp_path / "a.npy", np.ones(shape))
    assert read_image_file(tmp_path / "a.npy")[0].channels == tuple(names)


@pytest.mark.parametrize("shape", [(), (1, 2, 3, 4), (0,), (2, 0), (0, 2, 3)])
def test_an_array_of_no_texels_or_of_other_dimensions_is_refused(tmp_path, shape):
    np.save(tmp_path / "a.npy", np.ones(shape))
    with pytest.raises(InputError, match=r"expected numbers \(H, W\) or \(H, W, C\)"):
        read_image_file(tmp_path / "a.npy")


def test_deep_images_and_other_formats_are_refused(tmp_path):
    Image.new("RGB", (4, 4)).save(tmp_path / "a.bmp")
    with pytest.raises(InputError, match="of format bmp, not EXR, TIFF, PNG or NPY"):
        read_image_file(tmp_path / "a.bmp")
    spec = oiio.ImageSpec(4, 4, 1, "float")
    spec.deep = True
    data = oiio.DeepData()
    data.init(16, 1, oiio.TypeFloat, ("Z",))
    file = oiio.ImageOutput.create(str(tmp_path / "deep.exr"))
    assert file.open(str(tmp_path / "deep.exr"), spec)
    assert file.write_deep_image(data)
    file.close()
    with pytest.raises(InputError, match="deep image"):
        read_image_file(tmp_path / "deep.exr")


def test_sizes_that_the_format_believes_are_refused_by_the_files_own(tmp_path):
    """OpenEXR looks at its table of chunks; of a PNG OpenImageIO believes what is not enormous."""
    Image.new("RGB", (4, 4)).save(tmp_path / "a.png")
    data = bytearray((tmp_path / "a.png").read_bytes())
    data[16:24] = (10_000).to_bytes(4, "big") * 2
    data[29:33] = zlib.crc32(data[12:29]).to_bytes(4, "big")
    (tmp_path / "a.png").write_bytes(data)
    with pytest.raises(InputError, match="its header claims 10000x10000 texels"):
        read_image_file(tmp_path / "a.png")


def test_a_texture_of_the_limit_is_read_and_a_byte_more_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(image_file, "_MOST_EXPANSION", 0)
    Image.new("RGB", (4, 5)).save(tmp_path / "a.png")
    monkeypatch.setattr(image_file, "_HARMLESS", 4 * 5 * 3)
    assert read_image_file(tmp_path / "a.png")[0].planes[0].shape == (5, 4)
    monkeypatch.setattr(image_file, "_HARMLESS", 4 * 5 * 3 - 1)
    with pytest.raises(InputError, match="its header claims 4x5 texels"):
        read_image_file(tmp_path / "a.png")


@pytest.mark.parametrize("ending", ["exr", "tif"])
def test_a_tile_that_is_larger_than_memory_is_refused(tmp_path, ending):
    """The reader allocates a whole tile, however small the image is."""
    path = tmp_path / f"a.{ending}"
    pixels = np.random.default_rng(1).random((15, 20, 1), np.float32)
    write_tiled(path, pixels, 16)
    (part,) = read_image_file(path)
    assert np.array_equal(part.planes[0], pixels[..., 0])
    data = path.read_bytes()
    if ending == "exr":
        before = b"tiles\0tiledesc\0" + struct.pack("<i", 9)
        small, large = (before + struct.pack("<II", size, size) for size in (16, 30_000))
    else:  # TIFF's tags 322 and 323, TileWidth and TileLength: short, one of them, padded to 4 bytes
        small, large = (
            b"".join(struct.pack("<HHIHH", tag, 3, 1, size, 0) for tag in (322, 323)) for size in (16, 30_000)
        )
    assert data.count(small) == 1
    path.write_bytes(data.replace(small, large))
    words = (
        r"a\.\w+: its header claims 20x15 texels in tiles of 30000x30000, 3\.6 GB in all; a file of \d+ bytes cannot"
    )
    with pytest.raises(InputError, match=words):
        read_image_file(path)
