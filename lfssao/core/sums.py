"""Sums whose order is written: Python's own ``sum`` compensates the rounding of floats from version 3.12 on."""

from collections.abc import Iterable


def sum_in_order(values: Iterable[float]) -> float:
    """Sum of the values, each added to the rounded sum of those before it; 0 of none."""
    total = 0.0
    for value in values:
        total += value
    return total
