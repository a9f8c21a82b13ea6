"""Views and mappings: numbers that float32 cannot hold are refused, and distances from the viewers."""

import numpy as np
import pytest

from lfssao import Camera, InputError, WorldToImage, find_display
from lfssao.optics.kernels.projection import MATRIX
from lfssao.optics.view import check_positions

CAMERA = Camera("perspective", (1.0, 2.0, 5.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 2.0, 1.0, 9.0)


@pytest.mark.parametrize("factor", [1e39, 1e-41])
def test_mappings_beyond_float32_are_refused(factor):
    mapping = WorldToImage(MATRIX, factor * np.eye(4).ravel())
    assert mapping.as_type(np.float64).numbers[0] == factor
    with pytest.raises(InputError, match="leaves the range of float32: scale the world"):
        mapping.as_type(np.float32)


def test_numbers_are_rounded_once():
    mapping = CAMERA.view(40, 30).world_to_image
    assert (mapping.as_type(np.float32).numbers == mapping.numbers.astype(np.float32)).all()


def test_distances_from_the_viewers():
    """A camera's are along its axis; a module's count from the observers' line."""
    a, b, c, d = CAMERA.view(40, 30).viewer_distance()
    assert d + a * 1.0 + b * 2.0 + c * 5.0 == pytest.approx(0.0, abs=1e-12)  # the eye
    assert d == pytest.approx(np.sqrt(30.0))  # the target, at 0
    display = find_display("virtual").with_resolution(8, 6)
    scale = 0.25
    a, b, c, d = display.view(0, np.diag([scale, scale, -scale, 1.0])[:3]).viewer_distance()
    assert (a, b) == (0.0, 0.0)
    assert d + c * (-display.observer_z / scale) == pytest.approx(0.0, abs=1e-12)
    assert d == pytest.approx(-display.observer_z / scale)


def test_scenes_too_far_from_the_origin_are_refused():
    box = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
    check_positions(box + 2.0**22, texels_per_unit=1.0)
    with pytest.raises(InputError, match=r"the scene is 1 large and reaches 8.*e\+06 from the world's origin"):
        check_positions(box + 2.0**23, texels_per_unit=1.0)
