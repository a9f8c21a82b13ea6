"""The rays of a round of many texels as arrays, for casters that take batches, and the sums of their hits."""

from typing import Any, NamedTuple

import numpy as np

from lfssao.ao.kernels.truth_rays import begin_texel, covered, ray_direction, standard_error
from lfssao.core.jit import kernel


class Begun(NamedTuple):
    """Texels that cast rays: their numbers (n,) int64, where these begin (n, 3), two axes and the normal (n, 3, 3)."""

    texels: Any
    points: Any
    axes: Any


@kernel
def begin_texels(seen, positions, normals, step, begun):
    """Write, and count, those of the texels ``seen`` that have a normal.

    positions, normals: (T, 3), the textures row by row; step: how far off the surface rays begin along the normal.
    """
    found = 0
    for texel in seen:
        if begin_texel(positions[texel], normals[texel], step, begun.points[found], begun.axes[found]):
            begun.texels[found] = texel
            found += 1
    return found


@kernel
def write_round(chosen, begun, number, cast, middle, unit, origins, directions):
    """Write the rays of round ``number`` of each chosen texel, (n strata^2, 3) float32.

    Origins are relative to ``middle``, (3,), in units of ``unit``; chosen are places in ``begun``.
    """
    row = 0
    for place in chosen:
        point, axes = begun.points[place], begun.axes[place]
        x, y, z = (point[0] - middle[0]) / unit, (point[1] - middle[1]) / unit, (point[2] - middle[2]) / unit
        for cell in range(cast.strata * cast.strata):
            dx, dy, dz = ray_direction(begun.texels[place], number, cell, cast, axes)
            origins[row, 0], origins[row, 1], origins[row, 2] = x, y, z
            directions[row, 0], directions[row, 1], directions[row, 2] = dx, dy, dz
            row += 1


@kernel
def add_round(chosen, number, strata, distances, far, falloff, totals, squares, errors):
    """Add the mean of a round to each chosen texel's sums, and write the standard error of the mean so far.

    number: rounds before this one. distances: (n strata^2,) float32, of each ray's hit, infinity for none; far: the
    radius in their unit. totals, squares: sums of the rounds' means and of their squares, in and out. errors: out,
    infinity after the first round.
    """
    row = 0
    for place in chosen:
        total = 0.0
        for _ in range(strata * strata):
            total += covered(np.float64(distances[row]), far, falloff)
            row += 1
        mean = total / np.float64(strata * strata)
        totals[place] += mean
        squares[place] += mean * mean
        errors[place] = standard_error(totals[place], squares[place], number + 1) if number else np.inf
