"""The benchmarks of ``benchmarks/``: baselines have lfssao's bits."""

import bench_algorithm2
import bench_baselines
import pytest
from c_baselines import compile_baselines
from kernel_baselines import BASELINES
from settings import SETTINGS, SMALL, relief
from stages import differing, recorded


@pytest.fixture(scope="module")
def small_case():
    return bench_algorithm2.gallery_case(64, 48)


@pytest.mark.slow
def test_c_has_the_bits_of_algorithm_2(small_case, tmp_path):
    """The bench ends with a sentence where a bit differs."""
    library = compile_baselines(tmp_path, 1, "-ffp-contract=off")
    rows = bench_algorithm2.bench(small_case, library, library, 1)
    assert set(rows) >= {"lfssao", "plain_c"}
    assert 0.1 < bench_algorithm2.ours(small_case)().mean() < 0.5


@pytest.mark.slow
def test_a_shader_has_the_bits_of_algorithm_2(small_case):
    assert bench_baselines.glsl(small_case, 1)["glsl"]["equal_bits"] == 1.0


@pytest.mark.slow
def test_c_has_the_bits_of_all_kernels_that_have_a_baseline(tmp_path):
    """Each baseline still names a kernel, and some setting of the bench calls it."""
    library = compile_baselines(tmp_path, 1, "-ffp-contract=off")
    views = relief(*SMALL)
    with recorded(BASELINES) as calls:
        for setting in SETTINGS:
            setting.run(views)
    assert differing(calls, library) == []
    assert {call.baseline for call in calls} == set(BASELINES)
