"""LF Algorithms 1 and 2: the fraction of samples around each visible point that lie behind the visible surface.

A row's texels are the inner loop and samples the outer one, so that LLVM computes neighbouring texels as one vector.
The mapping is affine but for its last step: the affine half is applied once a point and once a sample, and the two are
added. All radii of a span are computed before the next span, as their points are the same. ``benchmarks/README.md``
says what the form of these loops gains.
"""

from typing import Any

import numpy as np

from lfssao.ao.kernels.spans import next_span
from lfssao.core.intrinsics import CHUNK, element, scratch
from lfssao.core.jit import formula, kernel
from lfssao.optics.kernels import projection as mapping
from lfssao.optics.kernels.display import VALID, display_module, physical_to_image
from lfssao.optics.kernels.projection import CROSSED_SLITS, MATRIX, affine_row, linear_row, signed_texel_number


@kernel
def transform_offsets(offsets, projection, turns):
    """The linear part of the mapping applied to the sample offsets, (n, 3, 4): line 5 and the affine half of line 6.

    A row of M (x c - y s, x s + y c, z, 0), the offset turned by cosine c and sine s, is (c A + s B) + C: A, B and C
    of each row. If ``turns`` is None, C is the row of the offset as it is.
    """
    (kind, m), out = projection, np.zeros((offsets.shape[0], 3, 4), projection.numbers.dtype)
    for s in range(offsets.shape[0]):
        x, y, z = offsets[s, 0], offsets[s, 1], offsets[s, 2]
        for row in range(4 if kind == MATRIX else 3):
            k = 4 * row
            out[s, 0, row], out[s, 1, row] = m[k] * x + m[k + 1] * y, m[k + 1] * x - m[k] * y
            out[s, 2, row] = linear_row(m, row, x, y, z) if turns is None else m[k + 2] * z
    return out


@formula
def load_turns(turns, turn, row, column, n):
    """Load cosines and sines of n texels of a row from a column on; turns: (2, H, W) or None, turn: two arrays, out."""
    if turns is not None:
        for i in range(n):
            turn[0][i], turn[1][i] = turns[0, row, column + i], turns[1, row, column + i]


@formula
def offset_row(offsets: Any, s: Any, row: Any, turns: Any, turn: Any, i: Any) -> Any:
    """A row of sample s, of ``transform_offsets``, at texel i of a run; turns and turn: those of ``load_turns``."""
    if turns is None:
        return offsets[s, 2, row]
    return (turn[0][i] * offsets[s, 0, row] + turn[1][i] * offsets[s, 1, row]) + offsets[s, 2, row]


@formula
def count_slits(slits, depth, width, height, n, a, b, c, first, samples, offsets, turns, turn, count):
    """Algorithm 2, lines 4 to 9, for the n points of one run: how many of their samples are in texture and domain.

    a, b, c, (>= n,), are the points after the mapping's affine half, an array a row of M; NaN where a texel sees no
    surface, which no compare lets through. offsets, (>= first + samples, 3, 4), are those of ``transform_offsets``;
    turns, turn: those of ``load_turns``. count, (>= n,) int32, gains the samples behind the surface.
    """
    zero, wide, high = depth.dtype.type(0), depth.dtype.type(width), depth.dtype.type(height)
    found = 0
    for s in range(first, first + samples):
        inside = np.int32(0)
        # About the view's axis no z turns: turned AO takes 1.23 times as long as other, else 1.37 [bench_algorithm2].
        along = (offsets[s, 0, 2] == zero) & (offsets[s, 1, 2] == zero)
        for i in range(n):
            x, y = a[i] + offset_row(offsets, s, 0, turns, turn, i), b[i] + offset_row(offsets, s, 1, turns, turn, i)
            z = c[i] + (offsets[s, 2, 2] if along else offset_row(offsets, s, 2, turns, turn, i))
            u, v, z, _ = mapping.project_crossed_slits(slits, x, y, z)
            there = (z < slits.z_m) & (z > slits.z_o) & (u >= zero) & (u < wide) & (v >= zero) & (v < high)
            hit = False
            if there:
                hit = element(depth, signed_texel_number(u, v, wide)) < z  # lines 7 and 8
            count[i] += np.int32(hit)  # line 9
            inside = np.int32(inside + np.int32(there))
        found += inside
    return found


@formula
def count_matrix(depth, width, height, n, a, b, c, q, first, samples, offsets, turns, turn, count):
    """Algorithm 1, lines 5 to 10; arguments and result of count_slits, with q, row 3 of M."""
    wide, high = depth.dtype.type(width), depth.dtype.type(height)
    found = 0
    for s in range(first, first + samples):
        inside = np.int32(0)
        for i in range(n):
            x, y = a[i] + offset_row(offsets, s, 0, turns, turn, i), b[i] + offset_row(offsets, s, 1, turns, turn, i)
            z, w = c[i] + offset_row(offsets, s, 2, turns, turn, i), q[i] + offset_row(offsets, s, 3, turns, turn, i)
            u, v, z, valid = mapping.project_matrix(x, y, z, w)
            there, texel = mapping.nearest_texel(u, v, wide, high)
            there = there & valid
            surface = depth[texel]  # line 8
            count[i] += np.int32((surface < z) & there)  # lines 9 and 10
            inside = np.int32(inside + np.int32(there))
        found += inside
    return found


@formula
def count_display(d, depth, width, height, n, a, b, c, first, samples, offsets, turns, turn, count):
    """Algorithm 2, lines 4 to 9, for any display; as count_slits, with d, the DisplayModule."""
    zero, wide, high = depth.dtype.type(0), depth.dtype.type(width), depth.dtype.type(height)
    found = 0
    for s in range(first, first + samples):
        inside = np.int32(0)
        for i in range(n):
            x, y = a[i] + offset_row(offsets, s, 0, turns, turn, i), b[i] + offset_row(offsets, s, 1, turns, turn, i)
            z = c[i] + offset_row(offsets, s, 2, turns, turn, i)
            u, v, status = physical_to_image(d, x, y, z)
            there = (status == VALID) & (u >= zero) & (u < wide) & (v >= zero) & (v < high)
            hit = False
            if there:
                hit = element(depth, signed_texel_number(u, v, wide)) < z
            count[i] += np.int32(hit)
            inside = np.int32(inside + np.int32(there))
        found += inside
    return found


@kernel
def finish_run(depth, at, start, n, samples, count, occlusion, before=0):
    """Write 0 from texel ``at`` to the run's start, count / samples of the n in it; return the visible points' samples.

    before: number of ``occlusion`` at which the texture begins.
    """
    zero, total = depth.dtype.type(0), depth.dtype.type(max(samples, 1))
    first = np.uint64(before)
    for texel in range(np.uint64(at), np.uint64(start)):
        occlusion[first + texel] = zero
    visible = np.int32(0)
    for i in range(n):
        texel = np.uint64(start + i)
        there = depth[texel] < np.inf
        fraction = depth.dtype.type(count[i]) / total
        occlusion[first + texel] = fraction if there else zero
        visible = np.int32(visible + np.int32(there))
    return np.int64(visible) * samples


@kernel(rows="depth")
def algorithm2(begin, stop, depth, positions, offsets, projection, turns, occlusion, outside):
    """LF Algorithm 2, occlusion of every texel of one module, of several radii.

    depth: (H, W), +infinity where there is no surface. positions: (H, W, 3). offsets: (R, n, 3), the samples of each
    radius relative to the point, world units. turns: (2, H, W), cosine and sine by which each texel's samples are
    turned, or None. occlusion: (R, H, W), out, 0 where there is no surface and for n = 0.
    outside: (R, H) int64, out: samples of each row outside the texture or the mapping's domain, not occluded.
    """
    height, width = depth.shape
    surface, places = depth.reshape(height * width), positions.reshape(3 * height * width)
    radii, samples, _ = offsets.shape
    fractions, texels = occlusion.reshape(radii * height * width), height * width
    (kind, m), nothing = projection, depth.dtype.type(np.nan)
    moved = transform_offsets(offsets.reshape(radii * samples, 3), projection, turns)
    a, b, c = scratch(m.dtype), scratch(m.dtype), scratch(m.dtype)
    q, count = scratch(m.dtype), scratch(np.int32)
    turn = scratch(m.dtype), scratch(m.dtype)
    for j in range(begin, stop):
        at, end = j * width, (j + 1) * width
        for r in range(radii):
            outside[r, j] = 0
        while at < end:
            start, n = next_span(surface, at, end, CHUNK)
            # Here and not in a function: one that is optimised before it is inlined knows less of these arrays.
            for i in range(n):
                t = 3 * (start + i)  # line 1
                x, y, z = places[np.uint64(t)], places[np.uint64(t + 1)], places[np.uint64(t + 2)]  # line 2
                x = x if surface[np.uint64(start + i)] < np.inf else nothing
                a[i], b[i], c[i] = affine_row(m, 0, x, y, z), affine_row(m, 1, x, y, z), affine_row(m, 2, x, y, z)
                if kind == MATRIX:
                    q[i] = affine_row(m, 3, x, y, z)
            load_turns(turns, turn, j, start - j * width, n)
            for r in range(radii):
                first = r * samples
                for i in range(n):
                    count[i] = 0
                if kind == CROSSED_SLITS:
                    slits = mapping.slits_of(m)
                    found = count_slits(
                        slits, surface, width, height, n, a, b, c, first, samples, moved, turns, turn, count
                    )
                elif kind == MATRIX:
                    found = count_matrix(
                        surface, width, height, n, a, b, c, q, first, samples, moved, turns, turn, count
                    )
                else:
                    module = display_module(m[12:])
                    found = count_display(
                        module, surface, width, height, n, a, b, c, first, samples, moved, turns, turn, count
                    )
                visible = finish_run(surface, at, start, n, samples, count, fractions, r * texels)
                outside[r, j] += visible - found
            at = start + n


@kernel(rows="depth")
def unproject(begin, stop, depth, screen_to_world, positions):
    """LF Algorithm 1, lines 1 to 3: the world positions, (H, W, 3), out, of a depth texture; screen_to_world: (16,)."""
    number, half = depth.dtype.type, depth.dtype.type(0.5)
    for j in range(begin, stop):
        for i in range(depth.shape[1]):
            u, v, d = number(i) + half, number(j) + half, depth[j, i]  # lines 1 and 2
            w = affine_row(screen_to_world, 3, u, v, d)  # line 3
            for row in range(3):
                positions[j, i, row] = affine_row(screen_to_world, row, u, v, d) / w
