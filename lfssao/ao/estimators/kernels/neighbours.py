"""Algorithm 2 with what several modules see: a sample is behind the surface where no module sees it in the open.

One depth texture is a surface without a back: all that lies behind it along its own rays counts as solid. Another
module looks past the front surface from the side. So a sample is occluded only if it lies behind the surface of every
texture it falls into; one that falls into none is not.
"""

from typing import NamedTuple

import numpy as np

from lfssao.ao.kernels.spans import next_span
from lfssao.ao.kernels.ssao import finish_run, transform_offsets
from lfssao.core.intrinsics import CHUNK, element, scratch
from lfssao.core.jit import formula, kernel
from lfssao.optics.kernels import projection as mapping
from lfssao.optics.kernels.display import VALID, display_module, physical_to_image
from lfssao.optics.kernels.projection import CROSSED_SLITS, MATRIX, Projection, affine_row, signed_texel_number

# Bits of a sample: it falls into a texture; it lies in the open there.
_INSIDE, _OPEN = 1, 2

# Numbers that a mapping's affine half makes of a point; a camera's are four, the others' three.
_ROWS = 4


class Views(NamedTuple):
    """Depth textures of V views and their mappings world -> image.

    kinds: (V,) int64. numbers: (V, 44), the mappings' numbers, of the textures' dtype; those a kind does not have are
    not read. sizes: (V, 2) int64, width and height. starts: (V,) int64, where in ``depths`` each texture begins.
    depths: the textures, row by row, one after the other.
    """

    kinds: np.ndarray
    numbers: np.ndarray
    sizes: np.ndarray
    starts: np.ndarray
    depths: np.ndarray


@formula
def load_points(kind, m, surface, positions, start, n, at, rows):
    """The mapping's affine half of n texels from number ``start`` on: each row CHUNK numbers, from number ``at`` on.

    The first is NaN where a texel sees no surface, which no compare lets through.
    """
    for i in range(n):
        t, k = 3 * (start + i), at + i
        x, y, z = positions[np.uint64(t)], positions[np.uint64(t + 1)], positions[np.uint64(t + 2)]
        x = x if surface[np.uint64(start + i)] < np.inf else type(x)(np.nan)
        rows[np.uint64(k)], rows[np.uint64(k + CHUNK)] = affine_row(m, 0, x, y, z), affine_row(m, 1, x, y, z)
        rows[np.uint64(k + 2 * CHUNK)] = affine_row(m, 2, x, y, z)
        if kind == MATRIX:
            rows[np.uint64(k + 3 * CHUNK)] = affine_row(m, 3, x, y, z)


@formula
def look(views, v, n, rows, move, known):
    """Look one sample of n points up in texture v.

    rows: as of ``load_points``. move: the sample behind the mapping's linear part, four numbers. known: in and out,
    _INSIDE and _OPEN.
    """
    kind, m, depths, first = views.kinds[v], views.numbers[v], views.depths, np.int32(views.starts[v])
    wide, high = m.dtype.type(views.sizes[v, 0]), m.dtype.type(views.sizes[v, 1])
    a, b, c, q = move[0], move[1], move[2], move[3]
    nothing, at = np.int32(0), v * _ROWS * CHUNK
    if kind == CROSSED_SLITS:
        zero, slits = type(wide)(0), mapping.slits_of(m)
        for i in range(n):
            k = at + i
            x, y, z = rows[np.uint64(k)] + a, rows[np.uint64(k + CHUNK)] + b, rows[np.uint64(k + 2 * CHUNK)] + c
            u, v, z, _ = mapping.project_crossed_slits(slits, x, y, z)
            there = (z < slits.z_m) & (z > slits.z_o) & (u >= zero) & (u < wide) & (v >= zero) & (v < high)
            hidden = True
            if there:
                hidden = element(depths, np.int32(first + signed_texel_number(u, v, wide))) < z
            known[i] |= np.int32(there) | (nothing if hidden else np.int32(_OPEN))
    else:
        module = display_module(m[12:])
        for i in range(n):
            k = at + i
            x, y, z = rows[np.uint64(k)] + a, rows[np.uint64(k + CHUNK)] + b, rows[np.uint64(k + 2 * CHUNK)] + c
            if kind == MATRIX:
                u, v, z, valid = mapping.project_matrix(x, y, z, rows[np.uint64(k + 3 * CHUNK)] + q)
            else:
                u, v, answer = physical_to_image(module, x, y, z)
                valid = answer == VALID
            inside, texel = mapping.nearest_texel(u, v, wide, high)
            there = inside & valid
            hidden = depths[np.uint64(first) + np.uint64(texel)] < z
            known[i] |= np.int32(there) | (np.int32(_OPEN) if there & (not hidden) else nothing)


@kernel(rows="surface")
def hidden_fraction(begin, stop, surface, positions, offsets, views, occlusion, outside):
    """Fraction of samples that are behind the visible surface in all the textures that they fall into.

    surface: (H, W), finite where the texel sees a surface. positions: (H, W, 3). offsets: (n, 3), the samples relative
    to the point, world units. occlusion: (H, W), out, 0 where there is no surface. outside: (H,), out: samples of each
    row that fall into none of the textures; they count as not occluded.
    """
    height, width = surface.shape
    kinds, numbers, samples = views.kinds, views.numbers, offsets.shape[0]
    visible, places = surface.reshape(height * width), positions.reshape(3 * height * width)
    fractions = occlusion.reshape(height * width)
    moves = np.empty((len(kinds), samples, 4), numbers.dtype)
    for v in range(len(kinds)):
        moved = transform_offsets(offsets, Projection(kinds[v], numbers[v]), None)
        for k in range(samples):  # ``moves[v] = ...`` is compiled with the text of an error: five seconds
            for row in range(4):
                moves[v, k, row] = moved[k, 2, row]
    rows = np.empty(len(kinds) * _ROWS * CHUNK, numbers.dtype)
    known, count = scratch(np.int32), scratch(np.int32)
    for j in range(begin, stop):
        at, end = j * width, (j + 1) * width
        outside[j] = 0
        while at < end:
            start, n = next_span(visible, at, end, CHUNK)
            for v in range(len(kinds)):
                load_points(kinds[v], numbers[v], visible, places, start, n, v * _ROWS * CHUNK, rows)
            for i in range(n):
                count[i] = 0
            found = 0
            for s in range(samples):
                for i in range(n):
                    known[i] = 0
                for v in range(len(kinds)):
                    look(views, v, n, rows, moves[v, s], known)
                inside = np.int32(0)
                for i in range(n):
                    count[i] += np.int32(known[i] == _INSIDE)
                    inside = np.int32(inside + np.int32(known[i] != 0))
                found += inside
            outside[j] += finish_run(visible, at, start, n, samples, count, fractions) - found
            at = start + n
