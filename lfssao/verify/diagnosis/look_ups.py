"""Changes of look-ups, for problems with a matrix ``image``, which is applied to (u, v, 1), and a ``border``."""

from dataclasses import replace
from typing import Any

import numpy as np

from lfssao.verify.diagnosis.change import INSIDE, OUTSIDE, Change, fixed, plain, shifts

_OPTIONS = {"clamp": "clamp", "repeat": "wrap", "mirror": "mirror"}  # rules by the values of the option ``border``
OCCLUDED = "occluded"  # the rule by which all samples beyond the border are occluded


def with_matrix(problem: Any, matrix: Any) -> Any:
    """The problem with a matrix, (3, 3), applied after its own."""
    return problem.changed(image=np.array(matrix, np.float64) @ problem.image)


def _matrix_change(kind: str, matrix: list[list[float]]) -> Change:
    return plain(kind, lambda p: with_matrix(p, matrix))


def place_changes(height: int, width: int) -> list[Change]:
    """Image points of a texture that are flipped, transposed or shifted by half a texel."""
    return [
        _matrix_change("u flipped", [[-1, 0, width], [0, 1, 0], [0, 0, 1]]),
        _matrix_change("v flipped", [[1, 0, 0], [0, -1, height], [0, 0, 1]]),
        _matrix_change("u and v flipped", [[-1, 0, width], [0, -1, height], [0, 0, 1]]),
        _matrix_change("u and v transposed", [[0, 1, 0], [1, 0, 0], [0, 0, 1]]),
        _matrix_change("look-ups at the nearest centre, half a texel off", [[1, 0, 0.5], [0, 1, 0.5], [0, 0, 1]]),
        _matrix_change("look-ups half a texel up and left", [[1, 0, -0.5], [0, 1, -0.5], [0, 0, 1]]),
    ]


def border_changes(has_option: bool) -> list[Change]:
    """Rules that replace image points beyond the border by a texel inside.

    ``has_option`` tells whether the estimator has the option ``border``.
    """
    changes = [fixed(f"{OUTSIDE} held by {border}", border=border) for border in INSIDE]
    options = {border: f"--parameter border={name}" for name, border in _OPTIONS.items() if has_option}
    return [replace(change, hint=options.get(border, "")) for change, border in zip(changes, INSIDE, strict=True)]


def occluding_border() -> Change:
    """The rule by which image points beyond the border occlude."""
    return fixed(f"{OUTSIDE} {OCCLUDED}", border=OCCLUDED)


def shift_changes() -> list[Change]:
    """Shifts of image points along u, along v and along both, texels."""
    return shifts(lambda p, u, v: with_matrix(p, [[1, 0, u], [0, 1, v], [0, 0, 1]]))
