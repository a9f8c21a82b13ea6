"""Methods that do not go through the square: rejection, VO's tables by repulsion, SAO's spiral.

Kernels are imported when they are called, so that LF's samples do not wait for them.
"""

from dataclasses import replace

import numpy as np

from lfssao.samples.method import Method
from lfssao.samples.repulsion import MOST, PROMISES, repulsion_table
from lfssao.samples.sets import FloatArray, SampleSet
from lfssao.samples.spiral import best_turns
from lfssao.samples.square import SHELL

_UNBIASED = ("inside", "distinct", "unbiased")


def _rejected(n: int, seed: int, columns: int) -> FloatArray:
    from lfssao.samples.kernels import warp as lift

    out = np.empty((n, columns))
    lift.rejection(np.uint64(seed), out)
    return out


def _in_shell(points: FloatArray, r_min: float, r_max: float) -> FloatArray:
    from lfssao.samples.kernels import warp as lift

    out = np.empty_like(points)
    lift.shell_points(points, r_min, r_max, out)
    return out


def _rejection_ball(n: int, seed: int, r_min: float, r_max: float) -> FloatArray:
    return _in_shell(_rejected(n, seed, 3), r_min, r_max)


def _rejection_sphere(n: int, seed: int) -> FloatArray:
    from lfssao.samples.kernels import warp as lift

    out = np.empty((n, 3))
    lift.normalise(_rejected(n, seed, 3), out)
    return out


def _rejection_disk(n: int, seed: int) -> FloatArray:
    return _rejected(n, seed, 2)


def _repulsion_ball(n: int, seed: int, r_min: float, r_max: float) -> SampleSet:
    """VO's points, moved along their radii where a shell is asked for: cells keep their shares of the volume."""
    table = repulsion_table("ball", n)
    return replace(table, points=_in_shell(table.points, r_min, r_max), seed=seed)


def _repulsion_disk(n: int, seed: int, centre: bool) -> SampleSet:
    return replace(repulsion_table("disk", n, centre), seed=seed)


def _spiral(n: int, seed: int, turns: int | None) -> FloatArray:
    from lfssao.samples.kernels import warp as lift

    out = np.empty((n, 2))
    lift.spiral_points(best_turns(n) if turns is None else turns, out)
    return out


METHODS: dict[str, dict[str, Method]] = {
    "rejection": {
        domain: Method("rejection", "independent points of the cube or square that lie inside", "LF section 6",
                       domain, make, _UNBIASED, options, prefix=True)
        for domain, make, options in (
            ("sphere", _rejection_sphere, {}), ("ball", _rejection_ball, SHELL), ("disk", _rejection_disk, {}),
        )
    },
    "repulsion": {
        domain: Method("repulsion", "points that repel each other, with the weights of their cells", "VO section 4.5",
                       domain, make, PROMISES, options, seeded=False, most=MOST)
        for domain, make, options in (
            ("ball", _repulsion_ball, SHELL), ("disk", _repulsion_disk, {"centre": True}),
        )
    },
    "spiral": {
        "disk": Method("spiral", "SAO's spiral, radii in equal steps", "SAO equations 6 and 7",
                       "disk", _spiral, ("inside", "distinct", "radii"), {"turns": None}, seeded=False),
    },
}  # fmt: skip
