"""Renderers of ``lf-neighbours`` stay inside its bounds, and bounds of too small errors fail.

A sample of each texel lies on a texel's edge or at a surface's depth but for the last digits, in the module's own
texture or in that of another.
"""

import os

import numpy as np
import oracle_scenes as oracle
import pytest
import random_renderer as rr
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from random_numbers import outside, scaled

from lfssao import (
    Buffers,
    Camera,
    RayCaster,
    builtin_scene,
    estimate,
    find_display,
    fit_roi,
    make_samples,
    module_views,
)
from lfssao.verify.bounds import neighbours, ssao
from lfssao.verify.bounds.error_model import find_model
from lfssao.verify.bounds.points import point_bounds

NAME = "lf-neighbours"
PROBLEMS = 2000 if os.environ.get("LFSSAO_WHOLE") else 60
RENDERERS = 40
DISPLAYS = "sample-a", "sample-a-conical", "convex", "picoarray"


def drawn_views(rng):
    """A view and up to four others: modules of a display, or cameras, side by side."""
    width, height = [(4, 3), (5, 3), (7, 5), (8, 6)][rng.integers(4)]
    count = int(rng.integers(1, 6))
    name = str(rng.choice([*DISPLAYS, "perspective", "orthographic"]))
    if name not in DISPLAYS:
        eyes = [(0.05 * k, 0.0, 5.0) for k in range(count)]
        return [Camera(name, eye, (0, 0, 0), (0, 1, 0), 3.0, 1.0, 20.0).view(width, height) for eye in eyes]
    display = find_display(name).with_resolution(width, height)
    first = int(rng.integers(len(display.modules) - count + 1))
    world = fit_roi(oracle.WORLD_BOX, display.roi)
    return [display.view(k, world) for k in range(first, first + count)]


def drawn_problem(rng):
    """Buffers, samples and radius; one of the textures has the decisions that rounding may turn."""
    views = drawn_views(rng)
    n = int(rng.choice([1, 3, 7, 20]))
    radius = float(rng.choice([0.01, 0.3, 1.0]))
    shape = (views[0].height, views[0].width)
    critical = int(rng.integers(len(views)))
    levels = rng.uniform(0.3, 0.7, 4) if views[0].screen_to_world is not None else rng.uniform(-0.2, 0.2, 4)
    made = oracle.critical_scene(rng, views[critical], n, radius, lambda samples, number: samples[number], levels)
    depth, positions, samples = made
    textures = []
    for k in range(len(views)):
        hides = np.full(shape, levels.min() - 1) if rng.random() < 0.7 else rng.choice(np.append(levels, np.inf), shape)
        textures.append(depth if k == critical else hides.astype(np.float32))
    own = np.where(np.isfinite(depth), textures[0], np.inf)
    own[np.isfinite(depth) & np.isinf(own)] = levels[0]  # positions are there
    neighbours = [(view.world_to_image, texture) for view, texture in zip(views[1:], textures[1:], strict=True)]
    if critical == 0 and len(neighbours) > 1:
        neighbours[0] = neighbours[0][0], np.ascontiguousarray(neighbours[0][1][:-1, :-1])
    return Buffers(views[0], own.astype(np.float32), positions, neighbours=neighbours), samples, radius


@np.errstate(all="ignore")
def occlusion(ar, seen, samples, radius):
    """Occlusion of every renderer, (R, H, W)."""
    inside = shown = False
    for mapping, depth in [(seen.view.world_to_image, seen.depth), *seen.neighbours]:
        given = seen.depth, seen.positions, mapping.kind, mapping.numbers, samples, radius
        u, v, z, valid = rr.image_points(ar, *given)
        there, j, i = rr.inside(depth, u, v, valid)
        surface = ar.flush(ar.full(depth.astype(np.float64)[j, i]))
        inside = inside | there
        shown = shown | (there & ~(surface < ar.flush(np.where(valid, z, 0.0))))
    count = np.count_nonzero(inside & ~shown, axis=-1)
    return np.where(np.isfinite(seen.depth), rr.fraction(ar, count, len(samples)), 0.0)


@pytest.mark.slow
def test_no_renderer_leaves_its_bounds_unless_errors_are_too_small():
    counts = []

    @settings(max_examples=PROBLEMS, phases=[Phase.generate], derandomize=True, deadline=None)
    @given(st.integers(0, 2**32), st.sampled_from(["shader", "nearest"]))
    def check(seed, name):
        rng = np.random.default_rng(seed)
        model = find_model(name)
        seen, samples, radius = drawn_problem(rng)
        found, weak = (point_bounds(NAME, seen, radius, samples, None, {}, m) for m in (model, scaled(model, 0.25)))
        assert not found.outside(estimate(NAME, seen, radius, samples).texture).any()
        made = occlusion(oracle.arithmetic(name, rng, RENDERERS), seen, samples, radius)
        assert outside(made, found) == 0
        count, low, high = (np.rint(values * len(samples)) for values in (made, weak.lower, weak.upper))
        missed = np.count_nonzero((count < low) | (count > high))  # decisions, and not what k / n rounds to
        counts.append((missed, len(seen.neighbours)))

    check()
    assert sum(missed > 0 for missed, others in counts if others) > 3


@pytest.fixture(scope="module")
def seen():
    """A module of a display with two others beside it."""
    mesh = builtin_scene("gallery")
    views = module_views(mesh, find_display("sample-a").with_resolution(300, 180), range(9, 12))
    caster = RayCaster(mesh, views[0].cast_from_world)
    made = [caster.gbuffer(view) for view in views]
    return Buffers.of(made[1], views[1], [(views[k].world_to_image, made[k].depth) for k in (0, 2)])


SAMPLES = make_samples("latin", 8)


def bounds(seen, model="sampler"):
    return point_bounds(NAME, seen, 0.4, SAMPLES, None, {}, model)


def test_without_others_bounds_are_those_of_algorithm_2(seen):
    alone = bounds(Buffers(seen.view, seen.depth, seen.positions))
    expected = ssao.ao_bounds(seen.depth, seen.positions, seen.view.world_to_image, SAMPLES, 0.4, "sampler")
    for name in ("lower", "upper", "undecided"):
        np.testing.assert_array_equal(getattr(alone, name), getattr(expected, name))
    assert alone.undecided.any()
    assert np.count_nonzero(alone.lower > bounds(seen).upper) > 100


def test_few_samples_of_a_display_are_undecided_and_texels_without_one_have_one_count(seen):
    number = len(SAMPLES) * np.count_nonzero(seen.depth < np.inf)
    assert bounds(seen, "shader").undecided.sum() < 1e-4 * number
    found = bounds(seen)
    assert 0 < found.undecided.sum() < 0.01 * number
    width = found.upper - found.lower
    assert width[found.undecided == 0].max() < 1e-5
    assert width[found.undecided > 0].min() > 0.9 / len(SAMPLES)


def test_samples_are_counted_in_parts_without_a_difference(seen, monkeypatch):
    expected = bounds(seen)
    monkeypatch.setattr(neighbours, "_BATCH", 3)
    assert np.array_equal(bounds(seen).lower, expected.lower)
    assert np.array_equal(bounds(seen).upper, expected.upper)
