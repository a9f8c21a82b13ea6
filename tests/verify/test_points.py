"""Bounds of the other estimators: few points are undecided, what is wrong falls outside, and what they are made of."""

from dataclasses import replace

import analytic_scenes as scenes
import numpy as np
import oracle_scenes as oracle
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reference import bounds as reference

from lfssao import Camera, InputError, builtin_scene, find_display, module_views
from lfssao.ao.estimators.registry import ESTIMATORS, estimate, find_estimator
from lfssao.ao.textures import Buffers
from lfssao.samples import make_samples
from lfssao.verify.bounds.error_model import MODELS, find_model
from lfssao.verify.bounds.explain import sorted_terms
from lfssao.verify.bounds.kernels.images import map_positions
from lfssao.verify.bounds.kernels.sums import LIMITLESS
from lfssao.verify.bounds.points import point_bounds, term_tracer
from lfssao.verify.bounds.problem import Problem
from lfssao.verify.bounds.registry import has_bounds
from lfssao.verify.bounds.view import occlusion_bounds
from lfssao.verify.kit.views import view_numbers

OTHERS = ("alchemy", "oriented-hemisphere", "vo-area")  # which have tests of their own
HELD = [name for name in ESTIMATORS if has_bounds(name)]
COUNTED = [name for name in HELD if find_estimator(name).default_samples()[0] is not None and name not in OTHERS]


@settings(max_examples=20)
@given(st.data())
def test_image_points_are_the_references_and_no_wider(data):
    view = oracle.drawn_view(data.draw, 2, 3)
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32)))
    places = rng.uniform(-3, 3, (6, 3))
    off = rng.choice([0.0, 1e-6, 0.1], (6, 3))
    kind = view.world_to_image.kind
    m = view.world_to_image.as_type(np.float32).numbers.astype(np.float64)
    by = MODELS[data.draw(st.sampled_from(["shader", "nearest"]))].errors
    image = np.empty((6, 3))
    error = np.empty((6, 3))
    sure = np.empty(6, np.bool_)
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


def test_bounds_of_areas_are_narrow_on_displays_and_none_on_cameras(seen):
    name, (points, weights) = "vo-area", find_estimator("vo-area").default_samples(5)
    for shown, radius in seen:
        options = ESTIMATORS[name].parameters
        there = shown.depth < np.inf
        found = point_bounds(name, shown, radius, points, weights, options)
        assert (found is None) == (shown.view.screen_to_world is not None)
        if found:
            made = estimate(name, shown, radius, points, weights).texture
            assert not found.outside(made).any()
            assert np.median((found.upper - found.lower)[there]) < 0.02
            assert found.outside(made * np.float32(0.9))[made > 0.05].mean() > 0.9
            skewed = weights * [1.3, 1, 1, 1, 1]
            others = {"randomize": False}
            for r, w, changes in ((1.05 * radius, weights, {}), (radius, skewed, {}), (radius, weights, others)):
                made = estimate(name, shown, r, points, w, **{**options, **changes}).texture
                assert found.outside(made)[there].mean() > 0.05


@pytest.mark.parametrize("name", [name for name in HELD if not name.startswith("vo-area")])
def test_bounds_are_those_of_the_arguments(name):
    """By a camera, whose axis VO reads; of another axis, or in another model, they would be others."""
    mesh = builtin_scene("statue")
    rng = np.random.default_rng(4)
    view = Camera.looking_at(mesh.bounds).view(5, 4)
    depth, positions, points = oracle.critical_scene(rng, view, 6, 0.3, lambda samples, number: samples[number])
    normals = oracle.unit(rng.normal(size=positions.shape)).astype(np.float32)
    options = ESTIMATORS[name].parameters
    weights = rng.uniform(0.2, 3, 6)
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
        known = name in HELD and not estimator.normals
        assert (point_bounds(name, *given, estimator.parameters) is not None) == known
    with pytest.raises(InputError, match="there is no error model 'loose'"):
        point_bounds("point", *given, ESTIMATORS["point"].parameters, "loose")


def test_remapped_ends_are_those_of_the_fraction_with_one_rounding_of_the_difference():
    seen = scenes.buffers("concave crease", scenes.SIGHTS["perspective"](9, 7), np.float32)
    model = replace(find_model("shader"), operation=2.0**-10)
    table = make_samples("latin", 8)
    options = find_estimator("point").parameters
    plain, remapped = (
        point_bounds("point", seen, 0.3, table, None, {**options, "remap": remap}, model) for remap in (False, True)
    )
    for end, made, way in ((plain.lower, remapped.lower, -1), (plain.upper, remapped.upper, 1)):
        assert end.max() > 0.5
        expected = 2 * np.maximum(end.astype(float) - 0.5, 0) * (1 + way * model.operation)
        np.testing.assert_allclose(made, expected, rtol=0, atol=3 * 2.0**-24)  # end, twice, and made are rounded


# The story of a texel


def test_the_story_of_a_texel_has_its_image_points_and_terms(seen):
    points = make_samples("latin", 16)
    options = find_estimator("point").parameters
    for shown, radius in seen:
        model = replace(find_model("shader"), coordinate=0.05)  # some samples are undecided
        found = point_bounds("point", shown, radius, points, None, options, model)
        told = term_tracer(Problem(shown, points, None, options, model), radius, "point")
        for row, column in np.argwhere((shown.depth < np.inf) & (found.undecided > 0))[::97]:
            story = told(row, column)
            u, v, _ = shown.view.world_to_image(shown.positions[row, column] + radius * points).T
            np.testing.assert_allclose(story[:, [0, 2]], np.stack([u, v], axis=1), atol=1e-3)
            assert story[:, 4].sum() / 16 == pytest.approx(found.lower[row, column], abs=1e-6)
            assert story[:, 5].sum() / 16 == pytest.approx(found.upper[row, column], abs=1e-6)
            texels = sorted_terms(story, shown.depth.shape)
            assert [t.is_decided for t in texels] == sorted(t.is_decided for t in texels)
            first = texels[0]
            assert "adds 0 to 1" in str(first)
            assert first.texel == (int(u[first.number]), int(v[first.number]))


def test_the_story_of_samples_says_where_they_lie_outside():
    """Two samples of three texels in a row: one far outside, one 1/4 texel inside the next texel's edge."""
    story = np.array([[9.0, 0, 0.5, 0, 0, 0], [1.25, 0.01, 0.5, 0.01, 0.5, 0.5], [3.0, 0.01, 0.5, 0.01, 0, 0.5]])
    beside, inside, outside = sorted_terms(story, (1, 3))
    assert str(sorted_terms(np.array([[1.5, 0.1, 0.5, 0.1, 0, 2.0**-124]]), (1, 3))[0]).endswith("and adds 0")
    assert "adds 0 to any number" in str(sorted_terms(np.array([[1.5, 0.1, 0.5, 0.1, 0, LIMITLESS]]), (1, 3))[0])
    assert str(outside) == "sample 0 lies outside the texture or the mapping's domain"
    assert str(inside) == "sample 1 reads texel (1, 0), 2.5e-01 from its edge (error up to 1.0e-02), and adds 0.5"
    assert str(beside) == "sample 2 lies next to the border (error up to 1.0e-02), and adds 0 to 0.5"
