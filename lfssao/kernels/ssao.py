"""LF Algorithms 1 and 2: the share of samples around each visible point that lie behind the visible surface."""

import numpy as np
from numba import prange

from lfssao.kernels.jit import kernel
from lfssao.kernels.mapping import (
    CROSSED_SLITS,
    affine_row,
    linear_row,
    locate_crossed_slits,
    locate_matrix,
)

# Rows that share one set of scratch arrays: enough that allocating them costs nothing, few enough that the rows
# divide evenly among threads.
_ROWS_A_BLOCK = 8


@kernel
def transform_offsets(offsets, kind, m):
    """The linear part of the mapping applied to the sample offsets, (n, 4): line 5 and the affine half of line 6."""
    out = np.zeros((offsets.shape[0], 4), m.dtype)
    for s in range(offsets.shape[0]):
        for row in range(3 if kind == CROSSED_SLITS else 4):
            out[s, row] = linear_row(m, row, offsets[s, 0], offsets[s, 1], offsets[s, 2])
    return out


@kernel
def count_row(depth, kind, m, width, height, points, offsets, texel, threshold, surface, count):
    """Lines 4 to 9 of Algorithm 2 (5 to 10 of Algorithm 1) for the visible points of one row.

    Parameters
    ----------
    depth : (height * width,) array
        The depth texture, row by row.
    kind, m : int, (16,) array
        The mapping world -> image.
    points : (4, n) array
        The visible points after the mapping's affine half.
    offsets : (samples, 4) array
        The samples likewise, linear part only.
    texel, threshold, surface : (n,) arrays
        Scratch.
    count : (n,) int32
        Out: how many samples lie behind the surface.

    Returns
    -------
    int
        How many samples fell outside the texture or the mapping's domain.
    """
    nowhere = m.dtype.type(-np.inf)
    outside = 0
    for i in range(count.shape[0]):
        count[i] = 0
    for s in range(offsets.shape[0]):
        # Algorithm 2 line 6 (1: line 7), world-to-image of one sample around every point of the row.
        if kind == CROSSED_SLITS:
            locate_crossed_slits(points, offsets[s], m, width, height, texel, threshold)
        else:
            locate_matrix(points, offsets[s], m, width, height, texel, threshold)
        # Line 7 (8). A loop of its own, as gathers would keep the loops before and behind it from being vectors;
        # the unsigned number spares the test for a negative index.
        for i in range(count.shape[0]):
            surface[i] = depth[np.uint32(texel[i])]
        # Lines 8 and 9 (9 and 10).
        for i in range(count.shape[0]):
            count[i] += np.int32(surface[i] < threshold[i])
            outside += np.int32(threshold[i] == nowhere)
    return outside


@kernel(parallel=True)
def algorithm2(depth, positions, offsets, kind, m, occlusion, outside):
    """LF Algorithm 2, occlusion of every texel of one module.

    Parameters
    ----------
    depth : (H, W) float32 or float64
        Image z of the visible surface, +infinity where there is none.
    positions : (H, W, 3), same dtype
        World coordinates of the visible surface.
    offsets : (n, 3), same dtype
        The samples relative to the point, world units.
    kind, m : int, (16,) same dtype
        The mapping world -> image (``lfssao.kernels.mapping``).
    occlusion : (H, W), same dtype
        Out: occluded samples / n; 0 where there is no surface and for n = 0.
    outside : (H,) int64
        Out: samples of each row outside the texture or the mapping's domain; they count as not occluded.
    """
    height, width = depth.shape
    flat_depth = depth.reshape(height * width)
    image_offsets = transform_offsets(offsets, kind, m)
    samples = m.dtype.type(max(offsets.shape[0], 1))
    rows = 3 if kind == CROSSED_SLITS else 4
    for block in prange((height + _ROWS_A_BLOCK - 1) // _ROWS_A_BLOCK):
        points = np.zeros((4, width), m.dtype)
        threshold, surface = np.empty(width, m.dtype), np.empty(width, m.dtype)
        texel, count, column = np.empty(width, np.int32), np.empty(width, np.int32), np.empty(width, np.int32)
        for j in range(block * _ROWS_A_BLOCK, min(height, (block + 1) * _ROWS_A_BLOCK)):
            n = 0
            for i in range(width):  # line 1, for the texels that see a surface
                occlusion[j, i] = 0
                if depth[j, i] < np.inf:
                    x, y, z = positions[j, i, 0], positions[j, i, 1], positions[j, i, 2]  # line 2
                    for row in range(rows):
                        points[row, n] = affine_row(m, row, x, y, z)
                    column[n] = i
                    n += 1
            outside[j] = count_row(
                flat_depth, kind, m, width, height, points[:, :n], image_offsets,
                texel[:n], threshold[:n], surface[:n], count[:n],
            )  # fmt: skip
            for k in range(n):
                occlusion[j, column[k]] = m.dtype.type(count[k]) / samples


@kernel(parallel=True)
def algorithm1(depth, offsets, screen_to_world, kind, m, occlusion, outside):
    """LF Algorithm 1, occlusion of every texel of an ordinary view.

    Parameters are those of ``algorithm2``, with ``screen_to_world``, (16,) the rows of a 4x4 matrix, in place of
    the positions texture; ``kind`` is MATRIX.
    """
    height, width = depth.shape
    flat_depth = depth.reshape(height * width)
    image_offsets = transform_offsets(offsets, kind, m)
    samples = m.dtype.type(max(offsets.shape[0], 1))
    half = m.dtype.type(0.5)
    for block in prange((height + _ROWS_A_BLOCK - 1) // _ROWS_A_BLOCK):
        points = np.zeros((4, width), m.dtype)
        threshold, surface = np.empty(width, m.dtype), np.empty(width, m.dtype)
        texel, count, column = np.empty(width, np.int32), np.empty(width, np.int32), np.empty(width, np.int32)
        for j in range(block * _ROWS_A_BLOCK, min(height, (block + 1) * _ROWS_A_BLOCK)):
            n = 0
            for i in range(width):
                occlusion[j, i] = 0
                if depth[j, i] < np.inf:
                    # lines 1 to 3
                    u, v, d = m.dtype.type(i) + half, m.dtype.type(j) + half, depth[j, i]
                    q = affine_row(screen_to_world, 3, u, v, d)
                    x = affine_row(screen_to_world, 0, u, v, d) / q
                    y = affine_row(screen_to_world, 1, u, v, d) / q
                    z = affine_row(screen_to_world, 2, u, v, d) / q
                    for row in range(4):
                        points[row, n] = affine_row(m, row, x, y, z)
                    column[n] = i
                    n += 1
            outside[j] = count_row(
                flat_depth, kind, m, width, height, points[:, :n], image_offsets,
                texel[:n], threshold[:n], surface[:n], count[:n],
            )  # fmt: skip
            for k in range(n):
                occlusion[j, column[k]] = m.dtype.type(count[k]) / samples
