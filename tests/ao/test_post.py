"""Merge, Gaussian blur and shading: against the reference bit for bit, and what follows from their definition."""

import numpy as np
import pytest
from bits import assert_same_bits
from hypothesis import given
from hypothesis import strategies as st
from reference import passes as reference

from lfssao.ao import post
from lfssao.ao import reference as readable
from lfssao.ao.kernels import post as post_kernels
from lfssao.errors import InputError

DTYPES = (np.float32, np.float64)
both = pytest.mark.parametrize("dtype", DTYPES)
shapes = st.one_of(
    st.tuples(st.integers(1, 9), st.integers(1, 9)), st.sampled_from([(1, 1), (1, 70), (40, 1), (2, 150)])
)
wide = st.one_of(st.floats(0.3, 1024), st.floats(0.3, 8), st.just(1024.0))
sigmas = st.one_of(st.floats(0.01, 4), st.sampled_from([5e-324, 1e-300, 1e-9, 1 / 3, 0.5, 1.0, 2.0]))


@st.composite
def textures(draw, dtype, shape=None):
    """Numbers from 0 to 1, and now and then any finite one, ties and signed zeros among them."""
    shape = draw(shapes) if shape is None else shape
    limits = np.finfo(dtype)
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    texture = rng.random(shape).astype(dtype)
    special = [0.0, -0.0, 1.0, 0.5, limits.tiny, limits.smallest_subnormal, -limits.smallest_subnormal, limits.eps]
    if draw(st.booleans()):
        special += [limits.max / 8, -limits.max / 8, 1e30]
    texture[rng.random(shape) < draw(st.floats(0, 1))] = dtype(rng.choice(np.array(special, dtype)))
    mask = rng.random(shape) < 0.5 * draw(st.booleans())
    texture[mask] = rng.choice(np.array(special, dtype), np.count_nonzero(mask))
    return texture


@both
@given(data=st.data())
def test_merge_equals_the_reference(dtype, data):
    shape = data.draw(shapes)
    layers = np.stack([data.draw(textures(dtype, shape)) for _ in range(data.draw(st.integers(1, 11)))])
    kept = layers.copy()
    merged = post.merge(list(layers))
    assert_same_bits(merged, reference.merge(layers))
    assert_same_bits(layers, kept)
    np.testing.assert_array_equal(merged, layers.max(axis=0))
    np.testing.assert_array_equal(post.merge(layers[::-1]), merged)


@both
@given(data=st.data())
def test_blur_equals_the_reference(dtype, data):
    source = data.draw(textures(dtype))
    sigma = data.draw(sigmas)
    weights = post.blur_weights(sigma, dtype)
    assert_same_bits(weights, reference.blur_table(sigma, dtype))
    half = np.full_like(source, 9)
    whole = np.full_like(source, 9)
    post_kernels.blur_horizontal(source, weights, half)
    assert_same_bits(half, reference.blur_rows(source, weights))
    post_kernels.blur_vertical(half, weights, whole)
    assert_same_bits(whole, reference.blur_columns(half, weights))
    assert_same_bits(post.blur(source, sigma), whole)


@both
@given(data=st.data())
def test_blurred_occlusion_stays_from_zero_to_one(dtype, data):
    """A covered region is 1 to the last bit, at every sigma; shading makes nothing negative of a colour that is not."""
    sigma = data.draw(wide)
    seed = data.draw(st.integers(0, 2**32))
    rng = np.random.default_rng(seed)
    source = np.minimum(rng.random((6, 9)) * data.draw(st.sampled_from([1, 1.01, 2, 50])), 1).astype(dtype)
    source[source > 0.99] = np.nextafter(dtype(1), dtype(0)) if data.draw(st.booleans()) else 1
    assert_same_bits(post.blur_weights(sigma, dtype), reference.blur_table(sigma, dtype))
    blurred = post.blur(source, sigma)
    assert blurred.min() >= 0
    assert blurred.max() <= 1
    rgb = (rng.random((6, 9, 3)) * 5).astype(dtype)
    assert post.shade(rgb, blurred).min() >= 0
    assert post.shade_white(source, blurred).min() >= 0
    assert np.all(post.blur(np.ones_like(source), sigma) == 1)


@both
def test_blur_without_sigma_copies(dtype):
    source = np.array([[0.25, -0.0], [1.0, 1e-40]], dtype)
    copy = post.blur(source, 0)
    assert_same_bits(copy, source)
    assert not np.shares_memory(copy, source)


@both
@given(data=st.data())
def test_shade_equals_the_reference(dtype, data):
    shape = data.draw(shapes)
    rgb = data.draw(textures(dtype, (*shape, 3)))
    occlusion = data.draw(textures(dtype, shape))
    shaded = np.full_like(rgb, 9)
    if np.abs(rgb).max() > 2 and np.abs(occlusion).max() > 2:
        rgb = np.clip(rgb, -1, 1)  # the product of two huge numbers is no colour
    post_kernels.apply_occlusion(rgb, occlusion, shaded)
    assert_same_bits(shaded, reference.shade(rgb, occlusion))
    assert_same_bits(post.shade(rgb, occlusion), shaded)


@both
@given(data=st.data())
def test_shading_without_colour_shades_a_white_image(dtype, data):
    shape = data.draw(shapes)
    seen = data.draw(st.integers(0, 2**32).map(lambda seed: np.random.default_rng(seed).random(shape) < 0.7))
    depth = np.where(seen, dtype(0.5), dtype(np.inf))
    occlusion = data.draw(textures(dtype, shape))
    white = np.repeat(seen[..., None], 3, axis=2).astype(dtype)
    assert_same_bits(post.shade_white(depth, occlusion), reference.shade(white, occlusion))


vectors = st.tuples(*[st.floats(-3, 3)] * 3).filter(lambda v: max(map(abs, v)) > 1e-6)


@both
@given(data=st.data(), direction=vectors, ambient=st.one_of(st.floats(0, 1), st.sampled_from([0.0, 0.5, 1.0])))
def test_a_light_equals_the_reference(dtype, data, direction, ambient):
    """Some normals are 0 or no unit vectors. All ambient light, whatever its AO is on, is no light at all."""
    shape = data.draw(shapes)
    rgb = np.clip(data.draw(textures(dtype, (*shape, 3))), -2, 2)
    occlusion = data.draw(textures(dtype, shape))
    occlusion = np.clip(occlusion, -2, 2)
    normals = np.clip(data.draw(textures(dtype, (*shape, 3))) * 2 - 1, -2, 2).astype(dtype)
    for place in ("ambient", "all"):
        light = post.Light(direction, ambient, place)
        made = post.shade(rgb, occlusion, normals, light)
        assert_same_bits(made, reference.light(rgb, occlusion, normals, direction, ambient, place))
        assert_same_bits(made, readable.lit(rgb, occlusion, normals, light.unit, ambient, place == "all"))
        whole = post.shade(rgb, occlusion, normals, post.Light(direction, 1, place))
        np.testing.assert_array_equal(whole, post.shade(rgb, occlusion))


@both
def test_what_faces_a_light_keeps_its_colour_and_what_turns_away_has_the_ambient_term(dtype):
    rgb = np.full((1, 3, 3), 0.5, dtype)
    occlusion = np.array([[0, 0, 0.5]], dtype)
    normals = np.array([[[0, 0.6, 0.8], [0, 0, -1], [0, 0.6, 0.8]]], dtype)
    usual = post.shade(rgb, occlusion, normals, post.Light([0, 3, 4]))
    np.testing.assert_allclose(usual[0, :, 0], [0.5, 0.25, 0.375], rtol=1e-6)
    assert_same_bits(usual, post.shade(rgb, occlusion, normals, post.Light((0, 3e14, 4e14))))
    all_of_it = post.shade(rgb, occlusion, normals, post.Light((0, 3, 4), 0.5, "all"))
    np.testing.assert_allclose(all_of_it[0, :, 0], [0.5, 0.25, 0.25], rtol=1e-6)
    white = post.shade_white(np.array([[1, np.inf, 1]], dtype), occlusion, normals, post.Light(np.array([0, 3, 4])))
    np.testing.assert_allclose(white[0, :, 0], [1, 0, 0.75], rtol=1e-6)


NO_DIRECTIONS = (0, 0, 0), (1, 2), (1, 2, "3"), (np.nan, 0, 1), (1e16, 0, 0), 5, None, "123"


@pytest.mark.parametrize("wrong", [
    *({"direction": bad} for bad in NO_DIRECTIONS), *({"ambient": bad} for bad in (-0.1, 1.1, np.nan, None, "1")),
    *({"occlude": bad} for bad in ("some", None, 1)),
])  # fmt: skip
def test_a_wrong_light_is_refused(wrong):
    with pytest.raises(InputError, match=next(iter(wrong))):
        post.Light(**{"direction": (1, 2, 3), **wrong})


T = np.zeros((2, 3))
C = np.zeros((2, 3, 3))
MIXED = T, T.astype(np.float32)


@pytest.mark.parametrize(("make", "refused"), [
    (post.blur, [(T, sigma) for sigma in (-1.0, np.nan, 1024.1, np.inf)]),
    (post.blur, [(bad, 1.0) for bad in (T[0], T.astype(np.float16), T[:, :0], T.tolist())]),
    (post.merge, [([],), ([T, T[:1]],), ([T.astype(int)],), ([T[0]],), (np.zeros((0, 2, 3)),), (list(MIXED),)]),
    (post.shade_white, [(T[0], T[0]), (T, T[:1]), MIXED]),
    (post.shade, [(np.zeros(shape), T) for shape in ((2, 3), (2, 3, 4), (3, 2, 3))]),
    (post.shade, [(np.zeros((2, 3, 3), np.float32), T)]),
    (post.shade, [(C, T, normals, post.Light((1, 2, 3))) for normals in (None, C[:1], C + np.nan, C.astype("f4"), 5)]),
    (post.shade, [(C, T, C, light) for light in (0, (1, 2, 3), "all")]),
])  # fmt: skip
def test_the_passes_refuse_what_does_not_fit(make, refused):
    for arguments in refused:
        with pytest.raises(InputError):
            make(*arguments)
