"""A look-up by a linear filter: the four texels around an image point, and numbers of a texture between them."""

from typing import Any, NamedTuple

from numba import types
from numba.extending import overload

from lfssao.core.jit import INLINED, formula
from lfssao.core.numbers import alternatives, middle_of, rounded, spread_of
from lfssao.core.vectors import Vector


class Corners(NamedTuple):
    """The texels around an image point: the upper left one, the next to the right, and those below both.

    x and y: the image point's place between their centres, 0 to 1, right and down.
    """

    texel: Any
    right: Any
    below: Any
    across: Any
    x: Any
    y: Any


def by_corners(seen: Any, of_texel: Any, between: Any, arguments: Any) -> Any:
    """Return what one formula makes of a look-up that is a texel, or another of one that is four; compilers know."""
    return (between if isinstance(seen, Corners) else of_texel)(seen, *arguments)


@overload(by_corners, jit_options=INLINED)
def _by_corners(seen, of_texel, between, arguments):
    if isinstance(seen, types.BaseNamedTuple) and seen.instance_class is Corners:
        return lambda seen, of_texel, between, arguments: between(seen, *arguments)
    return lambda seen, of_texel, between, arguments: of_texel(seen, *arguments)


@formula
def blended(corners: Any, a: Any, b: Any, c: Any, d: Any) -> Any:
    """Return the number between those of four texels; of balls that of all weights' products, too.

    The weights x and 1 - x are of one place, so balls take both forms at the middle of all places and add what another
    place makes of them, exactly: e and f away it is e f_x + f f_y + e f f_xy more, by the slopes at the middle. A
    renderer rounds each product in up to 7 operations; slopes are off by as many, as products differ between places.
    """
    x, y, e, f = middle_of(corners.x), middle_of(corners.y), spread_of(corners.x), spread_of(corners.y)
    upper, lower = a + x * (b - a), c + x * (d - c)
    blend = upper + y * (lower - upper)
    weighed = (((1 - x) * (1 - y)) * a + (x * (1 - y)) * b) + (((1 - x) * y) * c + (x * y) * d)
    above, below = rounded(b - a, 4, blend), rounded(d - c, 4, blend)
    left, right = rounded(c - a, 4, blend), rounded(d - b, 4, blend)
    moved = e * ((1 - y) * above + y * below) + f * ((1 - x) * left + x * right)
    return alternatives(blend, alternatives(blend, weighed) + (moved + (e * f) * (below - above)))


@formula
def blended_vector(corners: Any, a: Any, b: Any, c: Any, d: Any) -> Any:
    """Return the vector between those of four texels."""
    return Vector(
        blended(corners, a.x, b.x, c.x, d.x),
        blended(corners, a.y, b.y, c.y, d.y),
        blended(corners, a.z, b.z, c.z, d.z),
    )
