"""Algorithm 2 with what several modules see: a sample is behind the surface where no module sees it in the open.

One depth texture is a surface without a back: all that lies behind it along its own rays counts as solid. Another
module looks past the front surface from the side. So a sample is occluded only if it lies behind the surface of every
texture it falls into; one that falls into none is not.
"""

import numpy as np

from lfssao.kernels.jit import kernel
from lfssao.kernels.rows import affine_rows, load_row, project_rows
from lfssao.kernels.runs import next_run
from lfssao.kernels.ssao import finish_run, transform_offsets
from lfssao.kernels.threads import interleaved


@kernel(inline=True)
def look(kind, m, wide, high, n, base, v, offset, a, b, c, q, texel, z, inside):
    """Where one sample of n points lands in one texture: the sample's linear half is added to the points' rows."""
    for i in range(n):
        a[i], b[i] = base[v, 0, i] + offset[0], base[v, 1, i] + offset[1]
        c[i], q[i] = base[v, 2, i] + offset[2], base[v, 3, i] + offset[3]
    project_rows(kind, m, m[12:], wide, high, n, a, b, c, q, texel, z, inside)


@kernel(parallel=True)
def share_hidden(surface, positions, offsets, kinds, numbers, sizes, starts, depths, occlusion, outside):
    """Share of samples that are behind the visible surface in all the textures that they fall into.

    Parameters
    ----------
    surface : (H, W) float32 or float64
        Finite where the texel sees a surface.
    positions : (H, W, 3), same dtype
        World coordinates of the visible surface.
    offsets : (n, 3), same dtype
        The samples relative to the point, world units.
    kinds : (V,) int64
        Kinds of the mappings world -> image of V textures (``lfssao.kernels.mapping``).
    numbers : (V, 44), same dtype
        Their numbers; what a kind does not have is not read.
    sizes : (V, 2) int64
        Width and height of the textures.
    starts : (V,) int64
        Where in ``depths`` each begins.
    depths : (sum of sizes,), same dtype
        The depth textures, row by row, one after the other.
    occlusion : (H, W), same dtype
        Out: occluded samples / n; 0 where there is no surface and for n = 0.
    outside : (H,) int64
        Out: samples of each row that fall into none of the textures; they count as not occluded.
    """
    height, width = surface.shape
    views, samples = kinds.shape[0], offsets.shape[0]
    visible, places = surface.reshape(height * width), positions.reshape(3 * height * width)
    shares = occlusion.reshape(height * width)
    moves = np.empty((views, samples, 4), numbers.dtype)
    for v in range(views):
        moves[v] = transform_offsets(offsets, kinds[v], numbers[v])
    for j in interleaved(height):
        points, base = np.empty((3, width), numbers.dtype), np.empty((views, 4, width), numbers.dtype)
        a, b, c = np.empty(width, numbers.dtype), np.empty(width, numbers.dtype), np.empty(width, numbers.dtype)
        q, z = np.empty(width, numbers.dtype), np.empty(width, numbers.dtype)
        texel, inside = np.empty(width, np.uint32), np.empty(width, np.bool_)
        seen, clear = np.empty(width, np.bool_), np.empty(width, np.bool_)
        count = np.empty(width, np.int32)
        at, end = j * width, (j + 1) * width
        outside[j] = 0
        while at < end:
            start, n = next_run(visible, at, end, width)
            found = 0
            for i in range(n):
                count[i] = 0
            load_row(places, start, n, points)
            for v in range(views):
                affine_rows(kinds[v], numbers[v], n, points, base[v])
            for s in range(samples):
                for i in range(n):
                    seen[i], clear[i] = False, False
                for v in range(views):
                    wide, high = numbers.dtype.type(sizes[v, 0]), numbers.dtype.type(sizes[v, 1])
                    look(kinds[v], numbers[v], wide, high, n, base, v, moves[v, s], a, b, c, q, texel, z, inside)
                    for i in range(n):
                        before = not depths[starts[v] + texel[i]] < z[i]
                        seen[i] |= inside[i]
                        clear[i] |= inside[i] & before
                for i in range(n):
                    count[i] += np.int32(seen[i] & (not clear[i]))
                    found += np.int64(seen[i])
            outside[j] += finish_run(visible, at, start, n, samples, count, shares) - found
            at = start + n
