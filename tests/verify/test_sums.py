"""Bounds of the estimators that sum terms: float32 renderers stay inside, and what is wrong falls outside.

As in ``test_sound`` scenes are drawn so that rounding matters: taps land next to a texel's edge.
"""

from dataclasses import replace

import numpy as np
import pytest
import random_sums as rs
from hypothesis import given, settings
from hypothesis import strategies as st
from oracle_scenes import arithmetic, assert_inside, critical_scene, drawn_problems, random_turns, seen_along, unit

from lfssao import builtin_scene, find_display, module_views
from lfssao.ao.estimators.registry import estimate, find_estimator
from lfssao.verify.bounds.error_model import MODELS
from lfssao.verify.bounds.points import point_bounds

RENDERERS = 40
pytestmark = pytest.mark.usefixtures("one_thread")


def duff(ways):
    """Two axes at right angles to ways (H, W, 3)."""
    x, y, z = np.moveaxis(ways, -1, 0)
    sign = np.where(z >= 0, 1, -1)
    a = -1 / (sign + z)
    e = [1 + sign * x * x * a, sign * x * y * a, -sign * x]
    return np.stack(e, axis=-1), np.stack([x * y * a, sign + y * y * a, -y], axis=-1)


def turned_off(rng, turns, off):
    """Cosine and sine, half of them as far off as a renderer's may be."""
    return (1, 0) if turns is None else turns + rng.choice([-0.9, 0, 0, 0.9], turns.shape) * off


def check_alchemy(drawn, options, alter=lambda model: model):
    """Renderers of alchemy against the bounds."""
    view, rng, name, radius, n, turning = drawn
    shape = view.height, view.width
    turns = random_turns(rng, shape) if turning else None
    ways = unit(unit(view.cast_from_world[2, :3]) + rng.choice([0.1, 0.8]) * rng.normal(size=(*shape, 3)))
    ways[..., 2] = np.where(rng.random(shape) < 0.2, rng.choice([-1e-7, 0, 1e-7], shape), ways[..., 2])
    ways = unit(ways).astype(np.float32)
    normals = unit(rng.normal(size=(*shape, 3)) - ways).astype(np.float32)
    (e, f), (c, s) = duff(ways.astype(float)), turned_off(rng, turns, MODELS[name].angle)

    def moved(samples, number):
        x, y = 0.7 * samples[number, 0], 0.7 * samples[number, 1]
        return (x * c - y * s)[..., None] * e + (x * s + y * c)[..., None] * f

    depth, positions, samples = critical_scene(rng, view, n, radius, moved)
    places, ar, model = 0.7 * samples[:, :2], arithmetic(name, rng, RENDERERS), MODELS[name]
    shown = seen_along(view, depth, positions, normals, turns, ways)
    made = rs.alchemy(ar, shown, places, radius, options, model.angle)
    found = point_bounds("alchemy", shown, radius, places, None, options, alter(model))
    assert_inside(made, found, "alchemy")
    return int(found.undecided.sum()), int((made.max(0) - made.min(0) > 1e-3).sum())


@pytest.mark.slow
@settings(max_examples=40)
@given(
    drawn_problems(), st.sampled_from([0.3, 1.0, 3.0]), st.sampled_from([0.0, 1e-4, 0.05]),
    st.sampled_from([0.0, 1e-4, 0.01]), st.sampled_from([0.0, 0.5, 1.0, 2.5]),
)  # fmt: skip
def test_no_renderer_of_alchemy_leaves_its_bounds(drawn, sigma, beta, epsilon, k):
    check_alchemy(drawn, {"sigma": sigma, "beta": beta, "epsilon": epsilon, "k": k})


@pytest.mark.parametrize(("error", "value"), [("angle", 0.0), ("operation", 0.0)])
def test_with_an_error_left_out_renderers_leave_the_bounds(error, value):
    """They come near enough to the bounds to tell, and differ where taps are undecided."""
    view = module_views(builtin_scene("statue"), find_display("sample-a").with_resolution(4, 3), range(4, 5))[0]
    options, refused, found = {"sigma": 0.3, "beta": 1e-4, "epsilon": 0.01, "k": 1.0}, 0, []
    for seed in range(12):
        drawn = view, np.random.default_rng(seed), "shader", 1.0, 3, seed % 2 == 1
        found.append(check_alchemy(drawn, options))
        try:
            check_alchemy(drawn, options, lambda model: replace(model, **{error: value}))
        except AssertionError:
            refused += 1
    undecided, differing = np.sum(found, axis=0)
    assert undecided >= differing > 10
    assert refused > 2


# By estimator: the largest median width, and of changes that renderers get wrong, each number doing some harm
SHARP = {"alchemy": 3e-6}
WRONG = {"alchemy": ({"beta": 0.0}, {"sigma": 12 / 13}, {"k": 1.001})}


@pytest.mark.parametrize("name", SHARP)
def test_bounds_are_narrow_and_tell_what_is_wrong(name, seen):
    """The radius 1 % too large, another hash, the bias forgotten, the sum divided by a number too many."""
    estimator = find_estimator(name)
    points, _ = estimator.default_samples()
    for still, radius in seen:
        shown, there = still.turned("sao-hash"), still.depth < np.inf
        found = point_bounds(name, shown, radius, points, None, estimator.parameters)
        assert not found.outside(estimate(name, shown, radius, points).texture).any()
        assert np.median((found.upper - found.lower)[there]) < SHARP[name]
        assert (found.undecided[there] == 0).mean() > 0.8
        wrong = [(shown, radius, changes) for changes in WRONG[name]]
        for other, r, changes in (*wrong, (still.turned("common-hash"), radius, {}), (shown, 1.01 * radius, {})):
            made = estimate(name, other, r, points, **changes).texture
            assert found.outside(made)[there].mean() > 0.3, (r, changes)
