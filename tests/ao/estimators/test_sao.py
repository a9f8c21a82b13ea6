"""Scalable Ambient Obscurance: positions, normals and levels against the reference, formulas by hand, limits."""

from dataclasses import replace

import analytic_scenes as scenes
import numpy as np
import pytest
from bits import assert_same_bits
from estimator_cases import texel_table, view_numbers
from hypothesis import given, settings
from hypothesis import strategies as st
from reference import scalable as reference

from lfssao import Buffers, InputError, estimate
from lfssao.ao.estimators.sao import estimator as scalable
from lfssao.ao.estimators.sao.kernels import face_normals, reconstruct
from lfssao.ao.estimators.sao.kernels import scalable as kernels
from lfssao.ao.estimators.sao.texel_rays import linear_z, positions_of, texel_rays

both = pytest.mark.parametrize("dtype", [np.float32, np.float64])
every_sight = pytest.mark.parametrize("sight", scenes.SIGHTS)
FILTERS = [name for name in scalable.FILTERS if name != "none"]
sizes = st.one_of(
    st.tuples(st.integers(1, 9), st.integers(1, 9)), st.sampled_from([(1, 1), (1, 23), (23, 1), (2, 40), (16, 8)])
)
wild = [0.0, -0.0, 1.0, 0.5, -1.0, 2.0, 3.0, 1e-3, 1e30, -1e30, 1e-30, np.inf]


@st.composite
def textures(draw, dtype, low=0.5, high=4.0):
    """A smooth or a wild texture of depths with holes."""
    shape = draw(sizes)
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    z = rng.uniform(low, high) + draw(st.sampled_from([0.0, 1e-3, 0.3])) * rng.standard_normal(shape)
    z = z.astype(dtype)
    if draw(st.booleans()):
        z = rng.choice(np.array(wild, dtype), shape)
    z[rng.random(shape) < draw(st.sampled_from([0.0, 0.2, 1.0]))] = np.inf
    return z


def reference_view(view, dtype):
    return reference.View(view_numbers(view), dtype, texel_table(view, dtype))


def seen(name, sight, dtype=np.float64, size=(13, 9), holes=0.1):
    rng = np.random.default_rng(5)
    sight = scenes.SIGHTS[sight](*size)
    return scenes.buffers(name, sight, dtype, rng.random(size[::-1]) < holes)


# Equations 3 and 4


@every_sight
@both
def test_rebuilt_positions_are_those_of_the_positions_texture(sight, dtype):
    """The round trip that settles equation 3's signs: unproject(project(point)) is the point."""
    buffers = seen("tilted plane", sight, np.float64)
    z = linear_z(buffers).astype(dtype)
    rays = texel_rays(buffers.view, z.dtype)
    made = np.empty((*z.shape, 3), dtype)
    reconstruct.rebuild_positions(z, rays, made)
    there = np.isfinite(buffers.depth)
    assert np.abs(made[there] - buffers.positions[there]).max() < (2e-6 if dtype == np.float32 else 1e-14)
    assert np.isinf(made[~there]).all()
    assert_same_bits(made, reference_view(buffers.view, dtype).places(z))


@pytest.mark.parametrize("sight", ["perspective", "orthographic"])
def test_a_cameras_positions_texture_is_not_read(sight):
    buffers = seen("sphere on a plane", sight)
    blank = Buffers(buffers.view, buffers.depth, np.zeros_like(buffers.positions))
    assert_same_bits(estimate("sao", blank, 0.1).texture, estimate("sao", buffers, 0.1).texture)


def normals_of(buffers):
    z = linear_z(buffers)
    rays = texel_rays(buffers.view, z.dtype)
    positions = positions_of(buffers, z, rays)
    normals = np.empty_like(positions)
    face_normals.face_normals(z, positions, rays, normals)
    return (z, positions, rays), normals


@every_sight
@both
@pytest.mark.parametrize("size", [(13, 9), (1, 1), (1, 6), (8, 1), (260, 3), (3, 67)])
def test_face_normals_equal_the_reference(sight, dtype, size):
    """Across the borders of what the kernel takes at a time, with texels that have one neighbour or none."""
    for name in ("sphere on a plane", "step"):
        buffers = seen(name, sight, dtype, size, 0.5)
        (z, positions, _), normals = normals_of(buffers)
        assert_same_bits(normals, reference_view(buffers.view, dtype).normals(z, positions))


@every_sight
@pytest.mark.parametrize("name", ["facing plane", "tilted plane", "concave crease", "convex crease"])
def test_face_normals_are_the_planes_within_a_fifth_of_a_degree(name, sight):
    """Figure 4's claim for float32 depth; beside edges and holes the difference may cross the edge."""
    buffers = seen(name, sight, np.float32, (96, 72), 0.0)
    _, normals = normals_of(buffers)
    cosine = (normals.astype(float) * buffers.normals).sum(-1)
    sine = np.linalg.norm(np.cross(normals.astype(float), buffers.normals), axis=-1)
    x = buffers.positions[..., 0]
    with np.errstate(invalid="ignore"):
        # A pair of texels may straddle the crease: two texels to each side of it.
        inside = np.isfinite(buffers.depth) & ((np.abs(x) > 0.03) | ("plane" in name))
    assert inside.mean() > 0.5
    assert np.degrees(np.arctan2(sine, cosine))[inside].max() < 0.2


# The hierarchy


@both
@pytest.mark.parametrize("how", FILTERS)
@given(data=st.data())
@settings(max_examples=15)
def test_every_filter_equals_the_reference(how, dtype, data):
    z = data.draw(textures(dtype))
    origin = dtype(data.draw(st.sampled_from([0.0, -2.0, 1.0])))
    with np.errstate(all="ignore"):
        made = scalable.z_hierarchy(z, how, 5, float(origin))
        expected = reference.levels_of(z, how, 5, origin)
    assert len(made) == len(expected)
    for one, two in zip(made, expected, strict=True):
        np.testing.assert_array_equal(np.isnan(one), np.isnan(two))
        assert_same_bits(np.nan_to_num(one), np.nan_to_num(two))


def test_filters_by_hand():
    z = np.array([[1.0, 2.0, 5.0], [4.0, 4.0, np.inf]])
    levels = {how: scalable.z_hierarchy(z, how, 5) for how in FILTERS}
    assert {how: made[1].tolist() for how, made in levels.items()} == {
        "rotated": [[4.0, 5.0]],  # texel (0, 0) takes (1, 1), texel (1, 0) takes (2 + 1, 0), the border's 5
        "arithmetic": [[2.75, np.inf]],
        "harmonic": [[2.0, 10.0]],  # 4 / (1 + 1/2 + 1/4 + 1/4); 4 / (1/5 + 1/5 + 0 + 0)
        "min": [[4.0, np.inf]],
        "max": [[1.0, 5.0]],
    }
    assert [level.shape for level in levels["max"]] == [(2, 3), (1, 2), (1, 1)]
    # Table 1 row by row, (2x' + (y' & 1 ^ 1), 2y' + (x' & 1 ^ 1)): each texel of the four is taken once of 2x2.
    assert scalable.z_hierarchy(np.arange(16.0).reshape(4, 4), "rotated", 1)[1].tolist() == [[5, 3], [12, 10]]
    assert len(scalable.z_hierarchy(z, "none", 5)) == 1
    assert len(scalable.z_hierarchy(z, "max", 1)) == 2


# Levels, radii, taps


@both
@given(st.integers(0, 2**20), st.integers(0, 15), st.integers(0, 15), st.floats(0, 0.999))
def test_levels_are_the_papers(dtype, whole, log_q, top, part):
    h = dtype(whole + part) if whole < 2**16 else dtype(whole)
    expected = min(max(int(h).bit_length() - 1 - log_q, 0), top)
    assert kernels.mip_level(h, np.int32(log_q), np.int32(top)) == expected
    if int(h) >= 1:
        assert expected == min(max(int(np.floor(np.log2(int(h)) - log_q + 1e-12)), 0), top)  # equation 9


def test_taps_reach_as_far_as_the_balls_image():
    """Equation 5: at the depth of a facing plane, r in texels is f r / z; in the screen's plane, texels a metre."""
    radius, size = 0.1, (60, 48)
    expected = {
        "perspective": (radius / 2 * 2 * 48 / 0.75,) * 2,
        "orthographic": (radius * 48 / 0.75,) * 2,
        # At z = 0, the screen: texels a metre.
        "crossed slits": (radius * 60 / 1.0, radius * 48 / 0.75),
        "display": (radius * 60 / 1.0, radius * 48 / 0.75),
    }
    for sight, radii in expected.items():
        buffers = scenes.buffers("facing plane", scenes.SIGHTS[sight](*size))
        view = reference_view(buffers.view, np.float64)
        made = view.radii(20, 30, linear_z(buffers)[20, 30], radius)
        assert made == pytest.approx(radii, rel=1e-3 if sight == "display" else 1e-9), sight


# Formulas by hand


@both
def test_packing_loses_at_most_half_a_step(dtype):
    keys = np.linspace(0, 1, 4001, dtype=dtype)[None]
    a = np.linspace(0, 1, 4001, dtype=dtype)[None]
    visibility, back = scalable.unpack(scalable.pack(a, keys), keys.dtype)
    assert np.abs(visibility - a).max() <= 0.5 / 255 + 1e-6
    inside = keys < 1 - 2 / (255 * 256)
    assert np.abs(back - keys)[inside].max() <= 0.5 / (255 * 256) + 1e-7
    assert np.abs(back - keys).max() <= 2 / (255 * 256)  # the last step is kept for 'no surface'
    assert scalable.pack(np.ones((1, 1), dtype), np.full((1, 1), np.inf, dtype)).tolist() == [[[255, 255, 255]]]


def test_the_appendix_by_hand():
    """One tap one texel to the right of a texel on the floor sees a block: the sum has one term."""
    sight = scenes.SIGHTS["orthographic"](6, 6)  # 8 texels a unit
    depth = np.full((6, 6), 0.5)
    depth[:, 3:] = 0.5 - 0.05 / 2  # planes at 1 and 3: 0.05 nearer
    buffers = Buffers(sight.view, depth, np.zeros((6, 6, 3))).turned("sao-hash")
    z, rays = linear_z(buffers), texel_rays(sight.view, np.dtype(np.float64))
    radius = 0.5
    options = scalable.AppendixOptions(beta=0.01, epsilon=0.01, taps=1, turns=1, mip="none")
    made, _ = scalable.sample(buffers, z, rays, radius, options)
    # alpha = 1/2: h = 2 texels; theta = pi + phi at (x, y) = (2, 4), phi = 60 ^ (4 + 80) radians.
    theta = np.pi + (60 ^ 84)
    x, y = int(2 + 2 * np.cos(theta)), int(4 + 2 * np.sin(theta))
    assert (x, y) == (3, 4), (x, y)
    v = np.array([1 / 8, 0.0, 0.05])
    # The normal at (2, 4): its pair is the column 3, across the step.
    n = np.array([-0.05, 0, 1 / 8]) / np.hypot(0.05, 1 / 8)
    square = v @ v / radius**2
    a = 1 - 5 * (1 - square) ** 3 * max((v @ n / radius - 0.01) / (square + 0.01), 0)
    assert made[4, 2] == pytest.approx(a)


# Conventions of published shaders


@both
def test_offsets_of_taps_are_rounded_as_shaders_do(dtype):
    offsets = [-2.5, -1.75, -0.5, -0.25, 0.0, 0.5, 1.75, 2.5]
    wanted = {0: [-2, -1, 0, 0, 0, 0, 1, 2], 1: [-2, -2, 0, 0, 0, 1, 2, 3], None: offsets}
    for landing, want in wanted.items():
        assert [kernels.landed(dtype(offset), landing) for offset in offsets] == want


def test_an_approximate_turn_leaves_each_tap_behind_by_its_share():
    """6.28 is 0.0031853 radians short of a turn, of which tap i makes (i + 1/2) / s tau."""
    options = (scalable.AppendixOptions(full_turn=k) for k in ("exact", "6.28"))
    exact, short = (scalable.spiral_taps(each, np.dtype(float)) for each in options)
    behind = np.arctan2(
        *np.einsum("ijk,jk->ik", [[exact[:, 1], -exact[:, 0]], [exact[:, 0], exact[:, 1]]], short.T[:2])
    )
    assert behind == pytest.approx((2 * np.pi - 6.28) * exact[:, 2] * 7, abs=1e-14)
    np.testing.assert_array_equal(exact[:, 2], short[:, 2])


@every_sight
def test_normals_of_the_buffer_take_the_place_of_the_faces(sight):
    buffers = seen("sphere on a plane", sight, size=(40, 30))
    _, faces = normals_of(buffers)
    same = estimate("sao", replace(buffers, normals=faces), 0.2, normals="buffer").texture
    assert_same_bits(same, estimate("sao", replace(buffers, normals=None), 0.2).texture)
    away = estimate("sao", replace(buffers, normals=-faces), 0.2, normals="buffer").texture
    assert not np.array_equal(away, same)
    with pytest.raises(InputError, match="reads normals"):
        estimate("sao", replace(buffers, normals=None), 0.2, normals="buffer")


# Limits


@every_sight
@both
@pytest.mark.parametrize("name", ["sao", "sao-equation-1"])
def test_a_plane_is_open(name, sight, dtype):
    """v.n = 0: nothing is occluded, with the biases of the defaults; the hierarchy's depth at an unshifted texel is not
    in the plane, so that only level 0 is."""
    for surface in ("facing plane", "tilted plane"):
        made = estimate(name, seen(surface, sight, dtype, (40, 30), 0.0), 0.2, mip="none")
        assert not made.texture.any()
