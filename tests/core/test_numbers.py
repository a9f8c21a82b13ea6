"""Formulas of floats have the bits of Python's operators on NumPy's numbers."""

import pickle

import numpy as np
import pytest
from number_forms import operations, several

from lfssao.core import balls, doubts, places, quotients, vectors
from lfssao.core.jit import kernel
from lfssao.core.numbers import as_float, number, plain, rounded, select

SPECIAL = [0.0, -0.0, 1.0, -1.0, 0.1, 3.0, np.nan, np.inf, -np.inf, 1e-40, -1e-40, 1e30]


@kernel
def by_compiler(given, made):
    for i in range(given.shape[0]):
        x = as_float(given[i, 0])
        y = as_float(given[i, 1])
        z = as_float(given[i, 2])
        u = as_float(given[i, 3])
        v = as_float(given[i, 4])
        w = as_float(given[i, 5])
        one = operations(x, y, z)
        more = several(x, y, z, u, v, w)
        for k in range(len(one)):
            made[i, k] = plain(one[k])
        for k in range(len(more)):
            made[i, len(one) + k] = plain(more[k])


@np.errstate(all="ignore")
def by_python(given):
    return np.array([[*operations(*row[:3]), *several(*row)] for row in given], given.dtype)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_formulas_have_the_bits_of_python(dtype):
    """Among them NaN, of which the first number is taken, and zeros of both signs."""
    rng = np.random.default_rng(1)
    given = np.concatenate([rng.choice(SPECIAL, (400, 6)), rng.normal(size=(200, 6)) * 2.0 ** rng.integers(-9, 9)])
    given = given.astype(dtype)
    right = by_python(given)
    made = np.empty_like(right)
    by_compiler(given, made)
    there = ~np.isnan(right)
    integer = f"i{given.itemsize}"
    np.testing.assert_array_equal(np.isnan(made), ~there)
    np.testing.assert_array_equal(made[there].view(integer), right[there].view(integer))


def test_words_of_python():
    for x in (np.float32(0.1), np.float64(0.1)):
        assert isinstance(number(3, x), type(x))
        assert rounded(0.1, 3, x) == x
        assert isinstance(select(x > 0, x, 1), type(x))
        assert isinstance(select(x < 0, x, 1), type(x))


def test_types_of_values_are_found_again_by_the_cache_on_disk():
    """Numba writes the types of a kernel beside its code: a second process must read the same ones."""
    vector = vectors.VectorType(balls.ball, balls.ball, balls.ball)
    for kind in (vector, places.RowsType(*[balls.ball] * 4), doubts.doubt, quotients.QuotientType(*[balls.ball] * 3)):
        assert type(pickle.loads(pickle.dumps(kind))) is type(kind)
    assert places.SpotType is pickle.loads(pickle.dumps(places.SpotType))
