"""Scalable Ambient Obscurance: positions, normals and levels against the reference, and limits."""

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
from lfssao.ao.estimators.sao import hierarchy
from lfssao.ao.estimators.sao.kernels import passes, reconstruct
from lfssao.ao.estimators.sao.texel_rays import linear_z
from lfssao.ao.kernels import levels

both = pytest.mark.parametrize("dtype", [np.float32, np.float64])
every_sight = pytest.mark.parametrize("sight", scenes.SIGHTS)
FILTERS = [name for name in hierarchy.FILTERS if name != "none"]
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
    blank = Buffers(buffers.view, buffers.depth.astype(dtype), np.zeros((*z.shape, 3), dtype))
    made = np.empty((*z.shape, 3), dtype)
    reconstruct.rebuild_positions(scalable.sao_view(blank, z, scalable.AppendixOptions()), made)
    there = np.isfinite(buffers.depth)
    assert np.abs(made[there] - buffers.positions[there]).max() < (2e-6 if dtype == np.float32 else 1e-14)
    assert np.isinf(made[~there]).all()
    assert_same_bits(made, reference_view(buffers.view, dtype).places(z))


@pytest.mark.parametrize("sight", ["perspective", "orthographic"])
def test_a_cameras_positions_texture_is_not_read(sight):
    buffers = seen("sphere on a plane", sight)
    blank = Buffers(buffers.view, buffers.depth, np.zeros_like(buffers.positions))
    assert_same_bits(estimate("sao", blank, 0.1).texture, estimate("sao", buffers, 0.1).texture)


def made_of(buffers):
    """Positions and face normals of a view."""
    view = scalable.sao_view(buffers, linear_z(buffers), scalable.AppendixOptions())
    return (texture.reshape(*buffers.depth.shape, 3) for texture in (view.positions, view.normals))


@every_sight
@both
@pytest.mark.parametrize("size", [(13, 9), (1, 1), (1, 6), (8, 1), (260, 3), (3, 67)])
def test_face_normals_equal_the_reference(sight, dtype, size):
    """Across the borders of what the kernel takes at a time, with texels that have one neighbour or none."""
    for name in ("sphere on a plane", "step"):
        buffers = seen(name, sight, dtype, size, 0.5)
        positions, normals = made_of(buffers)
        assert_same_bits(normals, reference_view(buffers.view, dtype).normals(linear_z(buffers), positions))


# The hierarchy


@both
@pytest.mark.parametrize("how", FILTERS)
@given(data=st.data())
@settings(max_examples=15)
def test_every_filter_equals_the_reference(how, dtype, data):
    z = data.draw(textures(dtype))
    origin = dtype(data.draw(st.sampled_from([0.0, -2.0, 1.0])))
    with np.errstate(all="ignore"):
        made = hierarchy.z_hierarchy(z, how, 5, float(origin))
        expected = reference.levels_of(z, how, 5, origin)
    assert len(made) == len(expected)
    for one, two in zip(made, expected, strict=True):
        np.testing.assert_array_equal(np.isnan(one), np.isnan(two))
        assert_same_bits(np.nan_to_num(one), np.nan_to_num(two))


@both
@given(st.integers(0, 2**20), st.integers(0, 15), st.integers(0, 15), st.floats(0, 0.999))
def test_levels_are_the_papers(dtype, whole, log_q, top, part):
    h = dtype(whole + part) if whole < 2**16 else dtype(whole)
    expected = min(max(int(h).bit_length() - 1 - log_q, 0), top)
    assert levels.mip_level(h, np.int32(log_q), np.int32(top)) == expected
    if int(h) >= 1:
        assert expected == min(max(int(np.floor(np.log2(int(h)) - log_q + 1e-12)), 0), top)  # equation 9


@both
def test_packing_equals_the_reference(dtype):
    """Over all keys and without a surface."""
    a = np.linspace(0, 1, 4002, dtype=dtype)[None]
    keys = np.append(np.linspace(0, 1, 4001), np.inf).astype(dtype)[None]
    made = np.empty_like(a), np.empty_like(a)
    passes.through_bytes(a, keys, *made)
    for mine, want in zip(made, reference.unpack(reference.pack(a, keys), dtype), strict=True):
        assert_same_bits(mine, want)


# Limits


@every_sight
def test_normals_of_the_buffer_take_the_place_of_the_faces(sight):
    buffers = seen("sphere on a plane", sight, size=(40, 30))
    _, faces = made_of(buffers)
    same = estimate("sao", replace(buffers, normals=faces), 0.2, normals="buffer").texture
    assert_same_bits(same, estimate("sao", replace(buffers, normals=None), 0.2).texture)
    away = estimate("sao", replace(buffers, normals=-faces), 0.2, normals="buffer").texture
    assert not np.array_equal(away, same)
    with pytest.raises(InputError, match="reads normals"):
        estimate("sao", replace(buffers, normals=None), 0.2, normals="buffer")


@every_sight
@both
@pytest.mark.parametrize("name", ["sao", "sao-equation-1"])
def test_a_plane_is_open(name, sight, dtype):
    """v.n = 0: nothing is occluded, with the biases of the defaults; the hierarchy's depth at an unshifted texel is not
    in the plane, so that only level 0 is."""
    for surface in ("facing plane", "tilted plane"):
        made = estimate(name, seen(surface, sight, dtype, (40, 30), 0.0), 0.2, mip="none")
        assert not made.texture.any()
