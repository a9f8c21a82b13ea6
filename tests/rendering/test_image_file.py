"""Image files that are refused: damaged, of other formats, with headers that claim too much."""

import zlib

import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import Image

from lfssao.errors import InputError
from lfssao.rendering.image_file import read_image_file


def test_npy_files_are_checked_before_they_are_read(tmp_path):
    def refused(words):
        with pytest.raises(InputError, match=words):
            read_image_file(tmp_path / "a.npy")

    np.save(tmp_path / "a.npy", np.ones((3, 4), np.float32))
    data = (tmp_path / "a.npy").read_bytes()
    (tmp_path / "a.npy").write_bytes(data[:-1])
    refused("is damaged")
    (tmp_path / "a.npy").write_bytes(data.replace(b"(3, 4)", b"(30000, 40000)"))
    refused("is damaged|cannot be read")
    np.save(tmp_path / "a.npy", np.array([{}], object), allow_pickle=True)
    refused("holds object")
    np.save(tmp_path / "a.npy", np.ones((1, 2, 3, 4)))
    refused(r"expected numbers of shape \(H, W\)")
    (tmp_path / "a.npy").write_bytes(b"\x93NUMPY")
    refused("cannot be read as an NPY file")


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
