"""Algorithm 2 with neighbours: the reference, bit for bit; no neighbours are Algorithm 2; what a second module sees."""

from dataclasses import replace

import analytic_scenes as scenes
import numpy as np
import pytest
from bits import assert_same_bits
from hypothesis import given
from hypothesis import strategies as st
from oracle_scenes import in_distances
from reference.passes import algorithm2_with_neighbours
from ssao_cases import both, module_cases

from lfssao import RayCaster, estimate, find_display, make_samples, module_views
from lfssao.ao import ssao
from lfssao.ao.estimators import neighbours
from lfssao.errors import InputError
from lfssao.optics.view import KINDS, WorldToImage


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


def assert_equals_reference(depth, positions, mapping, others, samples, radius):
    """Occlusion and the number of samples outside; others: the mapping and depth texture of each neighbour."""
    actual = neighbours.algorithm2_with_neighbours(depth, positions, mapping, others, samples, radius)
    views = [(texture, KINDS[m.kind], m.numbers.astype(depth.dtype)) for m, texture in [(mapping, depth), *others]]
    occlusion, outside = algorithm2_with_neighbours(depth, positions, (radius * samples).astype(depth.dtype), views)
    assert_same_bits(actual.texture, occlusion)
    assert actual.outside == outside.sum()
    return actual


@both
@given(data=st.data())
def test_neighbours_equal_the_reference(dtype, data):
    assert_equals_reference(*data.draw(neighbourhoods(dtype)))


@both
@pytest.mark.parametrize("name", ["convex", "picoarray"])
def test_neighbours_of_any_display_equal_the_reference(statue, dtype, name):
    display = find_display(name).with_resolution(40, 24)
    chosen = range(len(display.modules) // 2, len(display.modules) // 2 + 3)
    views = module_views(statue, display, chosen)
    caster = RayCaster(statue, views[0].cast_from_world)
    depths = [caster.gbuffer(view).depth.astype(dtype) for view in views]
    depths[1] = np.ascontiguousarray(depths[1][:20, :30])  # where what falls beyond is outside
    own = depths[0], caster.gbuffer(views[0]).positions.astype(dtype), views[0].world_to_image
    samples = make_samples("random", 5, 4)
    radius = 0.5
    others = [(view.world_to_image, depth) for view, depth in zip(views[1:], depths[1:], strict=True)]
    together = assert_equals_reference(*own, others, samples, radius)
    assert together.outside > 0
    assert (ssao.algorithm2(*own, samples, radius).texture > together.texture).any()


def card_before_a_wall(index):
    """Textures that a module of sample-a has of a card, |x| < 2 cm at z = -0.2, before a wall at z = 0.2."""
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
    alone = ssao.algorithm2(depth, positions, mapping, samples, 0.1).texture
    together = neighbours.algorithm2_with_neighbours(depth, positions, mapping, others, samples, 0.1).texture
    wall = positions[..., 2] == np.float32(0.2)
    assert (alone[wall] > 0).any()  # a halo round the card
    assert not together[wall].any()  # 40 cm before the wall nothing is solid
    np.testing.assert_array_equal(together <= alone, True)


def test_the_estimator_asks_the_neighbours_of_its_buffers():
    """A camera's depth may be distances along its axis, which are no image z."""
    rng = np.random.default_rng(3)
    samples = make_samples("latin", 8)
    seen = in_distances(scenes.buffers("sphere on a plane", scenes.SIGHTS["perspective"](20, 15), np.float32))
    mapping = seen.view.world_to_image
    depth = seen.view.image_z(seen.depth)
    others = [(mapping, (depth + 0.05 * rng.normal(size=depth.shape)).astype(np.float32)), (mapping, depth[:9])]
    for asked in ([], others):
        expected = neighbours.algorithm2_with_neighbours(depth, seen.positions, mapping, asked, samples, 0.4)
        made = estimate("lf-neighbours", replace(seen, neighbours=asked), 0.4, samples)
        assert_same_bits(made.texture, expected.texture)
        assert made.outside == expected.outside
    assert (made.texture < ssao.algorithm2(depth, seen.positions, mapping, samples, 0.4).texture).any()


def test_more_texels_than_numbers_of_32_bits_are_refused():
    mapping = find_display("virtual").view(0, np.eye(3, 4)).world_to_image
    depth = np.zeros((3, 4), np.float32)
    positions = np.zeros((3, 4, 3), np.float32)
    others = [(mapping, np.broadcast_to(np.float32(0), (2**15, 2**15)))] * 2
    with pytest.raises(InputError, match="3 modules have 2147483660 texels"):
        neighbours.algorithm2_with_neighbours(depth, positions, mapping, others, np.ones((1, 3)), 1.0)


def test_textures_that_do_not_fit_each_other_are_refused():
    mapping, depth, positions = card_before_a_wall(10)
    samples = np.ones((1, 3))
    for changed, words in (
        ((depth, positions[1:], mapping, []), "positions: .*, expected"),
        ((depth[0], positions, mapping, []), "depth has shape"),
        ((depth, positions, None, []), "world_to_image is"),
        ((depth, positions, mapping, [(mapping, depth.astype(np.float64))]), "depth of neighbour 0 is of float64"),
    ):
        with pytest.raises(InputError, match=words):
            neighbours.algorithm2_with_neighbours(*changed, samples, 0.1)


@both
def test_texels_without_a_surface_have_no_samples_wherever_they_are_said_to_be(dtype):
    """Positions mean nothing where depth is infinite: renderers may leave there what was there before."""
    mapping, depth, positions = card_before_a_wall(10)
    depth = depth.astype(dtype)
    positions = positions.astype(dtype)
    depth[::2], depth[:, 60:66] = np.inf, np.inf
    samples = make_samples("latin", 8)
    expected = ssao.algorithm2(depth, positions, mapping, samples, 0.1)
    actual = neighbours.algorithm2_with_neighbours(depth, positions, mapping, [(mapping, depth)], samples, 0.1)
    assert_same_bits(actual.texture, expected.texture)
    assert actual.outside == expected.outside > 0
