"""Parts of the tests' reference that few cases of the kit reach: tables, clamps and orders, against the program."""

import re

import numpy as np
import pytest
from reference import mapping, samples
from reference.spiral import TURNS, tap_of, turns_of

from lfssao.optics.kernels import display as kernels
from lfssao.samples.kernels import spiral
from lfssao.samples.registry import sample_set
from lfssao.samples.spiral import best_turns
from lfssao.verify.kit.specification import specification


def test_the_references_turns_for_every_number_of_taps_are_the_texts_and_the_programs():
    """All 99 numbers: those of SPECIFICATION.md, of the table, and the taps that come of them, beyond the table too."""
    text = " ".join(re.findall(r"^ {4}((?:\d+ ?)+)$", specification(), re.MULTILINE))
    listed = " ".join(map(str, TURNS))
    assert len(TURNS) == 99
    assert listed in text
    for s in (*range(1, 100), 100, 101, 128, 150):
        taps = np.empty((s, 3), np.float32)
        spiral.unit_taps(best_turns(s), taps)
        made = np.array([tap_of(t, s, turns_of(s)) for t in range(s)], np.float32)
        np.testing.assert_array_equal(made, taps, err_msg=str(s))


@pytest.mark.parametrize("r_max", [1.0, 0.7, 3e-7, 0.0])
def test_radii_of_thin_shells_lie_between_the_shells_two(r_max):
    """Shells some roundings thick, where a cube root may miss either side, and thick ones: the program's bits."""
    for thickness in (0.0, 2.0**-52, 2.0**-51, 2.0**-48, 0.2, 1.0):
        r_min = r_max * (1 - thickness)
        made = samples.samples("random", 40, 5, r_min, r_max)
        want = sample_set("ball", "random", 40, 5, r_min=r_min, r_max=r_max).points
        np.testing.assert_array_equal(made.view(np.int64), want.view(np.int64))
        radii = np.sqrt((made**2).sum(axis=1))
        assert (radii >= r_min * (1 - 2**-50)).all()
        assert (radii <= r_max * (1 + 2**-50)).all()


def screens():
    """Lenses outside a convex screen's circle, on it, and inside a concave one's, with points all around them."""
    rng = np.random.default_rng(6)
    for number in range(400):
        d = np.zeros(32, np.float32)
        d[:7] = rng.uniform([-2, -0.3, 0.3, -0.3, -3, -1, -0.3], [2, 0.3, 3, 0.3, -1, 1, 0.3])
        d[8:17] = 9, 0, 5, 0, -9, 5, 0, 0, 1
        d[22] = kernels.NEVER
        if number % 20 == 0:  # on the circle: the crossing is the lens itself
            d[0], d[2], d[5] = 1, 1, 1
        yield d, rng.uniform(-3, 3, (6, 3)).astype(np.float32)


@pytest.mark.filterwarnings("ignore:divide by zero", "ignore:invalid value", "ignore:overflow")
def test_points_whose_rays_reach_the_screen_only_behind_the_lens():
    """The status, u and v of the reference and the kernel, where the crossing lies behind the lens among others."""
    behind = 0
    for d, points in screens():
        image, statuses = np.empty((6, 3), np.float32), np.empty(6, np.int64)
        kernels.map_points(d, points, 10**9, 10**9, image, statuses)
        for point, place, status in zip(points, image, statuses, strict=True):
            u, v, got = mapping.physical_to_image(d, *point)
            assert got == (0 if status == kernels.OUTSIDE else status)
            if got == 0:
                assert (u, v) == tuple(place[:2])
            t_s, hits = mapping.crossing(d[5], d[0], d[2], point[0] - d[0], point[2] - d[2])
            behind += bool(hits >= 0 and t_s <= 0 and status == kernels.MISSES_SCREEN)
    assert behind > 5
