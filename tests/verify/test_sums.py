"""Bounds of the estimators that sum terms: float32 renderers stay inside, and what is wrong falls outside.

As in ``test_sound`` scenes are drawn so that rounding matters: taps land next to a texel's edge.
"""

from dataclasses import replace
from functools import partial

import numpy as np
import oracle_scenes as oracle
import pytest
import random_sums as rs
from hypothesis import given, settings

from lfssao import Camera, RayCaster, builtin_scene, find_display, module_views
from lfssao.ao.estimators.registry import estimate, find_estimator
from lfssao.ao.estimators.sao.texel_rays import texel_rays
from lfssao.ao.textures import Buffers
from lfssao.verify.bounds.error_model import find_model
from lfssao.verify.bounds.points import point_bounds


def angle_of(model):
    return find_model(model).angle


def check_sao(drawn, options, alter=lambda model: model):
    """Renderers of the sampling pass against the bounds: taps land next to texels' edges, and at edges of levels."""
    view, rng, name, radius, n, _ = drawn
    shape = (view.height, view.width)
    rays = texel_rays(view, np.dtype(np.float32))
    n = n + 2
    camera = view.screen_to_world is not None
    depth = (rng.choice([0.3, 0.35, 0.5], shape) + rng.uniform(0, 0.02, shape) - (0 if camera else 0.4)).astype("f4")
    depth[rng.random(shape) < 0.1] = np.inf
    z = 2.0 if camera or not (depth < 9).any() else float(depth[depth < 9][0])
    depth[(rng.random(shape) < 0.4) & (z < 2)] = z
    j, i = np.indices(shape)
    positions = oracle.world_points(view, i + 0.5, j + 0.5, np.where(depth < 9, depth, 0).astype(float)).astype("f4")
    if rays.table is None:  # the last tap is two texels away, or four, at that depth
        texel = min(abs(rays.numbers[k + 2] + z * rays.numbers[k + 4]) * rays.units[k // 5] for k in (0, 5))
        radius = float(rng.choice([2, 4]) / (1 - 0.5 / n) * texel)
    phi = np.pi * (2 * rng.integers(0, n, shape) + 1) / n
    angles = rng.choice([0, 0.5, 1, 1.5], shape) * np.pi - phi + rng.uniform(-1, 1, shape) * angle_of(name)
    turns = np.stack([np.cos(angles), np.sin(angles)]).astype(np.float32)
    ahead = oracle.unit(view.cast_from_world[2, :3])
    towards = oracle.unit(rng.normal(size=(*shape, 3)) - 2 * ahead).astype(np.float32)
    shown = Buffers(view, depth, positions, towards, turns)
    estimator = "sao" if "intensity" in options else "sao-equation-1"
    options = {**find_estimator(estimator).parameters, **options, "taps": n, "turns": 1}
    found = point_bounds(estimator, shown, radius, None, None, options, alter(find_model(name)))
    return oracle.hold_renderers(name, rng, lambda ar: rs.sao(ar, shown, rays, radius, options, angle_of(name)), found)


CHOICES = {
    "mip": ["rotated", "min", "max"], "log_q": [0, 1], "beta": [0.0, 0.01], "quad_edge": [0.0, 0.3],
    "gauss": [0.0, 0.0, 1.0, 3.0], "packed": [False, True], "sharpness": [10.0], "normals": ["face", "buffer"],
    "landing": ["floor", "truncate", "nearest"], "sine": ["down", "up"], "full_turn": ["exact", "6.28"],
    "angle_sum": ["exact", "exact", "float32"],
}  # fmt: skip


@pytest.mark.slow
@settings(max_examples=60)
@given(oracle.drawn_problems())
def test_no_renderer_of_sao_leaves_its_bounds(drawn):
    rng = drawn[1]
    strengths = [{"intensity": 0.3}, {"intensity": 2.0}, {"sigma": 0.5}, {"sigma": 1.0, "k": 2.0}]
    options = {name: values[rng.integers(len(values))] for name, values in CHOICES.items()}
    check_sao(drawn, strengths[rng.integers(4)] | options)


PLAIN = {"intensity": 0.3, "log_q": 0, "quad_edge": 0.0, "gauss": 0.0}


@pytest.mark.slow
def test_no_probe_of_sao_leaves_the_bounds():
    for changes in ({}, {"normals": "buffer"}):
        oracle.hold_probes(partial(check_sao, options=PLAIN | changes), 33)


@pytest.mark.parametrize("error", ["angle", "operation"])
def test_with_an_error_left_out_renderers_of_sao_leave_the_bounds(error):
    """They come near enough to the bounds to tell, and differ where taps are undecided."""
    view = module_views(builtin_scene("statue"), find_display("sample-a").with_resolution(4, 3), range(4, 5))[0]
    refused = 0
    found = []
    for seed in range(20):
        drawn = view, np.random.default_rng(seed), "shader", 1.0, 3, seed % 2 == 1
        found.append(check_sao(drawn, dict(PLAIN)))
        try:
            check_sao(drawn, dict(PLAIN), lambda model: replace(model, **{error: 0.0}))
        except AssertionError:
            refused += 1
        undecided, differing = np.sum(found, axis=0)
        if refused > 2 and differing > 5:
            break
    assert undecided >= differing > 5
    assert refused > 2


# By estimator: the largest median width on a module and by a camera, whose z rounds, and how much of the surface the
# least change that renderers get wrong must harm.
SHARP = {
    "alchemy": (3e-6, 3e-6, 0.7),
    "hbao": (1e-3, 1e-3, 0.3),
    "sao": (2e-5, 2e-3, 0.25),
    "sao-equation-1": (5e-5, 5e-3, 0.2),
}
RAW = {"quad_edge": 0.0, "gauss": 0.0}


@pytest.mark.parametrize("name", SHARP)
def test_bounds_are_narrow_and_tell_what_is_wrong(name, seen):
    """The radius 1 % too large, another hash, the bias forgotten, the sum divided by a number too many."""
    estimator, (module, camera, harm) = find_estimator(name), SHARP[name]
    points, _ = estimator.default_samples()
    forgotten = {"beta": 0.0}, {"intensity" if name == "sao" else "sigma": 12 / 13}
    forgotten = ({"steps": 7}, {"attenuation": "linear"}) if name == "hbao" else forgotten
    for still, less in seen:
        radius = 3 * less  # some texels
        shown = still.turned("sao-hash")
        there = still.depth < np.inf
        for own in ({}, RAW) if "gauss" in estimator.parameters else ({},):
            found = point_bounds(name, shown, radius, points, None, {**estimator.parameters, **own})
            assert not found.outside(estimate(name, shown, radius, points, **own).texture).any()
            median = np.median((found.upper - found.lower)[there])
            assert median < (module if shown.view.screen_to_world is None else camera)
            assert (found.undecided[there] == 0).mean() > 0.5
            wrong = [(shown, radius, changes) for changes in forgotten]
            for other, r, changes in (*wrong, (still.turned("common-hash"), radius, {}), (shown, 1.01 * radius, {})):
                made = estimate(name, other, r, points, **{**own, **changes}).texture
                assert found.outside(made)[there].mean() > harm, (r, changes)


def test_angles_added_in_float32_are_told_from_exact_ones():
    """At 400 x 300 texels float32 holds the common hash to 1/8 radian, so that sums are off by up to 1/16."""
    mesh = builtin_scene("statue")
    view = Camera.looking_at(mesh.bounds).view(400, 300)
    shown = Buffers.of(RayCaster(mesh, view.cast_from_world).gbuffer(view, None), view).turned("common-hash")
    for own, other in (("float32", "exact"), ("exact", "float32")):
        options = {**find_estimator("sao").parameters, **RAW, "mip": "none", "angle_sum": own}
        found = point_bounds("sao", shown, 0.2, None, None, options)
        assert not found.outside(estimate("sao", shown, 0.2, **options).texture).any()
        made = estimate("sao", shown, 0.2, **{**options, "angle_sum": other}).texture
        assert found.outside(made)[(shown.depth < np.inf) & (made > 0)].mean() > 0.03
