"""World -> image and the rays of texels: the reference, DESIGN section 2's geometry, every module of every preset."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reference import mapping as reference
from reference import raycast, textbook

from lfssao import Display, Module, find_display, fit_roi
from lfssao.gbuffer.kernels import albedo as paint
from lfssao.optics.kernels import projection as mapping
from lfssao.optics.kernels import rays
from lfssao.optics.kernels.projection import Projection
from lfssao.optics.view import KINDS

ROI = ((-0.4, -0.3, -0.1), (0.4, 0.3, 0.1))  # between the nearest observers and modules that are drawn
WORLD_BOX = np.array([[-1.0, -2.0, -3.0], [4.0, 2.0, 1.0]])
presets = pytest.mark.parametrize("display", [find_display("virtual"), find_display("sample-a")], ids=str)
unit = st.floats(-1, 1)


def bits(values, dtype=np.float64):
    return np.array(values, dtype).view(np.int32 if dtype == np.float32 else np.int64)


def flat_displays():
    """A display of one module; its distances within a factor of ten of the screen's size."""
    module = st.builds(Module, unit, unit, st.floats(0.2, 2), st.integers(1, 2000), st.integers(1, 2000))
    size = st.floats(0.3, 3)
    return st.builds(
        lambda w, h, y, z, m: Display("drawn", w, h, y, z, (m,), ROI),
        size, size, unit, st.floats(-3, -0.3), module,
    )  # fmt: skip


# The reference


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
        actual, name = mapping.world_to_image(Projection(kind, m), x, y, z), KINDS[kind]
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


@given(st.integers(0, 99), st.integers(1, 4), st.integers(1, 4), st.integers(0, 5), st.floats(-5, 5), st.floats(-5, 5))
def test_sample_texture_equals_the_reference(seed, wide, high, first, u, v):
    texels = np.random.default_rng(seed).random((first + wide * high + 1, 3), np.float32)
    texture = texels[first : first + wide * high].reshape(high, wide, 3)
    for channel in range(3):
        actual = paint.sample_texture(texels, first, wide, high, u, v, channel)
        assert bits(actual) == bits(raycast.sample_texture(texture, u, v, channel))


# Domains and textures by hand


@pytest.mark.parametrize(("q", "valid"), [(2.0, True), (5e-324, True), (0.0, False), (-0.0, False), (-1.0, False)])
def test_a_matrix_is_defined_for_positive_q(q, valid):
    m = np.eye(4)
    m[3] = [0, 0, 0, q]
    assert mapping.world_to_image(Projection(mapping.MATRIX, m.ravel()), 0.0, 0.0, 0.0)[3] is valid


@pytest.mark.parametrize(("z", "valid"), [(3.0, False), (2.5, True), (-1.5, True), (-2.0, False), (math.nan, False)])
def test_crossed_slits_are_defined_between_the_slits(z, valid):
    m = np.array([1.0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 3, -2, 10, 20])  # z_m = 3, z_o = -2
    u, v, depth, defined = mapping.world_to_image(Projection(mapping.CROSSED_SLITS, m), 1.0, 7.0, z)
    assert defined is valid
    if z == 2.5:
        assert (u, v, depth) == (10 + 1 / 0.5, 20 + 7 / -4.5, 2.5)


def test_sample_texture_by_hand():
    texels = np.zeros((5, 3), np.float32)
    texels[1:, 0] = [1, 2, 3, 4]  # from number 1 on: upper row 1 2, lower row 3 4; v = 1 is the upper edge

    def at(u, v):
        return paint.sample_texture(texels, 1, 2, 2, u, v, 0)

    assert [at(0.25, 0.75), at(0.75, 0.75), at(0.25, 0.25), at(0.75, 0.25)] == [1, 2, 3, 4]  # centres
    assert at(0.5, 0.75) == 1.5
    assert at(0.5, 0.5) == 2.5
    assert at(0.0, 0.75) == at(1.0, 0.75) == at(-3.0, 0.75) == 1.5  # repeated: between 2 and 1
    assert at(0.25, 0.0) == at(0.25, 7.0) == 2  # between 3 and 1


# The geometry of displays


@given(display=flat_displays(), data=st.data())
def test_world_to_image_is_the_textbook_formula(display, data):
    m, world = display.modules[0], fit_roi(WORLD_BOX, display.roi)
    z = data.draw(st.floats(0.9 * display.observer_z, 0.9 * m.z))
    x, y = data.draw(unit), data.draw(unit)
    point = (np.array([x, y, z]) - world[:, 3]) / np.diag(world)
    u, v, depth = display.view(0, world).world_to_image(point)
    # 1e-9 texel, or that share of coordinates far outside the texture
    d = display.module_numbers(0).tolist()
    want = textbook.image(d[:3], d[3:5], (0, 0), False, d[8:17], d[17:22], (x, y, z))
    np.testing.assert_allclose([u, v], want, rtol=1e-12, atol=1e-9)
    assert depth == pytest.approx(z, abs=1e-14)


@presets
def test_points_of_a_texels_ray_land_on_its_centre(display):
    """All modules; texels at the corners, the middle and anywhere; z from 0.9 z_o to 0.9 m_z."""
    world = fit_roi(WORLD_BOX, display.roi)
    rng = np.random.default_rng(11)
    for number, m in enumerate(display.modules):
        view = display.view(number, world)
        u = np.array([0.5, m.width - 0.5, 0.5, m.width - 0.5, m.width / 2, *(rng.integers(0, m.width, 20) + 0.5)])
        v = np.array([0.5, 0.5, m.height - 0.5, m.height - 0.5, m.height / 2, *(rng.integers(0, m.height, 20) + 0.5)])
        for z in np.linspace(0.9 * display.observer_z, 0.9 * m.z, 12):
            points = []
            for centre in zip(u.tolist(), v.tolist(), strict=True):
                ox, oy, oz, dx, dy, dz, near, far = rays.texel_ray(view.rays, *centre)
                assert (oz, dz, near, far) == (0, 1, display.observer_z, m.z)
                points.append([ox + z * dx, oy + z * dy, z])
            image = view.world_to_image((np.array(points) - world[:, 3]) / np.diag(world))
            assert np.abs(image - np.stack([u, v, np.full_like(u, z)], axis=1)).max() < 1e-9


@given(display=flat_displays())
def test_behind_the_module_and_the_observers_there_is_no_image(display):
    mapped = display.view(0, np.eye(3, 4)).world_to_image
    m_z, z_o = display.modules[0].z, display.observer_z
    for z in (m_z, 2 * m_z, z_o, 2 * z_o):
        assert np.isnan(mapped([0.1, 0.1, z])).all()
    for z in (np.nextafter(m_z, 0), np.nextafter(z_o, 0)):
        assert not np.isnan(mapped([0.1, 0.1, z])).any()
