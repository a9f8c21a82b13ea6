"""Sectors of floats, balls and Python's numbers, each against sets of their numbers, by loops."""

from itertools import product

import numpy as np
import pytest

from lfssao.core.balls import UNKNOWN, Ball, ball_of
from lfssao.core.doubts import Doubt
from lfssao.core.jit import kernel
from lfssao.core.numbers import as_float, plain, select
from lfssao.core.sectors import (
    MOST,
    any_ends,
    ends_of,
    join_ends,
    joined,
    no_ends,
    sector_count,
    sector_is_set,
    sectors_between,
    state_between,
)

PAIRS = np.array(list(product(range(MOST + 1), repeat=2)))


def numbers_in(mask):
    return {k for k in range(MOST) if int(mask) >> k & 1}


@kernel
def of_floats(pairs, masks, counts, flags):
    for i in range(len(pairs)):
        masks[i] = sectors_between(as_float(pairs[i, 0]), as_float(pairs[i, 1]))
        other = sectors_between(as_float(pairs[i, 1]), as_float(pairs[i, 0]))
        counts[i] = plain(sector_count(joined(masks[i], other), as_float(pairs[i, 0])))
        for k in range(MOST):
            flags[i, k] = sector_is_set(masks[i], k)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_sectors_of_floats_are_those_from_the_first_to_before_the_last(dtype):
    masks = np.zeros(len(PAIRS), np.uint32)
    counts = np.zeros(len(PAIRS), dtype)
    flags = np.zeros((len(PAIRS), MOST))
    of_floats(PAIRS.astype(dtype), masks, counts, flags)
    for (first, last), mask, count, own in zip(PAIRS.tolist(), masks, counts, flags, strict=True):
        assert numbers_in(mask) == set(range(first, last)) == set(np.flatnonzero(own))
        assert [sector_is_set(mask, k) for k in range(MOST)] == own.tolist()
        assert mask == sectors_between(first, last)
        assert count == abs(first - last) == sector_count(joined(mask, sectors_between(last, first)), None)


@kernel
def of_balls(given, made, counts, by):
    """Sectors, joined with others and chosen in doubt, for sure and perhaps; given: (N, 4, 2), values and errors."""
    zero = ball_of(0.0, 0.0, by)
    for i in range(len(given)):
        a = Ball(given[i, 0, 0], given[i, 0, 1], zero)
        b = Ball(given[i, 1, 0], given[i, 1, 1], zero)
        c = Ball(given[i, 2, 0], given[i, 2, 1], zero)
        d = Ball(given[i, 3, 0], given[i, 3, 1], zero)
        x = sectors_between(a, b)
        y = sectors_between(c, d)
        both = joined(x, y)
        either = select(Doubt(True, False), x, y)
        hull = state_between(join_ends(join_ends(no_ends(x), ends_of(x)), y), zero)
        count = sector_count(both, zero)
        sure = select(Doubt(True, True), x, y)
        never = select(Doubt(False, False), x, y)
        every = any_ends(x)
        for k, each in enumerate((x, both, either, hull, sure, never, every)):
            made[i, k, 0], made[i, k, 1] = each.must, each.may
        for k in range(MOST):
            surely = sector_is_set(both, k).must
            perhaps = sector_is_set(both, k).may
            made[i, 7, 0] |= np.uint32(int(surely) << k)
            made[i, 7, 1] |= np.uint32(int(perhaps) << k)
        counts[i, 0], counts[i, 1] = count.value - count.error, count.value + count.error


def whole_of(value, error):
    return [k for k in range(MOST + 1) if abs(k - value) <= error]


def test_sectors_of_balls_hold_those_of_all_numbers_in_them_and_no_more():
    rng = np.random.default_rng(11)
    given = np.stack([rng.integers(0, MOST + 1, (400, 4)), rng.choice([0.0, 1e-6, 0.5, 1.0, 2.5], (400, 4))], axis=2)
    given[:, :, 0] += rng.choice([0.0, 0.5], (400, 4)) * (given[:, :, 1] >= 0.5)  # whole numbers are in each
    made = np.zeros((len(given), 8, 2), np.uint32)
    counts = np.zeros((len(given), 2))
    of_balls(given, made, counts, np.zeros(5))
    for numbers, found, (fewest, most) in zip(given, made, counts, strict=True):
        a, b, c, d = (whole_of(*each) for each in numbers)
        one, two = ([set(range(i, j)) for i in firsts for j in lasts] for firsts, lasts in ((a, b), (c, d)))
        unions = [x | y for x in one for y in two]
        for sets, (must, may) in zip((one, unions, one + two, one + two, one, two), found[:6], strict=True):
            assert numbers_in(must) == set.intersection(*sets)
            assert numbers_in(may) == set.union(*sets)
        assert found[7].tolist() == found[1].tolist()
        assert fewest == len(set.intersection(*unions))
        assert most == len(set.union(*unions))
        assert found[6].tolist() == [0, 2**MOST - 1]


def test_sectors_of_unknown_numbers_are_unknown():
    given = np.zeros((1, 4, 2))
    given[0, :2, 1] = UNKNOWN
    made = np.zeros((1, 8, 2), np.uint32)
    counts = np.zeros((1, 2))
    of_balls(given, made, counts, np.zeros(5))
    assert made[0, 0].tolist() == [0, 2**MOST - 1]
    assert counts[0].tolist() == [0, MOST]
