"""Views and mappings: numbers that float32 cannot hold are refused; mappings of one's own."""

from dataclasses import replace

import numpy as np
import pytest

from lfssao import Camera, InputError, Module, WorldToImage, find_display
from lfssao.optics import lens as optics
from lfssao.optics.kernels.projection import MATRIX
from lfssao.optics.view import check_positions

CAMERA = Camera("perspective", (1.0, 2.0, 5.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 2.0, 1.0, 9.0)


@pytest.mark.parametrize("factor", [1e39, 1e-41])
def test_mappings_beyond_float32_are_refused(factor):
    mapping = WorldToImage(MATRIX, factor * np.eye(4).ravel())
    assert mapping.as_type(np.float64).numbers[0] == factor
    with pytest.raises(InputError, match="leaves the range of float32: scale the world"):
        mapping.as_type(np.float32)


def test_scenes_too_far_from_the_origin_are_refused():
    box = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
    check_positions(box + 2.0**22, texels_per_unit=1.0)
    with pytest.raises(InputError, match=r"the scene is 1 large and reaches 8.*e\+06 from the world's origin"):
        check_positions(box + 2.0**23, texels_per_unit=1.0)


# Mappings of one's own

WORLD = np.array([[0.5, 0.1, 0.0, -0.1], [-0.1, 0.45, 0.05, 0.01], [0.0, 0.1, -0.6, 0.05]])
SAMPLE, CONVEX = find_display("sample-a"), find_display("convex")
CALIBRATED = Module(0.3, 0.05, 0.7, 32, 24, homography=(32.5, 0.6, 16.2, -0.4, -31.2, 12.3, 0.02, -0.03, 1.0), k1=-0.06)
DISPLAYS = {
    "crossed slits": SAMPLE,
    "curved": CONVEX,
    "conical": replace(SAMPLE, diffuser="conical"),
    "calibrated": replace(SAMPLE, modules=(CALIBRATED,)),
}


def bits(mapping):
    return mapping.kind, mapping.numbers.tobytes()


def own_mapping(display, module):
    """A module's mapping by the arguments that a display's numbers are, not by ``Display.view``."""
    w, h, z_o, y_o = display.screen_width, display.screen_height, display.observer_z, display.observer_height
    width, height = module.width, module.height
    if display is SAMPLE:
        x, y, z = WORLD - [[0, 0, 0, module.x], [0, 0, 0, y_o], [0, 0, 0, 0]]
        rows = [module.z * (width / w) * x, z_o * (-height / h) * y, z]
        offsets = width / 2 + width / w * module.x, height / 2 - height / h * y_o
        return WorldToImage.crossed_slits(rows, module.z, z_o, *offsets)
    homography = module.homography or optics.aligned_homography((w, h), (width, height))
    bent = {"screen_curvature": display.screen_curvature, "observer_curvature": display.observer_curvature}
    radial = {"c_u": width / 2, "c_v": height / 2, "unit": width / 2, "k1": module.k1, "k2": module.k2}
    place = {"m_x": module.x, "m_y": module.y, "m_z": module.z, "y_o": y_o, "z_o": z_o, "diffuser": display.diffuser}
    return WorldToImage.display(WORLD, **place, homography=homography, **bent, **radial)


@pytest.mark.parametrize("name", DISPLAYS)
def test_a_mapping_of_ones_own_has_the_bits_of_the_displays(name):
    display = DISPLAYS[name]
    index = len(display.modules) // 3
    assert bits(own_mapping(display, display.modules[index])) == bits(display.view(index, WORLD).world_to_image)


@pytest.mark.parametrize("name", [*DISPLAYS, "camera"])
def test_a_mapping_is_printed_as_the_call_that_makes_it(name):
    """Its lines break between arguments, and no number loses a digit."""
    mapping = (CAMERA.view(40, 30) if name == "camera" else DISPLAYS[name].view(0, 1e-5 * WORLD)).world_to_image
    assert max(map(len, repr(mapping).splitlines())) < 120
    assert bits(eval(repr(mapping), {"WorldToImage": WorldToImage})) == bits(mapping)


@pytest.mark.parametrize("name", ["sample-a", "convex"])
def test_the_viewers_distance_is_the_physical_z_from_the_observers_in_world_units(name):
    """One map takes a world four times as large as the display, turned about x, to physical space."""
    display = find_display(name)
    view = display.view(0, np.array([[0.25, 0, 0, 0], [0, 0, 0.25, 0.1], [0, -0.25, 0, 0.2]]))
    a, b, c, d = view.viewer_distance()
    for x, y, z in ((0.0, 0.0, 0.0), (1.0, 2.0, -3.0)):
        physical = -0.25 * y + 0.2
        assert a * x + b * y + c * z + d == pytest.approx(4 * (physical - display.observer_z))
