"""Which estimators' intervals are known, and where those are made that are not of formulas alone."""

from lfssao.ao.estimators.registry import ESTIMATORS, find_estimator

# Estimators with kernels of their own: the file of this folder whose function of the file's name makes their bounds.
# ``points`` imports it when it is asked for: most comparisons need none.
BOUNDS_FILES = {
    "multiresolution": "multiresolution",
    "lf-neighbours": "neighbours",
    "sao": "sao",
    "sao-equation-1": "sao",
}


def has_bounds(name: str) -> bool:
    """Whether intervals of an estimator other than ``lf`` are known: of all that are written as formulas."""
    return name in BOUNDS_FILES or (name in ESTIMATORS and find_estimator(name).formulas is not None)
