"""Print which promises find which planted bug of a sampler, as a table in Markdown; deterministic.

Each sampler is wrong in one way. A promise is asked on SETS seeds, as ``assert_sampler`` asks it, of n = 8, 16 and 64
points; the numbers are the n at which it is found, '-' stands where the right sampler does not keep it either. Run:
python benchmarks/bench_promises.py
"""

from collections.abc import Callable

import numpy as np

from lfssao.samples import sample_set
from lfssao.testing import check_promise

COUNTS = (8, 16, 64)
SETS = 200
ALL = ("inside", "distinct", "uniform", "projections", "latin", "net", "progressive", "low-discrepancy")
# Promises that the right sampler of a kind keeps.
KEPT = {"square": ALL, "ball": ALL[:4]}
Sampler = Callable[[int, int], np.ndarray]


def square(name: str) -> Sampler:
    """A right sampler of the square."""
    return lambda n, seed: sample_set("square", name, n, seed).points


def ball(n: int, seed: int) -> np.ndarray:
    """A right sampler of the ball."""
    return sample_set("ball", "owen-burley", n, seed).points


def changed(sampler: Sampler, change: Callable[[np.ndarray, np.random.Generator], np.ndarray]) -> Sampler:
    """A sampler whose points go through a change, which may draw numbers by the seed."""
    return lambda n, seed: change(sampler(n, seed).copy(), np.random.default_rng(seed))


def upper(points: np.ndarray, _: np.random.Generator) -> np.ndarray:
    """Points of the upper half alone."""
    points[:, 2] = abs(points[:, 2])
    return points


def no_root(points: np.ndarray, _: np.random.Generator) -> np.ndarray:
    """The radius t in place of its cube root."""
    return points * np.sum(points**2, axis=1, keepdims=True)


def repeated(points: np.ndarray, _: np.random.Generator) -> np.ndarray:
    """The last point is the first one again."""
    points[-1] = points[0]
    return points


def beyond(points: np.ndarray, _: np.random.Generator) -> np.ndarray:
    """A range of 1 % too much."""
    return points * 1.01


def independent(points: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Independent numbers in place of the second coordinate."""
    points[:, 1] = random.uniform(-1, 1, len(points))
    return points


def shuffled(points: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Another order of the points."""
    return random.permutation(points)


def diagonal(points: np.ndarray, _: np.random.Generator) -> np.ndarray:
    """The first coordinate twice."""
    points[:, 1] = points[:, 0]
    return points


def coarse(points: np.ndarray, _: np.random.Generator) -> np.ndarray:
    """Coordinates cut to 4 bits."""
    return np.floor(points * 8) / 8


BUGS: dict[str, tuple[str, Sampler]] = {
    "none (owen-burley)": ("square", square("owen-burley")),
    "independent points": ("square", square("random")),
    "xi_2 independent": ("square", changed(square("owen-burley"), independent)),
    "xi_1 twice": ("square", changed(square("owen-burley"), diagonal)),
    "another order of the points": ("square", changed(square("owen-burley"), shuffled)),
    "the seed is ignored": ("square", lambda n, _: square("owen-burley")(n, 1)),
    "coordinates cut to 4 bits": ("square", changed(square("owen-burley"), coarse)),
    "the last point is the first": ("square", changed(square("owen-burley"), repeated)),
    "1 % beyond the square": ("square", changed(square("owen-burley"), beyond)),
    "none (owen-burley) in the ball": ("ball", ball),
    "z of the upper half alone": ("ball", changed(ball, upper)),
    "r = t, no cube root": ("ball", changed(ball, no_root)),
    "1 % beyond the ball": ("ball", changed(ball, beyond)),
}


def main() -> None:
    """Print the table."""
    print(f"| bug | {' | '.join(ALL)} |\n|---|{'---|' * len(ALL)}")
    for bug, (kind, sampler) in BUGS.items():
        cells = dict.fromkeys(ALL, "-")
        sets = {n: [sampler(n, seed) for seed in range(SETS)] for n in COUNTS}
        for promise in KEPT[kind]:
            domain = "ball" if kind == "ball" else "square"
            found = {n: check_promise(promise, sets[n], domain) for n in COUNTS}
            cells[promise] = " ".join(str(n) for n in COUNTS if not found[n].holds)
        print(f"| {bug} | {' | '.join(cells.values())} |", flush=True)


if __name__ == "__main__":
    main()
