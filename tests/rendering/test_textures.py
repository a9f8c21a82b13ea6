"""Textures of one view: the files that they are saved to, and what layers that are left out cost."""

import numpy as np
from PIL import Image
from refusals import is_refused

import lfssao
from lfssao import Buffers, RayCaster, Settings, estimate, find_display, module_views, render_view

DISPLAY = find_display("sample-a").with_resolution(100, 60)


def test_textures_are_saved_by_the_ending(tmp_path):
    textures = lfssao.render("statue", DISPLAY, modules=[10])[0]
    textures.save(tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as picture:
        codes = np.asarray(picture)
    linear = textures.shaded.astype(np.float64)
    srgb = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    assert np.abs(codes - 255 * srgb).max() <= 0.51
    assert codes.std() > 10
    textures.save(tmp_path / "a.EXR")
    assert "shaded" in lfssao.read_exr(tmp_path / "a.EXR")
    for name in ("a.jpg", "a"):
        assert is_refused(lambda name=name: textures.save(name), "does not end in .exr or .png")
    depth = lfssao.render("statue", DISPLAY, Settings((0.1,), layers=("depth",)), [10])[0]
    assert is_refused(lambda: depth.save("a.png"), "a.png: shaded is not among the layers depth, write an .exr")
    assert is_refused(lambda: textures.save(5), "path is of type int")


def test_textures_without_colour_have_no_picture(statue):
    (view,) = module_views(statue, find_display("sample-a").with_resolution(64, 48), range(3, 4))
    made = render_view(RayCaster(statue, view.cast_from_world), view, Settings((0.1,), layers=("shaded",)))
    assert made._repr_png_() is None
    assert is_refused(lambda: made.image, "color is not among the layers shaded")
    assert is_refused(lambda: estimate("lf", Buffers.of(made.gbuffer, view), 0.1), "no positions")
