"""Parts of the tests' reference that few cases of the kit reach: tables, clamps and orders, against the program."""

import re

import numpy as np
import pytest
from reference import samples
from reference.spiral import TURNS, tap_of, turns_of

from lfssao.samples.kernels import spiral
from lfssao.samples.registry import sample_set
from lfssao.samples.spiral import best_turns
from lfssao.verify.kit.specification import specification


def test_the_references_turns_for_every_number_of_taps_are_the_texts_and_the_programs():
    """All 99 numbers: those of ESTIMATORS.md, of the table, and the taps that come of them, beyond the table too."""
    text = " ".join(re.findall(r"^ {4}((?:\d+ ?)+)$", specification()["ESTIMATORS.md"], re.MULTILINE))
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
