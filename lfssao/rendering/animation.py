"""Frames of a moving scene: an affine map world -> world for each."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lfssao.core.affine import Matrix, determinant
from lfssao.core.elementary import sincospi
from lfssao.errors import InputError, errors_of
from lfssao.files.npy import read_npy
from lfssao.files.whole import read_json
from lfssao.scene.mesh import Mesh, moved

MOST_FRAMES = 10_000


def turntable(bounds: NDArray[np.float64], count: int) -> list[Matrix]:
    """Affine maps world -> world, (3, 4), by k / count of a turn, counter-clockwise, about the middle of a box."""
    x, _, z = (0.5 * (bounds[0] + bounds[1])).tolist()
    out = []
    for k in range(count):
        sine, cosine = sincospi(2.0 * k / count)
        first = [cosine, 0.0, sine, x - (cosine * x + sine * z)]
        last = [-sine, 0.0, cosine, z - (cosine * z - sine * x)]
        out.append(np.array([first, [0.0, 1.0, 0.0, 0.0], last]))
    return out


def read_transforms(path: Path) -> list[Matrix]:
    """Affine maps world -> world, (3, 4) float64, from a file of 4x4 matrices that act on columns (x, y, z, 1).

    The file is JSON, a list of matrices of four rows of four numbers, or NPY, (n, 4, 4) numbers. Raises InputError if
    it cannot be read or does not hold that, or a matrix is not affine or not invertible.
    """
    if path.suffix.lower() not in (".json", ".npy"):
        raise InputError(f"{path}: frames come from a .json or an .npy file")
    given = read_npy(path) if path.suffix.lower() == ".npy" else read_json(path)
    try:
        matrices = np.asarray(given)
    except (ValueError, OverflowError):  # rows of several lengths, numbers of hundreds of digits
        matrices = np.empty(0)
    if matrices.dtype.kind not in "iuf" or matrices.ndim != 3 or matrices.shape[1:] != (4, 4):
        raise InputError(f"{path}: it does not hold a list of 4x4 matrices of numbers")
    if not 1 <= len(matrices) <= MOST_FRAMES:
        raise InputError(f"{path}: it holds {len(matrices)} matrices, 1 to {MOST_FRAMES} are possible")
    matrices = np.array(matrices, np.float64, order="C")
    for number, matrix in enumerate(matrices):
        if not np.isfinite(matrix).all():
            raise InputError(f"{path}: matrix {number} holds a number that is not finite")
        if matrix[3].tolist() != [0, 0, 0, 1]:
            raise InputError(f"{path}: matrix {number} is not affine, its last row is {matrix[3].tolist()}")
        if determinant(matrix[:3]) == 0:
            raise InputError(f"{path}: matrix {number} is singular: it flattens the scene")
    return list(matrices[:, :3])


def frame_bounds(mesh: Mesh, transforms: Sequence[Matrix]) -> list[NDArray[np.float64]]:
    """Smallest and largest world coordinates of a mesh in each frame, (2, 3) float64; InputError names the frame."""
    boxes = []
    for number, transform in enumerate(transforms):
        with errors_of(f"frame {number}"):
            boxes.append(moved(mesh, transform).bounds)
    return boxes


def swept_bounds(boxes: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return the box around the boxes of all frames, (2, 3) float64, which is fitted into the display."""
    return np.stack([np.min([low for low, _ in boxes], axis=0), np.max([high for _, high in boxes], axis=0)])
