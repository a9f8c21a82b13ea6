"""Point sets in the ball and the disk by repulsion (VO section 4.5): forces, Voronoi cells, and their relaxation.

Points are (n, d) float64, d = 3 in the ball and 2 in the disk. A cell's weight is its integral: of 1 over the ball, of
the unit ball's extent along z over the disk.
"""

from math import sqrt

import numba
import numpy as np

from lfssao.core.elementary import sincospi
from lfssao.core.philox import random_signed

_RING = 128  # charges on the disk's boundary; their field is off by a share of about rho^128
_OUTERMOST = 0.995  # the circle's field is off beyond
_DARTS = 64  # darts thrown before the distance that they have to keep shrinks

kernel = numba.njit(cache=True, error_model="numpy")


@kernel
def throw_darts(seed, points):
    """A Poisson set: darts at the ball or disk that keep a distance from those before them, which shrinks in need.

    points: (n, d), out. Dart k's coordinate a is number k of stream a. The set is shrunk a little, off the boundary.
    """
    n, d = points.shape
    apart = 4.0
    dart = 0
    missed = 0
    place = np.empty(d)
    count = 0
    while count < n:
        square = 0.0
        for a in range(d):
            place[a] = random_signed(seed, a, dart)
            square += place[a] * place[a]
        dart += 1
        if square > 1.0:
            continue
        nearest = 16.0
        for k in range(count):
            gap = 0.0
            for a in range(d):
                gap += (points[k, a] - 0.95 * place[a]) * (points[k, a] - 0.95 * place[a])
            nearest = min(nearest, gap)
        if nearest >= apart:
            for a in range(d):
                points[count, a] = 0.95 * place[a]
            count += 1
            missed = 0
        else:
            missed += 1
            if missed == _DARTS:
                missed = 0
                apart = apart * 0.9


@kernel
def repel(points, charge, forces):
    """The force on each point, 1 / d^4 from every other point and inwards from the boundary; the energy of them all.

    points, forces: (n, d), forces out. charge: of the whole boundary, in charges of a point. The energy of two charges
    is 1 / (3 d^3).
    """
    n, d = points.shape
    energy = 0.0
    for i in range(n):
        square = 0.0
        for a in range(d):
            square += points[i, a] * points[i, a]
        field, potential = _sphere_field(square) if d == 3 else _ring_field(sqrt(square))
        for a in range(d):
            forces[i, a] = -charge * field * points[i, a]
        energy += charge * potential
        for k in range(n):
            if k == i:
                continue
            square = 0.0
            for a in range(d):
                square += (points[i, a] - points[k, a]) * (points[i, a] - points[k, a])
            cube = square * sqrt(square)
            energy += 1.0 / (6.0 * cube)  # of each pair twice
            for a in range(d):
                forces[i, a] += (points[i, a] - points[k, a]) / (cube * square)
    return energy


@kernel
def _sphere_field(square):
    """Inward force over rho, and potential, at rho^2 < 1 of a unit charge spread over the unit sphere: closed forms."""
    deep = 1.0 - square
    return 2.0 / (3.0 * deep * deep), 1.0 / (3.0 * deep)


@kernel
def _ring_field(rho):
    """The same at rho < 1 of a unit charge spread over the unit circle: the mean over _RING charges."""
    field = 0.0
    potential = 0.0
    for k in range(_RING):
        sine, cosine = sincospi((k + 0.5) / (0.5 * _RING))
        square = (rho - cosine) * (rho - cosine) + sine * sine
        cube = square * sqrt(square)
        potential += 1.0 / (3.0 * cube)
        field += (cosine - rho) / (cube * square)
    return field / (_RING * max(rho, 1e-9)), potential / _RING


@kernel
def voronoi(points, cells, weights, centroids):
    """Integral and centroid of each point's Voronoi cell, summed over the centres of a grid of cells^d.

    points, centroids: (n, d); weights: (n,), they sum to 1. The first of points equally near has the cell. Layers are
    added from the lowest to the highest, rows and columns likewise.
    """
    n, d = points.shape
    for k in range(n):
        weights[k] = 0.0
        for a in range(d):
            centroids[k, a] = 0.0
    for c in range(cells if d == 3 else 1):
        z = ((2 * c + 1) - cells) / cells if d == 3 else 0.0
        for b in range(cells):
            y = ((2 * b + 1) - cells) / cells
            for a in range(cells):
                x = ((2 * a + 1) - cells) / cells
                inside = 1.0 - ((x * x + y * y) + z * z)
                if inside <= 0.0:
                    continue
                share = 1.0 if d == 3 else sqrt(inside)
                nearest = _nearest(points, x, y, z)
                weights[nearest] += share
                centroids[nearest, 0] += share * x
                centroids[nearest, 1] += share * y
                if d == 3:
                    centroids[nearest, 2] += share * z
    total = 0.0
    for k in range(n):
        total += weights[k]
    for k in range(n):
        for a in range(d):
            centroids[k, a] = centroids[k, a] / weights[k] if weights[k] > 0.0 else points[k, a]
        weights[k] = weights[k] / total


@kernel
def _nearest(points, x, y, z):
    n, d = points.shape
    nearest = 0
    best = np.inf
    for k in range(n):
        gap = (points[k, 0] - x) * (points[k, 0] - x) + (points[k, 1] - y) * (points[k, 1] - y)
        if d == 3:
            gap += (points[k, 2] - z) * (points[k, 2] - z)
        if gap < best:
            nearest = k
            best = gap
    return nearest


@kernel
def unevenness(weights):
    """Root mean square of n w - 1: how much the cells' integrals differ, 0 where they are equal."""
    n = weights.shape[0]
    total = 0.0
    for k in range(n):
        total += (n * weights[k] - 1.0) * (n * weights[k] - 1.0)
    return sqrt(total / n)


@kernel
def settle(points, centred, charge, moves):
    """Move points along the forces towards the least energy; the step of a move that does not pay is halved.

    points: (n, d), moved; the first one stays where centred. A step is how far the point with the largest force goes.
    """
    n, d = points.shape
    forces = np.empty((n, d))
    ahead = np.empty((n, d))
    trial = np.empty((n, d))
    energy = repel(points, charge, forces)
    step = 0.05
    for _ in range(moves):
        largest = 0.0
        for k in range(1 if centred else 0, n):
            square = 0.0
            for a in range(d):
                square += forces[k, a] * forces[k, a]
            largest = max(largest, sqrt(square))
        if largest == 0.0 or step < 1e-12:
            break
        inside = True
        for k in range(n):
            square = 0.0
            for a in range(d):
                move = 0.0 if centred and k == 0 else step * (forces[k, a] / largest)
                trial[k, a] = points[k, a] + move
                square += trial[k, a] * trial[k, a]
            inside = inside and square < _OUTERMOST * _OUTERMOST
        reached = repel(trial, charge, ahead) if inside else np.inf
        if reached < energy:
            energy = reached
            for k in range(n):
                for a in range(d):
                    points[k, a] = trial[k, a]
                    forces[k, a] = ahead[k, a]
            step = step * 1.2
        else:
            step = step * 0.5


@kernel
def relax(points, centred, cells, rounds, charge, moves):
    """Let points settle, weigh the boundary's charge by the cells, and again; the charge reached.

    points: (n, d), moved; the first one stays where centred. After each round of moves the charge is divided by a
    factor where the centroids of the cells lie farther out than their points, and multiplied where they lie farther
    in; the factor, 1.5 at first, becomes its own root whenever that changes.
    """
    n, d = points.shape
    weights = np.empty(n)
    centroids = np.empty((n, d))
    factor = 1.5
    before = 0.0
    for _ in range(rounds):
        settle(points, centred, charge, moves)
        voronoi(points, cells, weights, centroids)
        outwards = 0.0
        for k in range(n):
            for a in range(d):
                outwards += weights[k] * ((centroids[k, a] - points[k, a]) * points[k, a])
        if outwards * before < 0.0:
            factor = sqrt(factor)
        before = outwards
        charge = charge / factor if outwards > 0.0 else charge * factor
    settle(points, centred, charge, 4 * moves)
    return charge
