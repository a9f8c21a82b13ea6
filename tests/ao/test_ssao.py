"""LF Algorithms 1 and 2: against the reference bit for bit, and against values found by hand and by geometry."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit
from reference import passes as reference

from lfssao import Camera, Display, Module, WorldToImage, fit_roi
from lfssao.ao import passes
from lfssao.ao.kernels import ssao
from lfssao.ao.kernels.spans import next_span
from lfssao.errors import InputError
from lfssao.optics.view import KINDS

CROSSED_SLITS, MATRIX = 0, 1
both = pytest.mark.parametrize("dtype", [np.float32, np.float64])
ROI = ((-0.4, -0.3, -0.25), (0.4, 0.3, 0.25))
WORLD_BOX = np.array([[-1.0, -2.0, -3.0], [4.0, 2.0, 1.0]])


def assert_same_bits(actual, expected):
    assert (actual.dtype, actual.shape) == (expected.dtype, expected.shape)
    assert not np.isnan(actual).any()
    integer = np.int32 if actual.dtype == np.float32 else np.int64
    np.testing.assert_array_equal(np.ascontiguousarray(actual).view(integer), expected.view(integer))


def unwritten(depth):
    return np.full_like(depth, 9), np.full(depth.shape[0], -9, np.int64)


def run1(depth, offsets, back, m):
    occlusion, outside = unwritten(depth)
    ssao.algorithm1(depth, offsets, back, m, occlusion, outside)
    return occlusion, outside


def run2(depth, positions, offsets, kind, m):
    """What Algorithm 2 makes of one of three radii, which have other offsets."""
    occlusion, outside = (np.stack([part] * 3) for part in unwritten(depth))
    radii = np.stack([np.roll(offsets, 1, axis=1), offsets, offsets[:, ::-1]])
    ssao.algorithm2(depth, positions, radii, kind, m, occlusion, outside)
    return occlusion[1], outside[1]


def assert_same(actual, expected):
    assert_same_bits(actual[0], expected[0])
    assert actual[1].tolist() == expected[1].tolist()


def outside_of(result):
    """The reference's occlusion, and how many samples of each row are outside."""
    occlusion, answers = result
    return occlusion, answers[:, 1:].sum(axis=1)


# Inputs. Hypothesis draws shapes, parameters and a pool of numbers; a seed lays the pool out over the arrays.

sizes = st.one_of(
    st.tuples(st.integers(1, 10), st.integers(1, 8)),
    st.sampled_from([(1, 1), (1, 40), (19, 1), (1, 300), (2, 70), (17, 3)]),
)
LATTICE = [-3.0, -2.0, -1.0, -0.5, -0.0, 0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0]


def wild_pool(dtype):
    limits = np.finfo(dtype)
    special = [0.0, -0.0, 1.0, -1.0, 0.5, np.inf, -np.inf, np.nan]
    special += [s * float(x) for s in (1, -1) for x in (limits.max, limits.tiny, limits.smallest_subnormal)]
    width = 32 if dtype == np.float32 else 64
    number = st.one_of(st.floats(width=width), st.floats(-8, 8, width=width), st.sampled_from(special))
    return st.lists(number, min_size=6, max_size=30)


@st.composite
def raw_cases(draw, dtype):
    """Any 16 numbers as the mapping, from a pool of small lattice numbers (ties, edges, singular planes) or of any."""
    lattice = draw(st.booleans())
    pool = np.array(LATTICE if lattice else draw(wild_pool(dtype)), dtype)
    finite = np.append(pool[np.isfinite(pool)], dtype(1))
    shape, n = draw(sizes), draw(st.sampled_from([8, 2, 1, 0]))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    kind = draw(st.sampled_from([CROSSED_SLITS, MATRIX]))
    m = rng.choice(finite, 16)
    if draw(st.booleans()):  # near the identity, so that samples land in the texture
        m[:12] = np.eye(3, 4, dtype=dtype).ravel()
        m[12:] = [4, -3, 1, 1] if kind == CROSSED_SLITS else [0, 0, 0, 1]
        m[rng.integers(0, 16)] = rng.choice(finite)
    depth = rng.choice(pool, shape)
    depth[np.isnan(depth)] = np.inf
    depth[rng.random(shape) < draw(st.sampled_from([0.0, 0.1, 0.3, 0.5, 1.0]))] = np.inf
    positions = rng.choice(pool, (*shape, 3))
    if draw(st.booleans()):
        positions[..., 0] = np.arange(shape[1]) + 0.5
        positions[..., 1] = np.arange(shape[0])[:, None] + 0.5
    offsets = rng.choice(finite, (n, 3)) * dtype(draw(st.sampled_from([0.0, 1.0])))
    back = rng.choice(finite, 16)
    return depth, positions, offsets, kind, m, back


@st.composite
def module_cases(draw, dtype):
    """A smooth surface behind one module of a drawn display, by DESIGN section 2's ray of a texel."""
    height, width = draw(sizes)
    m_x, m_y, y_o = draw(st.tuples(*[st.floats(-1, 1)] * 3))
    m_z, z_o = draw(st.floats(0.3, 2)), draw(st.floats(-3, -0.5))
    display = Display("drawn", 1.0, 0.75, y_o, z_o, (Module(m_x, m_y, m_z, width, height),), ROI)
    world = fit_roi(WORLD_BOX, display.roi)
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    z = rng.uniform(0.8 * z_o, 0.8 * m_z) * np.ones((height, width)) + 0.02 * rng.standard_normal((height, width))
    s_x = (np.arange(width) + 0.5) / width - 0.5
    s_y = 0.75 * (0.5 - (np.arange(height)[:, None] + 0.5) / height)
    physical = np.stack([m_x + (s_x - m_x) * (m_z - z) / m_z, y_o + (s_y - y_o) * (z - z_o) / -z_o, z], axis=-1)
    positions = ((physical - world[:, 3]) / np.diag(world)).astype(dtype)
    depth = z.astype(dtype)
    depth[rng.random(depth.shape) < 0.1] = np.inf
    positions[np.isinf(depth)] = np.inf
    samples = rng.uniform(-1, 1, (draw(st.integers(1, 9)), 3))
    radius = draw(st.sampled_from([0.0, 1e-3, 0.3, 2.0, 30.0]))
    return depth, positions, display.view(0, world).world_to_image, samples, radius


@st.composite
def camera_cases(draw, dtype):
    height, width = draw(sizes)
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    eye = tuple(rng.uniform(2, 6, 3) * rng.choice([-1, 1], 3))
    kind = draw(st.sampled_from(["perspective", "orthographic"]))
    view = Camera(kind, eye, (0.0, 0.1, 0.2), (0.0, 1.0, 0.0), draw(st.floats(0.5, 4)), 1.0, 20.0).view(width, height)
    depth = (rng.uniform(0.1, 0.9) + 0.02 * rng.standard_normal((height, width))).astype(dtype)
    depth[rng.random(depth.shape) < 0.1] = np.inf
    samples = rng.uniform(-1, 1, (draw(st.integers(1, 9)), 3))
    return depth, view, samples, draw(st.sampled_from([0.0, 1e-3, 0.3, 2.0, 30.0]))


@both
@settings(max_examples=300)
@given(data=st.data())
def test_both_algorithms_equal_the_reference_for_any_numbers(dtype, data):
    depth, positions, offsets, kind, m, back = data.draw(raw_cases(dtype))
    second = reference.algorithm2(depth, positions, offsets, KINDS[kind], m)
    assert_same(run2(depth, positions, offsets, kind, m), outside_of(second))
    assert_same(run1(depth, offsets, back, m), outside_of(reference.algorithm1(depth, offsets, back, m)))


@njit
def all_spans(depth, at, end, most):
    found = []
    while at < end:
        start, n = next_span(depth, at, end, most)
        found.append((start, n))
        at = start + n
    return found


@settings(max_examples=60)
@given(
    st.integers(0, 2**32), st.integers(1, 1300), st.integers(0, 40), st.sampled_from([32, 256, 2048]),
    st.sampled_from([0.0, 1e-3, 0.01, 0.3, 1.0]),
)  # fmt: skip
def test_spans_hold_all_that_sees_a_surface_and_little_else(seed, width, first, most, share):
    rng = np.random.default_rng(seed)
    seen = rng.random(first + width) < share
    seen[first + rng.integers(width) : first + rng.integers(width + 1)] |= rng.random() < 0.5
    depth, at = np.where(seen, np.float32(-1), np.float32(np.inf)), first
    for start, n in all_spans(depth, first, first + width, most):
        assert not seen[at:start].any()
        assert n <= most
        assert n or start == first + width
        assert all(seen[k : min(k + 32, start + n)].any() for k in range(start, start + n, 32))
        at = start + n
    assert not seen[at : first + width].any()


def test_a_span_is_found_wherever_its_only_texel_is():
    for place in range(3, 800):
        depth = np.full(800, np.float32(np.inf))
        depth[place] = 0
        start, n = all_spans(depth, 3, 800, 256)[0]
        assert start <= place < start + n
        assert n <= 32


@both
@given(data=st.data())
def test_pass_algorithm2_equals_the_reference_on_modules(dtype, data):
    depth, positions, mapping, samples, radius = data.draw(module_cases(dtype))
    actual = passes.algorithm2(depth, positions, mapping, samples, radius)
    numbers, offsets = mapping.numbers.astype(dtype), (radius * samples).astype(dtype)
    texture, outside = outside_of(reference.algorithm2(depth, positions, offsets, KINDS[mapping.kind], numbers))
    assert_same_bits(actual.texture, texture)
    assert actual.outside == outside.sum()


@both
@given(data=st.data())
def test_pass_algorithm1_equals_the_reference_on_cameras(dtype, data):
    depth, view, samples, radius = data.draw(camera_cases(dtype))
    forth = view.world_to_image.numbers.reshape(4, 4)
    actual = passes.algorithm1(depth, view.screen_to_world, forth, samples, radius)
    back, offsets = view.screen_to_world.ravel().astype(dtype), (radius * samples).astype(dtype)
    forth = forth.ravel().astype(dtype)
    texture, outside = outside_of(reference.algorithm1(depth, offsets, back, forth))
    assert_same_bits(actual.texture, texture)
    assert actual.outside == outside.sum()


# Values found by hand. The mapping is u = x, v = y, z = z.

IDENTITY = np.eye(4).ravel()


def by_hand(depth, offsets, m=IDENTITY, dtype=np.float64):
    """Occlusion and outside of one row of texels, points at their centres, by both algorithms."""
    depth = np.array([depth], dtype)
    width = depth.shape[1]
    positions = np.stack([np.arange(width) + 0.5, np.full(width, 0.5), depth[0]], axis=-1).astype(dtype)[None]
    offsets, m = np.array(offsets, dtype).reshape(-1, 3), m.astype(dtype)
    second = run2(depth, positions, offsets, MATRIX, m)
    assert_same(run1(depth, offsets, IDENTITY.astype(dtype), m), second)
    return second[0][0].tolist(), int(second[1][0])


@both
def test_a_sample_at_the_depth_of_the_surface_is_not_occluded(dtype):
    # One texel right and 1 behind: texel 0 meets depth 1 at z = 1 (tie), texel 1 depth 1.5 at z = 2, texel 2 leaves.
    assert by_hand([0, 1, 1.5], [(1, 0, 1)], dtype=dtype) == ([0, 1, 0], 1)


@both
def test_occlusion_is_the_share_of_the_samples(dtype):
    third = float(dtype(1) / dtype(3))
    assert by_hand([0, 0], [(0, 0, 1), (0, 0, 0), (0, 0, -1)], dtype=dtype) == ([third, third], 0)


@both
def test_no_samples_and_no_surface_give_zero(dtype):
    assert by_hand([0, np.inf], [], dtype=dtype) == ([0, 0], 0)
    assert by_hand([np.inf, np.inf], [(0, 0, 1)], dtype=dtype) == ([0, 0], 0)
    assert by_hand([0, np.inf], [(1, 0, 100)], dtype=dtype) == ([0, 0], 0)  # the sample sees background


@both
def test_texel_edges_belong_to_the_texel_on_their_right(dtype):
    # x = 1 is texel 1 (depth -9: occluded), x = 2 is beyond the texture.
    assert by_hand([0, -9], [(0.5, 0, 0)], dtype=dtype) == ([1, 0], 1)
    assert by_hand([0, -9], [(-0.5, 0, 0)], dtype=dtype) == ([0, 0], 0)  # x = 0 and 1: their own texels, ties
    past = float(np.nextafter(dtype(0.5), dtype(1)))  # 1.5 - past is the last number below 1, 0.5 - past is negative
    assert by_hand([-9, 0], [(-past, 0, 0)], dtype=dtype) == ([0, 1], 1)


@both
@pytest.mark.parametrize(
    ("z", "outside"), [(-2.0, 1), (np.nextafter(np.float32(-2), np.float32(0)), 0), (3.0, 1), (-3.0, 1), (4.0, 1)]
)
def test_the_singular_planes_and_beyond_are_outside(dtype, z, outside):
    m = np.array([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 3, -2, 0.5, 0.5], dtype)  # X = x, Y = y, z_m = 3, z_o = -2
    positions = np.array([[[0, 0, z]]], dtype)
    occlusion, count = run2(np.full((1, 1), -1e9, dtype), positions, np.zeros((1, 3), dtype), CROSSED_SLITS, m)
    assert count.tolist() == [outside]
    assert occlusion.tolist() == [[1 - outside]]


@both
def test_a_matrix_is_undefined_from_q_zero_on(dtype):
    m = np.eye(4)
    m[3] = [0, 0, 1, 0]  # q = z
    assert by_hand([1], [(0, 0, -1)], m.ravel(), dtype) == ([0], 1)
    assert by_hand([1], [(0, 0, -2)], m.ravel(), dtype) == ([0], 1)


# Values from geometry


@both
def test_a_plane_that_faces_the_viewers_is_half_occluded(dtype):
    """Of each pair +d, -d one lies behind the plane: inside the texture ao is 1/2 without error."""
    display = Display("d", 1.0, 0.75, 0.1, -2.0, (Module(0.4, 0.0, 0.7, 48, 36),), ROI)
    view = display.view(0, np.eye(3, 4))
    z = 0.0625
    s_x, s_y = (np.arange(48) + 0.5) / 48 - 0.5, 0.75 * (0.5 - (np.arange(36)[:, None] + 0.5) / 36)
    x, y = np.broadcast_arrays(0.4 + (s_x - 0.4) * (0.7 - z) / 0.7, 0.1 + (s_y - 0.1) * (z + 2) / 2)
    positions = np.stack([x, y, np.full_like(x, z)], axis=-1).astype(dtype)
    depth = np.full((36, 48), z, dtype)
    d = np.random.default_rng(1).uniform(-1, 1, (500, 3))
    d = d[np.abs(d[:, 2]) > 1e-3]
    radius = 0.05
    result = passes.algorithm2(depth, positions, view.world_to_image, np.concatenate([d, -d]), radius)
    assert np.all(result.texture[7:-7, 7:-7] == 0.5)
    # At the border: which samples land inside, by DESIGN's formula; those within 1e-3 texel of it may count or not.
    far = radius * np.concatenate([d, -d])
    for j, i in [(0, 0), (0, 20), (35, 47), (18, 47)]:
        p = np.array([x[j, i], y[j, i], z]) + far
        u = 48 * (0.5 + 0.4 + (p[:, 0] - 0.4) * 0.7 / (0.7 - p[:, 2]))
        v = 36 * (0.5 - (0.1 + (p[:, 1] - 0.1) * -2 / (-2 - p[:, 2])) / 0.75)
        room = np.minimum(np.minimum(u, 48 - u), np.minimum(v, 36 - v))
        behind = far[:, 2] > 0
        least, most = np.mean(behind & (room > 1e-3)), np.mean(behind & (room > -1e-3))
        assert least - 1e-6 <= result.texture[j, i] <= most + 1e-6 < 0.5


@both
def test_beside_a_step_half_the_ball_is_hidden_and_what_lies_under_the_step(dtype):
    """A floor 1 away, a block 0.75 away from column 20 on: occluded is what is behind, or to the right of the edge."""
    view = Camera("orthographic", (0, 0, 0), (0, 0, -1), (0, 1, 0), 1.0, 0.5, 4.5).view(40, 40)  # 40 texels a unit
    depth = np.full((40, 40), (1.0 - 0.5) / 4, dtype)
    depth[:, 20:] = (0.75 - 0.5) / 4
    d = np.random.default_rng(2).uniform(-1, 1, (400, 3))
    d = d[(np.sum(d * d, axis=1) < 1) & (np.abs(d[:, 2]) > 1e-3)]
    d = np.concatenate([d, -d])
    radius = 0.2  # 8 texels; less than the block's height
    result = passes.algorithm1(depth, view.screen_to_world, view.world_to_image.numbers.reshape(4, 4), d, radius)
    assert np.all(result.texture[10:30, 8:12] == 0.5)  # the edge is out of reach
    for i in (13, 16, 19):
        reach = (20 - (i + 0.5)) / 8  # texels to the edge, in radii
        assert np.abs(d[:, 0] - reach).min() > 1e-6
        hidden = np.count_nonzero((d[:, 2] < 0) | (d[:, 0] > reach))
        assert np.all(result.texture[10:30, i] == dtype(hidden) / dtype(len(d)))


def test_algorithm2_does_not_mind_how_arrays_lie_in_memory():
    rng = np.random.default_rng(3)
    depth, positions, samples = rng.random((6, 9)), rng.random((6, 9, 3)) * [9, 6, 1], rng.uniform(-1, 1, (5, 3))
    mapping = WorldToImage(MATRIX, IDENTITY)
    want = passes.algorithm2(depth, positions, mapping, samples, 1.0)
    strided = np.repeat(depth, 2, axis=1)[:, ::2], np.repeat(positions, 2, axis=0)[::2]
    got = passes.algorithm2(*strided, mapping, samples[::-1][::-1], 1.0)
    assert_same_bits(got.texture, want.texture)
    assert got.outside == want.outside > 0


def test_algorithm_passes_refuse_what_does_not_fit():
    depth, positions, samples = np.zeros((2, 3)), np.zeros((2, 3, 3)), np.zeros((1, 3))
    mapping = WorldToImage(MATRIX, IDENTITY)
    bad = [
        (depth.astype(int), positions, samples, 1.0),
        (depth[0], positions, samples, 1.0),
        (depth[:0], positions[:0], samples, 1.0),
        (depth, positions[:1], samples, 1.0),
        (depth, positions.astype(np.float32), samples, 1.0),
        (depth, positions, samples[:0], 1.0),
        (depth, positions, samples[:, :2], 1.0),
        (depth, positions, samples + np.nan, 1.0),
        *((depth, positions, samples, radius) for radius in (-1.0, np.nan, np.inf)),
    ]
    for d, p, s, r in bad:
        with pytest.raises(InputError):
            passes.algorithm2(d, p, mapping, s, r)
    for back, forth in [(np.eye(3), np.eye(4)), (np.eye(4), np.eye(4).ravel())]:
        with pytest.raises(InputError):
            passes.algorithm1(depth, back, forth, samples, 1.0)
