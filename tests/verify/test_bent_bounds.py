"""Intervals of bent normals: no renderer that rounds leaves them, and those of too small errors are left."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from oracle_scenes import drawn_problems
from random_numbers import Number, Renderers, occlusion, outside, scaled
from test_formulas import VARIANTS, drawn_scene, formulas_of, view_of

from lfssao import bent_normals
from lfssao.ao.estimators import gtao
from lfssao.ao.estimators.look_ups import LOOK_UPS
from lfssao.ao.estimators.registry import ESTIMATORS
from lfssao.verify.bounds.bent import bent_bounds
from lfssao.verify.bounds.error_model import find_model
from lfssao.verify.bounds.problem import Problem

RENDERERS = 30


class Hull:
    """All numbers between the least and the largest of some."""

    def __init__(self, *parts):
        ends = [end for part in parts for end in (part.ends if isinstance(part, Hull) else (part, part))]
        self.ends = min(ends), max(ends)

    def __mul__(self, factor):
        return Hull(*(factor * end for end in self.ends))

    def __add__(self, other):
        return Hull(*(a + b for a, b in zip(self.ends, other.ends, strict=True)))


@pytest.mark.parametrize("weighting", ["cosine", "uniform"])
@pytest.mark.parametrize(("low", "high"), [(-0.5, 0.6), (-0.6, -0.1), (0.2, 0.9), (0.4, 0.4), (-0.7, 1.0)])
def test_ends_of_a_side_hold_those_of_all_cosines_between(monkeypatch, weighting, low, high):
    """A horizon at 45 degrees below the zenith's plane and higher; of the parts along e and -w."""
    for name, made in (("least", lambda _: low), ("most", lambda _: high), ("alternatives", Hull)):
        monkeypatch.setattr(gtao, name, made)
    arcs = SimpleNamespace(points=np.array([[1.0, 0.0]]), exact=True, cosine=weighting == "cosine")
    view = SimpleNamespace(arc_cosine=math.acos)
    normal = (math.sqrt(0.5), 0.0, math.sqrt(0.5))
    for k, axes in enumerate(((1.0, 0.0, 0.0), (0.0, 0.0, 1.0))):
        here = None, None, None, normal, axes
        found = gtao._open(0, arcs, view, here, 0, None).ends
        each = [gtao._parts(arcs, view, here, 0, c)[k] for c in np.linspace(low, high, 400)]
        assert found == pytest.approx((min(each), max(each)), abs=1e-4)
        assert found[0] <= min(each) + 1e-15
        assert max(each) - 1e-15 <= found[1]


def renderers(rng, name, model, options, radius, seen, samples):
    """Bent normals of renderers, (R, H, W, 3)."""
    numbers = formulas_of(name, options, radius, seen, samples)
    sums = []
    view = view_of(name, seen, options, model, numbers)
    for axis in range(3):
        own = numbers._replace(axis=axis)
        sums.append(occlusion(rng.integers(2**32), RENDERERS, model, view, own, seen.depth.shape, options))
    by = Renderers(rng, RENDERERS, model)
    x, y, z = (Number(by, each) for each in sums)
    with np.errstate(all="ignore"):
        largest = Number(by, np.max(np.abs(sums), axis=0))
        scaling = by.lot(0.5)
        parts = [by.where(scaling, part / largest, part) for part in (x, y, z)]
        length = np.sqrt(by.total([1.0] * 3, [part * part for part in parts]))
        made = [by.choose(part / length, (1 / length) * part).x for part in parts]
    return np.nan_to_num(np.stack(made, axis=-1))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["gtao", "visibility-bitmask"])
def test_no_renderer_leaves_its_bounds_unless_errors_are_too_small(name):
    choices = VARIANTS[name]
    counts = []
    widths = []
    if name == "visibility-bitmask":  # gtao has all look-ups: each compiles for half a minute
        choices = {key: values for key, values in choices.items() if key not in {*LOOK_UPS, "background"}}
    options = st.fixed_dictionaries({key: st.sampled_from(values) for key, values in choices.items()})

    @settings(max_examples=20, phases=[Phase.generate])
    @given(drawn_problems(), options)
    def check(drawn, options):
        view, rng, model, radius, n, turning = drawn
        model = find_model(model)
        options = {**ESTIMATORS[name].parameters, **options}
        seen, samples = drawn_scene(rng, name, options, view, radius, n, turning)
        made = renderers(rng, name, model, options, radius, seen, samples)
        found, weak = (
            bent_bounds(Problem(seen, np.zeros((0, 3)), None, options, m), radius, name)
            for m in (model, scaled(model, 0.25))
        )
        assert not found.outside(bent_normals(name, seen, radius, **options)).any()
        assert outside(made, found) == 0
        counts.append(outside(made, weak))
        widths.extend((found.upper - found.lower)[np.isfinite(seen.depth)].ravel())

    check()
    assert any(counts)
    assert np.quantile(widths, 0.25) < 1e-3
