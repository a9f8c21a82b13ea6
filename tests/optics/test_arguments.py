"""Arguments of views, cameras and displays that mean nothing: each is refused in a sentence that names it."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import is_refused

import lfssao
from lfssao import Camera, WorldToImage

CAMERA = Camera("perspective", (1.0, 2.0, 5.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 2.0, 1.0, 9.0)
DISPLAY = lfssao.find_display("sample-a").with_resolution(40, 24)
CONVEX = lfssao.find_display("convex").with_resolution(40, 24)
WORLD = np.eye(3, 4)
BOX = np.array([[-1.0, -2.0, -3.0], [4.0, 2.0, 1.0]])
VIEW = DISPLAY.view(0, WORLD)
MASKED = np.ma.array(np.ones((4, 3)), mask=np.eye(4, 3))

NO_GUARDS = [np.nan, -1, 1e30, 1.5, 4097, True, "2", None, [1]]
NO_SIZES = [np.nan, 0, -1, 1.5, 64.0, 1e30, 10**30, True, "64", None, [64]]
NO_MODULES = [np.nan, -1, 21, 1.5, "0", None, True]
NO_NUMBERS = [np.nan, "1", None, True, [1.0]]
NO_POINTS = ["here", None, MASKED, np.ones((4, 2)), [[1, 2, 3], [1]], 1.0, np.ones(3, bool)]


def module(**changes):
    return replace(DISPLAY, modules=(replace(DISPLAY.modules[0], **changes),))


WRONG = [
    *((lambda bad=bad: CAMERA.view(64, 48, bad), "guard is .*, it must be a whole number") for bad in NO_GUARDS),
    *((lambda bad=bad: DISPLAY.view(0, WORLD, bad), "guard is .*, it must be a whole") for bad in NO_GUARDS),
    *((lambda bad=bad: CONVEX.view(0, WORLD, bad), "guard is .*, it must be a whole") for bad in NO_GUARDS),
    *((lambda bad=bad: DISPLAY.module_numbers(0, bad), "guard is .*, it must be a whole") for bad in NO_GUARDS),
    *((lambda bad=bad: replace(VIEW, guard=bad), "guard is .*, it must be a whole") for bad in NO_GUARDS),
    *((lambda bad=bad: CAMERA.view(bad, 48), "width is .*, it must be a whole number from 1") for bad in NO_SIZES),
    *((lambda bad=bad: CAMERA.view(64, bad), "height is .*, it must be a whole number from 1") for bad in NO_SIZES),
    *((lambda bad=bad: replace(VIEW, width=bad), "width is .*, it must be a whole") for bad in NO_SIZES),
    *((lambda bad=bad: DISPLAY.with_resolution(bad, 24), "width is .*, it must be a whole") for bad in NO_SIZES),
    *((lambda bad=bad: DISPLAY.with_resolution(40, bad), "height is .*, it must be a whole") for bad in NO_SIZES),
    *((lambda bad=bad: module(width=bad), r"modules\[0\].resolution: width is") for bad in NO_SIZES),
    *((lambda bad=bad: DISPLAY.view(bad, WORLD), "module is .*, it must be a whole number from 0 to 20")
      for bad in NO_MODULES),
    *((lambda bad=bad: DISPLAY.module_numbers(bad), "module is") for bad in NO_MODULES),
    *((lambda bad=bad: DISPLAY.texel_ray(bad, 1.0, 1.0), "module is") for bad in NO_MODULES),
    *((lambda bad=bad: DISPLAY.physical_to_image(bad, np.zeros(3)), "module is") for bad in NO_MODULES),
    *((lambda bad=bad: DISPLAY.view(0, bad), "physical_from_world ") for bad in (
        np.nan * WORLD, "map", None, MASKED.T, 0 * WORLD, np.eye(4),
    )),
    *((lambda bad=bad: DISPLAY.physical_to_image(0, bad), "points ") for bad in NO_POINTS),
    *((lambda bad=bad: VIEW.world_to_image(bad), "points ") for bad in NO_POINTS),
    *((lambda u=u, v=v: DISPLAY.texel_ray(0, u, v), words) for u, v, words in [
        ("left", 1.0, "u is 'left'"), (1.0, None, "v is None"), (np.ones(2), np.ones(3), "u and v have shapes"),
        (MASKED, 1.0, "u is a masked array"),
    ]),
    # Mappings
    *((lambda bad=bad: WorldToImage(bad, np.zeros(16)), "kind is") for bad in (np.nan, -1, 3, "matrix", None)),
    *((lambda bad=bad: WorldToImage(1, bad), "numbers ") for bad in (np.zeros(3), "M", None, np.zeros(44), MASKED)),
    *((lambda bad=bad: WorldToImage.matrix(bad), "M is") for bad in (MASKED, np.nan * np.eye(4), "M", None)),
    # Cameras
    *((lambda bad=bad, n=n: replace(CAMERA, **{n: bad}), f"camera: {n} is") for n in ("eye", "target", "up")
      for bad in ("here", None, (0, 0), (0, "0", 1), (0, 0, np.nan), 1.0, MASKED[0])),
    *((lambda bad=bad, n=n: replace(CAMERA, **{n: bad}), f"camera: {n} is") for n in ("extent", "near", "far")
      for bad in NO_NUMBERS),
    (lambda: replace(CAMERA, projection=["perspective"]), "there is no camera"),
    *((lambda bad=bad: Camera.placed(BOX, fov=bad), "fov is") for bad in (np.nan, "wide", [40.0], 0, 180)),
    (lambda: Camera.placed(BOX, eye=(0.0, 9.0)), "eye is"),
    (lambda: Camera.placed(BOX, up="up"), "up is"),
    *((lambda bad=bad: Camera.looking_at(bad), "box is") for bad in (BOX[::-1], "box", np.nan * BOX, None)),
    # Displays
    *((lambda bad=bad, n=n: replace(DISPLAY, **{n: bad}), f"display sample-a: {key}: it is") for n, key in [
        ("screen_width", "screen.width"), ("screen_height", "screen.height"), ("screen_curvature", "screen.radius"),
        ("observer_z", "observer.distance"), ("observer_height", "observer.height"),
        ("observer_curvature", "observer.radius"),
    ] for bad in NO_NUMBERS),
    *((lambda bad=bad, n=n: module(**{n: bad}), rf"modules\[0\].{n}: it is") for n in (
        "x", "y", "z", "yaw", "pitch", "roll", "k1", "k2",
    ) for bad in NO_NUMBERS),
    *((lambda bad=bad: module(field_of_view=bad), "field_of_view: it is") for bad in (np.nan, "wide", True, [40])),
    *((lambda bad=bad: module(homography=bad), "homography: homography is") for bad in ("H", (1, 2), 9 * ["1"])),
    (lambda: replace(DISPLAY, modules=("left", "right")), r"modules\[0\] is of type str"),
    (lambda: replace(DISPLAY, modules=2), "modules is of type int"),
    *((lambda bad=bad: replace(DISPLAY, roi=bad), "display sample-a: roi") for bad in (
        "box", None, ((0, 0, 0), (1, 1)), ((0, 0, "0"), (1, 1, 1)), 5,
    )),
    (lambda: replace(DISPLAY, diffuser=["linear"]), "diffuser: there is no diffuser"),
    *((lambda bad=bad: lfssao.fit_roi(bad, DISPLAY.roi), "world_box is") for bad in (
        BOX[::-1], np.ma.array(BOX, mask=BOX > 3), np.nan * BOX, "box",
    )),
    (lambda: lfssao.fit_roi(BOX, BOX[::-1]), "physical_box is .*, its first corner must be the lower one"),
    *((lambda bad=bad: lfssao.parse_display(bad, "x"), "text is of type") for bad in (None, 5, b"name")),
    (lambda: lfssao.display_text(["c80"]), "there is no display"),
]  # fmt: skip


@pytest.mark.parametrize(("call", "words"), WRONG, ids=[words for _, words in WRONG])
def test_what_means_nothing_is_refused(call, words):
    assert is_refused(call, words)


def test_what_is_right_in_another_type_is_taken():
    """NumPy's whole numbers, arrays as places, and points where no image is."""
    for one in (np.int64(2), np.uint8(2), np.array(2)):
        view = CAMERA.view(one * 4, one * 3, one)
        assert (view.width, view.height, view.guard) == (12, 10, 2)
        assert DISPLAY.view(one, WORLD).name == "module_002"
        assert DISPLAY.with_resolution(one, one).modules[0].width == 2
    placed = Camera.placed(BOX, eye=np.array([9.0, 3.0, 7.0]), target=[1, 0, -1], up=None)
    assert placed.view(8, 6).world_to_image([1, 0, -1])[:2] == pytest.approx([4, 3])
    assert np.isnan(DISPLAY.physical_to_image(0, [np.nan, 0, 0])[0]).all()
    flat = np.array([[-1.0, -2.0, 1.0], [4.0, 2.0, 1.0]])  # a box without depth is one
    assert lfssao.fit_roi(flat, DISPLAY.roi).shape == (3, 4)
    assert CAMERA.view(64, 48, 4096).width == 64 + 2 * 4096
