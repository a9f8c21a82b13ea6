"""Estimators with known intervals, and the files of intervals that are not computed from formulas alone."""

from lfssao.ao.estimators.registry import ESTIMATORS, find_estimator

# Estimators with kernels of their own, each with a file of this folder; the function of the same name returns the
# bounds. ``points`` imports the file when it is needed: most comparisons need none.
BOUNDS_FILES = {
    "multiresolution": "multiresolution",
    "lf-neighbours": "neighbours",
    "sao": "sao",
    "sao-equation-1": "sao",
}


def has_bounds(name: str) -> bool:
    """Whether intervals of an estimator other than ``lf`` are known, as those of all estimators with formulas are."""
    return name in BOUNDS_FILES or (name in ESTIMATORS and find_estimator(name).formulas is not None)
