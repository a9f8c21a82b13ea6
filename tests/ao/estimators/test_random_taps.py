"""Refusals of Unity's SSAO; ``test_engines`` judges its numbers against GLSL."""

import numpy as np
import pytest

from lfssao import Camera, builtin_scene, find_display, module_views
from lfssao.ao.estimators.registry import estimate
from lfssao.ao.textures import Buffers
from lfssao.errors import InputError


def empty(view):
    shape = view.height, view.width
    normals = np.ones((*shape, 3), np.float32)
    return Buffers(view, np.zeros(shape, np.float32), np.zeros((*shape, 3), np.float32), normals, None)


@pytest.mark.parametrize(("name", "options", "words"), [
    ("unity-urp", {"tile": 3}, "unity-urp measures distances along a camera's axis"),
])  # fmt: skip
def test_shaders_of_cameras_are_refused_on_displays(name, options, words):
    view = module_views(builtin_scene("corner"), find_display("sample-a").with_resolution(4, 3), range(4, 5))[0]
    with pytest.raises(InputError, match=words):
        estimate(name, empty(view), 1.0, **options)


def test_a_tile_of_noise_that_the_texture_does_not_hold_is_refused():
    view = Camera.looking_at(builtin_scene("corner").bounds).view(40, 30)
    with pytest.raises(InputError, match="texture of 40x30 texels does not hold a tile of 31x31: --parameter tile=N"):
        estimate("unity-urp", empty(view), 1.0, tile=31)
