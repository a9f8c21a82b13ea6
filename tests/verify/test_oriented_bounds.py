"""Bounds of the normal-oriented hemisphere: few points are undecided, and what is wrong falls outside."""

import numpy as np

from lfssao import make_samples
from lfssao.ao.estimators.oriented import OrientedOptions
from lfssao.ao.estimators.registry import estimate
from lfssao.verify.bounds.points import point_bounds

NAME = "oriented-hemisphere"


def test_few_points_are_undecided_and_what_is_wrong_falls_outside(seen):
    points = make_samples("latin", 64, r_min=0.0)
    for still, radius in seen:
        shown = still.turned("hash")
        there = still.depth < np.inf
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
