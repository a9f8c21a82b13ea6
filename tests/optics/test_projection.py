"""World -> image and the rays of texels, and textures: the reference."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reference import mapping as reference
from reference import raycast

from lfssao.gbuffer import caster
from lfssao.gbuffer.kernels import surface as paint
from lfssao.optics.kernels import projection as mapping
from lfssao.optics.kernels import rays
from lfssao.optics.kernels.projection import Projection
from lfssao.optics.view import KINDS


def bits(values, dtype=np.float64):
    return np.array(values, dtype).view(np.int32 if dtype == np.float32 else np.int64)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@given(data=st.data())
def test_world_to_image_equals_the_reference(dtype, data):
    width = 32 if dtype == np.float32 else 64
    number = st.one_of(
        st.floats(-8, 8, width=width), st.sampled_from([0.0, -0.0, 1.0, -2.0, 3.0]), st.floats(width=width)
    )
    m = np.array(data.draw(st.lists(number, min_size=16, max_size=16)), dtype)
    x, y, z = np.array(data.draw(st.tuples(number, number, number)), dtype)
    for kind in (mapping.CROSSED_SLITS, mapping.MATRIX):
        actual = mapping.world_to_image(Projection(kind, m), x, y, z)
        name = KINDS[kind]
        with np.errstate(all="ignore"):
            want = reference.to_image(name, m, reference.affine_rows(name, m, (x, y, z)))
        assert actual[3] == (want[3] == 0)
        for a, b in zip(actual[:3], want[:3], strict=True):
            assert type(b) is dtype
            assert (math.isnan(a) and math.isnan(b)) or bits(a, dtype) == bits(b, dtype)


@pytest.mark.parametrize(
    ("kind", "orthographic"), [(mapping.CROSSED_SLITS, None), (mapping.MATRIX, 0.0), (mapping.MATRIX, 1.0)]
)
@given(st.lists(st.floats(-1e6, 1e6), min_size=8, max_size=8), st.floats(-1e4, 1e4), st.floats(-1e4, 1e4))
def test_texel_ray_equals_the_reference(kind, orthographic, numbers, u, v):
    lens = np.array([n if n != 0 else 1.0 for n in numbers])
    if orthographic is not None:
        lens[6] = orthographic
    ox, oy, oz, dx, dy, dz, near, far = rays.texel_ray(rays.Rays(kind, lens), u, v)
    assert (oz, dz) == (0, 1)
    want = raycast.rays_at(kind, lens, np.array([u]), np.array([v]))
    np.testing.assert_array_equal(bits([ox, oy, dx, dy, near, far]), bits(np.ravel(want)))


@given(
    st.integers(0, 99),
    *[st.integers(1, 4)] * 2,
    st.integers(0, 5),
    *[st.floats(-5, 5)] * 2,
    *[st.sampled_from(("repeat", "mirror", "clamp"))] * 2,
)
def test_sample_texture_equals_the_reference(seed, wide, high, first, u, v, wrap_u, wrap_v):
    texels = np.random.default_rng(seed).random((first + wide * high + 1, 3), np.float32)
    texture = texels[first : first + wide * high].reshape(high, wide, 3)
    for channel in range(3):
        wraps = caster.WRAP_CODES[wrap_u], caster.WRAP_CODES[wrap_v]
        actual = paint.sample_texture(texels, first, wide, high, u, v, channel, *wraps)
        assert bits(actual) == bits(raycast.sample_texture(texture, u, v, channel, (wrap_u, wrap_v)))


# Domains by hand


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_the_texture_ends_at_the_last_number_below_its_size(dtype):
    for size in (dtype(n) for n in (1, 2, 3, 480, 600, 768, 1000, 1023, 1024, 16384)):
        last = np.nextafter(size, dtype(0))
        assert mapping.last_below(size) == last
        for u, inside in ((last, True), (size, False), (dtype(0), True), (np.nextafter(dtype(0), -size), False)):
            held = min(int(u), int(size) - 1)
            assert mapping.nearest_texel(u, dtype(0.5), size, dtype(9)) == (inside, held)
            assert mapping.nearest_texel(dtype(0.5), u, dtype(9), size) == (inside, 9 * held)
