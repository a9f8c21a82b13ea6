"""Bounds of the other estimators that count points: float32 renderers stay inside, and few points are undecided.

As in ``test_sound`` scenes are drawn so that rounding matters. Normals are drawn at right angles to an offset
but for the last digits, so that the half ball's turn is next to its decision, too.
"""

from dataclasses import replace
from functools import partial

import analytic_scenes as scenes
import numpy as np
import oracle_scenes as oracle
import pytest
import random_renderer as rr
from hypothesis import given, settings
from hypothesis import strategies as st
from reference import bounds as reference

from lfssao import Camera, InputError, builtin_scene, find_display, module_views
from lfssao.ao.estimators.registry import ESTIMATORS, estimate, find_estimator
from lfssao.ao.estimators.vo.local_frame import ball_mirrors, disk_mirrors
from lfssao.ao.textures import Buffers
from lfssao.samples import make_samples
from lfssao.verify.bounds.error_model import MODELS, find_model
from lfssao.verify.bounds.kernels.images import map_positions
from lfssao.verify.bounds.points import BOUNDED, point_bounds
from lfssao.verify.bounds.view import occlusion_bounds
from lfssao.verify.kit.views import view_numbers

RENDERERS = 40
OTHERS = ("alchemy", "oriented-hemisphere", "vo-area", "vo-area-normal")  # which have tests of their own
COUNTED = [name for name in BOUNDED if find_estimator(name).default_samples()[0] is not None and name not in OTHERS]


def across(rng, offsets):
    """Unit vectors, float32, half of them at right angles to offsets (H, W, 3) but for rounding."""
    made = oracle.unit(rng.normal(size=offsets.shape))
    perpendicular = oracle.unit(np.cross(offsets, made))
    return np.where(rng.random(offsets.shape[:-1])[..., None] < 0.5, made, perpendicular).astype(np.float32)


def check_fractions(drawn, options, half):
    """Renderers of point or hemisphere against the bounds."""
    view, rng, name, radius, n, turning = drawn
    shape = view.height, view.width
    normals, turns = np.zeros((*shape, 3), np.float32), oracle.random_turns(rng, shape) if turning else None

    def moved(samples, number):
        o = oracle.turned(samples[number], turns) if turning else samples[number]
        if half:
            normals[:] = across(rng, o)
        side = np.where(np.einsum("ijk,ijk->ij", o, normals) < 0, -1, 1)
        return o * side[..., None]

    depth, positions, samples = oracle.critical_scene(rng, view, n, radius, moved)
    normals[~np.isfinite(depth)] = 0
    given = Buffers(view, depth, positions, normals if half else None, turns)
    estimator = "hemisphere" if half else "point"
    found = point_bounds(estimator, given, radius, samples, None, options, name)
    made = rr.points_behind(oracle.arithmetic(name, rng, RENDERERS), given, samples, radius, options)
    oracle.assert_inside(made, found, "fraction")
    right = estimate(estimator, given, radius, samples, **options)
    assert not found.outside(right.texture).any()
    return int(found.undecided.sum()), int((np.rint(made * n).max(0) - np.rint(made * n).min(0)).sum())


@pytest.mark.slow
@pytest.mark.parametrize("half", [False, True], ids=["point", "hemisphere"])
@settings(max_examples=20)
@given(
    oracle.drawn_problems(), st.booleans(), st.sampled_from(["depth", "positions"]),
    st.sampled_from(["open", "occludes"]), st.booleans(),
)  # fmt: skip
def test_no_renderer_that_counts_points_leaves_its_bounds(half, drawn, check, surface, background, remap):
    options = {"range_check": check, "surface": surface, "background": background}
    check_fractions(drawn, options | ({} if half else {"remap": remap}), half)


def both_radii(hidden, given, radius, options, mirrors, ar):
    """VO's occlusion by renderers, of one radius or two."""
    radii = (radius, options["second"] * radius) if options["second"] else (radius,)
    made = [hidden(ar, *given, r, options["thickness"], mirrors) for r in radii]
    return rr.dual(ar, *made, options["combine"]) if len(made) == 2 else made[0]


def check_volume(drawn, options, tangent):
    """Renderers of VO's points against the bounds."""
    view, rng, name, radius, n, turning = drawn
    shape = view.height, view.width
    turns = oracle.random_turns(rng, shape) if turning else None
    tiles = ball_mirrors(options["randomize"], options["seed"], np.dtype(np.float32))
    mirrors = oracle.mirrored(tiles, shape)
    normals = np.zeros((*shape, 3), np.float32)
    directions = np.broadcast_to(oracle.unit(rng.normal(size=3)), (*shape, 3)).astype(np.float32)
    deep = float(directions[0, 0] @ view.cast_from_world[2, :3])

    def moved(samples, number):
        o = samples[number].astype(np.float32).astype(float)
        o = oracle.turned(o, turns) if turning else o
        o = o - 2 * np.einsum("ijk,ijk->ij", o, mirrors)[..., None] * mirrors
        if tangent:
            normals[:] = across(rng, o)
        o = o - 2 * np.minimum(np.einsum("ijk,ijk->ij", o, normals), 0)[..., None] * normals
        back = options["thickness"] * deep * view.world_from_cast[:, 2] if rng.random() < 0.5 else 0.0
        return o - back / radius

    depth, positions, samples = oracle.critical_scene(rng, view, n, radius, moved)
    normals[~np.isfinite(depth)] = 0
    weights = rng.uniform(0.2, 3, n)
    given = oracle.seen_along(view, depth, positions, normals, turns, directions)
    estimator = "vo-points-normal" if tangent else "vo-points"
    fractions = (weights / np.cumsum(weights)[-1]).astype("f4")
    found = point_bounds(estimator, given, radius, samples, weights, options, name)
    made = partial(both_radii, rr.hidden_volume, (given, samples, fractions), radius, options, mirrors)
    return oracle.hold_renderers(name, rng, made, found)


def check_lines(drawn, options, tangent):
    """Renderers of VO's lines against the bounds; the places of some lines are next to another texel."""
    view, rng, name, radius, n, turning = drawn
    shape = view.height, view.width
    turns = oracle.random_turns(rng, shape) if turning else None
    mirrors = oracle.mirrored(disk_mirrors(options["randomize"], options["seed"], np.dtype(np.float32)), shape)
    ways = oracle.unit(oracle.unit(view.cast_from_world[2, :3]) + rng.choice([0.1, 0.8]) * rng.normal(size=(*shape, 3)))
    normals = oracle.unit(rng.normal(size=(*shape, 3)) - 2 * ways).astype(np.float32)
    a, b = oracle.disk_axes(view, ways, mirrors, turns if turning else (1.0, 0.0))

    def moved(samples, number):
        x, y, _ = 0.7 * np.moveaxis(samples[number], -1, 0)[..., None]
        return x * a + y * b

    depth, positions, samples = oracle.critical_scene(rng, view, n, radius, moved)
    places, weights = 0.7 * samples[:, :2], rng.uniform(0.2, 3, n)
    half = np.sqrt(1 - (places * places).sum(1))
    units = (2 if tangent else 1) * weights / weights.sum() / (2 * half)
    given = oracle.seen_along(view, depth, positions, normals if tangent else None, turns, ways.astype(np.float32))
    found = point_bounds("vo-lines-normal" if tangent else "vo-lines", given, radius, places, weights, options, name)
    made = partial(both_radii, rr.hidden_lines, (given, places, half, units), radius, options, mirrors)
    return oracle.hold_renderers(name, rng, made, found)


@pytest.mark.slow
@pytest.mark.parametrize("check", [check_volume, check_lines])
@settings(max_examples=20)
@given(
    oracle.drawn_problems(), st.booleans(), st.sampled_from([0.0, 0.02, 0.2]), st.sampled_from([0.0, 0.5]),
    st.sampled_from(["product", "minimum"]), st.booleans(),
)  # fmt: skip
def test_no_renderer_of_the_ball_leaves_its_bounds(check, drawn, tangent, thickness, second, combine, randomize):
    options = {"thickness": thickness, "second": second, "combine": combine, "randomize": randomize, "seed": 3}
    check(drawn, options, tangent)


@pytest.mark.slow
@pytest.mark.parametrize("tangent", [False, True])
def test_no_probe_of_lines_leaves_their_bounds(tangent):
    how = {"thickness": 0.25 * tangent, "second": 0.5 * tangent, "combine": "product", "randomize": True, "seed": 0}
    oracle.hold_probes(partial(check_lines, options=how, tangent=tangent))


def test_renderers_differ_where_points_are_undecided():
    """Else these scenes would prove nothing: bounds that are a point would be as sound."""
    display = find_display("sample-a").with_resolution(4, 3)
    view = module_views(builtin_scene("statue"), display, range(4, 5))[0]
    drawn = [(view, np.random.default_rng(seed), "shader", 1.0, 3, seed % 2 == 1) for seed in range(12)]
    plain = {"range_check": False, "surface": "depth", "background": "open"}
    vo = {"thickness": 0.1, "second": 0.0, "combine": "product", "randomize": True, "seed": 0}
    for check in (
        partial(check_fractions, options={**plain, "remap": False}, half=False),
        partial(check_fractions, options=plain, half=True),
        partial(check_volume, options=vo, tangent=True),
        partial(check_lines, options=vo, tangent=True),
    ):
        undecided, differing = np.sum([check(problem) for problem in drawn], axis=0)  # fmt: skip
        assert undecided >= differing > 10


@settings(max_examples=20)
@given(st.data())
def test_image_points_are_the_references_and_no_wider(data):
    view = oracle.drawn_view(data.draw, 2, 3)
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32)))
    places = rng.uniform(-3, 3, (6, 3))
    off = rng.choice([0.0, 1e-6, 0.1], (6, 3))
    kind, m = view.world_to_image.kind, view.world_to_image.as_type(np.float32).numbers.astype(np.float64)
    by = MODELS[data.draw(st.sampled_from(["shader", "nearest"]))].errors
    image, error, sure = np.empty((6, 3)), np.empty((6, 3)), np.empty(6, np.bool_)
    map_positions(places, off, kind, m, by, image, error, sure)
    for place in range(6):
        pairs = [reference.Pair(x, e, by) for x, e in zip(places[place], off[place], strict=True)]
        with np.errstate(all="ignore"):
            rows = [reference.row(m, k, pairs, by) for k in range(4 if kind == reference.MATRIX else 3)]
            u, v, z, truths = reference.image(kind, m, *rows, *[None] * (4 - len(rows)), by)
        assert sure[place] >= (truths == {True})
        if True not in truths:
            assert error[place][0] == -np.inf
        elif error[place][0] > -np.inf and max(u.e, v.e, z.e) < np.inf:
            np.testing.assert_allclose(image[place], [u.x, v.x, z.x], rtol=1e-12)
            assert (error[place] <= 1.001 * np.array([u.e, v.e, z.e]) + 1e-30).all()


# How sharp, and what has none


@pytest.mark.parametrize("name", COUNTED)
def test_few_points_are_undecided(name, seen):
    estimator = find_estimator(name)
    points, weights = estimator.default_samples()
    changes = {"range_check": True, "surface": "positions"} if "surface" in estimator.parameters else {"second": 0.5}
    changes = {name: value for name, value in changes.items() if name in estimator.parameters}
    for shown, radius in seen:
        there = shown.depth < np.inf
        for options in (estimator.parameters, {**estimator.parameters, **changes}):
            found = point_bounds(name, shown, radius, points, weights, options)
            assert not found.outside(estimate(name, shown, radius, points, weights, **options).texture).any()
            undecided = found.undecided[there]
            assert undecided.mean() / len(points) < 0.005
            assert (undecided == 0).mean() > 0.95
            assert found.upper.max() > 0.2
            widths = (found.upper - found.lower)[there]
            if "lines" not in name:
                assert widths[undecided == 0].max() < 1e-5
            else:
                assert np.median(widths) < (4e-4 if shown.view.screen_to_world is not None else 4e-5)
                check_wrong_lines(found, there, shown, name, radius, points, weights, options)


def check_wrong_lines(found, seen, buffers, name, radius, points, weights, options):
    """A radius 1 % too large, a wrong weight and mirrors left out fall outside the bounds of lines."""
    skewed = weights * [1.1, 1, 1, 1, 1]
    for r, w, changes in ((1.01 * radius, weights, {}), (radius, skewed, {}), (radius, weights, {"randomize": False})):
        made = estimate(name, buffers, r, points, w, **{**options, **changes}).texture
        assert found.outside(made)[seen].mean() > 0.3


@pytest.mark.parametrize("name", ["vo-area", "vo-area-normal"])
def test_bounds_of_areas_are_narrow_on_displays_and_none_on_cameras(name, seen):
    points, weights = find_estimator(name).default_samples(5)
    for shown, radius in seen:
        options, there = ESTIMATORS[name].parameters, shown.depth < np.inf
        found = point_bounds(name, shown, radius, points, weights, options)
        assert (found is None) == (shown.view.screen_to_world is not None)
        if found:
            made = estimate(name, shown, radius, points, weights).texture
            assert not found.outside(made).any()
            assert np.median((found.upper - found.lower)[there]) < 0.02
            assert found.outside(made * np.float32(0.9))[made > 0.05].mean() > 0.9
            skewed, others = weights * [1.3, 1, 1, 1, 1], {"randomize": False}
            for r, w, changes in ((1.05 * radius, weights, {}), (radius, skewed, {}), (radius, weights, others)):
                made = estimate(name, shown, r, points, w, **{**options, **changes}).texture
                assert found.outside(made)[there].mean() > 0.05


@pytest.mark.parametrize("name", [name for name in BOUNDED if not name.startswith("vo-area")])
def test_bounds_are_those_of_the_arguments(name):
    """By a camera, whose axis VO reads; of another axis, or in another model, they would be others."""
    mesh, rng = builtin_scene("statue"), np.random.default_rng(4)
    view = Camera.looking_at(mesh.bounds).view(5, 4)
    depth, positions, points = oracle.critical_scene(rng, view, 6, 0.3, lambda samples, number: samples[number])
    normals = oracle.unit(rng.normal(size=positions.shape)).astype(np.float32)
    options, weights = ESTIMATORS[name].parameters, rng.uniform(0.2, 3, 6)
    points = points[:, :2] / 2 if find_estimator(name).dimensions == 2 else points
    described = {
        "mapping": {"kind": "matrix", "numbers": view.world_to_image.numbers}, "estimator": name, "options": options,
        "view": view_numbers(view),
    }  # fmt: skip
    inputs = {"depth": depth, "positions": positions, "normals": normals, "points": points, "weights": weights}
    given = Buffers(view, depth, positions, normals)

    def same(a, b):
        return all(np.array_equal(getattr(a, end), getattr(b, end)) for end in ("lower", "upper", "undecided"))

    found = [occlusion_bounds(described, inputs, 0.3, MODELS[m]) for m in ("shader", "nearest")]
    right = [point_bounds(name, given, 0.3, points, weights, options, m) for m in ("shader", "nearest")]
    assert same(found[0], right[0])
    assert same(found[1], right[1])
    assert not same(*right)
    assert same(point_bounds(name, given, 0.3, points, weights, options), right[0])
    behind = replace(view, cast_from_world=-view.cast_from_world)
    away = oracle.seen_along(behind, depth, positions, normals, ways=given.directions)
    reads = name in ("alchemy", "hbao", "oriented-hemisphere") or name.startswith("vo-")
    assert same(right[0], point_bounds(name, away, 0.3, points, weights, options)) == (not reads)


def test_estimators_that_count_points_have_bounds_if_their_textures_are_given():
    view = module_views(builtin_scene("statue"), find_display("virtual").with_resolution(2, 2))[0]
    zeros = np.zeros((2, 2, 3), np.float32)
    given = Buffers(view, zeros[..., 0], zeros), 0.1, np.zeros((1, 3)), None
    for name, estimator in ESTIMATORS.items():
        known = name in BOUNDED and not estimator.normals
        assert (point_bounds(name, *given, estimator.parameters) is not None) == known
    with pytest.raises(InputError, match="there is no error model 'loose'"):
        point_bounds("point", *given, ESTIMATORS["point"].parameters, "loose")


def test_remapped_ends_are_those_of_the_fraction_with_one_rounding_of_the_difference():
    seen = scenes.buffers("concave crease", scenes.SIGHTS["perspective"](9, 7), np.float32)
    model, table = replace(find_model("shader"), operation=2.0**-10), make_samples("latin", 8)
    options = find_estimator("point").parameters
    plain, remapped = (
        point_bounds("point", seen, 0.3, table, None, {**options, "remap": remap}, model) for remap in (False, True)
    )
    for end, made, way in ((plain.lower, remapped.lower, -1), (plain.upper, remapped.upper, 1)):
        assert end.max() > 0.5
        expected = 2 * np.maximum(end.astype(float) - 0.5, 0) * (1 + way * model.operation)
        np.testing.assert_allclose(made, expected, rtol=0, atol=3 * 2.0**-24)  # end, twice, and made are rounded
