"""Methods that do not go through the square: rejection, VO's tables by repulsion, SAO's spiral."""

from dataclasses import replace
from functools import partial

import numpy as np

from lfssao.samples.kernels import warp
from lfssao.samples.kernels.spiral import unit_taps
from lfssao.samples.repulsion import MOST, PROMISES, repulsion_table
from lfssao.samples.sets import SHELL, FloatArray, Method, SampleSet, fill
from lfssao.samples.spiral import best_turns


def _rejected(n: int, seed: int, columns: int) -> FloatArray:
    return fill(warp.rejection, (n, columns), np.uint64(seed))


def _rejection_sphere(n: int, seed: int) -> FloatArray:
    points = _rejected(n, seed, 3)
    x, y, z = points.T
    return np.asarray(points / np.sqrt((x * x + y * y) + z * z)[:, None])


def _rejection_ball(n: int, seed: int, r_min: float, r_max: float) -> FloatArray:
    return fill(warp.shell_points, (n, 3), _rejected(n, seed, 3), r_min, r_max)


def _repulsion_ball(n: int, seed: int, r_min: float, r_max: float) -> SampleSet:
    """VO's points, moved along their radii where a shell is asked for: cells keep their fractions of the volume."""
    table = repulsion_table("ball", n)
    return replace(table, points=fill(warp.shell_points, (n, 3), table.points, r_min, r_max), seed=seed)


def _repulsion_disk(n: int, seed: int, centre: bool) -> SampleSet:
    return replace(repulsion_table("disk", n, centre), seed=seed)


def _spiral(n: int, seed: int, turns: int | None) -> FloatArray:
    taps = fill(unit_taps, (n, 3), best_turns(n) if turns is None else turns)
    return np.asarray(taps[:, :2] * taps[:, 2:])


_REJECTION = "rejection", "independent points of the cube or square that lie inside", "LF section 6"
_REPULSION = "repulsion", "points that repel each other, with the weights of their cells", "VO section 4.5"
_SPIRAL = "spiral", "SAO's spiral, radii in equal steps", "SAO equations 6 and 7"
_UNBIASED = ("inside", "distinct", "unbiased")

METHODS = (
    Method(*_REJECTION, "sphere", _rejection_sphere, _UNBIASED, prefix=True),
    Method(*_REJECTION, "ball", _rejection_ball, _UNBIASED, SHELL, prefix=True),
    Method(*_REJECTION, "disk", partial(_rejected, columns=2), _UNBIASED, prefix=True),
    Method(*_REPULSION, "ball", _repulsion_ball, PROMISES, SHELL, seeded=False, most=MOST),
    Method(*_REPULSION, "disk", _repulsion_disk, PROMISES, {"centre": True}, seeded=False, most=MOST),
    Method(*_SPIRAL, "disk", _spiral, ("inside", "distinct", "radii"), {"turns": None}, seeded=False),
)
