"""Occlusion of some texels by any estimator's formulas (``lfssao.ao.formulas``), as floats, with a changed look-up.

With ``Reading`` as it is by default and weights of 1 the numbers are those of ``lfssao.ao.kernels``, bit for bit.
"""

from typing import Any, NamedTuple

import numpy as np

from lfssao.ao.kernels.look_up import Look, look_up, seen_at
from lfssao.core.jit import formula, kernel
from lfssao.core.numbers import as_float, number, plain, select
from lfssao.core.places import Rows
from lfssao.optics.kernels.projection import image_of

_FEW = 4096  # texels that one thread computes


class Reading(NamedTuple):
    """A way to read textures: a look-up, the sign of the depths of samples, and by what image points are rounded.

    sign: 1, or -1 where surfaces have the other sign, too. split: 2^k + 1 to round u and v to k bits less than they
    have, or 0. reach: (K,), by which each texel's samples lie farther from it.
    """

    look: Look
    sign: Any
    split: Any
    reach: Any


@formula
def _rounded(x, split):
    """A coordinate to fewer bits (Dekker 1971)."""
    large = split * x
    return large - (large - x) if split > 0 else x


@formula
def _stretched(place, base, reach):
    """A place so many times as far from the one of the texel's surface."""
    far, other = reach != 1, base + number(reach, place.u) * (place - base)
    return Rows(
        select(far, other.u, place.u), select(far, other.v, place.v), select(far, other.q, place.q),
        select(far, other.z, place.z),
    )  # fmt: skip


@formula
def _image(view, place):
    """The image point of a place, NaN where it has none."""
    u, v, valid = image_of(view.kind, view.lens, place.u, place.v, place.q, place.z)
    nothing = view.rows.dtype.type(np.nan)
    return plain(u) if valid else nothing, plain(v) if valid else nothing


@formula
def _looked_up(reading, u, v, size):
    """The texel that an image point is looked up in."""
    return look_up(reading.look, _rounded(u, reading.split), _rounded(v, reading.split), size)


@formula
def _between(reading, u, v, texel, size):
    """Return what formulas are given of an image point in a texel."""
    x, y = _rounded(u, reading.split), _rounded(v, reading.split)
    return seen_at(reading.look, x, y, texel, size)


@kernel(rows="texels", few=_FEW)
def sum_texels(begin, stop, view, estimator, reading, size, texels, weights, occlusion):
    """Occlusion of texels by their samples, (K,); texels: (K,), their numbers, row * width + column.

    view: ``FloatView``. reading: ``Reading``. size: height and width. weights: (n, 1), by which the samples' terms are
    multiplied.
    """
    dtype, empty = occlusion.dtype, reading.look.empty
    zero = dtype.type(0)
    for k in range(begin, stop):
        texel, total = np.uint32(texels[k]), zero
        here, base = estimator.start(view, texel), view.at(view.position(texel))
        counts = (view.depth[texel] < np.inf) & estimator.counts(view, here)
        for s in range(estimator.points.shape[0] if counts else 0):
            place = _stretched(estimator.place(view, here, s), base, reading.reach[k])
            u, v = _image(view, place)
            seen, z = _looked_up(reading, u, v, size), view.depth_at(place)
            if seen >= 0:
                there = view.shows(seen) | reading.look.cleared
                texel_seen = np.uint32(seen if there or empty < 0 else empty)
                other = _between(reading, u, v, texel_seen, size)
                term = estimator.term(view, here, s, number(reading.sign, z) * z, texel, other)
                there = view.shows(other) | reading.look.cleared
                total += weights[s, 0] * plain(select(there | (empty >= 0), term, estimator.background()))
        occlusion[k] = plain(estimator.end(as_float(total))) if counts else zero


@kernel(rows="texels", few=_FEW)
def fold_texels(begin, stop, view, estimator, reading, size, texels, weights, occlusion):
    """Occlusion of texels by the steps along their directions, as ``sum_texels``.

    weights: (n, steps), by which what a step adds is multiplied; one of weight 0 does not raise the state.
    """
    dtype, empty = occlusion.dtype, reading.look.empty
    zero, half = dtype.type(0), dtype.type(0.5)
    for k in range(begin, stop):
        texel, total = np.uint32(texels[k]), zero
        here, base = estimator.start(view, texel), view.at(view.position(texel))
        x, y = dtype.type(view.column(texel)) + half, dtype.type(view.row(texel)) + half
        counts, state = (view.depth[texel] < np.inf) & estimator.counts(view, here), estimator.begin(view, here, 0)
        for s in range(estimator.points.shape[0] if counts else 0):
            u, v = _image(view, _stretched(estimator.place(view, here, s), base, reading.reach[k]))
            across, down, begun = u - x, v - y, estimator.begin(view, here, s)
            state = begun if s % estimator.sides == 0 else state
            for step in range(estimator.steps):
                n = as_float(dtype.type(step + 1))
                part, weight = plain(estimator.part(view, texel, n)), weights[s, step]
                seen = _looked_up(reading, x + part * across, y + part * down, size)
                if seen >= 0 and weight > 0:
                    there = view.shows(seen) | reading.look.cleared
                    texel_seen = np.uint32(seen if empty < 0 or there else empty)
                    other = _between(reading, x + part * across, y + part * down, texel_seen, size)
                    added, after = estimator.step(view, here, s, n, state, texel, other)
                    total += weight * plain(number(added, as_float(weight)))
                    state = after
            if (s + 1) % estimator.sides == 0:
                weight = weights[s, 0]
                total += weight * plain(number(estimator.leave(view, here, s, state), as_float(weight)))
        occlusion[k] = plain(estimator.end(as_float(total))) if counts else zero
