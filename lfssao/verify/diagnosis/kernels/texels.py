"""Occlusion of some texels by any estimator's formulas (``lfssao.ao.formulas``), as floats, with a changed look-up.

With ``Look`` as it is by default and weights of 1 the numbers are those of ``lfssao.ao.kernels``, bit for bit.
"""

import numpy as np

from lfssao.ao.kernels.look_up import look_up
from lfssao.core.jit import kernel
from lfssao.core.numbers import as_float, plain, select
from lfssao.optics.kernels.projection import image_of

_FEW = 4096  # texels that one thread computes


@kernel(inline=True)
def _image(view, place):
    """The image point of a place, NaN where it has none."""
    u, v, valid = image_of(view.kind, view.lens, place.u, place.v, place.q, place.z)
    nothing = view.rows.dtype.type(np.nan)
    return plain(u) if valid else nothing, plain(v) if valid else nothing


@kernel(inline=True)
def _looked_up(look, view, u, v, size):
    """The texel that an image point sees: of one without a surface the one that stands for it, if there is one."""
    seen = look_up(look, u, v, size)
    if seen >= 0 and look.empty >= 0 and not view.shows(seen):
        return look.empty
    return seen


@kernel(rows="texels", few=_FEW)
def sum_texels(begin, stop, view, estimator, look, size, texels, weights, occlusion):
    """Occlusion of texels by their samples, (K,); texels: (K,), their numbers, row * width + column.

    view: ``FloatView``. size: height and width. weights: (n, 1), by which the samples' terms are multiplied.
    """
    dtype = occlusion.dtype
    zero = dtype.type(0)
    for k in range(begin, stop):
        texel, total = np.uint32(texels[k]), zero
        here = estimator.start(view, texel)
        counts = view.shows(texel) & estimator.counts(view, here)
        for s in range(estimator.points.shape[0] if counts else 0):
            place = estimator.place(view, here, s)
            u, v = _image(view, place)
            seen = _looked_up(look, view, u, v, size)
            if seen >= 0:
                other = np.uint32(seen)
                term = estimator.term(view, here, s, view.depth_at(place), texel, other)
                total += weights[s, 0] * plain(select(view.shows(other), term, estimator.background()))
        occlusion[k] = plain(estimator.end(as_float(total))) if counts else zero


@kernel(rows="texels", few=_FEW)
def fold_texels(begin, stop, view, estimator, look, size, texels, weights, occlusion):
    """Occlusion of texels by the steps along their directions, as ``sum_texels``.

    weights: (n, steps), by which what a step adds is multiplied; one of weight 0 does not raise the state.
    """
    dtype = occlusion.dtype
    zero, half = dtype.type(0), dtype.type(0.5)
    for k in range(begin, stop):
        texel, total = np.uint32(texels[k]), zero
        here = estimator.start(view, texel)
        x, y = dtype.type(view.column(texel)) + half, dtype.type(view.row(texel)) + half
        counts = view.shows(texel) & estimator.counts(view, here)
        for s in range(estimator.points.shape[0] if counts else 0):
            u, v = _image(view, estimator.place(view, here, s))
            across, down, state = u - x, v - y, estimator.begin(view, here, s)
            for step in range(estimator.steps):
                part, weight = dtype.type(step + 1) / dtype.type(estimator.steps), weights[s, step]
                seen = _looked_up(look, view, x + part * across, y + part * down, size)
                if seen >= 0 and weight > 0:
                    added, after = estimator.step(view, here, state, texel, np.uint32(seen))
                    total += weight * plain(added)
                    state = after
        occlusion[k] = plain(estimator.end(as_float(total))) if counts else zero
