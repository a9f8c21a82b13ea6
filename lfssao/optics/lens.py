"""Module optics: the homography from screen to texels, where distortion folds, and heights of curved surfaces."""

from math import inf, sqrt

import numpy as np

from lfssao.core.affine import cofactors, determinant
from lfssao.core.elementary import sincospi
from lfssao.errors import InputError

Homography = tuple[float, ...]  # 9, rows of three
Vector = tuple[float, float, float]


def aligned_homography(screen: tuple[float, float], resolution: tuple[int, int]) -> Homography:
    """Homography of a texture that covers the screen exactly: u = W (1/2 + x / w), v = H (1/2 - y / h)."""
    w, h = screen
    width, height = resolution
    return (width / w, 0.0, width / 2, 0.0, -height / h, height / 2, 0.0, 0.0, 1.0)


@np.errstate(all="ignore")  # what overflows is refused when it is inverted
def projector_homography(
    lens: Vector, rotation: Vector, field_of_view: float, resolution: tuple[int, int]
) -> Homography:
    """Homography of a distortion-free projector at ``lens``, from the plane z = 0 (metres) to its texels.

    The rotation is yaw (to +x), pitch (up) and roll, degrees, applied in that order to a projector that looks along -z;
    the field of view is horizontal, degrees.
    """
    width, height = resolution
    sine, cosine = sincospi(field_of_view / 360.0)
    focal = 0.5 * width * cosine / sine
    (sy, cy), (sp, cp), (sr, cr) = (sincospi(angle / 180.0) for angle in rotation)
    forward = np.array([sy * cp, sp, -(cy * cp)])
    level = np.array([cy, 0.0, sy])  # right before the roll
    steep = np.array([-(sy * sp), cp, cy * sp])  # up before the roll
    right = cr * level + sr * steep
    up = cr * steep - sr * level
    rows = np.array([focal * right + 0.5 * width * forward, -focal * up + 0.5 * height * forward, forward])
    # Directions from the lens to (x, y, 0) are (x - m_x, y - m_y, -m_z).
    rows[:, 2] = -((rows[:, 0] * lens[0] + rows[:, 1] * lens[1]) + rows[:, 2] * lens[2])
    return tuple(rows.ravel().tolist())


def with_guard(h: Homography, guard: int) -> Homography:
    """Return the homography of a texture with ``guard`` more texels on each side: u and v grow by guard."""
    upper = [a + guard * c for a, c in zip(h[:6], (*h[6:], *h[6:]), strict=True)]
    return (*upper, *h[6:])


@np.errstate(all="ignore")  # what overflows is refused
def invert(h: Homography) -> Homography:
    """Inverse of a homography, adjugate over determinant; InputError if it is singular."""
    m = np.reshape(h, (3, 3))
    if not abs(determinant(m)) > 1e-12 * np.sqrt(np.sum(m * m, axis=1)).prod():
        raise InputError("the homography is singular")
    return tuple((cofactors(m).T / determinant(m)).ravel().tolist())


def fold_radius(k1: float, k2: float) -> float:
    """Square of the smallest radius at which 1 + 3 k1 r^2 + 5 k2 r^4 is 0, where the distortion folds; or infinity."""
    a = 5.0 * k2
    b = 3.0 * k1
    if a == 0.0:
        return -1.0 / b if b < 0.0 else inf
    discriminant = b * b - 4.0 * a
    if discriminant < 0.0:
        return inf
    # The root that does not subtract, and the other from their product 1 / a.
    q = -0.5 * (b + (sqrt(discriminant) if b >= 0.0 else -sqrt(discriminant)))
    roots = [root for root in ((q / a), (1.0 / q if q != 0.0 else inf)) if root > 0.0]
    return min(roots, default=inf)


def bulge(curvature: float, x: float) -> float:
    """Height in z at x of a circle of that curvature through the origin; beyond its end, that of its end."""
    sine = min(abs(curvature * x), 1.0)
    return curvature * x * x / (1.0 + sqrt(1.0 - sine * sine)) if sine < 1.0 else 1.0 / curvature
