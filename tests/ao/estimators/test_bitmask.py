"""The visibility bitmask against a march in plain Python by angles, and against closed forms."""

from dataclasses import replace
from itertools import pairwise
from math import acos, asin, atan2, cos, floor, hypot, pi, sin

import analytic_scenes as scenes
import numpy as np
import pytest

from lfssao import bent_normals, estimate
from lfssao.core.elementary import sincospi

OPTIONS = {"slices": 2, "steps": 5, "randomize": False}


def middles_between(low, high, weighting, count):
    """Sectors whose middle lies between two angles from the normal; edges within a billionth are undecided."""
    part = sin if weighting == "cosine" else lambda x: 2 * x / pi
    low, high = (count * (part(min(max(each, -pi / 2), pi / 2)) + 1) / 2 for each in (low, high))
    close = min(abs(x - 0.5 - round(x - 0.5)) for x in (low, high)) < 1e-9
    return {k for k in range(count) if low < k + 0.5 < high}, close


def slices_of(seen, j, i, radius, thickness, weighting, count):
    """Directions of both slices of a texel, seen straight from above, set sectors, and whether rounding decides any."""
    p = seen.positions[j, i]
    n = seen.normals[j, i]
    height, width = seen.depth.shape
    texel = 0.75 / height
    for slice_ in range(2):
        sine, cosine = sincospi((2 * slice_ + 1) / 4)
        along = np.array([cosine, -sine, 0.0])  # the rightward direction, and downward
        tilt = atan2(n @ along, n[2])
        bits = set()
        undecided = False
        for side in (1, -1):
            for k in range(1, 6):
                reach = side * radius * k / 5 / texel
                column = floor(i + 0.5 + reach * cosine)
                row = floor(j + 0.5 + reach * sine)
                if not (0 <= column < width and 0 <= row < height) or (row, column) == (j, i):
                    continue
                d = seen.positions[row, column] - p
                if not np.linalg.norm(d) < radius:
                    continue
                back = d - np.array([0, 0, thickness])
                front, behind = (side * acos(x[2] / np.linalg.norm(x)) - tilt for x in (d, back))
                found, close = middles_between(min(front, behind), max(front, behind), weighting, count)
                bits = bits | found
                undecided = undecided or close
        yield along, bits, undecided


def rough():
    """A plane with bumps of up to half the radius 0.2, and normals of all directions to the viewer."""
    rng = np.random.default_rng(4)
    seen = scenes.buffers("facing plane", scenes.SIGHTS["orthographic"](40, 30))
    positions = seen.positions + np.array([0, 0, 0.1]) * rng.random((30, 40, 1))
    normals = rng.normal(size=(30, 40, 3)) + np.array([0, 0, 3])
    normals[..., 2] = np.abs(normals[..., 2]) + 0.1
    return replace(seen, positions=positions, normals=normals / np.linalg.norm(normals, axis=-1, keepdims=True))


@pytest.mark.parametrize("weighting", ["cosine", "uniform"])
@pytest.mark.parametrize(("count", "thickness"), [(32, 0.4), (5, 0.1), (32, 30.0)])
def test_every_texel_has_the_sectors_of_a_march_by_angles(weighting, count, thickness):
    """Texels of which rounding decides a sector, 0 to 2 of 1200, are left out."""
    seen = rough()
    radius = 0.2
    own = {"weighting": weighting, "sectors": count, "thickness": thickness}
    made = estimate("visibility-bitmask", seen, radius, **own, **OPTIONS).texture
    wrong = 0
    left_out = 0
    totals = set()
    for j, i in np.ndindex(seen.depth.shape):
        slices = list(slices_of(seen, j, i, radius, radius * thickness, weighting, count))
        total = sum(len(bits) for _, bits, _ in slices)
        undecided = any(close for *_, close in slices)
        found = made[j, i] * 2 * count
        assert found == pytest.approx(round(found), abs=1e-9)
        wrong += not undecided and round(found) != total
        left_out += undecided
        totals.add(total)
    assert wrong == 0
    assert left_out <= 2
    assert len(totals) > count / 3


def open_direction(slices, n, weighting, count):
    """The unit vector of the middles of open sectors, each by its solid angle and weight, of a normal."""
    total = np.zeros(3)
    up = np.array([0, 0, 1.0])
    for along, bits, _ in slices:
        tilt = atan2(n @ along, n[2])
        length = hypot(n @ along, n[2])
        for k in set(range(count)) - bits:
            part = (2 * k + 1) / count - 1
            angle = tilt + (asin(part) if weighting == "cosine" else part * pi / 2)
            weight = abs(sin(angle)) * (length if weighting == "cosine" else 1)
            total += weight * (sin(angle) * along + cos(angle) * up)
    return total / np.linalg.norm(total)


@pytest.mark.parametrize("weighting", ["cosine", "uniform"])
@pytest.mark.parametrize(("count", "thickness"), [(32, 0.4), (5, 0.1)])
def test_every_texel_has_the_bent_normal_of_its_open_sectors(weighting, count, thickness):
    seen = rough()
    radius = 0.2
    own = {"weighting": weighting, "sectors": count, "thickness": thickness}
    made = bent_normals("visibility-bitmask", seen, radius, **own, **OPTIONS)
    wrong = 0
    bends = []
    for j, i in np.ndindex(seen.depth.shape):
        slices = list(slices_of(seen, j, i, radius, radius * thickness, weighting, count))
        exact = open_direction(slices, seen.normals[j, i], weighting, count)
        decided = not any(close for *_, close in slices)
        wrong += decided and np.abs(made[j, i] - exact).max() > 1e-9
        bends.append(exact @ seen.normals[j, i])
    assert wrong == 0
    assert np.quantile(bends, 0.1) < 0.95


@pytest.mark.parametrize(
    ("weighting", "exact"), [("cosine", lambda h: 1 - np.sin(h)), ("uniform", lambda h: 1 - 2 * h / np.pi)]
)
def test_a_pit_hides_what_lies_below_its_horizon(weighting, exact):
    """The bottom of a cone, seen from above: all sides have one horizon, whose angle from the axis is h."""
    seen = scenes.buffers("facing plane", scenes.SIGHTS["orthographic"](161, 121), np.float64)
    x = seen.positions[..., 0]
    y = seen.positions[..., 1]
    for slope in (0.3, 1.0, 3.0):
        positions = np.stack([x, y, slope * np.hypot(x, y)], axis=-1)
        pit = replace(seen, positions=positions)
        made = estimate("visibility-bitmask", pit, 0.3, weighting=weighting, thickness=1e3, slices=8, steps=8)
        assert made.texture[60, 80] == pytest.approx(exact(np.arctan2(1, slope)), abs=1 / 32)


def test_a_plane_that_faces_the_viewer_hides_nothing_of_itself():
    seen = scenes.buffers("facing plane", scenes.SIGHTS["orthographic"](96, 72), np.float32)
    for weighting in ("cosine", "uniform"):
        assert not estimate("visibility-bitmask", seen, 0.1, weighting=weighting).texture.any()


def test_no_thickness_hides_nothing_and_the_published_rule_hides_more():
    seen = scenes.buffers("sphere on a plane", scenes.SIGHTS["perspective"](40, 30))
    made = [
        estimate("visibility-bitmask", seen, 0.2, **more).texture
        for more in ({"thickness": 0.0}, {"thickness": 0.05}, {"thickness": 0.5}, {"thickness": 0.5, "rule": "touched"})
    ]
    assert not made[0].any()
    for less, more in pairwise(made):
        assert (less <= more).all()
        assert more.mean() > 1.2 * less.mean()
