"""Images as they are seen: Orientation, windows, arrays of channels, sizes that are not decoded."""

import numpy as np
import OpenImageIO as oiio
import pytest
from exr_parts import write_parts
from PIL import Image, ImageOps

from lfssao import InputError
from lfssao.files.exr import read_exr
from lfssao.files.image_file import guard_of, read_image_file
from lfssao.samples.noise_file import read_noise

PIXELS = np.arange(12, dtype=np.float32).reshape(3, 4)
# As each Orientation stores the picture: where its row 0 and its column 0 are seen (TIFF 6).
STORED = {
    1: PIXELS,
    2: PIXELS[:, ::-1],
    3: PIXELS[::-1, ::-1],
    4: PIXELS[::-1],
    5: PIXELS.T,
    6: PIXELS.T[::-1],
    7: PIXELS.T[::-1, ::-1],
    8: PIXELS.T[:, ::-1],
}


def written(path, pixels, kind="float", window=(0, 0), display=None, **attributes):
    """An image of one channel whose data window begins at ``window``, in a display window x, y, width, height."""
    spec = oiio.ImageSpec(*pixels.shape[::-1], 1, kind)
    spec.x, spec.y = window
    if display is not None:
        spec.full_x, spec.full_y, spec.full_width, spec.full_height = display
    for name, value in attributes.items():
        spec.attribute(name, value)
    write_parts(path, [(spec, np.ascontiguousarray(pixels)[..., None])])
    return path


@pytest.mark.parametrize("orientation", STORED)
@pytest.mark.parametrize(("ending", "kind", "scale"), [
    ("tif", "float", 1), ("exr", "half", 1), ("exr", "float", 1),
    ("png", "uint16", 1 / 65535), ("png", "uint8", 1 / 255),
])  # fmt: skip
def test_row_0_is_the_upper_one_by_any_orientation(tmp_path, orientation, ending, kind, scale):
    stored = np.float32(STORED[orientation] * scale)
    path = written(tmp_path / f"a.{ending}", stored, kind, Orientation=orientation)
    (part,) = read_image_file(path)
    assert np.array_equal(part.planes[0], PIXELS)
    if ending == "png":
        assert np.array_equal(np.array(ImageOps.exif_transpose(Image.open(path))), PIXELS)
    assert read_image_file(path, sizes=[(4, 3)])[0].planes[0].max() == 11
    assert read_image_file(path, sizes=[(3, 4)])[0].planes[0].max() == 0


def test_an_orientation_that_there_is_not_is_refused(tmp_path):
    path = written(tmp_path / "a.exr", PIXELS, Orientation=9)
    with pytest.raises(InputError, match="its Orientation is 9, expected 1 to 8"):
        read_image_file(path)


@pytest.mark.parametrize(("window", "display", "margins"), [
    ((0, 0), (0, 0, 4, 3), (0, 0, 0, 0)),
    ((-5, -5), (-5, -5, 4, 3), (0, 0, 0, 0)),
    ((7, 2), (7, 2, 4, 3), (0, 0, 0, 0)),
    ((-1, -1), (0, 0, 2, 1), (1, 1, 1, 1)),
    ((9, 9), (10, 10, 2, 1), (1, 1, 1, 1)),
    ((0, 0), (0, 0, 6, 5), (0, 0, -2, -2)),
    ((2, 1), (0, 0, 6, 4), (-2, -1, 0, 0)),
    ((-2, -1), (0, 0, 1, 1), (2, 1, 1, 1)),
])  # fmt: skip
@pytest.mark.parametrize("kind", ["float", "half"])
def test_a_data_window_is_the_display_window_or_a_guard_band_larger_or_refused(
    tmp_path, window, display, margins, kind
):
    path = written(tmp_path / "a.exr", PIXELS, kind, window, display)
    (part,) = read_image_file(path)
    assert part.margins == margins
    if len(set(margins)) == 1:
        assert guard_of(margins) == read_exr(path)[""].guard == margins[0]
    else:
        with pytest.raises(InputError, match=rf"display window by {', '.join(map(str, margins))} texels"):
            read_exr(path)


def test_margins_turn_with_the_image(tmp_path):
    path = written(tmp_path / "a.exr", STORED[6], "float", (-2, -1), (0, 0, 1, 1), Orientation=6)
    left, above, right, below = 2, 1, 0, 2  # as they are stored: 3x4 texels about 1
    assert read_image_file(path)[0].margins == (below, left, above, right)


@pytest.mark.parametrize("ending", ["tif", "exr"])
def test_a_cropped_image_of_another_format_has_margins_too(tmp_path, ending):
    (part,) = read_image_file(written(tmp_path / f"a.{ending}", PIXELS, "float", (5, 2), (0, 0, 20, 30)))
    assert part.margins == (-5, -2, -11, -25)


@pytest.mark.parametrize(("shape", "sizes", "channels", "size"), [
    ((1, 9, 8), None, 1, (8, 9)), ((3, 9, 8), None, 3, (8, 9)), ((3, 9, 3), None, 3, (9, 3)),
    ((3, 9, 8), [(8, 9)], 3, (8, 9)), ((3, 4, 8), [(4, 3)], 8, (4, 3)), ((4, 3, 4), [(4, 3)], 4, (4, 3)),
])  # fmt: skip
def test_an_array_may_have_its_channels_first(tmp_path, shape, sizes, channels, size):
    array = np.arange(np.prod(shape)).reshape(shape)
    np.save(tmp_path / "a.npy", array)
    (part,) = read_image_file(tmp_path / "a.npy", sizes=sizes)
    assert (len(part.planes), part.planes[0].shape[::-1]) == (channels, size)
    first = array[0] if shape[0] == channels and shape[:2] != size[::-1] else array[..., 0]
    assert np.array_equal(part.planes[0], first)


def test_texels_of_another_size_than_expected_are_not_decoded(tmp_path):
    """A file cut behind its header is told by its size alone."""
    path = written(tmp_path / "a.exr", np.zeros((300, 200), np.float32), compression="none")
    path.write_bytes(path.read_bytes()[:-100_000])
    (part,) = read_image_file(path, sizes=[(4, 3)])
    assert (part.planes[0].shape, part.planes[0].strides) == ((300, 200), (0, 0))
    with pytest.raises(InputError, match="cannot be read"):
        read_image_file(path, sizes=[(200, 300)])
    with pytest.raises(InputError, match="it has 200x300 texels, textures with guard have 4x3"):
        read_noise(path, False, [(4, 3)])


def test_a_damaged_tiff_is_told_in_the_words_of_the_first_error(tmp_path):
    path = written(tmp_path / "a.tif", np.random.default_rng(1).random((64, 64), np.float32), compression="none")
    path.write_bytes(path.read_bytes()[:3000] + path.read_bytes()[-400:])
    source = oiio.ImageInput.open(str(path))
    if source is None:
        words = oiio.geterror()
    else:
        assert source.read_image(0, 0, 0, 1, "float") is None
        words = source.geterror()
    with pytest.raises(InputError) as refused:
        read_image_file(path)
    assert words.split("\n")[0] in str(refused.value)
    assert "seek to subimage" not in str(refused.value)
