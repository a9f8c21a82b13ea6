"""Displays of all kinds: the reference, the textbook, round trips, views, refusals, presets."""

import math
from dataclasses import replace

import numba
import numpy as np
import pytest
from bits import assert_same_bits
from display_cases import PRESETS, ROUNDINGS, SHAPES, calibrated, displays, presets, round_trip_error, texels, unit
from hypothesis import assume, given, reject, settings
from hypothesis import strategies as st
from reference import mapping as reference
from reference import textbook
from reference.passes import algorithm2

from lfssao import Display, Mesh, Module, RayCaster, WorldToImage, make_samples
from lfssao.ao import ssao
from lfssao.errors import InputError
from lfssao.optics.kernels import display as kernels
from lfssao.optics.kernels import projection as mapping
from lfssao.optics.kernels import rays

VALID = kernels.VALID
OUTSIDE = kernels.OUTSIDE
WORLD = np.hstack([np.diag([1.0, 1.0, -1.0]), np.zeros((3, 1))])
both = pytest.mark.parametrize("dtype", [np.float32, np.float64])


def numbers_of_any_kind(draw, dtype):
    """A module's 32 numbers: of a drawn display, or from a pool with ties, edges and extreme values."""
    if draw(st.booleans()):
        return draw(displays()).module_numbers(0).astype(dtype)
    width = 32 if dtype == np.float32 else 64
    lattice = st.sampled_from([0.0, -0.0, 1.0, -1.0, 2.0, -2.0, 0.5, 3.0])
    pool = draw(st.sampled_from([lattice, st.one_of(lattice, st.floats(-8, 8, width=width), st.floats(width=width))]))
    d = np.array(draw(st.lists(pool, min_size=32, max_size=32)), dtype)
    if draw(st.booleans()):  # so that most get as far as the optics
        d[2], d[4], d[14:17] = abs(d[2]) + 1, -abs(d[4]) - 1, (0, 0, 1)
    return d


def coordinates(dtype):
    width = 32 if dtype == np.float32 else 64
    special = st.sampled_from([0.0, -0.0, 1.0, -1.0, 0.5, -2.0])
    return st.tuples(*[st.one_of(st.floats(-2, 2, width=width), special, st.floats(width=width))] * 3)


# The reference and the textbook


@both
@settings(max_examples=500)
@given(data=st.data())
def test_physical_to_image_equals_the_reference(dtype, data):
    d = numbers_of_any_kind(data.draw, dtype)
    for point in data.draw(st.lists(coordinates(dtype), min_size=1, max_size=6)):
        x, y, z = np.array(point, dtype)
        with np.errstate(all="ignore"):
            actual = kernels.physical_to_image(kernels.display_module(d), x, y, z)
            want = reference.physical_to_image(d, x, y, z)
        assert actual[2] == want[2]
        for a, b in zip(actual[:2], want[:2], strict=True):
            assert type(b) is dtype
            assert (math.isnan(a) and math.isnan(b)) or dtype(a).tobytes() == b.tobytes()


@settings(max_examples=200)
@given(display=displays(), points=st.lists(st.tuples(unit, unit, st.floats(-0.9, 0.9)), min_size=4, max_size=12))
def test_images_are_the_textbooks_and_their_rays_go_through_the_points(display, points):
    """1e-9 texel, or that share of coordinates far outside the texture; z from 0.9 z_o to 0.9 m_z.

    By the display and by its view, where flat displays have a mapping and rays of their own.
    """
    m = display.modules[0]
    d = display.module_numbers(0).tolist()
    points = np.array(points)
    points[:, 2] *= np.where(points[:, 2] > 0, m.z, -display.observer_z)
    image, answers = display.physical_to_image(0, points)
    keep = np.isin(answers, (VALID, OUTSIDE)) & (np.abs(np.nan_to_num(image[:, :2])) < 20 * m.width).all(axis=1)
    view, (u, v, depth), points = display.view(0, WORLD), image[keep].T, points[keep]
    np.testing.assert_array_equal(depth, points[:, 2])
    found = view.world_to_image(points * [1, 1, -1])
    np.testing.assert_allclose(found, image[keep], rtol=1e-11, atol=1e-9)
    origin, direction, span = display.texel_ray(0, u, v)
    assert ((span[:, 0] < depth) & (depth < span[:, 1])).all()
    np.testing.assert_allclose(origin + depth[:, None] * direction, points, rtol=0, atol=1e-8)
    for place, *centre in zip(points, u, v, strict=True):
        ray = np.array(rays.texel_ray(view.rays, *centre))
        np.testing.assert_allclose(ray[:3] + place[2] * ray[3:6], place, rtol=0, atol=1e-8)
    assume(all(abs(c) > 0.01 or c == 0 for c in d[5:7]))  # circles larger than that cost the oracle's formula digits
    optics = d[:3], d[3:5], tuple(d[5:7]), d[7], d[8:17], d[17:22]
    want = [textbook.image(*optics, point) for point in points.tolist()]
    np.testing.assert_allclose(image[keep, :2], np.reshape(want, (-1, 2)), rtol=1e-11, atol=1e-9)


@both
@given(display=displays(), size=st.sampled_from([(1, 1), (13, 9), (3, 17), (40, 2)]), seed=st.integers(0, 2**32))
def test_algorithm2_of_any_display_equals_the_reference(dtype, display, size, seed):
    """Points and depths anywhere near the screen, a tenth missing."""
    try:
        display = display.with_resolution(*size)
    except InputError:  # in a texture of another shape its distortion would fold
        reject()
    rng = np.random.default_rng(seed)
    shape = size[::-1]
    there = rng.random(shape) < 0.9
    depth = np.where(there, rng.uniform(-0.2, 0.2, shape), np.inf).astype(dtype)
    positions = np.where(there[..., None], rng.uniform(-0.4, 0.4, (*shape, 3)), np.inf).astype(dtype)
    world = np.hstack([np.diag([0.5, 0.4, -0.6]), rng.uniform(-0.05, 0.05, (3, 1))])
    numbers = np.concatenate([world.ravel(), display.module_numbers(0)])
    samples = make_samples("random", 7, 3)
    radius = rng.choice([0.02, 0.5, 10.0])
    actual = ssao.algorithm2(depth, positions, WorldToImage(mapping.DISPLAY, numbers), samples, radius)
    offsets = (radius * samples).astype(dtype)
    occlusion, answers = algorithm2(depth, positions, offsets, "display", numbers.astype(dtype))
    assert_same_bits(actual.texture, occlusion)
    assert actual.outside == answers[:, 1:].sum()


@both
@pytest.mark.parametrize("kind", [mapping.DISPLAY, mapping.CROSSED_SLITS])
def test_left_and_top_edges_are_in_the_texture_and_right_and_bottom_ones_are_not(dtype, kind):
    """Points of the screen, whose coordinates are exact, before surfaces that hide them."""
    display = Display("even", 4.0, 2.0, 0.0, -2.0, (Module(0.0, 0.0, 1.0, 4, 2),), ((-1, -1, -0.5), (1, 1, 0.5)))
    points = np.array([(-2, 0, 0), (2, 0, 0), (0, 1, 0), (0, -1, 0), (-2, 1, 0), (2, -1, 0), (0, 0, 0), (1, 0.5, 0)])
    inside = [True, False, True, False, True, False, True, True]
    image, answers = display.physical_to_image(0, points)
    assert answers.tolist() == [VALID if one else OUTSIDE for one in inside]
    np.testing.assert_array_equal(image[:, :2], points[:, :2] * [1, -1] + [2, 1])
    numbers = np.concatenate([WORLD.ravel(), display.module_numbers(0)])
    to_image = WorldToImage(kind, numbers) if kind == mapping.DISPLAY else display.view(0, WORLD).world_to_image
    depth = np.full((2, 4), -1, dtype)
    positions = points.reshape(2, 4, 3).astype(dtype)
    found = ssao.algorithm2(depth, positions, to_image, np.zeros((4, 3)), 1.0)
    assert found.texture.ravel().tolist() == inside
    assert found.outside == 4 * inside.count(False)


# Round trips


@presets
def test_points_of_a_presets_rays_land_on_their_texels(display):
    for index, m in enumerate(display.modules):
        worst, there = round_trip_error(display, index, *texels(m, index))
        # The outer texels of picoarray's outer modules light no part of the screen; some pass the observers before it.
        assert there.sum() >= 3 if display.name == "picoarray" else there.all()
        assert worst < ROUNDINGS


@settings(max_examples=200)
@given(display=displays(), seed=st.integers(0, 2**32))
def test_points_of_a_texels_ray_land_on_it(display, seed):
    m = display.modules[0]
    worst, there = round_trip_error(display, 0, *texels(m, seed))
    assert there.any()
    if display.screen_curvature == display.observer_curvature == 0 and m.field_of_view is m.homography is None:
        assert there.all()
    assert worst < ROUNDINGS


# Views, arrays, users' kernels, calibrated optics


@pytest.mark.parametrize("name", SHAPES)
def test_views_with_and_without_a_guard_band_of_a_mesh_that_reaches_behind_everything(name):
    """Triangles through the modules, the observers and beyond: what is seen lies on the texels' rays' spans."""
    display = SHAPES[name]
    rng = np.random.default_rng(36)
    vertices = (rng.uniform(-2, 2, (60, 1, 3)) + rng.uniform(-1.5, 1.5, (60, 3, 3))).reshape(-1, 3)
    caster = RayCaster(Mesh(vertices, np.arange(180).reshape(-1, 3)), WORLD)
    plain = display.view(0, WORLD)
    wide = display.view(0, WORLD, guard=7)
    assert (wide.width, wide.height) == (plain.width + 14, plain.height + 14)
    points = rng.uniform(-0.1, 0.1, (30, 3))
    np.testing.assert_allclose(
        wide.world_to_image(points), plain.world_to_image(points) + np.array([7, 7, 0]), rtol=0, atol=1e-9
    )  # fmt: skip
    g = caster.gbuffer(wide)
    assert (g.triangle[7:-7, 7:-7] != caster.gbuffer(plain).triangle).sum() <= 2
    assert not np.isnan(g.depth).any()
    assert not np.isnan(g.positions).any()
    seen = g.triangle >= 0
    assert 20 < seen.sum() < seen.size
    assert ((g.depth[seen] > display.observer_z) & (g.depth[seen] < display.modules[0].z)).all()
    ao = ssao.algorithm2(g.depth, g.positions, wide.world_to_image, make_samples("random", 16, 1), 2.0)
    assert not np.isnan(ao.texture).any()
    assert 0 < ao.outside <= 16 * seen.sum()


@numba.njit
def write_images(numbers, points, out):
    module = kernels.display_module(numbers)
    for k in range(points.shape[0]):
        out[k, 0], out[k, 1], out[k, 2] = kernels.physical_to_image(module, points[k, 0], points[k, 1], points[k, 2])


@pytest.mark.parametrize(("dtype", "texel"), [(np.float32, 1e-3), (np.float64, 0)])
def test_users_kernels_can_call_physical_to_image(dtype, texel):
    points = np.random.default_rng(37).uniform(-0.4, 0.4, (5000, 3)).astype(dtype)
    found = np.full_like(points, np.nan)
    write_images(SHAPES["convex"].module_numbers(0).astype(dtype), points, found)
    image, answers = SHAPES["convex"].physical_to_image(0, points)
    np.testing.assert_array_equal(found[:, 2], np.where(answers == OUTSIDE, VALID, answers))
    np.testing.assert_allclose(found[:, :2], np.nan_to_num(image[:, :2]), rtol=0, atol=texel)


def test_arrays_of_any_shape():
    display = SHAPES["conical"]
    points = np.random.default_rng(38).uniform(-0.3, 0.3, (4, 5, 3))
    image, answers = display.physical_to_image(0, points)
    for place in np.ndindex(4, 5):
        one, answer = display.physical_to_image(0, points[place].tolist())
        np.testing.assert_array_equal(one, image[place])
        assert (one.shape, answer) == ((3,), answers[place])
    turned, _ = display.physical_to_image(0, points.transpose(1, 0, 2))
    np.testing.assert_array_equal(turned, image.transpose(1, 0, 2))
    assert display.physical_to_image(0, np.zeros((0, 3)))[0].shape == (0, 3)
    grid = display.texel_ray(0, np.full((2, 1), 3.5), np.array([1.5, 2.5, 3.5]))
    assert [a.shape for a in grid] == [(2, 3, 3), (2, 3, 3), (2, 3, 2)]
    for one, all_of_them in zip(display.texel_ray(0, 3.5, 2.5), grid, strict=True):
        assert_same_bits(one, all_of_them[0, 1])


POINTS = np.random.default_rng(43).uniform(-0.1, 0.1, (30, 3))


@pytest.mark.parametrize("scale", [-2.0, -1.0, 0.25, 8.0])
def test_only_the_ratios_of_a_homography_matter(scale):
    """Powers of two, so that no digit is rounded: the projector that it was made of."""
    projector = SHAPES["projector"]
    display = replace(projector, modules=(calibrated(projector.modules[0], scale),))
    assert (display.physical_to_image(0, POINTS)[1] == VALID).any()
    for found, want in zip(display.physical_to_image(0, POINTS), projector.physical_to_image(0, POINTS), strict=True):
        np.testing.assert_array_equal(found, want)
    for found, want in zip(display.texel_ray(0, 9.5, 3.5), projector.texel_ray(0, 9.5, 3.5), strict=True):
        np.testing.assert_array_equal(found, want)


@pytest.mark.parametrize(("optics", "k1", "rows"), [(calibrated, 0.0, 3), (calibrated, 0.02, 2), (replace, 0.02, 2)])
def test_calibrated_optics_scale_with_the_resolution(optics, k1, rows):
    """Twice as many columns, as many times the rows; distortion and projectors' square texels are scaled evenly."""
    module = replace(optics(SHAPES["projector"].modules[0]), k1=k1)
    display = replace(SHAPES["projector"], modules=(module,))
    larger, _ = display.with_resolution(2 * 97, rows * 61).physical_to_image(0, POINTS)
    image, _ = display.physical_to_image(0, POINTS)
    np.testing.assert_allclose(larger, image * [2, rows, 1], rtol=0, atol=1e-9)


# Refusals (by files: test_display_file.py)

M = Module(0.0, 0.0, 0.5, 64, 48)
REFUSED = {  # by key: changes of the display, and of its module
    "observer.distance": [
        {"observer_z": 0.0},
        {"observer_z": 1.0},
        {"observer_z": -0.3, "screen_curvature": -1.9},  # behind a concave screen's edges
        {"observer_z": -0.3, "observer_curvature": 3.0},  # an arc through the screen
    ],
    "observer.height": [{"observer_height": math.nan}],
    "screen.width": [{"screen_width": 0.0}],
    "screen.height": [{"screen_height": math.inf}],
    "screen.radius": [{"screen_curvature": 2.0}],
    "diffuser": [
        {"diffuser": "round"},
        *({"diffuser": "conical", f"{w}_curvature": 0.1} for w in ("screen", "observer")),
    ],
    "modules": [{"modules": ()}],
    "modules[0]": [{"yaw": 120.0, "field_of_view": 40.0}],  # it looks away
    "modules[0].x": [{"x": math.nan}, {"x": math.inf}],
    "modules[0].z": [{"z": 0.0}, {"z": 0.2, "x": 0.45, "screen_curvature": 1.9}],  # before a convex screen's side
    "modules[1].z": [{"modules": (M, replace(M, z=-0.5))}],
    "modules[0].resolution": [{"height": 0}],
    "modules[0].field_of_view": [{"field_of_view": 180.0}],
    "modules[0].yaw": [{"roll": 1.0}],
    "modules[0].homography": [{"homography": (1.0,) * 9}, {"homography": (1.0,) * 9, "field_of_view": 9.0}],
    "modules[0].k1": [{"k1": math.nan}, {"k1": -0.2}, {"k1": -0.0949}],  # the last folds at the corner
    "roi": [
        {"roi": ((-0.1, -0.1, 0.1), (0.1, 0.1, 0.1))},
        {"roi": ((-1.9, -0.1, -1.0), (1.9, 0.1, 0.1)), "observer_curvature": 0.5},  # beyond the arc
        # Through the conical diffuser's singular surface, which is curved.
        {"roi": ((-0.1, 0.0, -0.1), (0.1, 1.5, 0.46)), "diffuser": "conical", "observer_z": -1.0, "y": 0.5},
    ],
    "roi.min": [{"roi": ((-0.1, -0.1, -2.0), (0.1, 0.1, 0.1))}],
    "roi.max": [{"roi": ((-0.1, -0.1, -0.2), (0.1, 0.1, 0.5))}],
}


@pytest.mark.parametrize(("key", "changes"), [(key, one) for key, several in REFUSED.items() for one in several])
def test_impossible_displays_are_refused_by_their_key(key, changes):
    module, display = ({k: v for k, v in changes.items() if hasattr(M, k) == of_module} for of_module in (True, False))
    fine = Display("fine", 1.0, 0.6, 0.0, -2.0, (M,), ((-0.1, -0.1, -0.1), (0.1, 0.1, 0.1)))
    replace(fine, observer_z=-0.4, screen_curvature=-1.9)  # its edges are at z = -0.36
    replace(fine, modules=(replace(M, field_of_view=0.5),))
    with pytest.raises(InputError) as caught:
        replace(fine, **{"modules": (replace(M, **module),), **display})
    assert str(caught.value).startswith(f"display fine: {key}: ")
    assert "\n" not in str(caught.value)


# The presets' geometry


@presets
def test_every_module_of_a_preset_sees_much_of_the_roi(display):
    axes = [np.linspace(a, b, 9) for a, b in zip(*display.roi, strict=True)]
    points = np.stack(np.meshgrid(*axes), axis=-1)
    seen = np.array([display.physical_to_image(k, points)[1] == VALID for k in range(len(display.modules))])
    fractions = seen.mean(axis=(1, 2, 3))
    assert fractions.min() > 0.4
    np.testing.assert_allclose(fractions, fractions[::-1], rtol=0, atol=0.02)
    assert seen.any(axis=0).mean() > 0.8


PICO = np.radians(1.66 * (np.arange(72) - 35.5))
CONVEX = np.radians(np.linspace(-50, 50, 48))


@pytest.mark.parametrize(("name", "size", "x", "z"), [
    ("virtual", (1024, 768), [0.0], 0.7),
    ("sample-a", (1000, 600), np.arange(-1000, 1001, 100) / 1000, 0.7),
    ("sample-a-conical", (1000, 600), np.arange(-1000, 1001, 100) / 1000, 0.7),
    ("sample-b", (800, 600), np.arange(-1000, 1001, 50) / 1000, 0.4),
    ("c80", (1024, 768), np.linspace(-2.33, 2.33, 80), 2.0),
    ("picoarray", (480, 320), 0.6 * np.sin(PICO), 0.6 * np.cos(PICO)),
    ("convex", (1024, 768), 0.7 * np.sin(CONVEX), 1.5 - 0.7 * np.cos(CONVEX)),
])  # fmt: skip
def test_modules_stand_where_they_are_published_or_assumed(name, size, x, z):
    assert (PRESETS[name].diffuser == "conical") == (name in ("sample-a-conical", "sample-b"))
    modules = PRESETS[name].modules
    assert {(m.width, m.height) for m in modules} == {size}
    np.testing.assert_allclose([m.x for m in modules], x, rtol=0, atol=1e-12)
    np.testing.assert_allclose([m.z for m in modules], z, rtol=0, atol=1e-12)


def test_picoarrays_middle_modules_cover_the_screen():
    corners = [(x, y, 0.0) for x in (-0.15, 0.15) for y in (-0.15, 0.15)]
    assert (PRESETS["picoarray"].physical_to_image(35, corners)[1] == VALID).all()
