"""The sum of each texel's samples, for any estimator (``lfssao.ao.formulas``), as floats.

Texels are computed in chunks of a row, their numbers in slots, so that the loops over texels become vectors: one of the
places of a sample, and one of its look-ups, which is faster than both together [bench_estimators]. Rows are computed by
tiles, so that the surface on which turned samples of neighbours land far apart stays in the nearest caches.
"""

import numpy as np

from lfssao.ao.kernels.float_view import adds, bare_view, landed, shown, texel_of_look, with_kind
from lfssao.ao.kernels.look_up import look_up, seen_at
from lfssao.ao.kernels.spans import CHUNK, next_span
from lfssao.core.intrinsics import get, put, scratch, texel_slots
from lfssao.core.jit import formula, kernel
from lfssao.core.numbers import as_float, plain, select
from lfssao.optics.kernels.projection import (
    CROSSED_SLITS,
    DISPLAY,
    MATRIX,
    hold_inside,
    image_of,
    last_below,
)

_slots = texel_slots(48)
_TILE = 8  # rows of a tile


@formula
def _start_texels(kind, view, estimator, first, n, slots):
    """Put the numbers of n texels into their slots; kind: that of the view's mapping."""
    seen = with_kind(view, kind)
    for i in range(n):
        put(slots, i, estimator.start(seen, first + i))


@formula
def start_texels(moments_of, view, estimator, first, n, slots):
    """Put the numbers of n texels into their slots; numba leaves out branches by an argument that is None.

    Formulas of filtered textures ask for images: a loop for each kind of mapping makes vectors of these, by which
    vo-area of one area takes 0.7 times as long [bench_estimators]. Others would only be compiled three times.
    """
    if moments_of is None:
        _start_texels(view.kind, view, estimator, first, n, slots)
    elif view.kind == CROSSED_SLITS:
        _start_texels(CROSSED_SLITS, view, estimator, first, n, slots)
    elif view.kind == MATRIX:
        _start_texels(MATRIX, view, estimator, first, n, slots)
    else:
        _start_texels(DISPLAY, view, estimator, first, n, slots)


@formula
def _place_sample(kind, view, estimator, s, n, like, places, slots):
    """Image points u, v, u NaN where there is none, and z of sample s of n texels."""
    us, vs, zs = places
    seen, nothing = with_kind(view, kind), us.dtype.type(np.nan)
    for i in range(n):
        place = estimator.place(seen, get(slots, i, like), s)
        u, v, valid = image_of(kind, view.lens, place.u, place.v, place.q, place.z)
        us[i], vs[i], zs[i] = plain(u) if valid else nothing, plain(v), plain(seen.depth_at(place))


@formula
def finish_texels(view, estimator, first, n, like, totals, missed, slots, occlusion):
    """Write the occlusion of n texels, flat; return how many of their samples are outside."""
    zero, lost = occlusion.dtype.type(0), 0
    for i in range(n):
        there = (view.depth[first + i] < np.inf) & estimator.counts(view, get(slots, i, like))
        occlusion[first + i] = plain(estimator.end(as_float(totals[i]))) if there else zero
        lost += missed[i] if there else 0
    return lost


@kernel(rows="occlusion")
def sum_samples(begin, stop, view, estimator, occlusion, outside):
    """Occlusion of every texel by its samples, (H, W), 0 where there is no surface; view: ``FloatView``.

    outside: (H,), out: samples of each row outside the texture or the mapping's domain; they add nothing.
    """
    view = bare_view(view)
    size, fractions, count = occlusion.shape, occlusion.reshape(-1), estimator.points.shape[0]
    width, dtype = size[1], occlusion.dtype
    slots, missed, totals = _slots(dtype), scratch(np.int32), scratch(dtype)
    places = us, vs, zs = scratch(dtype), scratch(dtype), scratch(dtype)
    like, zero = estimator.start(view, 0), dtype.type(0)
    right_edge, bottom_edge = last_below(dtype.type(size[1])), last_below(dtype.type(size[0]))
    for top in range(begin, stop, _TILE):
        bottom = min(stop, top + _TILE)
        for j in range(top, bottom):
            outside[j] = 0
        for column in range(0, width, CHUNK):
            for j in range(top, bottom):
                at = j * width + column
                end = min(at + CHUNK, (j + 1) * width)
                while at < end:
                    first, n = next_span(view.depth, at, end, CHUNK)
                    for k in range(at, first):
                        fractions[k] = zero
                    start_texels(view.moments_of, view, estimator, first, n, slots)
                    for i in range(n):
                        totals[i], missed[i] = zero, 0
                    for s in range(count):
                        if view.kind == CROSSED_SLITS:
                            _place_sample(CROSSED_SLITS, view, estimator, s, n, like, places, slots)
                        elif view.kind == MATRIX:
                            _place_sample(MATRIX, view, estimator, s, n, like, places, slots)
                        else:
                            _place_sample(DISPLAY, view, estimator, s, n, like, places, slots)
                        # Here and not in a function: one that is optimised before it is inlined knows less of arrays.
                        for i in range(n):
                            x, y = hold_inside(us[i], right_edge), hold_inside(vs[i], bottom_edge)
                            sought = look_up(view.look, us[i], vs[i], size)
                            inside = adds(view, (x == us[i]) & (y == vs[i]), sought)
                            texel = texel_of_look(view, x, y, sought, size[1])
                            seen = landed(view, x, y, seen_at(view.look, us[i], vs[i], texel, size))
                            term = estimator.term(view, get(slots, i, like), s, as_float(zs[i]), first + i, seen)
                            made = plain(select(shown(view, seen), term, estimator.background()))
                            totals[i] += made if inside else zero
                            missed[i] += np.int32(not inside)
                    outside[j] += finish_texels(view, estimator, first, n, like, totals, missed, slots, fractions)
                    at = first + n
