"""Each estimator's limit for many samples and small texels, on surfaces with known answers.

The docstrings of the estimators' files state the limit as an integral over the height z = h(x, y) of a surface that an
orthographic camera sees from straight above. The integrals stand here, by the midpoint rule: the estimators are
compared with them.
"""

from functools import partial

import analytic_scenes as scenes
import numpy as np
import pytest
from estimator_cases import filled_ball, sunflower

from lfssao import estimate, make_samples
from lfssao.ao.estimators.registry import of_one_view

RADIUS = 0.1  # less than the step's height, 0.125, which is also the sphere's radius
WIDTH, HEIGHT = 192, 144  # a texel is 0.0052, 1/19 of the radius
PLACES = {
    "facing plane": (0.0, 0.07),
    "tilted plane": (0.0, 0.07),
    "concave crease": (-0.01, -0.03, 0.05, -0.15),
    "convex crease": (-0.01, -0.03, 0.05, -0.15),
    "step": (-0.02, -0.05, -0.08, 0.06, -0.15),
    "sphere on a plane": (-0.2, -0.17, -0.15, -0.13, -0.05, 0.0),
}


def polar(rings, ways):
    """Midpoints of the unit disk's radii and angles, as x, y and radius."""
    alpha, theta = np.meshgrid((np.arange(rings) + 0.5) / rings, 2 * np.pi * (np.arange(ways) + 0.5) / ways)
    return alpha * np.cos(theta), alpha * np.sin(theta), alpha


# Limits: what the estimators' docstrings say, of the height h, at the point p with the unit normal n


def behind(h, p, n, radius, half):
    """Share of the ball, or of its half above the tangent plane, that lies under the height: column by column."""
    x, y, alpha = polar(200, 360)
    reach = radius * np.sqrt(1 - alpha**2)
    dx = radius * x
    dy = radius * y
    rise = h(p[0] + dx, p[1] + dy) - p[2]
    floor = np.maximum(-reach, -(n[0] * dx + n[1] * dy) / n[2]) if half else -reach
    hidden = np.maximum(np.minimum(rise, reach) - floor, 0)
    return np.sum(hidden * alpha) / np.sum(2 * reach * alpha) * (2 if half else 1)


def shell(h, p, n, radius, half):
    """The same of LF's shell, from 0.8 R to R."""
    outer, inner = (r**3 * behind(h, p, n, r, half) for r in (radius, 0.8 * radius))
    return (outer - inner) / (radius**3 - (0.8 * radius) ** 3)


def taps(h, p, n, radius):
    """u.n and u.u of the points of the surface over a disk whose radii are uniform; lengths in radii."""
    x, y, _ = polar(300, 360)
    z = (h(p[0] + radius * x, p[1] + radius * y) - p[2]) / radius
    return x * n[0] + y * n[1] + z * n[2], x * x + y * y + z * z


def alchemy(h, p, n, radius):
    above, square = taps(h, p, n, radius)
    return 2 * SIGMA * np.mean(np.maximum(above, 0) / (square + EPSILON))


def sao(h, p, n, radius):
    above, square = taps(h, p, n, radius)
    return 5 * SIGMA * np.mean(np.maximum(1 - square, 0) ** 3 * np.maximum(above - BETA, 0) / (square + EPSILON))


def sao_equation_1(h, p, n, radius):
    above, square = taps(h, p, n, radius)
    away = (2 - p[2]) / radius  # the camera stands at z = 2
    return 2 * SIGMA * np.mean(np.maximum(above - BETA / 20 * away, 0) / (square + EPSILON))


def horizons(h, p, n, radius, directions=360, steps=600, quadratic=1.0):
    """Mean over the directions of the integral of W over the rising sine of the horizon."""
    theta = np.pi * (2 * np.arange(directions)[:, None] + 1) / directions
    length = radius * (np.arange(steps) + 1) / steps
    dx = length * np.cos(theta)
    dy = length * np.sin(theta)
    dz = h(p[0] + dx, p[1] + dy) - p[2]
    away = np.sqrt(dx**2 + dy**2 + dz**2)
    slope = -(n[0] * np.cos(theta) + n[1] * np.sin(theta)) / n[2]
    start = slope / np.sqrt(1 + slope**2)
    sine = np.where(away < radius, dz / away, -1)
    risen = np.maximum(np.maximum.accumulate(sine, axis=1), start)
    gains = np.diff(risen, axis=1, prepend=start)
    return np.mean(np.sum((1 - quadratic * (away / radius) ** 2) * gains, axis=1))


def slices(h, p, n, radius, steps):
    """Cosine-weighted directions that no horizon hides, the integral over a slice's angles by the midpoint rule too."""
    theta = np.pi * (2 * np.arange(64)[:, None] + 1) / 64
    length = radius * (np.arange(steps) + 1) / steps
    dx = length * np.cos(theta)
    dy = length * np.sin(theta)
    dz = h(p[0] + dx, p[1] + dy) - p[2]
    away = np.sqrt(dx**2 + dy**2 + dz**2)
    cosine = np.max(np.where(away < radius, dz / away, -1), axis=1, keepdims=True)
    angle = np.arccos(cosine) * (np.arange(400) + 0.5) / 400
    x = np.sin(angle) * np.cos(theta)
    y = np.sin(angle) * np.sin(theta)
    z = np.cos(angle)
    weight = np.maximum(x * n[0] + y * n[1] + z * n[2], 0) / np.pi
    return 1 - 2 * np.pi * np.mean(np.sum(weight * np.sin(angle), axis=1) * np.arccos(cosine[:, 0]) / 400)


def half_circles(h, p, n, radius, steps):
    """Part of each slice's half circle around the normal that lies below the horizons, by sines, mean over slices."""
    theta = np.pi * (2 * np.arange(64)[:, None] + 1) / 64
    length = radius * (np.arange(steps) + 1) / steps
    dx = length * np.cos(theta)
    dy = length * np.sin(theta)
    dz = h(p[0] + dx, p[1] + dy) - p[2]
    near = np.sqrt(dx**2 + dy**2 + dz**2) < radius
    angle = np.min(np.where(near, np.arctan2(length, dz), np.pi), axis=1)
    tilt = np.arctan2(n[0] * np.cos(theta[:, 0]) + n[1] * np.sin(theta[:, 0]), n[2])
    return 1 - np.mean(np.sin(np.minimum(angle - tilt, np.pi / 2)))


def square_of_texels(h, p, n, radius):
    """Mean over the square of (1 - t^2 / R^2) max(0, cos); alone, a level is its own maximum and average."""
    a = (KERNEL + 0.5) * 0.75 / HEIGHT
    u = a * (2 * (np.arange(400) + 0.5) / 400 - 1)
    x, y = np.meshgrid(u, u)
    z = h(p[0] + x, p[1] + y) - p[2]
    t = np.sqrt(x * x + y * y + z * z)
    mean = np.mean(np.maximum(1 - (t / radius) ** 2, 0) * np.maximum(x * n[0] + y * n[1] + z * n[2], 0) / t)
    return 1 - (1 - mean) ** 2


# Settings that come near the limit: many samples, and no passes after them


SIGMA = 0.15
BETA = 0.01
EPSILON = 0.01
KERNEL = 15
SPIRAL = {"taps": 200, "turns": 97, "mip": "none", "quad_edge": 0.0, "gauss": 0.0, "epsilon": EPSILON}


def even_radii(n, m):
    """Taps whose radii, not whose area, are even."""
    x, y, _ = polar(n, m)
    return np.stack([x.ravel(), y.ravel()], -1)


LF = make_samples("jittered", 1024, 3)
AROUND = {"directions": 32, "steps": 6}
# Limit, radius, samples and parameters of each estimator, and how far off it may be: less than a ball of 0.9 R would be
# (0.016, twice that by half balls), but for random points, whose error is 0.014 (of 0.85 R it would be 0.025). A
# texel is 1/19 of the radius; a wall's or a sphere's edge is found to within half of it, of which stratified points and
# lines on average miss little. A texel's spiral has 200 taps on 97 turns. The areas of VO are 1.3 texels wide: below
# that a tangent plane's slope stays in their variance. Steps of horizons must be wide against texels, which lie beside
# the way: it is the sum over six steps, with a larger ball, that is compared.
NEAR_THE_LIMIT = {
    "lf": (partial(shell, half=False), RADIUS, LF, {}, 0.012),
    "point": (partial(shell, half=False), RADIUS, LF, {}, 0.012),
    "hemisphere": (partial(shell, half=True), RADIUS, LF, {}, 0.02),
    "alchemy": (alchemy, RADIUS, even_radii(20, 32), {"sigma": SIGMA, "beta": 0.0, "epsilon": EPSILON}, 0.01),
    "sao": (sao, RADIUS, None, {"intensity": SIGMA, "beta": BETA, **SPIRAL}, 0.02),
    "sao-equation-1": (sao_equation_1, RADIUS, None, {"sigma": SIGMA, "beta": BETA / 20, **SPIRAL}, 0.02),
    "multiresolution": (square_of_texels, RADIUS, None, {"levels": 1, "kernel": KERNEL}, 0.01),
    "vo-points": (partial(behind, half=False), RADIUS, filled_ball(600), {}, 0.02),
    "vo-points-normal": (partial(behind, half=True), RADIUS, filled_ball(600), {}, 0.03),
    "vo-lines": (partial(behind, half=False), RADIUS, sunflower(200), {}, 0.015),
    "vo-lines-normal": (partial(behind, half=True), RADIUS, sunflower(200), {}, 0.03),
    "vo-area": (partial(behind, half=False), RADIUS, sunflower(200), {}, 0.015),
    "oriented-hemisphere": (
        partial(behind, half=True), RADIUS, filled_ball(600), {"bias": 0.0, "range_check": "none"}, 0.03
    ),
    "hbao": (partial(horizons, **AROUND), 0.3, None, {"randomize": False, **AROUND}, 0.03),
    "visibility-bitmask": (
        partial(half_circles, steps=6), 0.3, None,
        {"randomize": False, "slices": 32, "steps": 6, "thickness": 1e3}, 0.03
    ),
    "gtao": (partial(slices, steps=6), 0.3, None, {"randomize": False, "slices": 32, "steps": 6}, 0.02),
}  # fmt: skip


@pytest.fixture(scope="module")
def seen():
    sight = scenes.SIGHTS["orthographic"](WIDTH, HEIGHT)
    return {surface: scenes.buffers(surface, sight) for surface in scenes.SURFACES}


@pytest.mark.parametrize("surface", scenes.SURFACES)
@pytest.mark.parametrize("name", of_one_view())
def test_an_estimator_tends_to_its_limit(name, surface, seen):
    limit, radius, points, parameters, tolerance = NEAR_THE_LIMIT[name]
    made = estimate(name, seen[surface], radius, points, **parameters).texture
    for x in PLACES[surface]:
        j, i, at = scenes.nearest(seen[surface], x)
        want = limit(scenes.SURFACES[surface].height, at, seen[surface].normals[j, i], radius)
        assert abs(made[j, i] - want) < tolerance, (x, made[j, i], want)
