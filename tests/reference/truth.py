"""Ray-cast occlusion by brute force: every triangle on every ray. All in float64."""

import math

import numpy as np

from reference.elementary import in_order, sincospi
from reference.philox import key_of, philox4x32
from reference.points import axes_across
from reference.raycast import first_hits


def distances(origin, directions, far, corners):
    """Distance of each ray from one origin to the first triangle, infinity beyond far; axes renamed, steepest z."""
    out = np.full(len(directions), np.inf)
    steepest = np.abs(directions).argmax(axis=1)
    for axis in range(3):
        for sign in (1.0, -1.0):
            rays = np.flatnonzero((steepest == axis) & (np.sign(directions[:, axis]) == sign))
            if len(rays) == 0:
                continue
            x, y, z = np.roll(np.arange(3), -(axis + 1))  # the two axes after it, then itself
            d = directions[rays]
            sx, sy = d[:, x] / d[:, z], d[:, y] / d[:, z]
            ox, oy = origin[x] - sx * origin[z], origin[y] - sy * origin[z]
            # A ray that goes down z is one that goes up after z has been turned round, which rounds nothing.
            turned = corners[:, :, [x, y, z]] * [1.0, 1.0, sign]
            o = sign * origin[z]
            near, end = np.full(len(rays), o), np.full(len(rays), np.inf)
            hits = first_hits((ox, oy, sign * sx, sign * sy, near, end), turned)
            t = (hits.z - o) / (sign * d[:, z])
            out[rays] = np.where((hits.triangle >= 0) & (t > 0) & (t <= far), t, np.inf)
    return out


def local_direction(u, v, weighting):
    sine, cosine = sincospi(2.0 * v)
    r, z = (math.sqrt(u), math.sqrt(1.0 - u)) if weighting == "cosine" else (math.sqrt(1.0 - u * u), u)
    return r * cosine, r * sine, z


def covered(t, far, falloff):
    if t == math.inf:
        return 0.0
    part = t / far
    outer = max(part, 0.8)
    return {
        "constant": 1.0, "linear": 1.0 - part, "quadratic": 1.0 - part * part, "cubic": 1.0 - part * part * part,
        "shell": (1.0 - outer * outer * outer) / 0.488,
    }[falloff]  # fmt: skip


def directions_of(texel, number, strata, seed, weighting, axes):
    out = []
    for row in range(strata):
        for column in range(strata):
            counter = (number * strata * strata + row * strata + column, 0, texel, 0)
            a, b, _, _ = philox4x32(counter, key_of(seed))
            u, v = (column + (a + 0.5) / 2.0**32) / strata, (row + (b + 0.5) / 2.0**32) / strata
            x, y, z = local_direction(u, v, weighting)
            out.append([(axes[0][k] * x + axes[1][k] * y) + axes[2][k] * z for k in range(3)])
    return np.array(out)


def begin(place, normal, step):
    """The origin of a texel's rays, and two axes and the normal; None without one."""
    n = [float(a) for a in normal]
    length = math.sqrt((n[0] * n[0] + n[1] * n[1]) + n[2] * n[2])
    if not length > 0.0:
        return None
    n = [a / length for a in n]
    return np.array([float(p) + step * a for p, a in zip(place, n, strict=True)]), [*axes_across(n), n]


def texel(number, place, normal, corners, far, step, weighting, falloff, strata, rounds, tolerance, seed):
    """Occlusion, its standard error and the rays of one texel with a surface."""
    begun = begin(place, normal, step)
    if begun is None:
        return 0.0, 0.0, 0
    origin, axes = begun
    total = squares = 0.0
    done, error = 0, math.inf
    while done < rounds[0] or (done < rounds[1] and error > tolerance):
        ways = directions_of(number, done, strata, seed, weighting, axes)
        mean = in_order(covered(t, far, falloff) for t in distances(origin, ways, far, corners)) / len(ways)
        total, squares, done = total + mean, squares + mean * mean, done + 1
        if done > 1:
            error = math.sqrt(max(squares - total * total / done, 0.0) / (float(done) * float(done - 1)))
    return total / done, error, done * strata * strata
