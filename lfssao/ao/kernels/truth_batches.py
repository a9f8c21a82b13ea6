"""The rays of a round of many texels as arrays, for whoever meets them in batches, and the sums of what they met."""

import numpy as np

from lfssao.ao.kernels.truth_rays import begin_texel, covered, ray_direction, standard_error
from lfssao.core.jit import kernel


@kernel
def begin_texels(seen, positions, normals, step, texels, points, axes):
    """Where the rays of texels begin, and around what; how many of the texels have a normal.

    Parameters
    ----------
    seen : (n,) int64
        Numbers of texels that have a surface.
    positions, normals : (T, 3) float32 or float64
        The textures, row by row.
    step : float64
        By how much rays begin off the surface along the normal.
    texels, points, axes : (n,), (n, 3), (n, 3, 3) int64, float64, float64
        Out, the first of them: a texel's number, where its rays begin, and two axes and the normal.
    """
    found = 0
    for texel in seen:
        if begin_texel(positions[texel], normals[texel], step, points[found], axes[found]):
            texels[found] = texel
            found += 1
    return found


@kernel
def write_round(
    chosen, texels, points, axes, number, strata, seed, weighting, middle, unit, origins, directions
):  # fmt: skip
    """Write the rays of one round of each chosen texel, in float32, about ``middle`` and in units of ``unit``.

    Parameters
    ----------
    chosen : (n,) int64
        Which of the texels that have begun cast rays.
    texels, points, axes
        As of ``begin_texels``.
    number, strata, seed, weighting
        Round, cells along an edge, key, COSINE or UNIFORM (``truth_rays.ray_direction``).
    middle, unit : (3,) float64, float64
        What is 0, and how long 1 is, in the space of origins.
    origins, directions : (n * strata^2, 3) float32
        Out.
    """
    row = 0
    for place in chosen:
        x = (points[place, 0] - middle[0]) / unit
        y = (points[place, 1] - middle[1]) / unit
        z = (points[place, 2] - middle[2]) / unit
        around = axes[place]
        for cell in range(strata * strata):
            dx, dy, dz = ray_direction(texels[place], number, cell, strata, seed, weighting, around)
            origins[row, 0], origins[row, 1], origins[row, 2] = x, y, z
            directions[row, 0], directions[row, 1], directions[row, 2] = dx, dy, dz
            row += 1


@kernel
def add_round(chosen, number, strata, distances, far, falloff, totals, squares, errors):
    """Add the mean of a round to each chosen texel's sums, and write the standard error of the mean so far.

    Parameters
    ----------
    chosen : (n,) int64
        Which of the texels that have begun have cast this round.
    number, strata : int
        Rounds before this one; cells along an edge.
    distances : (n * strata^2,) float32
        To what each ray meets, infinity where it meets nothing.
    far, falloff : float64, int
        The radius in the unit of the distances; CONSTANT, LINEAR or QUADRATIC.
    totals, squares, errors : (m,) float64
        In and out: sums of the rounds' means and of their squares. Out: the error, infinity after the first round.
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
