"""Point sampling with options that LF does not have: hemisphere, range check, line 7's other form.

A sample of the half ball is added to the points of a span first; then it is looked up by the loops of Algorithms 1 and
2 where depth alone decides, on a convex display in half the time [bench_estimators]. The options that read the
positions texture take two loops: texel numbers (one loop for each kind of mapping), then the textures there. Both are
in a function that is not inlined: otherwise LLVM makes no vectors of the loops of Algorithms 1 and 2, and those take
six times as long.
"""

from typing import NamedTuple

import numpy as np

from lfssao.ao.kernels import ssao
from lfssao.ao.kernels.spans import next_span
from lfssao.ao.kernels.ssao import count_display, count_matrix, count_slits, load_turns, offset_row, turned_offset
from lfssao.core.intrinsics import CHUNK, scratch
from lfssao.core.jit import kernel
from lfssao.optics.kernels import projection as mapping
from lfssao.optics.kernels.display import VALID, display_module, physical_to_image
from lfssao.optics.kernels.projection import CROSSED_SLITS, MATRIX, affine_row, hold_inside, last_below, texel_number


class Seen(NamedTuple):
    """A view's textures row by row, one dtype: image z, +infinity where there is no surface; world coordinates.

    looked: depth as samples look it up: the same, or -infinity where there is no surface and background occludes.
    """

    depth: np.ndarray
    positions: np.ndarray
    looked: np.ndarray


class Choices(NamedTuple):
    """Options of point sampling.

    reach: scalar of the dtype, squared distance, world units, from the point up to which a surface point occludes;
    infinity: any. forward: whether that point's depth is the mapped position's and not the depth texture's. remap:
    whether the fraction is mapped by 2 max(0, fraction - 1/2).
    """

    reach: np.floating
    forward: bool
    remap: bool


@kernel(inline=True)
def load_row(texture, start, n, row):
    """The vectors of n texels from texel number ``start`` on, texture (3 H W,), into row (3, >= n)."""
    for i in range(n):
        t = np.uint64(3) * (np.uint64(start) + np.uint64(i))
        row[0, i], row[1, i], row[2, i] = texture[t], texture[t + np.uint64(1)], texture[t + np.uint64(2)]


@kernel(inline=True)
def affine_rows(projection, n, points, rows):
    """The mapping's affine half of n points (3, >= n) into rows (4, >= n); row 3 is a camera's, else row 2 again."""
    kind, m = projection
    for i in range(n):
        x, y, z = points[0, i], points[1, i], points[2, i]
        rows[0, i], rows[1, i] = affine_row(m, 0, x, y, z), affine_row(m, 1, x, y, z)
        rows[2, i] = affine_row(m, 2, x, y, z)
        rows[3, i] = affine_row(m, 3, x, y, z) if kind == MATRIX else rows[2, i]


@kernel(inline=True)
def project_rows(projection, size, n, moved, texel, z, inside):
    """Texel numbers, uint32, and image z of n points, and whether they lie in the texture and the mapping's domain.

    size: width and height of the texture, of the dtype. moved: a, b, c, q, the points after the mapping's affine half,
    an array a row of M; q is a camera's.
    """
    (kind, m), (width, height), (a, b, c, q) = projection, size, moved
    last_u, last_v = last_below(width), last_below(height)
    if kind == CROSSED_SLITS:
        slits = mapping.slits_of(m)
        for i in range(n):
            u, v, w, _ = mapping.project_crossed_slits(slits, a[i], b[i], c[i])
            column, row = hold_inside(u, last_u), hold_inside(v, last_v)
            texel[i], z[i] = texel_number(column, row, width), w
            inside[i] = (column == u) & (row == v) & (w < slits.z_m) & (w > slits.z_o)
    elif kind == MATRIX:
        for i in range(n):
            u, v, w, _ = mapping.project_matrix(a[i], b[i], c[i], q[i])
            column, row = hold_inside(u, last_u), hold_inside(v, last_v)
            texel[i], z[i] = texel_number(column, row, width), w
            inside[i] = (column == u) & (row == v) & (q[i] > 0)
    else:
        module = display_module(m[12:])
        for i in range(n):
            u, v, answer = physical_to_image(module, a[i], b[i], c[i])
            z[i] = c[i]
            there, texel[i] = mapping.nearest_texel(u, v, width, height)
            inside[i] = there & (answer == VALID)


@kernel(inline=True)
def forward_depth(projection, x, y, z):
    """Image z of a surface point, +infinity where the mapping is not defined: LF's alternative to line 7."""
    kind, m = projection
    c = affine_row(m, 2, x, y, z)
    if kind == MATRIX:
        q = affine_row(m, 3, x, y, z)
        return c / q if q > 0 else m.dtype.type(np.inf)
    return c


@kernel(inline=True)
def move_row(offsets, ends, s, normals, n, up, turns, turn, rows, a, b, c, q):
    """Line 5 and the affine half of line 6 of sample s for n points; one below the surface moves to the other side."""
    z, zero, one = offsets[s, 2], type(a[0])(0), type(a[0])(1)
    for i in range(n):
        side = one
        if normals is not None:
            x, y = turned_offset(offsets[s, 0], offsets[s, 1], turn, i)
            side = -one if (x * up[0, i] + y * up[1, i]) + z * up[2, i] < zero else one
        a[i] = rows[0, i] + side * offset_row(ends, s, 0, turns, turn, i)
        b[i] = rows[1, i] + side * offset_row(ends, s, 1, turns, turn, i)
        c[i] = rows[2, i] + side * offset_row(ends, s, 2, turns, turn, i)
        q[i] = rows[3, i] + side * offset_row(ends, s, 3, turns, turn, i)


@kernel
def count_near(projection, seen, choices, size, n, points, moved, count):
    """Lines 6 to 9 with the range check and line 7's other form; return how many samples are in texture and domain.

    size: width and height, of the dtype. moved: a, b, c and q of ``project_rows``.
    """
    texel, inside, z = np.empty(CHUNK, np.uint32), np.empty(CHUNK, np.bool_), np.empty(CHUNK, points.dtype)
    project_rows(projection, size, n, moved, texel, z, inside)
    found = np.int32(0)
    for i in range(n):
        t = np.uint64(3) * np.uint64(texel[i])
        x, y, w = seen.positions[t], seen.positions[t + np.uint64(1)], seen.positions[t + np.uint64(2)]
        surface = seen.looked[texel[i]]
        there = surface < np.inf
        surface = forward_depth(projection, x, y, w) if choices.forward and surface > -np.inf else surface
        dx, dy, dz = x - points[0, i], y - points[1, i], w - points[2, i]
        near = ((dx * dx + dy * dy) + dz * dz) <= choices.reach
        count[i] += np.int32((surface < z[i]) & near & inside[i] & there)
        found = np.int32(found + np.int32(inside[i]))
    return found


@kernel(rows="occlusion")
def occluded_fraction(begin, stop, seen, normals, offsets, projection, choices, turns, occlusion, outside):
    """Fraction of samples behind the visible surface, with options, into occlusion (H, W).

    normals: (3 H W,), unit world normals n, or None; with them an offset o with (o_x n_x + o_y n_y) + o_z n_z < 0 is
    replaced by -o. offsets: (n, 3), the samples relative to the point, world units. turns: (2, H, W), cosine and sine
    by which each texel's samples are turned. outside: (H,), out: samples of each row outside the texture or
    the mapping's domain; they count as not occluded.
    """
    (height, width), (kind, m) = occlusion.shape, projection
    fractions = occlusion.reshape(-1)
    ends, samples = ssao.transform_offsets(offsets, projection, turns), offsets.shape[0]
    size = m.dtype.type(width), m.dtype.type(height)
    still = np.zeros((1, 3, 4), m.dtype)  # samples are in a, b, c, q already
    looks = not choices.forward and choices.reach == np.inf  # at depths alone
    points, up = np.empty((3, CHUNK), m.dtype), np.zeros((3, CHUNK), m.dtype)
    rows, a, b = np.empty((4, CHUNK), m.dtype), scratch(m.dtype), scratch(m.dtype)
    c, q, count = scratch(m.dtype), scratch(m.dtype), scratch(np.int32)
    turn = scratch(m.dtype), scratch(m.dtype)
    for j in range(begin, stop):
        at, end = j * width, (j + 1) * width
        outside[j] = 0
        while at < end:
            start, n = next_span(seen.depth, at, end, CHUNK)
            load_row(seen.positions, start, n, points)
            if normals is not None:
                load_row(normals, start, n, up)
            load_turns(turns, turn, j, start - j * width, n)
            affine_rows(projection, n, points, rows)
            for i in range(n):
                count[i] = 0
            found = 0
            for s in range(samples):
                move_row(offsets, ends, s, normals, n, up, turns, turn, rows, a, b, c, q)
                if looks and kind == CROSSED_SLITS:
                    slits = mapping.slits_of(m)
                    found += count_slits(slits, seen.looked, width, height, n, a, b, c, 0, 1, still, None, turn, count)
                elif looks and kind == MATRIX:
                    found += count_matrix(seen.looked, width, height, n, a, b, c, q, 0, 1, still, None, turn, count)
                elif looks:
                    module = display_module(m[12:])
                    found += count_display(
                        module, seen.looked, width, height, n, a, b, c, 0, 1, still, None, turn, count
                    )
                else:
                    found += count_near(projection, seen, choices, size, n, points, (a, b, c, q), count)
            outside[j] += ssao.finish_run(seen.depth, at, start, n, samples, count, fractions) - found
            if choices.remap:
                for texel in range(np.uint64(at), np.uint64(start + n)):
                    above = fractions[texel] - fractions.dtype.type(0.5)
                    fractions[texel] = fractions.dtype.type(2) * max(fractions.dtype.type(0), above)
            at = start + n
