"""Numbers between four texels: balls hold what any renderer's weights make of them, and hardly more."""

import numpy as np
import pytest

from lfssao.core.balls import SAFETY, Ball, ball_of
from lfssao.core.corners import Corners, blended
from lfssao.core.jit import kernel

UNIT = 2.0**-24
N = 4000


@kernel
def bounded(texels, places, off, by, made):
    """Values and errors between texels (N, 4) at places (N, 2), each off by so much."""
    zero = ball_of(0.0, 0.0, by)
    for i in range(len(texels)):
        x = Ball(places[i, 0], off, zero)
        y = Ball(places[i, 1], off, zero)
        a = Ball(texels[i, 0], 0.0, zero)
        b = Ball(texels[i, 1], 0.0, zero)
        c = Ball(texels[i, 2], 0.0, zero)
        d = Ball(texels[i, 3], 0.0, zero)
        found = blended(Corners(0, 0, 0, 0, x, y), a, b, c, d)
        made[i, 0], made[i, 1] = found.value, found.error


def by_lines(x, y, a, b, c, d):
    upper = a + x * (b - a)
    lower = c + x * (d - c)
    return upper + y * (lower - upper)


def by_weights(x, y, a, b, c, d):
    u = 1 - x
    v = 1 - y
    return ((u * v) * a + (x * v) * b) + ((u * y) * c + (x * y) * d)


def by_weights_in_another_order(x, y, a, b, c, d):
    u = 1 - x
    v = 1 - y
    return (((x * d) * y + (c * u) * y) + (b * v) * x) + (a * v) * u


@pytest.mark.parametrize("apart", [1e-3, 1.0, 300.0])
@pytest.mark.parametrize("off", [0.0, 2.0**-12, 2.0**-7])
def test_a_linear_look_up_is_as_wide_as_its_places_make_it(apart, off):
    """A float32 renderer takes any place nearby, by any form; the width is that of the exact form over these places."""
    rng = np.random.default_rng(7)
    texels = (5.0 + apart * rng.normal(size=(N, 4))).astype(np.float32)
    places = rng.uniform(off, 1 - off, size=(N, 2)).astype(np.float32)
    places[: N // 4, 0] = off  # next to a texel's centre
    made = np.empty((N, 2))
    bounded(texels.astype(float), places.astype(float), off, np.full(5, UNIT), made)
    for _ in range(20):
        way = rng.choice([-1.0, 0.0, 1.0], size=places.shape)
        x, y = (places + (1 - 2.0**-20) * off * way).astype(np.float32).T
        for form in (by_lines, by_weights, by_weights_in_another_order):
            number = form(x, y, *texels.T)
            assert number.dtype == np.float32
            assert (abs(number - made[:, 0]) <= made[:, 1] * SAFETY).all()
    ends = [by_lines(*(places + off * np.array(way)).astype(float).T, *texels.astype(float).T)
            for way in ((-1, -1), (-1, 1), (1, -1), (1, 1))]  # fmt: skip
    widest = np.maximum(np.max(ends, axis=0) - made[:, 0], made[:, 0] - np.min(ends, axis=0))
    assert (made[:, 1] <= 1.01 * widest + 24 * UNIT * abs(texels).max(axis=1)).all()
