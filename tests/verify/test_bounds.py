"""The oracle's bounds: the kernels against the reference, the later stages by hand, how sharp they are, and reasons."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracle_scenes import critical_scene, drawn_view
from reference import bounds as reference
from reference import passes

from lfssao import Camera, InputError, RayCaster, builtin_scene, default_radii, find_display, make_samples, module_views
from lfssao.ao.post import blur
from lfssao.ao.ssao import algorithm2
from lfssao.optics.kernels.projection import MATRIX
from lfssao.optics.view import WorldToImage
from lfssao.verify.bounds import post, ssao
from lfssao.verify.bounds.bounds import Bounds, exact_bounds
from lfssao.verify.bounds.error_model import MODELS, ErrorModel, find_model
from lfssao.verify.bounds.explain import explainer
from lfssao.verify.bounds.kernels import point_bounds as kernels
from lfssao.verify.bounds.sao import sum_error

IDENTITY = WorldToImage(1, np.eye(4).ravel())
ULP = Fraction(1, 2**23)


# The kernels


@st.composite
def small_cases(draw):
    """Scenes next to decisions, and the same with numbers that no scene has."""
    height, width = draw(st.sampled_from([(3, 4), (1, 9), (1, 1), (5, 2)]))
    view = drawn_view(draw, height, width)
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    n = draw(st.sampled_from([1, 3, 5]))
    radius = draw(st.sampled_from([0.01, 0.3, 2.0, 1e-40]))
    depth, positions, samples = critical_scene(rng, view, n, radius)
    if draw(st.booleans()):
        odd = np.array([0.0, -0.0, 1e-40, -1e-40, 1e30, -np.inf, 3.0], np.float32)
        depth = np.where(rng.random(depth.shape) < 0.3, rng.choice(odd, depth.shape), depth)
        if positions is not None:
            positions[rng.random(depth.shape) < 0.3] = rng.choice([0.0, 1e-40, -2.5, 1e30, 40.0], 3)
    if draw(st.booleans()):
        samples = np.round(8 * samples) / 8  # exact offsets, on a lattice
    return view, depth, positions, samples, radius, draw(st.sampled_from(["shader", "sampler", "nearest"]))


@settings(max_examples=60)
@given(small_cases())
def test_outcomes_are_the_references_and_no_more_are_in_doubt(case):
    view, depth, positions, samples, radius, model = case
    back = view.screen_to_world if positions is None else None
    by = find_model(model).errors
    points = ssao.sample_points(samples, radius)
    seen = ssao.with_depth_ends(
        ssao.checked_view(depth, positions, view.world_to_image, radius, back), find_model(model)
    )
    fewest = np.full(depth.shape, -9, np.int32)
    most = np.full(depth.shape, -9, np.int32)
    kernels.count_hidden(seen, points, by, fewest, most)
    found = np.empty((len(samples), 9))
    # The reference has no room for distances, of which renderers make window depths (``linear_room``).
    windows = seen.kind == MATRIX and seen.numbers[8:11].any() and seen.numbers[12:15].any()
    for j, i in np.ndindex(depth.shape):
        if not depth[j, i] < np.inf:
            assert fewest[j, i] == most[j, i] == 0
            continue
        kernels.trace_samples(seen, points, j, i, by, found)
        if back is None:
            pairs = [reference.number(c, by) for c in positions[j, i]]
        else:
            pairs = reference.texel_point(seen.back, i, j, depth[j, i], by)
        sets = []
        for o, certain, row in zip(points.offsets, points.is_exact, found, strict=True):
            mapping = seen.kind, seen.numbers
            u, v, z, truths, outcomes_of = reference.sample(depth, pairs, o, certain, *mapping, by, back is None)
            sets.append(outcomes_of)
            assert row[6] <= (True in truths)
            assert row[7] >= (truths == {True})
            assert windows or (row[8] == 2) <= (len(outcomes_of) == 2)
            assert row[8] == 2 or bool(row[8]) in outcomes_of
            if row[6] and max(u.e, v.e, z.e) < np.inf:
                assert (abs(row[:6:2] - [u.x, v.x, z.x]) <= 1e-6 * np.array([u.e, v.e, z.e]) + 1e-30).all()
                no_wider = row[1:6:2] <= 1.001 * np.array([u.e, v.e, z.e]) + 1e-30
                assert no_wider[: 2 if windows else 3].all()
        assert windows or fewest[j, i] >= sum(a == {True} for a in sets)
        assert windows or most[j, i] <= sum(True in a for a in sets)


# Counts


def row_of(depth, sample):
    """Fewest, most and undecided at the first of a row of texels whose points are their centres, by one sample."""
    depth = np.array([depth], np.float32)
    width = depth.shape[1]
    positions = np.stack([np.arange(width) + 0.5, np.full(width, 0.5), depth[0]], axis=-1).astype(np.float32)[None]
    found = ssao.ao_bounds(depth, positions, IDENTITY, np.array([sample]), 1.0)
    return found.lower[0, 0], found.upper[0, 0], found.undecided[0, 0]


def test_a_sample_on_an_edge_is_undecided_where_the_texels_differ_and_only_there():
    # u = 1 lies in texel 1, or a rounding before it in texel 0: surfaces at 0 and 5 differ, 0 and 1 do not at z = 3.
    assert row_of([0, 5, np.inf], (0.5, 0, 3.0))[2] == 1
    assert row_of([0, 1, np.inf], (0.5, 0, 3.0))[2] == 0
    assert row_of([0, 5, np.inf], (0.5, 0, -3.0))[2] == 0
    assert row_of([0, 5, np.inf], (0.499, 0, 3.0))[2] == 0
    # The border of the texture is an edge with nothing beyond.
    assert row_of([0], (0.5, 0, 3.0))[2] == 1  # u = 1: outside, or in the last digits before
    assert row_of([0], (0.5, 0, -3.0))[2] == 0
    assert row_of([0], (0.6, 0, 3.0)) == (0, 0, 0)


def test_a_tie_that_no_operation_rounds_is_clear_and_one_that_may_round_is_undecided():
    slits = WorldToImage(0, np.array([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 3, -2, 0.5, 0.5], float))
    depth = np.zeros((1, 1), np.float32)
    position = np.zeros((1, 1, 3), np.float32)
    for z, undecided in ((0.0, 0), (0.125, 0), (0.1, 1)):  # 0.1 in float64, rounded, or a rounded 1 times a rounded 0.1
        depth[:], position[..., 2] = np.float32(z) * 2, np.float32(z)
        found = ssao.ao_bounds(depth, position, slits, np.array([[0.0, 0.0, z]]), 1.0)
        assert found.undecided.tolist() == [[undecided]]
        assert found.lower.tolist() == [[0.0]]


def test_a_tie_stays_clear_where_a_turn_leaves_the_depth():
    """Cosine 0.6 and sine 0.8; x is no part of the depth, or all of it."""
    for part, undecided in ((0.0, 0), (1.0, 1)):
        slits = WorldToImage(0, np.array([1, 0, 0, 0, 0, 1, 0, 0, part, 0, 1, 0, 3, -2, 0.5, 0.5], float))
        depth = np.full((1, 1), 0.25 + part * 0.15, np.float32)
        position = np.float32([[[0, 0, 0.125]]])
        turns = np.float32([[[0.6]], [[0.8]]])
        sample = np.array([[0.25, 0.0, 0.125]])
        assert ssao.ao_bounds(depth, position, slits, sample, 1.0, turns=turns).undecided.tolist() == [[undecided]]


def worst(roundings):
    """The largest factor that a quotient and so many other roundings of the shader model may make."""
    return float((1 + Fraction(7, 2) * ULP) * (1 + ULP) ** roundings)


@pytest.mark.parametrize("n", [1, 3, 8, 12, 33, 64, 100])
def test_fractions_and_sums_hold_the_worst_rounding_and_little_more(n):
    low, high = ssao.fraction_bounds(n, MODELS["shader"])
    for k in range(1, n + 1):  # 1 / n, rounded as a quotient, added k times
        grown = worst(k - 1)
        assert high[k] >= np.nextafter(np.float32(k / n * grown), np.float32(0))
        assert low[k] <= np.nextafter(np.float32(k / n * (2 - grown)), np.float32(2))
        assert max(high[k] - k / n * grown, k / n * (2 - grown) - low[k]) < 2.0**-22
    assert (high[:-1] < low[1:]).all()
    assert (low[0], high[0]) == (0, 0)
    assert 0 <= sum_error(n, MODELS["shader"]) - (worst(n + 3) - 1) < 2.0**-39 * n


# Models


@pytest.mark.parametrize("seed", range(3))
def test_strict_bounds_are_the_reference_and_the_models_nest(seed):
    rng = np.random.default_rng(seed)
    view = module_views(builtin_scene("ammonite"), find_display("virtual").with_resolution(12, 9))[0]
    depth, positions, samples = critical_scene(rng, view, 5, 0.3)
    given = depth, positions, view.world_to_image, samples, 0.3
    found = {name: ssao.ao_bounds(*given, name) for name in MODELS}
    texture = algorithm2(*given).texture
    np.testing.assert_array_equal(found["strict"].lower.view(np.int32), texture.view(np.int32))
    np.testing.assert_array_equal(found["strict"].upper.view(np.int32), texture.view(np.int32))
    for inner, outer in (("strict", "nearest"), ("nearest", "shader"), ("shader", "sampler")):
        assert (found[outer].lower <= found[inner].lower).all()
        assert (found[inner].upper <= found[outer].upper).all()
    for sigma in (0.0, 0.7):
        blurred = post.blur_bounds(exact_bounds(texture), sigma, "strict")
        np.testing.assert_array_equal(blurred.lower, blur(texture, sigma))
        assert blurred.lower is blurred.upper or (blurred.lower == blurred.upper).all()


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("sigma", [0.0, 1e-9, 0.05, 0.4, 1.0, 6.0])
def test_blur_bounds_hold_the_blur_of_occlusion_and_of_visibility(model, sigma):
    rng = np.random.default_rng(5)
    texture = (rng.integers(0, 9, (7, 9)) / 8).astype(np.float32)
    found = post.blur_bounds(exact_bounds(texture), sigma, model)
    assert not found.outside(blur(texture, sigma)).any()
    assert (found.upper - found.lower).max() <= 5e-5
    if model != "strict":  # with little occlusion, light rounds most
        for dark in (texture, 0 * texture, texture / 1000):
            found = post.blur_bounds(exact_bounds(dark), sigma, model)
            assert not found.outside(1 - blur(1 - dark, sigma)).any()
            assert (found.upper - found.lower).max() <= 5e-5


@pytest.mark.parametrize("sigma", [0.4, 1.0, 30.0, 1024.0])
def test_errors_of_weights_cover_an_exact_gaussian_and_no_more(sigma):
    """A renderer that hardly rounds is off the table by the table's own rounding, half a quantum but at the centre."""
    errors = post.weight_errors(sigma, ErrorModel("fine", "", False, 2.0**-50, 2.0**-50, 2.0**-50, (2.0**-50, 0.0)))
    off = np.abs(np.array(passes.blur_weights(sigma)) - passes.blur_table(sigma))
    assert (off <= errors).all()
    assert (errors <= off + 2.0**-36).all()
    assert np.delete(errors, len(errors) // 2).max() <= 2.0**-25 * (1 + 2.0**-10)


def test_shade_bounds_turn_with_the_sign_of_the_colour():
    occlusion = Bounds(np.float32([[0.25]]), np.float32([[0.5]]))
    found = post.shade_bounds(np.float32([[[1.0, -1.0, 0.0]]]), occlusion)
    np.testing.assert_allclose(found.lower, [[[0.5, -0.75, 0.0]]], rtol=1e-6)
    np.testing.assert_allclose(found.upper, [[[0.75, -0.5, 0.0]]], rtol=1e-6)
    assert found.lower[0, 0, 0] < 0.5
    assert found.upper[0, 0, 0] > 0.75


def test_merge_bounds_are_maxima_and_undecided_samples_add_up():
    a = Bounds(np.float32([[0.1, 0.5]]), np.float32([[0.3, 0.5]]), np.int32([[2, 0]]))
    b = Bounds(np.float32([[0.2, 0.1]]), np.float32([[0.2, 0.9]]), np.int32([[0, 1]]))
    found = post.merge_bounds([a, b])
    np.testing.assert_array_equal(found.lower, np.float32([[0.2, 0.5]]))
    np.testing.assert_array_equal(found.upper, np.float32([[0.3, 0.9]]))
    assert found.undecided.tolist() == [[2, 1]]


def test_a_number_that_is_none_is_outside():
    found = exact_bounds(np.float32([[0.5, 0.5]])).outside(np.float32([[np.nan, 0.5]]))
    assert found.tolist() == [[True, False]]


# Sharpness


@pytest.mark.slow
@pytest.mark.parametrize("name", ["gallery", "statue", "armadillo", "ammonite"])
def test_few_samples_are_undecided_in_the_embedded_scenes(name):
    """At most 0.5 % of the samples at visible points, at least 95 % of the visible texels certain, in every radius."""
    mesh = builtin_scene(name)
    display = find_display("virtual").with_resolution(256, 192)
    for view in (module_views(mesh, display)[0], Camera.looking_at(mesh.bounds).view(256, 192)):
        gbuffer = RayCaster(mesh, view.cast_from_world).gbuffer(view, color=None)
        samples = make_samples()
        surface = gbuffer.depth < np.inf
        for radius in default_radii(mesh):
            given = gbuffer.depth, gbuffer.positions, view.world_to_image, samples, radius
            undecided = ssao.ao_bounds(*given, screen_to_world=view.screen_to_world).undecided[surface]
            assert undecided.sum() <= 0.005 * undecided.size * len(samples)
            assert (undecided == 0).mean() >= 0.95


# Reasons


def test_explain_names_the_texel_the_edge_and_the_error():
    depth = np.float32([[0, 5, np.inf]])
    positions = np.zeros((1, 3, 3), np.float32)
    positions[0, 0] = 0.5, 0.5, 0.0
    samples = np.array([(0.25, 0, -3), (0.5, 0, 3), (2, 0, 9), (9, 0, 9), (0, 0.375, -3)])
    found = explainer(depth, positions, IDENTITY, samples, 1.0)((0, 0))
    assert found[0].number == 1
    near, edge, empty, off, low = sorted(found, key=lambda s: s.number)
    assert [s.outcome for s in (near, edge, empty, off, low)] == ["clear", "undecided", "clear", "clear", "clear"]
    assert (edge.texel, edge.edge_distance, edge.depth_behind) == ((1, 0), 0.0, -2.0)
    assert (near.edge_distance, low.edge_distance, empty.depth_behind, off.texel) == (0.25, 0.125, -np.inf, None)
    assert 0 < edge.error_uv < 1e-5
    assert str(near).startswith("sample 0 is clear: it reads texel (0, 0), 2.5e-01 from its edge")
    assert "3.0e+00 before its surface" in str(near)
    assert "sees no surface" in str(empty)
    assert "outside the texture" in str(off)
    assert explainer(depth, positions, IDENTITY, samples, 1.0)((2, 0)) == []


def test_explain_of_algorithm_1_has_its_points_from_depth():
    depth = np.float32([[0, 2, 0]])
    samples = np.array([(1, 0, 1.0)])
    found = explainer(depth, None, IDENTITY, samples, 1.0, "strict", np.eye(4))((1, 0))
    assert [(s.u, s.v, s.z, s.texel, s.outcome) for s in found] == [(2.5, 0.5, 3.0, (2, 0), "occluded")]


GLSL = {"operation": Fraction(1), "division": Fraction(5, 2), "root": Fraction(9, 2), "sine": Fraction(2**12)}
IEEE = {"operation": Fraction(1, 2), "division": Fraction(1, 2), "root": Fraction(1, 2), "sine": Fraction(1)}


@pytest.mark.parametrize(("name", "off", "centre", "coordinate", "exponential"), [
    ("shader", GLSL, -8, 0, (3, 2)), ("sampler", GLSL, -8, 2.0**-8, (3, 2)), ("nearest", IEEE, -12, 0, (2, 0)),
])  # fmt: skip
def test_the_numbers_of_a_model_are_those_of_its_operations(name, off, centre, coordinate, exponential):
    """In ulp, as its documentation lists them: of a (1 / b), a root, and a sine of the sum of two rounded angles."""
    model = MODELS[name]
    ulp = Fraction(1, 2**23)
    operation, division, root = (off[kind] * ulp for kind in ("operation", "division", "root"))
    assert (model.operation, model.smallest) == (operation, 2.0**-126)
    quotient = (1 + division) * (1 + operation) - 1
    for most, needed in ((model.quotient, quotient), (model.root, root)):
        assert needed <= Fraction(most) <= needed * (1 + 8 * ulp)
    angles = 8 * operation  # those of up to pi by 2 ulp each, their sum by 4
    assert angles < Fraction(model.angle) - off["sine"] * ulp <= 16 * operation
    assert (model.centre, model.coordinate) == (2.0**centre, coordinate)
    assert tuple(part * 2**23 for part in model.exponential) == exponential


def test_what_does_not_fit_is_refused():
    depth = np.zeros((2, 3), np.float32)
    positions = np.zeros((2, 3, 3), np.float32)
    samples = np.zeros((1, 3))
    good = {"depth": depth, "positions": positions, "world_to_image": IDENTITY, "samples": samples, "radius": 1.0}
    slits = WorldToImage(0, np.ones(16))
    bad = [
        {"depth": depth.astype(float)}, {"depth": depth[0]}, {"positions": None}, {"positions": positions[:1]},
        {"samples": samples[:, :2]}, {"samples": samples + np.nan}, {"radius": -1.0}, {"model": "vague"},
        {"screen_to_world": np.eye(3)}, {"screen_to_world": np.eye(4), "world_to_image": slits},
    ]  # fmt: skip
    ssao.ao_bounds(**good)
    for change in bad:
        with pytest.raises(InputError):
            ssao.ao_bounds(**{**good, **change})
    with pytest.raises(InputError, match="shader, sampler, nearest, strict"):
        find_model("vague")
    with pytest.raises(InputError):
        post.shade_bounds(positions, exact_bounds(depth[:1]))
    with pytest.raises(InputError):
        post.merge_bounds([])
