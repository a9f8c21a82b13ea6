"""Methods that fill LF's square [-1, 1]^2, and through Algorithms 3 and 4 the sphere, the ball's shell and the disk.

Points have two columns, (xi_1, xi_2), and for the ball a third, t on (0, 1), that Algorithm 4 makes the radius of: the
sequences' own third dimension, independent random numbers for all others. Algorithm 3 keeps areas only: distances that
a method keeps on the square are not kept on the sphere.
"""

from collections.abc import Callable
from functools import partial
from math import isqrt

import numpy as np

from lfssao.samples.kernels import ball, square
from lfssao.samples.sets import SHELL, FloatArray, Method, fill

# (n, seed, columns) -> (n, columns)
Points = Callable[[int, int, int], FloatArray]


def grid(n: int) -> tuple[int, int]:
    """Return columns and rows of the grid nearest to a square with columns * rows = n; for a prime n one row."""
    rows = next(r for r in range(isqrt(n), 0, -1) if n % r == 0)
    return n // rows, rows


def _jittered(n: int, seed: int, columns: int) -> FloatArray:
    return fill(square.jittered, (n, columns), np.uint64(seed), grid(n)[0])


def _by(kernel: Callable[..., object]) -> Points:
    """Return points that a kernel makes of the seed alone."""
    return lambda n, seed, columns: fill(kernel, (n, columns), np.uint64(seed))


def _poisson(n: int, seed: int, columns: int) -> FloatArray:
    from lfssao.samples.kernels import poisson  # late: of this method alone

    return fill(poisson.poisson, (n, columns), np.uint64(seed))


def _burley(n: int, seed: int, columns: int) -> FloatArray:
    from lfssao.samples.kernels import burley  # late: of this method alone

    return fill(burley.burley_points, (n, columns), np.uint64(seed))


def _on_sphere(points: Points, n: int, seed: int) -> FloatArray:
    from lfssao.samples.kernels import warp  # late: a render's samples are in the ball

    return fill(warp.sphere_points, (n, 3), points(n, seed, 2))


def _on_disk(points: Points, n: int, seed: int) -> FloatArray:
    from lfssao.samples.kernels import warp  # late: a render's samples are in the ball

    return fill(warp.disk_points, (n, 2), points(n, seed, 2))


def _in_ball(points: Points, n: int, seed: int, r_min: float, r_max: float) -> FloatArray:
    return fill(ball.ball_points, (n, 3), points(n, seed, 3), r_min, r_max)


def _methods(
    name: str,
    title: str,
    source: str,
    points: Points,
    promises: tuple[str, ...] = (),
    *,
    prefix: bool = False,
    unbiased: bool = True,
    sphere: tuple[str, ...] = (),
) -> list[Method]:
    """One method in all four domains, with its promises on the square and those that are left on the sphere."""
    always = ("inside", "distinct", "unbiased") if unbiased else ("inside", "distinct")
    makers: dict[str, tuple[Callable[..., FloatArray], tuple[str, ...]]] = {
        "square": (lambda n, seed: points(n, seed, 2), promises),
        "sphere": (partial(_on_sphere, points), sphere),
        "ball": (partial(_in_ball, points), ()),
        "disk": (partial(_on_disk, points), ()),
    }
    return [
        Method(name, title, source, domain, make, (*always, *kept), SHELL if domain == "ball" else {}, prefix)
        for domain, (make, kept) in makers.items()
    ]


METHODS = (
    *_methods("random", "independent uniform points", "LF section 6", _by(square.random), prefix=True),
    *_methods("jittered",
              "one point in each cell of the grid of n cells that is nearest to a square (n strips for a prime n)",
              "LF section 6", _jittered, ("stratified",)),
    *_methods("latin", "one point in each row and column", "LF section 6", _by(square.latin),
              ("latin", "projections")),
    *_methods("poisson", "Poisson disk set of exactly n points; distances wrap in xi_2", "LF section 6, Bridson 2007",
              _poisson, ("poisson", "blue"), unbiased=False),
    *_methods("halton", "Halton's sequence in bases 2, 3 and 5, digits scrambled", "Halton 1960, Owen 1995",
              _by(square.halton_points), ("low-discrepancy",), prefix=True),
    *_methods("sobol", "Sobol's sequence, Owen-scrambled", "Sobol 1967, Owen 1995",
              _by(square.sobol_points), ("net", "progressive", "low-discrepancy"), prefix=True),
    *_methods("owen-burley", "Sobol's sequence, shuffled and Owen-scrambled by a hash that shaders can do",
              "Burley 2020, Laine and Karras 2011", _burley,
              ("net", "progressive", "low-discrepancy"), prefix=True),
    *_methods("r2", "Roberts's sequence, R2 on surfaces and R3 in the ball, shifted", "Roberts 2018",
              _by(square.roberts), ("low-discrepancy",), prefix=True),
    *_methods("fibonacci", "Fibonacci lattice: on the sphere the Fibonacci sphere, on the disk Vogel's spiral; shifted",
              "Vogel 1979, Swinbank and Purser 2006",
              _by(square.fibonacci), ("rows", "low-discrepancy"), sphere=("equal-area",)),
)  # fmt: skip
