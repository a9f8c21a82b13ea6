"""Renderers of ``multiresolution`` stay inside its bounds, and bounds of too small errors fail.

The formulas run uncompiled on numbers that round at random (``random_numbers``). A neighbour lies at the radius, or in
the tangent plane, but for the last digits.
"""

import os
from functools import reduce
from operator import add

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from oracle_scenes import unit
from random_numbers import Number, Renderers, outside, scaled, single

from lfssao import Camera
from lfssao.ao.estimators.kernels import multiresolution as kernels
from lfssao.ao.estimators.multiresolution import level_pyramid
from lfssao.ao.estimators.registry import ESTIMATORS, estimate
from lfssao.ao.textures import Buffers
from lfssao.core.vectors import Vector
from lfssao.verify.bounds.error_model import find_model
from lfssao.verify.bounds.points import point_bounds

NAME = "multiresolution"
PROBLEMS = 2000 if os.environ.get("LFSSAO_WHOLE") else 40
RENDERERS = 40


def drawn_scene(rng):
    """Buffers of a small camera and a radius: that of a pair of neighbours but for the last digits, or any."""
    height, width = rng.integers(1, 9, 2)
    view = Camera("perspective", (0, 0, 3), (0, 0, 0), (0, 1, 0), 2.0, 1.0, 5.0).view(int(width), int(height))
    depth = rng.choice([0.3, 0.4, 0.5, np.inf], (height, width), p=[0.3, 0.3, 0.3, 0.1]).astype(np.float32)
    positions = (rng.normal(size=3) + 0.1 * rng.normal(size=(height, width, 3))).astype(np.float32)
    positions[rng.random((height, width)) < 0.05] = positions[0, 0]  # some are the same point
    normals = unit(rng.normal(size=(height, width, 3)))
    across = np.roll(positions, 1, axis=1) - positions
    flat = (rng.random((height, width)) < 0.5) & (np.abs(across).sum(axis=-1) > 0)
    along = np.einsum("ijk,ijk->ij", across, normals) / np.maximum(np.einsum("ijk,ijk->ij", across, across), 1e-9)
    normals = unit(np.where(flat[..., None], normals - along[..., None] * across, normals)).astype(np.float32)
    distances = np.linalg.norm(across.astype(float), axis=-1)
    radius = float(rng.choice(distances[distances > 0])) if (distances > 0).any() and rng.random() < 0.7 else 0.15
    return Buffers(view, depth, positions, np.where(np.isfinite(depth)[..., None], normals, 0), None), radius


class Textures:
    """Vectors of texels, of renderers; a texel is any where it is -1."""

    def __init__(self, by, texture):
        self.by, self.texture = by, texture.reshape(-1, 3)

    def __call__(self, texel):
        return Vector(*(Number(self.by, single(self.texture[texel, k][None, :, None])) for k in range(3)))


def neighbours(level, rows, columns):
    """Texel numbers at rows and columns of a level, -1 outside."""
    inside = (rows >= 0) & (columns >= 0) & (rows < level.shape[0]) & (columns < level.shape[1])
    return np.where(inside, level[rows % level.shape[0], columns % level.shape[1]], -1)


def level_occlusion(by, level, place, normal, options, radius):
    """Occlusion of a level of each renderer, a Number of its texels that show a surface."""
    rows, columns = np.nonzero(level >= 0)
    here = level[rows, columns]
    reach = options["kernel"]
    terms = []
    far = by.number(single(radius), None)
    squared = by.choose(by.number(single(float(np.float32(radius)) ** 2), None), far * far)
    squared = by.choose(by.number(single(radius * radius), None), squared)
    for j in range(-reach, reach + 1):
        for i in range(-reach, reach + 1):
            tap = neighbours(level, rows + j, columns + i)
            if i or j:
                term = kernels.obscured(place(tap) - place(here), normal(here), far, squared)
                terms.append(by.where((tap >= 0)[None, :, None], term, 0.0))
    total = reduce(add, [terms[k] for k in by.rng.permutation(len(terms))])
    return by.off(total.x / len(terms), by.model.quotient)


def carried(by, level, coarse, place, normal, radius, values):
    """Two numbers that four coarse texels carry to each texel, from those of the coarse level."""
    rows, columns = np.nonzero(level >= 0)
    here = level[rows, columns]
    weights = []
    found = [[], []]
    numbers = np.cumsum(coarse.ravel() >= 0).reshape(coarse.shape) - 1
    for k in range(4):
        row = rows // 2 + (k // 2) * (2 * (rows % 2) - 1)
        column = columns // 2 + (k % 2) * (2 * (columns % 2) - 1)
        other = neighbours(coarse, row, column)
        number = neighbours(numbers, row, column)
        near = (3 - 2 * (k // 2)) * (3 - 2 * (k % 2))
        w = kernels.upsampling_weight(place(other) - place(here), normal(here), normal(other), by.number(radius, None))
        there = (other >= 0)[None, :, None]
        weights.append(by.where(there, near * w, 0.0))
        for of, value in zip(found, values, strict=True):
            of.append(by.where(there, Number(by, value.x[:, number]), 0.0))
    order = by.rng.permutation(4)
    total = reduce(add, [weights[k] for k in order])
    made = []
    for of in found:
        after = reduce(add, [weights[k] * of[k] for k in order]) / total
        before = reduce(add, [(weights[k] / total) * of[k] for k in order])
        made.append(by.where(total.x > 0, by.choose(after, before), 0.0))
    return made


def renderers(seed, model, seen, radius, options):
    """Occlusion of renderers of a model, (R, H, W)."""
    by = Renderers(np.random.default_rng(seed), RENDERERS, model)
    levels = level_pyramid(seen.depth, options["levels"])
    place = Textures(by, seen.positions)
    normal = Textures(by, seen.normals)
    made = np.zeros((RENDERERS, *seen.depth.shape))
    with by.compute():
        values = ()
        for k in reversed(range(options["levels"])):
            own = level_occlusion(by, levels[k], place, normal, options, radius)
            if values:
                most, mean = carried(by, levels[k], levels[k + 1], place, normal, radius, values)
                values = Number(by, np.maximum(own.x, most.x)), own + mean
            else:
                values = own, own
        most = values[0]
        mean = by.off(values[1].x / options["levels"], model.quotient)
        both = by.choose(1 - (1 - most) * (1 - mean), most + mean * (1 - most))
        chosen = {"maximum": most, "average": mean, "both": both}[options["combine"]]
    made[:, seen.depth < np.inf] = np.clip(chosen.x[..., 0], 0, 1)
    return made


@pytest.mark.slow
def test_no_renderer_leaves_its_bounds_unless_errors_are_too_small():
    counts = []
    chosen = st.fixed_dictionaries({
        "levels": st.integers(1, 3), "kernel": st.integers(1, 2),
        "combine": st.sampled_from(["both", "maximum", "average"]),
    })  # fmt: skip

    # hypothesis draws by the text of the function: in other words it meets the problem of the next test.
    @settings(max_examples=PROBLEMS, phases=[Phase.generate], derandomize=True, deadline=None)
    @given(st.integers(0, 2**32), st.sampled_from(["shader", "nearest"]), chosen)
    def check(seed, name, options):
        seen, radius = drawn_scene(np.random.default_rng(seed))
        options, model = {**ESTIMATORS[NAME].parameters, **options}, find_model(name)
        found, weak = (point_bounds(NAME, seen, radius, None, None, options, m) for m in (model, scaled(model, 0.25)))
        assert not found.outside(estimate(NAME, seen, radius, None, None, **options).texture).any()
        made = renderers(seed, model, seen, radius, options)
        assert outside(made, found) == 0
        counts.append(outside(made, weak))

    check()
    assert np.count_nonzero(counts) > 3


@pytest.mark.xfail(reason="three texels of rounding to nearest lie outside: the interval or this renderer is wrong")
def test_a_problem_whose_renderers_leave_their_bounds():
    """Three texels are 0, and the interval is from 2.4e-10 to 3.4e-9."""
    seen, radius = drawn_scene(np.random.default_rng(1075))
    options = {**ESTIMATORS[NAME].parameters, "levels": 3, "kernel": 2, "combine": "average"}
    model = find_model("nearest")
    found = point_bounds(NAME, seen, radius, None, None, options, model)
    assert outside(renderers(1075, model, seen, radius, options), found) == 0


def test_a_tenth_less_and_another_kernel_lie_outside():
    rng = np.random.default_rng(3)
    seen, radius = drawn_scene(rng)
    while seen.depth.size < 40:
        seen, radius = drawn_scene(rng)
    options = ESTIMATORS[NAME].parameters
    found = point_bounds(NAME, seen, radius, None, None, options)
    made = estimate(NAME, seen, radius, None, None)
    shown = made.texture > 0.01
    assert shown.sum() > 5
    assert found.outside(made.texture * np.float32(0.9))[shown].all()
    assert found.outside(estimate(NAME, seen, radius, None, None, kernel=1).texture).any()


def test_no_bounds_are_known_where_the_square_of_the_radius_is_no_number():
    seen, _ = drawn_scene(np.random.default_rng(0))
    for radius in (1e20, 1e-25):
        assert point_bounds(NAME, seen, radius, None, None, ESTIMATORS[NAME].parameters) is None
