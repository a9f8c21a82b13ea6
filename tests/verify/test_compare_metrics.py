"""The figures of ``lfssao compare``: ulp, errors, PSNR, SSIM, numbers that are not finite."""

import numpy as np
import pytest

from lfssao.verify.bounds.bounds import Bounds
from lfssao.verify.compare.layers import Layer
from lfssao.verify.compare.metrics import measure, ulp_distance
from lfssao.verify.compare.result import Tolerance, result_of
from lfssao.verify.verdict import Judgement, Verdict


def test_ulp_distance_counts_numbers():
    a = np.array([1, -0.0, 1e-45, -1e-45, 3.4028235e38, 1], np.float32)
    b = np.array([np.nextafter(np.float32(1), np.float32(2)), 0, -1e-45, 1e-45, -3.4028235e38, 1], np.float32)
    assert ulp_distance(a, b).tolist() == [1, 0, 2, 2, 2 * 0x7F7FFFFF, 0]
    most = np.array([1.7976931348623157e308])
    assert ulp_distance(most, -most).tolist() == [2 * 0x7FEFFFFFFFFFFFFF]
    assert ulp_distance(np.float16([1, -1]), np.float16([1.001, 1])).tolist() == [1, 2 * 0x3C00]
    assert ulp_distance(np.uint8([0, 255]), np.uint8([255, 0])).tolist() == [255, 255]


@pytest.mark.parametrize(("a", "b", "ulp"), [
    (1, 1.0000001, 1), (-1.125, -1, 2**20), (1, 1.1250001, None), (0, -0.0, 0), (0, 1e-3, None), (1e-45, 0, None),
    (3e-45, 1e-45, None), (-1.2e-38, 1.2e-38, None),
])  # fmt: skip
def test_ulp_are_left_out_where_they_mean_nothing(a, b, ulp):
    """Too many, another sign, zero, subnormal numbers, codes."""
    assert measure((np.float32([[a, 1]]),), (np.float32([[b, 1]]),)).max_ulp == ulp
    assert measure((np.uint8([[1]]),), (np.uint8([[2]]),)).max_ulp is None


def test_figures_are_those_of_their_formulas():
    from skimage.metrics import peak_signal_noise_ratio

    rng = np.random.default_rng(3)
    b = rng.random((20, 30), np.float32)
    a = b + rng.normal(0, 0.01, b.shape).astype(np.float32)
    found = measure((a,), (b,))
    error = a.astype(np.float64) - b
    assert found.differing == int((a != b).sum())
    assert found.mean_error == pytest.approx(np.abs(error).mean())
    assert found.rmse == pytest.approx(np.sqrt((error**2).mean()))
    assert found.max_error == np.abs(error).max()
    assert found.psnr == pytest.approx(peak_signal_noise_ratio(b.astype(float), a.astype(float), data_range=1))
    assert 0.9 < found.ssim < 1
    assert measure((1 - b,), (b,)).ssim < 0


def test_figures_leave_out_what_is_not_finite_and_count_it():
    b = np.linspace(0, 1, 100, dtype=np.float32).reshape(10, 10)
    a = b.copy()
    b[0, :4] = [np.inf, np.inf, 1, np.nan]
    a[0, :4] = [-np.inf, 1, np.nan, np.nan]
    found = measure((a,), (b,))
    assert (found.infinity_mismatches, found.nan_mismatches) == (2, 1)
    assert (found.differing, found.max_ulp, found.max_error, found.rmse, found.ssim) == (3, 0, 0, 0, 1)


@pytest.mark.parametrize("shape", [(1, 1), (2, 9), (3, 3), (5, 8)])
def test_small_textures_have_figures(shape):
    found = measure((np.ones(shape, np.float32),), (np.zeros(shape, np.float32),))
    assert found.psnr == 0
    assert (found.ssim is None) == (min(shape) < 3)


def test_the_worst_texels_are_farthest_beyond_their_intervals_and_then_farthest_off():
    """Ten of fifteen: no numbers first, then by the distance from the interval, ties row by row; those inside last."""
    e = 2.0**-6
    mine = np.float32([[e, 0.875, e, np.nan, e], [0.5, e, 0.375, e, e], [-0.25, 1, -np.inf, 0, 0]])
    upper = np.float32([[0.5, 1, 0.5, 0.5, 0.5], [0.375, 0.5, 0.125, 0.5, 0.5], [0.5, 1, 0.5, 0.5, 0.5]])
    right = 0 * upper
    allowed = Bounds(0 * upper, upper)
    judged = Judgement(Verdict.OUTSIDE, "", mine != right, allowed.outside(mine), allowed)
    sides = (Layer("ao_1", ("Y",), (texture,), None) for texture in (mine, right))
    found = result_of("module_000", *sides, judged, Tolerance(), str).worst
    outside = [(3, 0), (2, 2), (2, 1), (0, 2), (0, 1)]
    assert [(t.column, t.row) for t in found] == [*outside, (1, 2), (1, 0), (0, 0), (2, 0), (4, 0)]
    assert [t.outside for t in found] == [True] * 5 + [False] * 5
    assert (found[2].mine, found[2].reference, found[2].lower, found[2].upper) == ((0.375,), (0,), (0,), (0.125,))
    assert found[2].reason == "(2, 1)"
