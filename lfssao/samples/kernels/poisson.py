"""Poisson disk sets on LF's square by Bridson's algorithm (2007), exactly n points.

The square is the unrolled cylinder of Algorithm 3, so distances wrap in xi_2: xi_2 = -1 and 1 are one place.
"""

from math import floor, sqrt

import numpy as np

from lfssao.core.elementary import sincospi
from lfssao.core.jit import formula, kernel
from lfssao.core.philox import philox4x32, random_below, random_signed
from lfssao.samples.kernels.square import SHUFFLE, random_radii

_TRIES = 30  # Bridson's k
_FIRST = 8  # the first search's stream; each takes one
_START = 0.73  # of the distance of a triangular lattice: most searches end near it
_MASK, _32 = np.uint64(0xFFFFFFFF), np.uint64(32)


@formula
def distance_square(x0, y0, x1, y1):
    """Square of the distance of two points of the square, which wraps in its second coordinate."""
    across = abs(y1 - y0)
    across = min(across, 2.0 - across)
    return (x1 - x0) * (x1 - x0) + across * across


@kernel
def bridson(seed, stream, r, points):
    """Fill the square with points at least r apart until no more is found, or the array is full; return their number.

    points: (most, 2), out. Candidates stand r to 2 r from a random point of the front, uniform on that ring; a point
    leaves the front when 30 candidates around it have failed.
    """
    most = points.shape[0]
    cells = int(2.0 * sqrt(2.0) / r) + 1  # on a side: those of a diagonal below r hold one point
    reach = int(r * cells / 2.0) + 1
    grid = np.full((cells, cells), -1, np.int32)
    front = np.empty(most, np.int32)
    points[0, 0], points[0, 1] = random_signed(seed, stream, 0), random_signed(seed, stream, 1)
    grid[_cell(points[0, 0], cells), _cell(points[0, 1], cells)] = 0
    front[0] = 0
    count = waiting = 1
    dart = 2
    while waiting > 0 and count < most:
        place = random_below(seed, stream, dart, waiting)
        dart += 1
        around = front[place]
        found = False
        for _ in range(_TRIES):
            ring, turn, _, _ = philox4x32(dart, stream, 1, 0, seed & _MASK, seed >> _32)
            dart += 1
            away = r * sqrt(1.0 + 3.0 * ((ring + 0.5) / 4294967296.0))
            sine, cosine = sincospi((turn + 0.5) / 2147483648.0)
            x, y = points[around, 0] + away * cosine, points[around, 1] + away * sine
            y = y - 2.0 * floor((y + 1.0) * 0.5)
            if abs(x) > 1.0 or abs(y) > 1.0:
                continue
            if _is_free(x, y, r * r, points, grid, reach):
                points[count, 0], points[count, 1] = x, y
                grid[_cell(x, cells), _cell(y, cells)] = count
                front[waiting] = count
                count += 1
                waiting += 1
                found = True
                break
        if not found:
            waiting -= 1
            front[place] = front[waiting]
    return count


@formula
def _cell(coordinate, cells):
    return min(int((coordinate + 1.0) * 0.5 * cells), cells - 1)


@kernel
def _is_free(x, y, square, points, grid, reach):
    cells = grid.shape[0]
    i, j = _cell(x, cells), _cell(y, cells)
    span = min(reach, cells // 2)
    for a in range(max(i - reach, 0), min(i + reach, cells - 1) + 1):
        for b in range(j - span, j + span + 1):
            other = grid[a, b % cells]
            if other >= 0 and distance_square(x, y, points[other, 0], points[other, 1]) < square:
                return False
    return True


@kernel
def poisson(seed, out):
    """Fill out with exactly n points at least r apart, in random order, and return r.

    The first r is _START; a search that finds fewer points than n makes the next r smaller accordingly. Points above n,
    a few in a hundred, are left out at random.
    """
    n = out.shape[0]
    r = _START * sqrt(8.0 / (sqrt(3.0) * n))
    points = np.empty((n + n // 4 + 8, 2))
    stream = _FIRST
    count = bridson(seed, stream, r, points)
    while count < n:
        r = r * min(sqrt(count / n), 0.99)
        stream += 1
        count = bridson(seed, stream, r, points)
    for k in range(n):
        other = k + random_below(seed, SHUFFLE, k, count - k)
        for a in range(2):
            points[k, a], points[other, a] = points[other, a], points[k, a]
            out[k, a] = points[k, a]
    random_radii(seed, out)
    return r
