"""Sample sets: offsets in the unit ball from LF's Algorithms 3 and 4, by the distributions of LF section 6.

A method fills the square [-1, 1]^2 with n points (xi_1, xi_2); Algorithm 3 lifts them to the sphere, Algorithm 4 into
the shell. Each is a function of (n, seed) alone, with equal bits on every machine.
"""

from collections.abc import Callable
from math import isqrt

import numpy as np
from numpy.typing import NDArray

from lfssao.errors import InputError
from lfssao.kernels import ball
from lfssao.kernels.philox import random_below, random_signed, random_unit

FloatArray = NDArray[np.float64]
SquarePoints = Callable[[int, np.uint64], FloatArray]

# Streams of the counter-based generator: numbers of one stream never meet those of another.
_XI1, _XI2, _RADIUS, _SHUFFLE = range(4)


def _random(n: int, seed: np.uint64) -> FloatArray:
    """Independent uniform points."""
    return np.array([[random_signed(seed, _XI1, k), random_signed(seed, _XI2, k)] for k in range(n)])


def _shuffle(n: int, seed: np.uint64) -> list[int]:
    """A random permutation of 0 .. n - 1 (Fisher and Yates)."""
    order = list(range(n))
    for k in range(n - 1, 0, -1):
        other = int(random_below(seed, _SHUFFLE, k, k + 1))
        order[k], order[other] = order[other], order[k]
    return order


def _grid(n: int) -> tuple[int, int]:
    """Columns and rows of the grid nearest to a square with columns * rows = n."""
    rows = next(r for r in range(isqrt(n), 0, -1) if n % r == 0)
    return n // rows, rows


def _jittered(n: int, seed: np.uint64) -> FloatArray:
    """One uniform point in each cell of a grid.

    The grid has n cells, as near to a square as n's divisors allow; for a prime n it is n strips along xi_1, so that
    each cell holds the same number of points, one, for every n.
    """
    columns, rows = _grid(n)
    out = np.empty((n, 2))
    for k in range(n):
        out[k, 0] = _in_cell(k % columns, columns, random_unit(seed, _XI1, k))
        out[k, 1] = _in_cell(k // columns, rows, random_unit(seed, _XI2, k))
    return out


def _latin(n: int, seed: np.uint64) -> FloatArray:
    """One uniform point in each row and each column of an n x n grid."""
    column_of_row = _shuffle(n, seed)
    out = np.empty((n, 2))
    for k in range(n):
        out[k, 0] = _in_cell(column_of_row[k], n, random_unit(seed, _XI1, k))
        out[k, 1] = _in_cell(k, n, random_unit(seed, _XI2, k))
    return out


def _in_cell(cell: int, cells: int, place: float) -> float:
    """A coordinate of [-1, 1]: the place, 0 to 1, inside one of equal cells."""
    return 2.0 * ((cell + place) / cells) - 1.0


METHODS: dict[str, SquarePoints] = {"random": _random, "jittered": _jittered, "latin": _latin}


def square_points(method: str, n: int, seed: int = 0) -> FloatArray:
    """Points on the square [-1, 1]^2, (n, 2) float64: LF's (xi_1, xi_2).

    Parameters
    ----------
    method : str
        'random', 'jittered' or 'latin' (LF section 6).
    n : int
        How many, at least 1.
    seed : int
        0 to 2**64 - 1.

    Raises
    ------
    InputError
        If the method is unknown, n < 1 or the seed is out of range.
    """
    if method not in METHODS:
        raise InputError(f"there is no sampling '{method}': choose one of {', '.join(METHODS)}")
    if not isinstance(n, int | np.integer) or n < 1:
        raise InputError(f"the number of samples is {n}, it must be a whole number of at least 1")
    if not isinstance(seed, int | np.integer) or not 0 <= seed < 2**64:
        raise InputError(f"the seed is {seed}, it must be a whole number between 0 and 2**64 - 1")
    return METHODS[method](n, np.uint64(seed))


def make_samples(
    method: str = "latin", n: int = 8, seed: int = 0, r_min: float = 0.8, r_max: float = 1.0
) -> FloatArray:
    """Sample offsets in the shell r_min <= r <= r_max of the ball, (n, 3) float64, by Algorithms 3 and 4.

    Parameters
    ----------
    method, n, seed
        As for ``square_points``.
    r_min, r_max : float
        LF's r_min and r_max over R; LF found 0.8 and 1 suitable. Multiply the result by R, in world units.

    Raises
    ------
    InputError
        As ``square_points``; also if not 0 <= r_min <= r_max, or one of them is not finite.
    """
    if not 0 <= r_min <= r_max < np.inf:
        raise InputError(f"r_min and r_max are {r_min} and {r_max}, they must be 0 <= r_min <= r_max")
    square = square_points(method, n, seed)
    t = np.array([random_unit(np.uint64(seed), _RADIUS, k) for k in range(n)])
    out = np.empty((n, 3))
    ball.ball_points(square[:, 0].copy(), square[:, 1].copy(), t, r_min, r_max, out)
    return out
