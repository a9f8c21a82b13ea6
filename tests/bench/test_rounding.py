"""The C baselines with random rounding stay inside the intervals, and would not if these were much narrower."""

import bench_rounding
import numpy as np
import pytest
from c_baselines import compile_baselines

from lfssao.verify.bounds.bounds import Bounds


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    return compile_baselines(tmp_path_factory.mktemp("baselines"), 1, *bench_rounding.OPTIONS)


def narrowed(bounds, part):
    """Bounds of a part of the width, around the same middles."""
    low = bounds.lower.astype(np.float64)
    high = bounds.upper.astype(np.float64)
    middle = (low + high) / 2
    reach = part * (high - low) / 2
    return Bounds((middle - reach).astype(np.float32), (middle + reach).astype(np.float32))


@pytest.mark.parametrize("name", ["alchemy", "vo-points", "hbao"])
def test_no_direction_of_rounding_leaves_the_intervals(monkeypatch, library, name):
    name_of_view, buffers, radius = next(bench_rounding.textures(bench_rounding.SIZE))
    found = bench_rounding.spread(name, name_of_view, buffers, radius, library, 20)
    assert found.outside == 0
    assert found.apart > 1000
    bounds = bench_rounding.intervals
    monkeypatch.setattr(bench_rounding, "intervals", lambda *given: narrowed(bounds(*given), 1 / (2 * found.ratio)))
    assert bench_rounding.spread(name, name_of_view, buffers, radius, library, 20).outside > 0


def test_rounding_is_to_nearest_after_a_run(library):
    name_of_view, buffers, radius = next(bench_rounding.textures(bench_rounding.SIZE))
    bench_rounding.spread("vo-points", name_of_view, buffers, radius, library, 1)
    ones = np.ones(8, np.float32)
    tiny = np.full(8, 2.0**-25, np.float32)
    assert np.array_equal(ones + tiny, ones)
    assert np.array_equal(ones - tiny, ones)
