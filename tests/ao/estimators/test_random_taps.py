"""Refusals of Unity's SSAO and N8AO, and N8AO's kernel; ``test_engines`` judges their numbers against GLSL."""

import numpy as np
import pytest

from lfssao import Camera, builtin_scene, find_display, module_views
from lfssao.ao.estimators.registry import estimate, find_estimator
from lfssao.ao.textures import Buffers
from lfssao.errors import InputError


def empty(view):
    shape = view.height, view.width
    normals = np.ones((*shape, 3), np.float32)
    return Buffers(view, np.zeros(shape, np.float32), np.zeros((*shape, 3), np.float32), normals, None)


@pytest.mark.parametrize(("name", "options", "words"), [
    ("unity-urp", {"tile": 3}, "unity-urp measures distances along a camera's axis"),
    ("n8ao", {}, "n8ao reads a camera's planes"),
])  # fmt: skip
def test_shaders_of_cameras_are_refused_on_displays(name, options, words):
    view = module_views(builtin_scene("corner"), find_display("sample-a").with_resolution(4, 3), range(4, 5))[0]
    with pytest.raises(InputError, match=words):
        estimate(name, empty(view), 1.0, **options)


def test_a_tile_of_noise_that_the_texture_does_not_hold_is_refused():
    view = Camera.looking_at(builtin_scene("corner").bounds).view(40, 30)
    with pytest.raises(InputError, match="texture of 40x30 texels does not hold a tile of 31x31: --parameter tile=N"):
        estimate("unity-urp", empty(view), 1.0, tile=31)


def test_n8aos_kernel_is_a_golden_spiral_of_cosine_weighted_directions():
    points, weights = find_estimator("n8ao").default_samples()
    assert weights is None
    assert np.linalg.norm(points, axis=1) == pytest.approx(1)
    assert points[:, 2] ** 2 == pytest.approx(1 - (np.arange(16) + 0.5) / 16)
    turned = np.diff(np.unwrap(np.arctan2(points[:, 1], points[:, 0]), period=2 * np.pi))
    assert turned % (2 * np.pi) == pytest.approx(2.399963)
