"""The program that makes the tables of point sets by repulsion: ``python tests/tools/make_repulsion.py FOLDER``.

VO section 4.5, and what it leaves open. Forces: 1 / d^4 between points, and from a charge spread evenly over the
boundary, found by bringing the points to the centroids of their Voronoi cells (those of the disk weighted by the z
extent of the ball). Out of several Poisson sets to start from (VO: tens), the one is kept whose cells end with the most
even integrals, VO's goal. The weights are the integrals over the cells of VO's grids, 128^3 and 512^2. Disks are made
twice, with a point in the centre and without one held there.

VO finds 6, 12 and 33 points, and with the centre 5, 7, 9, 13 and 16 lines, unusually good. The sets of 6 (octahedron)
and 12 (icosahedron) points and 5, 7 and 9 lines are symmetrical about the centre, and so exact for a plane through it,
the flat surface; 33 points, 13 and 16 lines are not (15 and 17 are). Over planes anywhere no number stands out.
"""

import sys
from collections.abc import Iterator
from functools import partial
from math import pi
from pathlib import Path

import numpy as np
import repulsion
from numpy.typing import NDArray

from lfssao.files.whole import write_whole

FloatArray = NDArray[np.float64]

MOST = 64
VOLUME = 4.0 / 3.0 * pi
# Dimensions, whether the first point stays in the centre, cells a side while relaxing and of the weights.
TABLES = {"ball": (3, False, 48, 128), "disk": (2, False, 192, 512), "disk-centre": (2, True, 192, 512)}
STARTS = {"ball": 48, "disk": 6, "disk-centre": 6}


def relaxed(table: str, n: int, start: int) -> tuple[FloatArray, FloatArray]:
    """One relaxed set: points (n, d) and weights (n,), which sum to the ball's volume.

    Parameters
    ----------
    table : str
        'ball', 'disk' or 'disk-centre'.
    n : int
        How many points.
    start : int
        Seed of the Poisson set that it starts from.
    """
    d, centred, coarse, fine = TABLES[table]
    points = np.empty((n, d))
    repulsion.throw_darts(np.uint64(start), points)
    if centred or n == 1:
        points[0] = 0.0
    repulsion.relax(points, centred, coarse, 12, 0.4 * n, 40)
    weights = np.empty(n)
    repulsion.voronoi(points, fine, weights, np.empty((n, d)))
    return points, VOLUME * weights


def best(table: str, n: int) -> FloatArray:
    """The set of the most even cells among those of all starts: (n, d + 1), coordinates and weight.

    Parameters
    ----------
    table, n
        As of ``relaxed``.
    """
    sets = [relaxed(table, n, start) for start in range(STARTS[table])]
    points, weights = min(sets, key=lambda made: float(repulsion.unevenness(made[1] / VOLUME)))
    return np.column_stack([points, weights])


def rows(table: str) -> Iterator[FloatArray]:
    """The sets of 1, 2, ..., MOST points."""
    from tqdm import tqdm  # late: only the program shows its progress

    for n in tqdm(range(1, MOST + 1), desc=table, unit="set", disable=None):
        yield best(table, n)


def main(folder: Path) -> None:
    """Make all tables: one .npy file each, the sets one after the other."""
    for table in TABLES:
        write_whole(folder / f"{table}.npy", partial(np.save, arr=np.concatenate(list(rows(table)))))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
