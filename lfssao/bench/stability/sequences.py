"""Errors of two formulas for an image point that nears a slit: the kernels', and the straightforward one."""

from functools import cache

import numpy as np

from lfssao.bench.stability.exact import CrossedSlits, exact_image, rational
from lfssao.bench.stability.inputs import SLITS, STEPS, near
from lfssao.bench.stability.measure import PATHS, Stiff, computed, error_of
from lfssao.bench.stability.running_error import EXACT


@cache
def curves() -> dict[str, list[tuple[int, float, float]]]:
    """Return the errors of both formulas near both slits, by "lens, float32" and so on.

    Each entry is k, for every k that the path can tell from the slit, and the largest errors of ours and of the
    straightforward formula, in ulp of the coordinate or of one texel.

    The straightforward one divides by 1 - z / m_z, whose quotient is rounded before the difference is taken: half an
    ulp of 1 is 2^(k - 24) or 2^(k - 53) of the difference. m_z - z is exact that near.
    """
    found: dict[str, list[tuple[int, float, float]]] = {}
    for slit, (_, axis) in SLITS.items():
        for path in PATHS:
            digits = np.finfo(path).nmant + 1
            found[f"{slit}, {path}"] = [
                (k, *_errors(near(slit, k), axis, path)) for k in range(1, min(STEPS, digits) + 1)
            ]
    return found


def _errors(case: Stiff, axis: int, path: str) -> tuple[float, float]:
    dtype, flat = np.dtype(path), case.mapping
    assert isinstance(flat, CrossedSlits)
    ours = computed(case, dtype)[0][..., axis]
    slit = dtype.type(flat.display.modules[0].z if axis == 0 else flat.display.observer_z)
    place, z = case.positions[..., axis].astype(dtype), case.positions[..., 2].astype(dtype)
    numbers = flat.to_image.as_type(dtype).numbers
    scale, middle = numbers[5 * axis] / slit, numbers[14 + axis]
    with np.errstate(divide="ignore", invalid="ignore"):  # 1 - z / m_z may be 0: that is what is shown
        straightforward = middle + scale * (place / (dtype.type(1) - z / slit))
    largest, steps, offset = [0.0, 0.0], flat.steps(EXACT), rational(case.offset)
    for texel in np.ndindex(case.depth.shape):
        exact = exact_image(steps, rational(case.positions[texel].astype(dtype)), offset)
        if exact is not None:
            errors = [error_of(u, exact[axis], dtype)[1] for u in (ours[texel], straightforward[texel])]
            largest = [max(pair) for pair in zip(largest, errors, strict=True)]
    return largest[0], largest[1]
