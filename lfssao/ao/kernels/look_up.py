"""How an image point is looked up: its texel, a rule for the border, and what stands where there is no surface."""

from typing import Any, NamedTuple

import numpy as np

from lfssao.core.corners import Corners
from lfssao.core.jit import formula
from lfssao.core.numbers import as_float, unless_none

VALUE, CLAMP, MIRROR, WRAP, MIRROR_INSIDE = range(5)  # rules for the border
NOTHING = -1  # the texel of a look-up that adds nothing
FARTHEST = 1e6  # texels from the texture, beyond which a rule makes no difference


class Look(NamedTuple):
    """A way to look image points up.

    border: VALUE, or the rule by which a texel inside stands for one outside. outside: the number of the texel that
    stands for all others by the rule VALUE. empty: the number of the texel that stands for all without a surface. Both
    are NOTHING where there is no such texel. cleared: whether texels without a surface hold a place. linear: not None
    if textures are read between four texels, and not in one. matrix: None, or (2, 3), applied to (u, v, 1), as tuples
    of the arithmetic's floats: compiled loops would count the owners of an array.
    """

    border: int = VALUE
    outside: int = NOTHING
    empty: int = NOTHING
    cleared: bool = False
    linear: Any = None
    matrix: Any = None


@formula
def hold_place(place: Any, size: Any, rule: Any) -> Any:
    """The column or row inside 0 to size - 1 that stands for any, a whole number; by VALUE that of CLAMP."""
    if rule == WRAP:
        return place % size
    if rule == MIRROR:
        folded = place % (2 * size)
        return np.minimum(folded, 2 * size - 1 - folded)
    if rule == MIRROR_INSIDE and size > 1:
        folded = place % (2 * size - 2)
        return np.minimum(folded, 2 * size - 2 - folded)
    return np.minimum(np.maximum(place, 0), size - 1)


@formula
def _texel_at(u):
    """The column or row of an image coordinate, int64, at most so far outside that rules are the same."""
    return np.int64(np.floor(min(max(np.float64(u), -FARTHEST), FARTHEST)))


@formula
def _moved(m, u, v):
    """An image point by the matrix of a look."""
    if m is None:
        return u, v
    return (m[0][0] * u + m[0][1] * v) + m[0][2], (m[1][0] * u + m[1][1] * v) + m[1][2]


@formula
def texel_in(look, column, row, size):
    """The number of the texel that stands for one in any column and row, whole numbers, or NOTHING."""
    height, width = size
    if look.border == VALUE and not (0 <= column < width and 0 <= row < height):
        return look.outside
    return hold_place(row, height, look.border) * width + hold_place(column, width, look.border)


@formula
def _linear(look):
    return look.linear


@formula
def linear_of(look):
    """Whether a look reads between four texels, not None if it does."""
    return unless_none(look, None, _linear, ())


@formula
def _corner_in(look, column, row, size):
    """The number of a corner's texel; one beyond the border that is none is the nearest inside."""
    texel, (height, width) = texel_in(look, column, row, size), size
    nearest = hold_place(row, height, CLAMP) * width + hold_place(column, width, CLAMP)
    return np.uint32(nearest if texel == NOTHING else texel)


@formula
def corners_in(look, column, row, x, y, size):
    """The corners whose upper left one lies in any column and row, and the image point's place between them."""
    return Corners(
        _corner_in(look, column, row, size),
        _corner_in(look, column + 1, row, size),
        _corner_in(look, column, row + 1, size),
        _corner_in(look, column + 1, row + 1, size),
        x,
        y,
    )


@formula
def seen_at(look, u, v, texel, size):
    """Return what formulas are given of an image point in a texel: the texel, or by a linear look four around it."""
    return unless_none(linear_of(look), texel, _corners_at, (look, u, v, size))


@formula
def _corners_at(linear, look, u, v, size):
    x, y = _moved(look.matrix, u, v)
    half = type(x)(0.5)
    left, top = np.floor(x - half), np.floor(y - half)
    across, down = as_float((x - half) - left), as_float((y - half) - top)
    return corners_in(look, _texel_at(left), _texel_at(top), across, down, size)


@formula
def holds_place(look):
    """Whether texels without a surface hold a place."""
    if look is None:
        return False
    return look.cleared


@formula
def look_up(look, u, v, size):
    """The number of the texel that image point (u, v) is looked up in, row * width + column, or NOTHING.

    size: height and width. A point without image, NaN, is looked up in NOTHING by every rule, as is any without a look.
    """
    if look is None:
        return NOTHING
    x, y = _moved(look.matrix, u, v)
    if np.isnan(x) or np.isnan(y):
        return NOTHING
    return texel_in(look, _texel_at(x), _texel_at(y), size)
