"""Points of the sphere and the ball, independent or wrong in one way."""

import numpy as np


def on_sphere(z, phi):
    r = np.sqrt(1 - z * z)
    return np.column_stack([r * np.cos(phi), r * np.sin(phi), z])


def draw(n, seed, wrong=""):
    """n points of the ball, independent or wrong in one way."""
    z, turn, t = np.random.default_rng(seed).random((3, n))
    z = z if wrong == "upper" else 2 * z - 1
    turn = turn / 2 - 0.25 if wrong == "half" else turn  # over the beginning of the circle
    return on_sphere(z, 2 * np.pi * turn) * (t if wrong == "r = t" else np.cbrt(t))[:, None]
