"""The calls that make a sample set by any method."""

from typing import Any

import numpy as np

from lfssao.core.arguments import as_number, check_seed, check_whole
from lfssao.errors import InputError, check_choice, shown
from lfssao.samples import square
from lfssao.samples.sets import DIMENSIONS, FloatArray, Method, SampleSet, Value

MOST = 2**32 - 1  # the generator's counters have 32 bits


def find_method(domain: str, name: str) -> Method:
    """Return the method of a name on a domain; InputError if there is none.

    >>> lfssao.samples.find_method("ball", "latin").title
    'one point in each row and column'
    """
    check_choice("domain", domain, DIMENSIONS)
    for method in square.METHODS:
        if (method.domain, method.name) == (domain, name):
            return method
    from lfssao.samples.methods import METHODS  # late: most renders take a method of the square

    check_choice(f"sampling of the {domain}", name, METHODS[domain])
    return METHODS[domain][name]


def sample_set(domain: str, method: str, n: int, seed: int = 0, **options: Value) -> SampleSet:
    """Return a sample set by any method: a function of its arguments alone, with equal bits on every machine.

    InputError if the domain, the method or an option does not exist, n or the seed is out of range, or not 0 <= r_min
    <= r_max < infinity.

    Parameters
    ----------
    domain : str
        'square', [-1, 1]^2; 'sphere', 'ball' or 'disk', of radius 1.
    method : str
        A name in ``METHODS[domain]``.
    n : int
        Number of points, at least 1.
    seed : int
        0 to 2**64 - 1; repulsion and spiral do not depend on it.
    options : numbers
        'r_min' and 'r_max' of every method in the ball (LF's over R; 0 and 1: the whole ball); 'turns' of the spiral
        (the best for n); 'centre' of repulsion in the disk, whether it holds a point there (True).

    Examples
    --------
    >>> lfssao.samples.sample_set("disk", "spiral", 9).points.shape
    (9, 2)
    """
    chosen = find_method(domain, method)
    most = MOST if chosen.most is None else chosen.most
    n = check_whole(f"{method}: the number of samples", n, 1, most)
    seed = check_seed("the seed", seed)
    for name in options:
        check_choice(f"option of {method} on the {domain}", name, chosen.options)
    values = {**chosen.options, **options}
    _check_options(**values)
    found = chosen.make(n, seed, **values)
    if isinstance(found, SampleSet):
        return found
    return SampleSet(found, None, domain, method, seed, chosen.promises)


def _check_options(r_min: Any = 0.0, r_max: Any = 1.0, turns: Any = None, centre: Any = True) -> None:
    if not 0 <= as_number(r_min) <= as_number(r_max) < np.inf:
        raise InputError(f"r_min and r_max are {shown(r_min)} and {shown(r_max)}, they must be 0 <= r_min <= r_max")
    if turns is not None:
        check_whole("turns", turns, 1, 2**20)
    if not isinstance(centre, bool):
        raise InputError(f"centre is {centre}, it must be True or False")


def square_points(method: str, n: int, seed: int = 0) -> FloatArray:
    """Points on the square [-1, 1]^2, (n, 2) float64: LF's (xi_1, xi_2); arguments and errors as of ``sample_set``.

    >>> lfssao.square_points("jittered", 16).shape
    (16, 2)
    """
    return sample_set("square", method, n, seed).points


def make_samples(
    method: str = "latin", n: int = 8, seed: int = 0, r_min: float = 0.8, r_max: float = 1.0
) -> FloatArray:
    """Sample offsets in the shell r_min <= r <= r_max of the ball, (n, 3) float64, by Algorithms 3 and 4.

    Arguments and errors are those of ``sample_set``; LF found radii of 0.8 and 1, over R, suitable. Multiply by R.

    >>> lfssao.make_samples("latin", 8, seed=1).shape
    (8, 3)
    """
    return sample_set("ball", method, n, seed, r_min=r_min, r_max=r_max).points
