"""Methods that fill LF's square [-1, 1]^2, and through Algorithms 3 and 4 the sphere, the ball's shell and the disk.

A fill gives n points (xi_1, xi_2) and, for the ball, a third number t on (0, 1) that Algorithm 4 makes the radius of:
the sequences' own third dimension, independent random numbers for all others. Distances, where a method keeps any, are
those of the square and not of the sphere, whose areas alone Algorithm 3 keeps.
"""

from dataclasses import dataclass
from importlib import import_module
from math import isqrt

import numpy as np

from lfssao.samples.kernels import ball
from lfssao.samples.method import Fill, Make, Method, Value
from lfssao.samples.sets import FloatArray

# LF's Algorithm 4 with the whole ball; LF found a shell from 0.8 suitable, the default of make_samples.
SHELL: dict[str, Value] = {"r_min": 0.0, "r_max": 1.0}


def grid(n: int) -> tuple[int, int]:
    """Columns and rows of the grid nearest to a square with columns * rows = n; for a prime n one row."""
    rows = next(r for r in range(isqrt(n), 0, -1) if n % r == 0)
    return n // rows, rows


def _fill(file: str, name: str) -> Fill:
    """A kernel (seed, out) as a fill; its file is imported when it is called, so that no other method waits for it."""

    def fill(n: int, seed: int, columns: int) -> FloatArray:
        out = np.empty((n, columns))
        getattr(import_module(f"lfssao.samples.kernels.{file}"), name)(np.uint64(seed), out)
        return out

    return fill


def _jittered(n: int, seed: int, columns: int) -> FloatArray:
    from lfssao.samples.kernels import square  # late: as in _fill

    out = np.empty((n, columns))
    square.jittered(np.uint64(seed), grid(n)[0], out)
    return out


@dataclass(frozen=True)
class _Square:
    """A method on the square: what it is, what it keeps there, and what is left of that in each other domain."""

    title: str
    source: str
    fill: Fill
    promises: tuple[str, ...] = ()
    prefix: bool = False
    unbiased: bool = True
    sphere: tuple[str, ...] = ()


_SQUARES = {
    "random": _Square("independent uniform points", "LF section 6", _fill("square", "random"), prefix=True),
    "jittered": _Square(
        "one point in each cell of the grid of n cells that is nearest to a square (n strips for a prime n)",
        "LF section 6", _jittered, ("stratified",),
    ),
    "latin": _Square("one point in each row and column", "LF section 6", _fill("square", "latin"), ("latin",)),
    "poisson": _Square(
        "Poisson disk set of exactly n points; distances wrap in xi_2", "LF section 6, Bridson 2007",
        _fill("poisson", "poisson"), ("poisson",), unbiased=False,
    ),
    "halton": _Square(
        "Halton's sequence in bases 2, 3 and 5, digits scrambled", "Halton 1960, Owen 1995",
        _fill("sequences", "halton_points"), ("low-discrepancy",), prefix=True,
    ),
    "sobol": _Square(
        "Sobol's sequence, Owen-scrambled", "Sobol 1967, Owen 1995",
        _fill("sequences", "sobol_points"), ("net", "low-discrepancy"), prefix=True,
    ),
    "r2": _Square(
        "Roberts's sequence, R2 on surfaces and R3 in the ball, shifted", "Roberts 2018",
        _fill("square", "roberts"), ("low-discrepancy",), prefix=True,
    ),
    "fibonacci": _Square(
        "Fibonacci lattice: on the sphere the Fibonacci sphere, on the disk Vogel's spiral; shifted",
        "Vogel 1979, Swinbank and Purser 2006",
        _fill("square", "fibonacci"), ("rows", "low-discrepancy"), sphere=("equal-area",),
    ),
}  # fmt: skip


def _methods(name: str, of: _Square) -> dict[str, Method]:
    """One method of the square in all four domains."""

    def on_square(n: int, seed: int) -> FloatArray:
        return of.fill(n, seed, 2)

    def on_sphere(n: int, seed: int) -> FloatArray:
        from lfssao.samples.kernels import warp as lift

        out = np.empty((n, 3))
        lift.sphere_points(of.fill(n, seed, 2), out)
        return out

    def on_disk(n: int, seed: int) -> FloatArray:
        from lfssao.samples.kernels import warp as lift

        out = np.empty((n, 2))
        lift.disk_points(of.fill(n, seed, 2), out)
        return out

    def in_ball(n: int, seed: int, r_min: float, r_max: float) -> FloatArray:
        xi1, xi2, t = np.ascontiguousarray(of.fill(n, seed, 3).T)
        out = np.empty((n, 3))
        ball.ball_points(xi1, xi2, t, r_min, r_max, out)
        return out

    always = ("inside", "distinct", *(("unbiased",) if of.unbiased else ()))
    made: dict[str, tuple[Make, tuple[str, ...]]] = {
        "square": (on_square, of.promises),
        "sphere": (on_sphere, of.sphere),
        "ball": (in_ball, ()),
        "disk": (on_disk, ()),
    }
    return {
        domain: Method(
            name, of.title, of.source, domain, make, (*always, *kept),
            options=SHELL if domain == "ball" else {}, prefix=of.prefix,
        )
        for domain, (make, kept) in made.items()
    }  # fmt: skip


METHODS = {name: _methods(name, of) for name, of in _SQUARES.items()}
