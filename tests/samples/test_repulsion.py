"""VO's tables: made again, weights, and which numbers of points are good."""

import math

import make_repulsion
import numpy as np
import pytest
from bits import bits

from lfssao.errors import InputError
from lfssao.samples import repulsion_table, sample_set

VOLUME = 4 / 3 * math.pi
KINDS = [("ball", None), ("disk", None), ("disk", True), ("disk", False)]


# Tables


@pytest.mark.parametrize(("domain", "centre"), KINDS)
def test_every_table_lies_inside_and_weighs_the_volume(domain, centre):
    for n in range(1, 65):
        made = repulsion_table(domain, n, centre)
        assert made.points.shape == (n, 3 if domain == "ball" else 2)
        assert np.all(np.sum(made.points**2, axis=1) < 1)
        assert made.weights.shape == (n,)
        assert made.weights.min() > 0
        assert math.fsum(made.weights) == pytest.approx(VOLUME, rel=1e-14)
        if centre or (domain == "disk" and centre is None):
            assert not made.points[0].any()


@pytest.mark.parametrize(("table", "n"), [("ball", 3), ("disk", 4), ("disk-centre", 5)])
def test_tables_are_what_their_program_makes(table, n):
    made = make_repulsion.best(table, n)
    centre = None if table == "ball" else table == "disk-centre"
    shipped = repulsion_table(table.split("-")[0], n, centre)
    np.testing.assert_array_equal(bits(made[:, :-1]), bits(shipped.points))
    np.testing.assert_array_equal(bits(made[:, -1]), bits(shipped.weights))


@pytest.mark.parametrize(("domain", "centre"), KINDS)
@pytest.mark.parametrize("n", [2, 9, 33, 64])
def test_weights_are_those_of_random_points_nearest_to_each(domain, centre, n):
    """20,000 uniform points of the ball, seen along z for the disk: each fraction within 6 sigma of its weight."""
    made = repulsion_table(domain, n, centre)
    cloud = sample_set("ball", "random", 20_000, 1).points[:, : made.points.shape[1]]
    nearest = np.argmin(np.sum((cloud[:, None] - made.points) ** 2, axis=-1), axis=1)
    fraction = np.bincount(nearest, minlength=n) / len(cloud)
    weight = made.weights / VOLUME
    assert np.all(np.abs(fraction - weight) < 6 * np.sqrt(weight / len(cloud)))


# Which numbers of points are good


def planes(count=4000):
    """Directions and offsets of planes that cut the unit ball, and the fraction of the ball beyond each."""
    u = sample_set("sphere", "random", count, 1).points
    t = sample_set("square", "random", count, 2).points[:, 0]
    return u, t, (1 - t) ** 2 * (2 + t) / 4


def estimate(made, u, t):
    """The fraction of the ball beyond planes by point samples, or by line samples along z."""
    p = made.points
    w = made.weights / VOLUME
    if made.domain == "ball":
        return (p @ u.T > t).T @ w
    reach = np.sqrt(1 - np.sum(p**2, axis=1))[:, None]
    at = np.clip((t - p @ u[:, :2].T) / u[:, 2], -reach, reach)
    return (np.where(u[:, 2] > 0, reach - at, at + reach) / (2 * reach)).T @ w


def noise(domain, n, centre=None, middle=False):
    """Root mean square error over planes; with ``middle`` over planes through the centre, which cut off one half."""
    u, t, fraction = planes()
    t, fraction = (0 * t, 0 * fraction + 0.5) if middle else (t, fraction)
    return float(np.sqrt(np.mean((estimate(repulsion_table(domain, n, centre), u, t) - fraction) ** 2)))


def test_noise_falls_with_the_number_of_points_without_large_steps():
    """Over all planes no number stands out by more than a tenth, VO's 33 points neither."""
    for domain, slope in (("ball", -0.63), ("disk", -0.95)):
        scaled = [noise(domain, n) * n**-slope for n in range(5, 41)]
        middle = np.array([np.median(scaled[max(k - 3, 0) : k + 4]) for k in range(len(scaled))])
        assert np.all(np.abs(scaled / middle - 1) < 0.12), np.round(scaled / middle, 3)


def test_six_and_twelve_points_are_platonic_and_exact_for_planes_through_the_middle():
    for n, gap in ((6, math.sqrt(2)), (12, 1 / math.sin(2 * math.pi / 5))):  # octahedron, icosahedron: edge / radius
        points = repulsion_table("ball", n).points
        r = np.sqrt(np.sum(points**2, axis=1))
        assert np.ptp(r) < 0.01
        gaps = np.sqrt(np.sum((points[:, None] - points) ** 2, axis=-1)) + 9 * np.eye(n)
        assert gaps.min(axis=1) / r == pytest.approx(gap, rel=0.02)
        assert noise("ball", n, middle=True) < 0.01
    assert noise("ball", 13, middle=True) > 0.03


def test_with_the_centre_five_seven_and_nine_lines_are_exact_for_planes_through_the_middle():
    """VO's 13 and 16 are not: of our sets with the centre 15 and 17 are symmetrical, and 9 lines beat 10."""
    assert all(noise("disk", n, True, middle=True) < 1e-3 for n in (5, 7, 9, 15, 17))
    assert all(noise("disk", n, True, middle=True) > 0.01 for n in (8, 10, 13, 16))


def test_five_lines_are_no_worse_than_twelve_points():
    assert noise("disk", 5) < noise("ball", 12) < noise("disk", 4) * 1.2


@pytest.mark.parametrize(("arguments", "words"), [
    (("sphere", 4), "ball, disk"), (("ball", 0), "1 to 64"), (("ball", 65), "1 to 64"), (("ball", 4.0), "1 to 64"),
    (("ball", 4, True), "centre"),
])  # fmt: skip
def test_what_is_refused(arguments, words):
    with pytest.raises(InputError, match=words):
        repulsion_table(*arguments)
