"""Images of diffuse colours: of 8 and of 16 bits, each decoded once."""

import numpy as np
import OpenImageIO as oiio
import pytest
from mesh_files import linear
from PIL import Image

from lfssao.errors import InputError
from lfssao.scene.images import read_image

RNG = np.random.default_rng(31)
NAMES = {1: ("Y",), 2: ("Y", "A"), 3: ("R", "G", "B"), 4: ("R", "G", "B", "A")}


def written(path, codes, **attributes):
    """An image file of whole numbers, by OpenImageIO."""
    spec = oiio.ImageSpec(codes.shape[1], codes.shape[0], codes.shape[2], str(codes.dtype))
    spec.channelnames = NAMES[codes.shape[2]]
    if codes.shape[2] in (2, 4):
        spec.alpha_channel = codes.shape[2] - 1
        spec.attribute("oiio:UnassociatedAlpha", 1)
    for name, value in attributes.items():
        spec.attribute(name, value)
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), spec), output.geterror()
    assert output.write_image(codes)
    output.close()
    return path


@pytest.mark.parametrize("bits", [8, 16])
@pytest.mark.parametrize(("name", "channels", "attributes"), [
    *(("a.png", channels, {}) for channels in NAMES),
    *(("a.tif", channels, {"compression": how}) for channels in (1, 3, 4) for how in ("none", "zip", "lzw")),
    ("a.tif", 3, {"compression": "none", "tiff:bigendian": 1}), ("a.tif", 1, {"planarconfig": "separate"}),
])  # fmt: skip
def test_every_bit_of_whole_numbers_is_kept(tmp_path, bits, name, channels, attributes):
    codes = RNG.integers(0, 2**bits, (5, 7, channels), dtype=f"uint{bits}")
    wanted = np.repeat(codes[..., :1], 3, axis=2) if channels < 3 else codes[..., :3]
    read = read_image(written(tmp_path / name, codes, **attributes))
    assert read.dtype == np.float32
    assert read == pytest.approx(linear(wanted, 2**bits - 1), abs=1e-7)


def test_interlaced_images_and_palettes(tmp_path):
    codes = RNG.integers(0, 256, (9, 9, 3), dtype=np.uint8)
    Image.fromarray(codes).quantize(256).save(tmp_path / "a.png")
    assert read_image(tmp_path / "a.png") == pytest.approx(linear(codes), abs=1e-7)


def test_pixels_that_pillow_gives_in_part_are_refused(tmp_path):
    codes = RNG.integers(0, 65536, (5, 7, 3), dtype=np.uint16)
    separate = written(tmp_path / "a.tif", codes, planarconfig="separate")
    (tmp_path / "a.ppm").write_bytes(b"P6 7 5 65535\n" + codes.astype(">u2").tobytes())
    Image.fromarray(RNG.random((3, 3)).astype(np.float32)).save(tmp_path / "b.tif")
    for path, words in (
        (separate, "of a TIFF's planes of more than 8 bits"),
        (tmp_path / "a.ppm", "of a PPM's pixels of more than 8 bits"),
        (tmp_path / "b.tif", "pixels of mode F have no known range"),
    ):
        with pytest.raises(InputError, match=words):
            read_image(path)
    (tmp_path / "a.ppm").write_bytes(b"P6 7 5 255\n" + (codes >> 8).astype(np.uint8).tobytes())
    assert read_image(tmp_path / "a.ppm") == pytest.approx(linear(codes >> 8), abs=1e-7)
