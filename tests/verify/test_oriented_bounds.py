"""Bounds of the normal-oriented hemisphere: float32 renderers stay inside, and what is wrong falls outside."""

from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracle_scenes import critical_scene, drawn_problems, hold_probes, hold_renderers, random_turns, unit
from random_oriented import hidden_weights

from lfssao import Buffers, builtin_scene, find_display, make_samples, module_views
from lfssao.ao.estimators.oriented import OrientedOptions
from lfssao.ao.estimators.registry import estimate
from lfssao.verify.bounds.points import point_bounds

NAME, RENDERERS = "oriented-hemisphere", 40


def check(drawn, options):
    """Renderers against the bounds; half of the scenes have points that are as deep as surface and bias."""
    view, rng, name, radius, n, turning = drawn
    shape = view.height, view.width
    turns = random_turns(rng, shape) if turning else None
    normals = unit(rng.normal(size=(*shape, 3))).astype(np.float32)
    c, s = (1, 0) if turns is None else turns[..., None].astype(float)
    side = c * view.world_from_cast[:, 0] + s * view.world_from_cast[:, 1]
    near = rng.random(shape) < 0.2  # to a normal without a frame
    normals[near] = unit(np.broadcast_to(side, normals.shape)[near] * (1 + rng.normal(size=3) * 1e-6))
    up = normals.astype(float)
    t = unit(side - np.einsum("ijk,ijk->ij", up, np.broadcast_to(side, up.shape))[..., None] * up + 1e-12)
    b = np.cross(up, t)
    deep = np.sqrt((view.cast_from_world[2, :3] ** 2).sum()) * view.world_from_cast[:, 2] * (rng.random() < 0.5)

    def moved(samples, number):
        x, y, z = np.moveaxis(samples[number], -1, 0)[..., None]
        return (x * t + y * b + abs(z) * up) - options["bias"] * deep

    depth, positions, samples = critical_scene(rng, view, n, radius, moved)
    normals[~np.isfinite(depth)] = 0
    seen = Buffers(view, depth, positions, normals, turns)
    found = point_bounds(NAME, seen, radius, samples, None, options, name)
    assert not found.outside(estimate(NAME, seen, radius, samples, **options).texture).any()
    return hold_renderers(name, rng, lambda ar: hidden_weights(ar, seen, samples, radius, options), found)


@pytest.mark.slow
@settings(max_examples=30)
@given(
    drawn_problems(), st.sampled_from([0.0, 0.05, 0.5]), st.sampled_from(["none", "distance", "smoothstep"]),
    st.sampled_from(["open", "occludes"]),
)  # fmt: skip
def test_no_renderer_leaves_its_bounds(drawn, bias, range_check, background):
    check(drawn, {"bias": bias, "range_check": range_check, "background": background})


@pytest.mark.slow
def test_no_probe_leaves_the_bounds():
    for range_check in ("none", "smoothstep"):
        options = {"bias": 0.05, "range_check": range_check, "background": "open"}
        hold_probes(partial(check, options=options), 33)


def test_renderers_differ_where_points_are_undecided():
    display = find_display("sample-a").with_resolution(4, 3)
    view = module_views(builtin_scene("statue"), display, range(4, 5))[0]
    options = {"bias": 0.05, "range_check": "none", "background": "open"}
    drawn = [(view, np.random.default_rng(seed), "shader", 1.0, 3, seed % 2 == 1) for seed in range(12)]
    undecided, differing = np.sum([check(problem, options) for problem in drawn], axis=0)
    assert undecided >= differing > 10


def test_few_points_are_undecided_and_what_is_wrong_falls_outside(seen):
    points = make_samples("latin", 64, r_min=0.0)
    for still, radius in seen:
        shown, there = still.turned("hash"), still.depth < np.inf
        for options in ({}, {"range_check": "none", "background": "occludes"}):
            found = point_bounds(NAME, shown, radius, points, None, {**vars(OrientedOptions()), **options})
            undecided = found.undecided[there]
            assert not found.outside(estimate(NAME, shown, radius, points, **options).texture).any()
            assert undecided.mean() / 64 < 0.001
            assert (undecided == 0).mean() > 0.95
            assert np.median((found.upper - found.lower)[there]) < 2e-5
        found = point_bounds(NAME, shown, radius, points, None, vars(OrientedOptions()))
        for r, table, changes in (
            (1.05 * radius, points, {}), (radius, points[:-1], {}), (radius, points, {"bias": 0.0}),
            (radius, points, {"range_check": "none"}), (radius, points * [1, 1, 0.95], {}),
        ):  # fmt: skip
            assert found.outside(estimate(NAME, shown, r, table, **changes).texture).any()
        assert found.outside(estimate(NAME, still, radius, points).texture).any()
