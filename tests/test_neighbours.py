"""Algorithm 2 with neighbours: its twin, bit for bit; no neighbours are Algorithm 2; what a second module sees."""

import neighbours_twin
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_ssao import assert_same_bits, both, module_cases

from lfssao import find_display, fit_roi, passes
from lfssao.errors import InputError
from lfssao.view import WorldToImage

BOX = np.array([[-1.0, -0.75, -1.0], [1.0, 0.75, 1.0]])


@st.composite
def neighbourhoods(draw, dtype):
    """A module's textures and up to three depth textures of other sizes, seen through its mapping or another's."""
    depth, positions, mapping, samples, radius = draw(module_cases(dtype))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    others = []
    for _ in range(draw(st.integers(0, 3))):
        shape = tuple(rng.integers(1, 12, 2))
        numbers = mapping.numbers * (1 + 0.01 * rng.standard_normal(16))
        texture = (np.nan_to_num(depth, posinf=0.0).mean() + 0.05 * rng.standard_normal(shape)).astype(dtype)
        texture[rng.random(shape) < 0.2] = np.inf
        others.append((WorldToImage(mapping.kind, numbers), texture))
    return depth, positions, mapping, others, samples, radius


@both
@given(data=st.data())
def test_neighbours_equal_their_twin(dtype, data):
    depth, positions, mapping, others, samples, radius = data.draw(neighbourhoods(dtype))
    actual = passes.algorithm2_with_neighbours(depth, positions, mapping, others, samples, radius)
    views = [(texture, m.kind, m.numbers.astype(dtype)) for m, texture in [(mapping, depth), *others]]
    occlusion, outside = neighbours_twin.share_hidden(depth, positions, (radius * samples).astype(dtype), views)
    assert_same_bits(actual.texture, occlusion)
    assert actual.outside == outside.sum()


@both
@given(data=st.data())
def test_without_neighbours_it_is_algorithm_2(dtype, data):
    depth, positions, mapping, samples, radius = data.draw(module_cases(dtype))
    actual = passes.algorithm2_with_neighbours(depth, positions, mapping, [], samples, radius)
    expected = passes.algorithm2(depth, positions, mapping, samples, radius)
    assert_same_bits(actual.texture, expected.texture)
    assert actual.outside == expected.outside


def card_before_a_wall(index):
    """What a module of sample-a sees of a card, |x| < 2 cm at z = -0.2, before a wall at z = 0.2; by its own rays."""
    display = find_display("sample-a").with_resolution(200, 120)
    view = display.view(index, np.eye(3, 4))
    v, u = np.mgrid[:120, :200] + 0.5
    origin, direction, _ = display.texel_ray(index, u.ravel(), v.ravel())
    near, far = (origin + z * direction for z in (-0.2, 0.2))
    card = np.abs(near[:, 0]) < 0.02
    points = np.where(card[:, None], near, far).reshape(120, 200, 3)
    return view.world_to_image, points[..., 2].astype(np.float32), points.astype(np.float32)


def test_a_neighbour_sees_behind_a_card():
    """Samples beside the wall's point that the card hides from one module lie in the open for one beside it."""
    mapping, depth, positions = card_before_a_wall(10)
    others = [card_before_a_wall(k)[:2] for k in (7, 13)]
    samples = np.array([[0.0, 0.0, -1.0], [0.5, 0.0, -0.5], [-0.5, 0.0, -0.5]])
    alone = passes.algorithm2(depth, positions, mapping, samples, 0.1).texture
    together = passes.algorithm2_with_neighbours(depth, positions, mapping, others, samples, 0.1).texture
    wall = positions[..., 2] == np.float32(0.2)
    assert (alone[wall] > 0).any()  # a halo round the card
    assert not together[wall].any()  # 40 cm before the wall nothing is solid
    np.testing.assert_array_equal(together <= alone, True)


def test_a_sample_that_only_a_neighbour_can_tell_counts():
    """Outside the module's own texture, in the neighbour's: behind its surface."""
    mapping = find_display("virtual").with_resolution(1, 1).view(0, np.eye(3, 4)).world_to_image
    wide = find_display("virtual").with_resolution(40, 30).view(0, np.eye(3, 4)).world_to_image
    depth, positions = np.zeros((1, 1), np.float32), np.zeros((1, 1, 3), np.float32)
    shifted = WorldToImage(mapping.kind, mapping.numbers + np.eye(1, 16, 14)[0] * 5)  # 5 texels to the right: outside
    samples = np.array([[0.0, 0.0, 0.1]])
    assert passes.algorithm2(depth, positions, shifted, samples, 1.0).outside == 1
    for z, hidden in ((0.05, 1.0), (0.2, 0.0)):
        other = wide, np.full((30, 40), z, np.float32)
        found = passes.algorithm2_with_neighbours(depth, positions, shifted, [other], samples, 1.0)
        assert (float(found.texture[0, 0]), found.outside) == (hidden, 0)


def test_a_neighbour_of_another_dtype_is_refused():
    world = fit_roi(BOX, find_display("virtual").roi)
    mapping = find_display("virtual").view(0, world).world_to_image
    depth, positions = np.zeros((3, 4), np.float32), np.zeros((3, 4, 3), np.float32)
    for other in (np.zeros((3, 4)), np.zeros((0, 4), np.float32)):
        with pytest.raises(InputError, match="neighbour 1"):
            passes.algorithm2_with_neighbours(depth, positions, mapping, [(mapping, other)], np.ones((1, 3)), 1.0)
