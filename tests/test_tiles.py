"""Samples decided for whole tiles: the bits of Algorithm 2, what is decided, and when it is asked."""

import numpy as np
import pytest
import test_display
import tiles_twin
import twins
from hypothesis import given, reject, settings
from hypothesis import strategies as st
from test_ssao import CROSSED_SLITS, MATRIX, assert_same_bits, both, camera_cases, module_cases, raw_cases, run1, run2

from lfssao import Camera, RayCaster, Settings, WorldToImage, builtin_scene, find_display, make_samples, passes, tiles
from lfssao.errors import InputError
from lfssao.kernels import tiled_ssao
from lfssao.kernels.mapping import DISPLAY
from lfssao.kernels.tile_images import BLOCK
from lfssao.plan import make_plan
from lfssao.rendering import diagonal, module_views, render_view
from lfssao.view_plan import ViewPlan

pytestmark = pytest.mark.usefixtures("one_thread")


def in_tiles(depth, positions, offsets, m, back=None):
    """Occlusion and outside, of eight rows each, of the kernel; of a camera's where ``back`` is its matrix.

    The mapping is of any display where it has 44 numbers.
    """
    occlusion, outside = np.full_like(depth, 9), np.full(-(-depth.shape[0] // 8), -9, np.int64)
    tiled_ssao.occlusion_in_tiles(*asked(depth, positions, offsets, m, back), occlusion, outside)
    return occlusion, outside


def asked(depth, positions, offsets, m, back=None):
    kind, bounds = CROSSED_SLITS if back is None else MATRIX, tiles.depth_bounds(depth)
    slopes = np.empty((0, 0, 0), m.dtype)
    if len(m) == 44:
        kind, slopes = DISPLAY, tiles._slopes(depth, positions, offsets, DISPLAY, m, BLOCK)
    return depth, positions, offsets, kind, np.empty(0, m.dtype) if back is None else back, m, bounds, slopes


def assert_equal(found, expected):
    assert_same_bits(found[0], expected[0])
    rows = np.arange(0, len(expected[1]), 8)
    assert found[1].tolist() == np.add.reduceat(expected[1], rows).tolist()


def smooth(rng, dtype, height, width, step=0.0):
    """A relief before a background, some of it NaN, behind the mapping u = x + 1, v = y + 1 at small z.

    ``step``: what its depths are multiples of, if of anything: samples' may then equal them.
    """
    y, x = np.mgrid[:height, :width] + 0.5
    z = rng.uniform(-0.1, 0.1) * np.sin(rng.uniform(0, 0.3) * x + rng.uniform(0, 0.3) * y)
    z = z + rng.choice([0.0, 0.0, 1e-3, 0.05]) * rng.standard_normal(z.shape)
    z = np.round(z / step) * step if step else z
    depth = z.astype(dtype)
    depth[(x - rng.uniform(0, width)) * rng.choice([-1, 1]) > 0.4 * width] = np.inf
    depth[rng.random(depth.shape) < rng.choice([0.0, 0.0, 0.02])] = rng.choice([np.nan, np.inf, -np.inf])
    positions = np.stack([x - 1, y - 1, z], axis=-1).astype(dtype)
    odd = rng.random(positions.shape) < rng.choice([0.0, 0.0, 0.003])
    positions[odd] = rng.choice([np.nan, np.inf, -np.inf, 3.0, -50.0])
    m = np.array([1e3, 0, 0, 0, 0, 1e3, 0, 0, 0, 0, 1, 0, 1e3, -1e3, 1, 1], dtype)
    m[5] = -m[5]  # v = v_0 + Y / (z_o - Z)
    return depth, positions, m


def camera(height, width, recession, dtype):
    """Matrices screen -> world and world -> screen of a camera in whose middle a texel is as large as a unit."""
    x, y = width / 2, height / 2
    back = [1, 0, 0, -x, 0, 1, 0, -y, 0, 0, 1, 0, 0, 0, -recession, 1]
    forth = [1, 0, x * recession, x, 0, 1, y * recession, y, 0, 0, 1, 0, 0, 0, recession, 1]
    return np.array(back, dtype), np.array(forth, dtype)


def plane(side):
    """Depth, positions and mapping of a plane that faces the viewers."""
    depth, positions, m = smooth(np.random.default_rng(0), np.float32, side, side)
    depth[:], positions[..., 2] = 0, 0
    return depth, positions, m


@st.composite
def smooth_cases(draw, dtype, most):
    """Surfaces of which most samples are decided, samples that leave the texture, and more of them than a chunk has."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    height, width = draw(st.sampled_from([(1, 1), (9, 17), (16, 16), (13, 30), (27, 8), (8, 9)]))
    step = draw(st.sampled_from([0.0, 1 / 64]))
    depth, positions, m = smooth(rng, dtype, height, width, step)
    n = draw(st.sampled_from([1, 5, 23, most]))
    spread = np.array([*(draw(st.sampled_from([0.3, 3, 15])),) * 2, draw(st.sampled_from([0.02, 0.3, 1500]))])
    offsets = rng.uniform(-1, 1, (n, 3)) * spread
    if step:
        offsets[:, 2] = np.round(offsets[:, 2] / step) * step
    return depth, positions, offsets.astype(dtype), m


@st.composite
def smooth_camera_cases(draw, dtype, most):
    """The same depths as a camera's."""
    depth, positions, offsets, _ = draw(smooth_cases(dtype, most))
    return depth, positions, offsets, *camera(*depth.shape, draw(st.sampled_from([0.0, 0.1, 1.5])), dtype)


@both
@given(data=st.data())
def test_the_kernel_equals_algorithm1s_twin_for_any_numbers(dtype, data):
    depth, positions, offsets, _, m, back = data.draw(raw_cases(dtype))
    assert_equal(in_tiles(depth, positions, offsets, m, back), twins.algorithm1(depth, offsets, back, m))


@both
@given(data=st.data())
def test_the_kernel_equals_algorithm1s_twin_on_smooth_surfaces(dtype, data):
    depth, positions, offsets, back, m = data.draw(smooth_camera_cases(dtype, 40))
    assert_equal(in_tiles(depth, positions, offsets, m, back), twins.algorithm1(depth, offsets, back, m))


@both
@settings(max_examples=200)
@given(data=st.data())
def test_the_kernel_equals_algorithm1_for_many_samples(dtype, data):
    depth, positions, offsets, back, m = data.draw(smooth_camera_cases(dtype, 600))
    assert_equal(in_tiles(depth, positions, offsets, m, back), run1(depth, offsets, back, m))


@both
@given(data=st.data())
def test_cameras_with_and_without_bounds(dtype, data):
    depth, view, samples, radius = data.draw(camera_cases(dtype))
    matrices = view.screen_to_world, view.world_to_image.numbers.reshape(4, 4)
    without = passes.algorithm1(depth, *matrices, samples, radius)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tiles, "_LEAST_DECIDED", data.draw(st.sampled_from([-1.0, 0.3])))
        made = passes.algorithm1(depth, *matrices, samples, radius, bounds=tiles.depth_bounds(depth))
    assert_same_bits(made.texture, without.texture)
    assert made.outside == without.outside


@st.composite
def display_cases(draw, dtype, most):
    """A surface seen by a module of any display, some of its points anywhere, and samples from near to far."""
    height, width = draw(st.sampled_from([(1, 1), (9, 17), (40, 48)]))
    try:
        display = draw(test_display.displays()).with_resolution(width, height)
    except InputError:  # in a texture of another shape its distortion would fold
        reject()
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    world = np.hstack([np.diag([0.5, 0.4, -0.6]), rng.uniform(-0.05, 0.05, (3, 1))])
    depth, positions = (np.ascontiguousarray(n, dtype) for n in test_display.textures(display, rng, world))
    odd = rng.random(positions.shape) < rng.choice([0.0, 0.0, 0.003])
    positions[odd] = rng.choice([np.nan, np.inf, -np.inf, 3.0, -50.0, 1e30])
    offsets = draw(st.sampled_from([0.01, 0.1, 0.5])) * rng.uniform(-1, 1, (draw(st.sampled_from([1, 5, most])), 3))
    m = np.concatenate([world.ravel(), display.module_numbers(0)]).astype(dtype)
    return depth, positions, offsets.astype(dtype), m


@both
@given(data=st.data())
def test_the_kernel_equals_algorithm2_of_any_display(dtype, data):
    depth, positions, offsets, m = data.draw(display_cases(dtype, 300))
    assert_equal(in_tiles(depth, positions, offsets, m), run2(depth, positions, offsets, DISPLAY, m))


@both
@settings(max_examples=30)
@given(data=st.data(), every=st.integers(1, 3))
def test_what_is_decided_of_any_display_equals_the_twin(dtype, data, every):
    depth, positions, offsets, m = data.draw(display_cases(dtype, 20))
    slopes = tiles._slopes(depth, positions, offsets, DISPLAY, m, BLOCK)
    left, seen = tiles_twin.looked_up(depth, positions, offsets, m, slopes=slopes)
    assert counted(depth, positions, offsets, m, every) == of_some(left, seen, len(offsets), every)


@both
@given(data=st.data())
def test_the_kernel_equals_algorithm2s_twin_for_any_numbers(dtype, data):
    depth, positions, offsets, _, m, _ = data.draw(raw_cases(dtype).filter(lambda case: case[3] == CROSSED_SLITS))
    assert_equal(in_tiles(depth, positions, offsets, m), twins.algorithm2(depth, positions, offsets, CROSSED_SLITS, m))


@both
@given(data=st.data())
def test_the_kernel_equals_algorithm2s_twin_on_smooth_surfaces(dtype, data):
    depth, positions, offsets, m = data.draw(smooth_cases(dtype, 40))
    assert_equal(in_tiles(depth, positions, offsets, m), twins.algorithm2(depth, positions, offsets, CROSSED_SLITS, m))


@both
@settings(max_examples=200)
@given(data=st.data())
def test_the_kernel_equals_algorithm2_for_many_samples(dtype, data):
    depth, positions, offsets, m = data.draw(smooth_cases(dtype, 600))
    assert_equal(in_tiles(depth, positions, offsets, m), run2(depth, positions, offsets, CROSSED_SLITS, m))


@both
@given(data=st.data())
def test_modules_with_and_without_bounds(dtype, data):
    depth, positions, mapping, samples, radius = data.draw(module_cases(dtype))
    without = passes.algorithm2(depth, positions, mapping, samples, radius)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tiles, "_LEAST_DECIDED", data.draw(st.sampled_from([-1.0, 0.3])))
        bounds = tiles.depth_bounds(depth)
        made = passes.algorithm2(depth, positions, mapping, samples, radius, bounds=bounds)
    assert_same_bits(made.texture, without.texture)
    assert made.outside == without.outside


# What is decided


@both
@settings(max_examples=30)
@given(data=st.data())
def test_bounds_of_depths(dtype, data):
    depth = data.draw(smooth_cases(dtype, 1))[0]
    np.testing.assert_array_equal(tiles.depth_bounds(depth), tiles_twin.blocks(depth))


def test_bounds_of_depths_of_textures_wider_than_a_chunk():
    depth = np.random.default_rng(2).standard_normal((10, 600)).astype(np.float32)
    np.testing.assert_array_equal(tiles.depth_bounds(depth), tiles_twin.blocks(depth))


def counted(depth, positions, offsets, m, every, back=None):
    looked_up, given = np.full((2, len(range(0, depth.shape[0], 8 * every))), -9)
    tiled_ssao.count_decided(*asked(depth, positions, offsets, m, back), every, looked_up, given)
    return looked_up.tolist(), given.tolist()


def of_some(left, seen, samples, every):
    """What ``counted`` gives, of what is left of all tiles' samples, and which of them see a surface."""
    rows = [np.s_[k * every, k % every :: every] for k in range(-(-len(left) // every))]
    return [left[row].sum() for row in rows], [seen[row].sum() * samples for row in rows]


@both
@settings(max_examples=40)
@given(data=st.data(), every=st.integers(1, 3))
def test_what_is_decided_equals_the_twin(dtype, data, every):
    depth, positions, offsets, m = data.draw(smooth_cases(dtype, 300))
    left, seen = tiles_twin.looked_up(depth, positions, offsets, m)
    assert counted(depth, positions, offsets, m, every) == of_some(left, seen, len(offsets), every)


@both
@settings(max_examples=40)
@given(data=st.data())
def test_what_is_decided_of_cameras_equals_the_twin(dtype, data):
    depth, positions, offsets, back, m = data.draw(smooth_camera_cases(dtype, 300))
    left, seen = tiles_twin.looked_up(depth, positions, offsets, m, back)
    assert counted(depth, positions, offsets, m, 1, back) == of_some(left, seen, len(offsets), 1)


def test_every_outcome_is_decided_somewhere_of_a_camera():
    """As below; a sample behind the eye, or in its plane, is not decided."""
    depth, positions, _ = plane(16)
    back, m = camera(16, 16, 0.5, np.float32)
    expected = {(0, 0, 1): (1, 0), (0, 0, -0.1): (0, 0), (0, 0, 0): (0, 0), (99, 0, 1): (0, 256), (0, 0, -2): (0, 256)}
    for offset, (occlusion, outside) in expected.items():
        offsets = np.array([offset], np.float32)
        assert counted(depth, positions, offsets, m, 1, back)[0] == ([2, 2] if offset[2] == -2 else [0, 0])
        made = in_tiles(depth, positions, offsets, m, back)
        assert made[0].tolist() == np.full((16, 16), occlusion).tolist()
        assert made[1].sum() == outside


def test_a_cameras_tile_with_a_depth_that_overflows_alone_is_not_decided():
    """Of column 0 Z = 1e4 x - 1e4 y is inf - inf, else 0; all land on (10, 10), before nothing and behind nothing."""
    depth, positions, _ = plane(16)
    back = np.array([0, 0, 0, 3.40316e34, 0, 0, 0, 3.40316e34, 0, 0, 1, 0, 1e-4, 0, 0, 1], np.float32)
    m = np.array([1, 0, 0, 0, 0, 1, 0, 0, 1e4, -1e4, 0, 0, 0.1, 0, 0, 0], np.float32)
    offsets = np.zeros((3, 3), np.float32)
    assert counted(depth, positions, offsets, m, 1, back)[0] == [3, 3]
    made = in_tiles(depth, positions, offsets, m, back)
    assert made[1].sum() == 0
    assert_equal(made, run1(depth, offsets, back, m))


def test_every_outcome_is_decided_somewhere():
    """A plane: samples behind it, before it, on it and beyond the texture, for all its tiles."""
    depth, positions, m = plane(16)
    expected = {(0, 0, 1): (1, 0), (0, 0, -1): (0, 0), (0, 0, 0): (0, 0), (99, 0, 1): (0, 256), (0, 0, 2e3): (0, 256)}
    for offset, (occlusion, outside) in expected.items():
        offsets = np.array([offset], np.float32)
        looked_up, given = counted(depth, positions, offsets, m, 1)
        assert given == [2, 2]
        assert looked_up == ([2, 2] if offset[2] == 2e3 else [0, 0])  # a divisor that may be 0 decides nothing
        made = in_tiles(depth, positions, offsets, m)
        assert made[0].tolist() == np.full((16, 16), occlusion).tolist()
        assert made[1].sum() == outside


@pytest.mark.parametrize(("elsewhere", "there"), [(-1, 0), (1, -1)])
@pytest.mark.parametrize("corner", [(0, 0), (0, 12), (12, 0), (12, 12)])
def test_each_of_the_four_blocks_is_asked(elsewhere, there, corner):
    """Samples at z = 0 of a tile's points, spread over 4 x 4 cells of which one corner differs: a tie, or before."""
    depth, positions, m = plane(16)
    positions[:8, :8, :2] = 2 * np.stack(np.meshgrid(np.arange(8), np.arange(8)), axis=-1) - 0.5
    depth[:] = elsewhere
    depth[corner[0] : corner[0] + 4, corner[1] : corner[1] + 4] = there
    offsets = np.zeros((1, 3), np.float32)
    expected = run2(depth, positions, offsets, CROSSED_SLITS, m)
    assert set(expected[0][:8, :8].ravel()) == {0, 1}
    assert_equal(in_tiles(depth, positions, offsets, m), expected)


@pytest.mark.parametrize(("name", "least"), [("convex", 0.7), ("sample-b", 0.7), ("picoarray", 0.5)])
def test_most_samples_of_an_ordinary_scene_are_decided_on_displays_that_are_not_flat(name, least):
    mesh = builtin_scene("statue")
    views = module_views(mesh, find_display(name))
    view = views[len(views) // 3]
    seen = RayCaster(mesh, view.cast_from_world).gbuffer(view, None)
    offsets = (0.08 * diagonal(mesh) * make_samples("latin", 64)).astype(np.float32)
    left, given = counted(seen.depth, seen.positions, offsets, view.world_to_image.as_type(np.float32), 1)
    assert sum(left) < (1 - least) * sum(given)


def test_a_point_that_overflows_to_no_number_has_no_sample_in_the_texture():
    """Its row is inf - inf, the others are finite: the tile is decided without it."""
    depth, positions, m = plane(16)
    depth[:], m[6], m[10] = -1, 1e3, 0  # Y = -1000 y + 1000 z, Z = 0
    positions[5, 6, 1:] = 3e38
    offsets = np.zeros((7, 3), np.float32)
    assert counted(depth, positions, offsets, m, 1) == ([0, 0], [14, 14])
    made = in_tiles(depth, positions, offsets, m)
    assert made[1].tolist() == [7, 0]
    assert np.argwhere(made[0] != 1).tolist() == [[5, 6]]
    assert made[0][5, 6] == 0


# When it is asked, and done


@pytest.fixture
def done(monkeypatch):
    """Sizes of the textures that are done in tiles."""
    sizes, kernel = [], tiled_ssao.occlusion_in_tiles

    def noted(depth, *rest):
        sizes.append(depth.shape)
        kernel(depth, *rest)

    monkeypatch.setattr(tiled_ssao, "occlusion_in_tiles", noted)
    return sizes


def test_few_decided_samples_are_looked_up_in_rows(done):
    depth, positions, m = plane(48)
    mapping = WorldToImage(CROSSED_SLITS, m.astype(np.float64))
    samples = make_samples("latin", 99)
    without = passes.algorithm2(depth, positions, mapping, samples, 2.0)
    for noise in (0, 9):
        depth[::8, ::8] = noise  # texels before or behind the reach of all samples, in every cell
        depth[4::8, 4::8] = -noise
        bounds = tiles.depth_bounds(depth)
        made = passes.algorithm2(depth, positions, mapping, samples, 2.0, bounds=bounds)
        assert done == [(48, 48)]
        if not noise:
            assert_same_bits(made.texture, without.texture)
    beside = np.full_like(depth, np.inf)
    beside[9:, 9:] = 0  # no tile that is asked sees the surface
    passes.algorithm2(beside, positions, mapping, samples, 2.0, bounds=tiles.depth_bounds(beside))
    assert done == [(48, 48)]
    # Algorithm 2 of a camera's mapping is not asked, whatever the bounds are.
    passes.algorithm2(depth, positions, WorldToImage(1, np.eye(4).ravel()), samples, 2.0, bounds=bounds)
    assert done == [(48, 48)]


def test_bounds_of_another_texture_are_refused():
    depth, positions, m = plane(48)
    mapping = WorldToImage(CROSSED_SLITS, m.astype(np.float64))
    for bounds in (tiles.depth_bounds(depth[:44]), tiles.depth_bounds(depth.astype(np.float64))):
        with pytest.raises(InputError, match="bounds"):
            passes.algorithm2(depth, positions, mapping, make_samples(), 1.0, bounds=bounds)


def test_asking_is_worth_its_time_where_there_is_much_to_look_up():
    for kind in (CROSSED_SLITS, MATRIX):
        assert tiles.worth_asking(kind, 100, 100, 128, 1)
        assert not tiles.worth_asking(kind, 100, 100, 127, 99)
        assert not tiles.worth_asking(kind, 10, 100, 256, 3)
        assert tiles.worth_asking(kind, 10, 100, 256, 4)
    assert tiles.worth_asking(DISPLAY, 390_625, 10**7, 128, 1)
    assert not tiles.worth_asking(DISPLAY, 390_624, 10**6, 128, 99)
    assert not tiles.worth_asking(DISPLAY, 10**6, 10**6, 127, 99)


@pytest.mark.parametrize("kind", ["virtual", "convex", "sample-b", "perspective", "orthographic"])
def test_renders_in_tiles_have_the_bits_of_all_others(kind, done):
    """Every sampled radius of a view with many samples, whatever is decided; radius 0 and one that comes again not."""
    mesh, samples = builtin_scene("statue"), make_samples("latin", 300)
    if kind not in ("perspective", "orthographic"):
        views = module_views(mesh, find_display(kind).with_resolution(96, 72))
        view = views[len(views) // 3]
    else:
        view = Camera.looking_at(mesh.bounds, kind).view(96, 72)
    caster, options = RayCaster(mesh, view.cast_from_world), Settings((0.0, 0.4, 0.2, 0.4), samples)
    plan, everything = ViewPlan.of(view, mesh.bounds, options), ViewPlan.everything(view, options)
    assert (plan.in_tiles, everything.in_tiles, len(plan.sampled)) == (True, False, 2)
    without = render_view(caster, view, options, (), everything)
    assert not done
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tiles, "_LEAST_DECIDED", -1.0)
        patch.setattr(tiles, "_EVERY", BLOCK)
        patch.setattr(tiles, "LEAST_LOOKED_UP", 0)
        made = render_view(caster, view, options, (), plan)
    assert done == [(72, 96)] * 2
    assert made.outside == without.outside
    for one, other in zip(made.ao, without.ao, strict=True):
        assert_same_bits(one, other)
    few = Settings((0.4,), samples[:40])
    render_view(caster, view, few, (), ViewPlan.of(view, mesh.bounds, few))
    assert len(done) == 2


@pytest.mark.parametrize(
    ("options", "display", "word"),
    [
        ({"samples": 256}, "virtual", None),
        ({"samples": 127}, "virtual", "fewer than 128"),
        ({"samples": 128}, "convex", None),
        ({"samples": 127}, "convex", "fewer than 128"),
        ({"samples": 256, "neighbours": 1}, "sample-a", "several"),
        ({"samples": 256, "estimator": "point"}, "virtual", "own affair"),
        ({"samples": 256}, None, None),
        ({"samples": 127}, None, "fewer than 128"),
    ],
)
def test_the_plan_says_what_is_asked(options, display, word):
    mesh, samples = builtin_scene("statue"), make_samples("latin", options["samples"])
    view = Camera.looking_at(mesh.bounds, "perspective").view(48, 36)
    if display is not None:
        view = module_views(mesh, find_display(display).with_resolution(48, 36))[0]
    made = make_plan(mesh, [view], Settings((0.2,), **{**options, "samples": samples}))
    (cut,) = (cut for cut in made.cuts if cut.what == "tiles")
    assert (cut.when == "at run time") == made.views[0][1].in_tiles == (word is None)
    assert (word or "one tile of 64") in cut.reason
