"""The algorithms as the paper prints them, and the kernels that run: the same bits."""

import numpy as np
import pytest
from bits import assert_same_bits

import lfssao
from lfssao import reference
from lfssao.samples import texel_turns
from lfssao.samples.kernels import ball

SCENE = lfssao.builtin_scene("ammonite")
SAMPLES = lfssao.make_samples("latin", 5, seed=3)
RADIUS = 0.05


def seen_by(display, index):
    (view,) = lfssao.module_views(SCENE, lfssao.find_display(display).with_resolution(22, 16), range(index, index + 1))
    return view, lfssao.RayCaster(SCENE, view.cast_from_world).gbuffer(view)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize(("display", "index"), [("sample-a", 4), ("convex", 2), ("picoarray", 30)])
def test_algorithm2(display, index, dtype):
    view, seen = seen_by(display, index)
    given = seen.depth.astype(dtype), seen.positions.astype(dtype), view.world_to_image, SAMPLES, RADIUS
    for turns in (None, texel_turns("ign", 16, 22, 0, np.dtype(dtype))):
        expected = reference.algorithm2(*given, turns)
        assert 0 < expected.max() <= 1
        assert_same_bits(lfssao.algorithm2(*given, turns).texture, expected)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_algorithm1(projection, dtype):
    view = lfssao.Camera.looking_at(SCENE.bounds, projection).view(22, 16)
    depth = lfssao.RayCaster(SCENE, view.cast_from_world).gbuffer(view).depth.astype(dtype)
    given = depth, view.screen_to_world, view.world_to_image.numbers.reshape(4, 4), SAMPLES, RADIUS
    for turns in (None, texel_turns("ign", 16, 22, 0, np.dtype(dtype))):
        expected = reference.algorithm1(*given, turns)
        assert 0 < expected.max() <= 1
        assert_same_bits(lfssao.algorithm1(*given, turns).texture, expected)


def test_algorithms_3_and_4():
    numbers = np.random.default_rng(1).random((200, 5))
    for xi1, xi2, t, r_min, r_max in numbers * [2, 2, 1, 0.5, 0.5] + [-1, -1, 0, 0, 0.5]:
        point = reference.algorithm3(xi1, xi2)
        assert point == ball.algorithm3(xi1, xi2)
        assert reference.algorithm4(point, t, r_min, r_max) == ball.algorithm4(*point, t, r_min, r_max)
    assert reference.algorithm4((0.0, 0.0, 1.0), 0.5, 0.0, 0.0) == ball.algorithm4(0.0, 0.0, 1.0, 0.5, 0.0, 0.0)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_merge_blur_and_shade(dtype):
    rng = np.random.default_rng(2)
    layers = rng.random((3, 9, 11)).astype(dtype)
    rgb = rng.random((9, 11, 3)).astype(dtype)
    merged = reference.merge(layers)
    assert_same_bits(lfssao.merge(layers), merged)
    for sigma in (0.0, 0.4, 1.0, 2.5):
        blurred = reference.blur(merged, sigma)
        assert_same_bits(lfssao.blur(merged, sigma), np.ascontiguousarray(blurred))
        assert_same_bits(lfssao.shade(rgb, lfssao.blur(merged, sigma)), reference.shade(rgb, blurred))
