"""Angles from texel to texel: their range, the spectrum of the blue noise, what is refused."""

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reference import dither

from lfssao.errors import InputError
from lfssao.samples import ROTATIONS, angle_turns, texel_angles


@pytest.mark.parametrize("name", ROTATIONS)
@pytest.mark.parametrize("size", [(1, 1), (3, 70), (130, 65)])
def test_every_rotation_gives_every_texel_an_angle(name, size):
    angles = texel_angles(name, *size)
    assert angles.shape == size
    assert angles.dtype == np.float64
    assert angles.min() >= 0
    assert angles.max() < 2
    tile = ROTATIONS[name].tile
    if tile is not None:
        whole = texel_angles(name, 2 * tile, tile)
        np.testing.assert_array_equal(whole[:tile], whole[tile:])
        np.testing.assert_array_equal(angles[:tile, :tile], whole[: size[0], : size[1]][:tile, :tile])
    angles[:] = 5  # a texture of one's own
    assert texel_angles(name, *size).max() < 2


def test_the_blue_noise_tile_is_the_references():
    ranks = texel_angles("blue-noise", 64, 64) * 2048 - 0.5
    np.testing.assert_array_equal(ranks, dither.blue_noise())


@pytest.mark.parametrize(("arguments", "words"), [
    (("hsh", 4, 4), "did you mean 'hash'"), (("none", 0, 4), "height is 0"), (("none", 4, -1), "width is -1"),
])  # fmt: skip
def test_what_is_refused(arguments, words):
    with pytest.raises(InputError, match=words):
        texel_angles(*arguments)


@settings(max_examples=30)
@given(st.lists(st.floats(-(2.0**32), 2.0**32) | st.floats(-10, 10), min_size=1, max_size=20))
def test_cosine_and_sine_of_radians_are_those_of_all_their_digits(values):
    """Whole turns of 2 pi that float64 holds but for its last digit would be off by 1e-7 at 2**32."""
    with mpmath.workdps(60):
        want = [[float(f(mpmath.mpf(x))) for x in values] for f in (mpmath.cos, mpmath.sin)]
    made = angle_turns(np.array([values]), np.dtype(np.float64))
    np.testing.assert_allclose(made[:, 0], want, rtol=0, atol=1e-15)
    single = angle_turns(np.array([values]), np.dtype(np.float32))
    np.testing.assert_array_equal(single, made.astype(np.float32))


@pytest.mark.parametrize("radians", [
    [[0.0]], np.zeros(3), np.zeros((2, 2, 1)), np.zeros((2, 2), np.float16), np.array([[1, 2]]),
    np.array([[0.0, np.nan]]), np.array([[np.inf]]), np.array([[-(2.0**32) * 1.001]]),
])  # fmt: skip
def test_angles_that_are_none_are_refused(radians):
    with pytest.raises(InputError, match="rotation: an"):
        angle_turns(radians, np.dtype(np.float32))
