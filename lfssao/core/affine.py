"""Small matrices and sums in a written order: those of BLAS, LAPACK and Python differ between machines."""

from collections.abc import Iterable
from functools import reduce
from operator import add
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Matrix = NDArray[np.float64]


def multiply(a: ArrayLike, b: ArrayLike) -> Matrix:
    """Matrix product of (n, m) and (m, k), float64; each entry adds its products from the first to the last."""
    left, right = np.asarray(a, np.float64), np.asarray(b, np.float64)
    product = left[:, :1] * right[:1]
    for k in range(1, left.shape[1]):
        product = product + left[:, k : k + 1] * right[k : k + 1]
    return product


def transform_points(affine: ArrayLike, points: Matrix) -> Matrix:
    """Points, (n, 3), under the first three rows of an affine map: ((m0 x + m1 y) + m2 z) + m3, float64."""
    m = np.asarray(affine, np.float64)
    with np.errstate(over="ignore", invalid="ignore"):  # vertices are checked afterwards, normals may be anything
        return multiply(points, m[:3, :3].T) + m[:3, 3]


def to_4x4(affine: ArrayLike) -> Matrix:
    """A (3, 4) affine map as a (4, 4) matrix."""
    return np.vstack([np.asarray(affine, np.float64), [0.0, 0.0, 0.0, 1.0]])


def determinant(affine: ArrayLike) -> float:
    """Determinant of the linear part of a (3, 4) affine map; negative where the map turns handedness."""
    m = np.asarray(affine, np.float64)
    a, b, c = cofactors(m)[0] * m[0, :3]
    return float((a + b) + c)


def cofactors(affine: ArrayLike) -> Matrix:
    """Cofactor matrix, (..., 3, 3), of the linear part of affine maps: it turns normals as a map turns surfaces."""
    m = np.asarray(affine, np.float64)[..., :3, :3]
    a, b = m[..., [1, 2, 0], :], m[..., [2, 0, 1], :]
    # As np.cross, which takes three times as long and searches for changed displays invert many.
    return np.asarray(a[..., [1, 2, 0]] * b[..., [2, 0, 1]] - a[..., [2, 0, 1]] * b[..., [1, 2, 0]])


def invert_affine(affine: ArrayLike) -> Matrix:
    """Inverse of a (3, 4) affine map, adjugate over determinant; ZeroDivisionError if it is singular."""
    m = np.asarray(affine, np.float64)
    size = determinant(m)
    if size == 0.0:
        raise ZeroDivisionError("the affine map is singular")
    linear = cofactors(m).T / size
    return np.hstack([linear, -multiply(linear, m[:, 3:])])


def unit_vectors(vectors: NDArray[Any]) -> NDArray[Any]:
    """Vectors, (..., 3), over their lengths, in their dtype; 0 where a length is 0 or no number."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    with np.errstate(all="ignore"):
        length = np.sqrt((x * x + y * y) + z * z)[..., None]
    there = (length > 0) & (length < np.inf)
    return np.asarray(np.divide(vectors, length, out=np.zeros_like(vectors), where=there))


def sum_in_order(values: Iterable[float]) -> float:
    """Sum of the values, each added to the rounded sum of those before: Python's own compensates from 3.12 on."""
    return reduce(add, values, 0.0)
