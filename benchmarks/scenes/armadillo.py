"""An upright armadillo-like creature, our own: banded shell, long ears, claws and scaly skin."""

import numpy as np
from implicit import (
    Array,
    Distance,
    Part,
    Triple,
    axis,
    both_sides,
    box,
    capsule,
    ellipsoid,
    frame,
    groove,
    intersection,
    polygonise,
    sphere,
    torus,
    wave,
)

from lfssao.scene.mesh import Mesh

CELL = 0.01007  # grid step, scene units: chosen for the face count of the paper's armadillo, 212,574
_SKULL: Triple = (0.02, 1.43, 0.10)
# The head looks a little down and to its left: the snout shows from the front.
_HEAD = frame((5.0, -1.5, 12.0), (0.0, 1.0, 0.0))


def armadillo() -> Mesh:
    """Upright creature that faces +Z and stands on y = 0, without paint as the paper's.

    Returns
    -------
    Mesh
        About 212,574 faces, closed; 1.9 scene units high.
    """
    parts = [*_body(), *_legs(), *_arms(), *_tail(), *_head()]
    axes = (axis(-0.80, 1.00, CELL), axis(-0.02, 1.98, CELL), axis(-0.80, 0.70, CELL))
    vertices, faces = polygonise([*parts, _ground()], axes, relief=_scales)
    lowest = vertices[:, 1].min()
    vertices[:, 1] -= lowest
    return Mesh(vertices, faces, name="armadillo")


def _scales(x: Array, y: Array, z: Array) -> Array:
    """Small scales all over: three waves that cross each other, each over two coordinates only to be fast."""
    fine = 1.0 / 0.046
    a = wave((x + 0.58 * y) * fine)
    b = wave((y + 0.61 * z) * fine)
    c = wave((z - 0.55 * x) * fine)
    return (a + b + c) * 0.0016


def _ground() -> Part:
    """Everything below y = 0, taken away: flat soles."""
    return box((0.0, -0.5, 0.0), (2.0, 0.5, 2.0)).cutting(0.01)


def _rings(direction: Triple, period: float, depth: float, width: float = 0.22) -> Distance:
    """Grooves of ``depth`` across ``direction``, one every ``period`` scene units."""
    dx, dy, dz = (d / period for d in frame(direction, (0.3, 0.9, 0.4))[2])
    return lambda x, y, z: -depth * groove(x * dx + y * dy + z * dz, width)


def _body() -> list[Part]:
    belly = ellipsoid((0.0, 0.70, 0.05), (0.33, 0.37, 0.29))
    chest = ellipsoid((0.0, 1.02, 0.03), (0.27, 0.27, 0.22))
    shell = ellipsoid((0.0, 0.84, -0.08), (0.45, 0.60, 0.42)).with_relief(_scutes, 0.02)
    back = intersection(shell, box((0.0, 0.8, -0.5), (1.0, 1.0, 0.47)), 0.05)
    neck = capsule((0.0, 1.15, 0.02), (0.02, 1.36, 0.07), 0.17, 0.14)
    return [
        belly.with_relief(_belly_plates, 0.02),
        chest.with_relief(_belly_plates, 0.02).joined(0.12),
        neck.with_relief(_rings((0.0, 1.0, 0.2), 0.06, 0.012), 0.02).joined(0.1),
        back.joined(0.015),
    ]


def _belly_plates(x: Array, y: Array, z: Array) -> Array:
    """Plates across the belly that sag in the middle."""
    return -0.014 * groove((y - 0.35 * x * x) / 0.095, 0.16)


def _scutes(x: Array, y: Array, z: Array) -> Array:
    """Shell of overlapping bands: each rises towards its lower edge and is cut into plates."""
    row = (y + 0.25 * z) / 0.105
    over = row - np.floor(row)
    # x / (|x| + |z|) goes like an angle about the body's axis, without an arc tangent.
    around = 9.0 * x / (np.abs(x) + np.abs(z - 0.12) + 0.05)
    plates = groove(around + 0.5 * np.floor(row), 0.13)
    return 0.022 * (1.0 - over) - 0.012 * plates - 0.016 * groove(row, 0.16)


def _legs() -> list[Part]:
    hip: Triple = (0.19, 0.52, 0.02)
    knee: Triple = (0.30, 0.34, 0.12)
    ankle: Triple = (0.27, 0.10, 0.03)
    wrinkles = _rings((0.2, 1.0, 0.0), 0.075, 0.010)
    foot = ellipsoid((0.28, 0.055, 0.14), (0.125, 0.085, 0.20))
    toes = [
        _digit(
            (0.28 + s * 0.075, 0.06, 0.24),
            (0.29 + s * 0.125, 0.05, 0.345),
            (0.29 + s * 0.15, 0.015, 0.45),
            0.05,
        )
        for s in (-1.0, 0.0, 1.0)
    ]
    one = [
        capsule(knee, hip, 0.145, 0.20).joined(0.06),
        capsule(ankle, knee, 0.115, 0.13).with_relief(wrinkles, 0.02).joined(0.05),
        sphere((0.31, 0.35, 0.2), 0.085).with_relief(_rings((0.0, 1.0, 0.6), 0.04, 0.008), 0.01).joined(0.04),
        foot.joined(0.06),
        *[part for toe in toes for part in toe],
    ]
    return both_sides(one)


def _digit(root: Triple, knuckle: Triple, tip: Triple, radius: float) -> list[Part]:
    """Finger or toe from root to knuckle, and the claw from there to the tip."""
    base = tuple(k + 0.15 * (r - k) for k, r in zip(knuckle, root, strict=True))
    return [
        capsule(root, knuckle, radius, 0.85 * radius).joined(0.02),
        capsule((base[0], base[1] + 0.006, base[2]), tip, 0.62 * radius, 0.9 * CELL).joined(0.006),
    ]


def _arms() -> list[Part]:
    raised = _arm((0.29, 1.10, 0.02), (0.57, 1.00, 0.12), (0.64, 1.27, 0.22), (0.05, 0.9, 0.35))
    lowered = _arm((-0.29, 1.10, 0.02), (-0.53, 0.86, 0.10), (-0.43, 0.86, 0.38), (0.15, -0.1, 0.9))
    return raised + lowered


def _arm(shoulder: Triple, elbow: Triple, wrist: Triple, pointing: Triple) -> list[Part]:
    side, up, forward = frame(pointing, (0.0, 0.3, 1.0) if pointing[1] > 0.5 else (0.0, 1.0, 0.0))
    along = frame((wrist[0] - elbow[0], wrist[1] - elbow[1], wrist[2] - elbow[2]), (0.1, 0.4, 0.8))[2]

    def place(s: float, u: float, f: float) -> Triple:
        x, y, z = (w + s * a + u * b + f * c for w, a, b, c in zip(wrist, side, up, forward, strict=True))
        return x, y, z

    parts = [
        sphere(shoulder, 0.145).joined(0.06),
        capsule(shoulder, elbow, 0.125, 0.095).joined(0.04),
        capsule(elbow, wrist, 0.115, 0.075).with_relief(_rings(along, 0.055, 0.009), 0.01).joined(0.03),
        ellipsoid(place(0.0, 0.0, 0.06), (0.095, 0.06, 0.10), (side, up, forward)).joined(0.04),
    ]
    for s in (-1.5, -0.5, 0.5, 1.5):
        reach = 0.02 if abs(s) > 1.0 else 0.045
        parts += _digit(
            place(s * 0.05, 0.0, 0.09),
            place(s * 0.072, 0.012, 0.155 + reach),
            place(s * 0.085, -0.05, 0.27 + reach),
            0.034,
        )
    return parts


def _tail() -> list[Part]:
    bends: list[Triple] = [
        (0.0, 0.42, -0.34), (0.16, 0.20, -0.56), (0.44, 0.10, -0.56), (0.70, 0.075, -0.36),
        (0.86, 0.11, -0.10),
    ]  # fmt: skip
    radii = (0.19, 0.135, 0.10, 0.065, 0.02)
    parts = []
    for k in range(4):
        start = bends[k]
        end = bends[k + 1]
        along = (end[0] - start[0], end[1] - start[1], end[2] - start[2])
        piece = capsule(start, end, radii[k], radii[k + 1])
        parts.append(piece.with_relief(_rings(along, 0.055, 0.013), 0.015).joined(0.03))
    return parts


def _in_head(side: float, up: float, forward: float) -> Triple:
    """World place of a point given in the head's own axes about the skull's middle."""
    x, y, z = (c + side * s + up * u + forward * f for c, s, u, f in zip(_SKULL, *_HEAD, strict=True))
    return x, y, z


def _head() -> list[Part]:
    skull = ellipsoid(_SKULL, (0.165, 0.15, 0.19), _HEAD)
    muzzle = capsule(_in_head(0.0, -0.02, 0.12), _in_head(0.0, -0.055, 0.43), 0.115, 0.052)
    helmet = ellipsoid(_in_head(0.0, 0.055, -0.02), (0.155, 0.13, 0.19), _HEAD)
    plates = _rings(_HEAD[2], 0.062, 0.014)
    mouth = ellipsoid(_in_head(0.0, -0.105, 0.36), (0.10, 0.012, 0.19), _HEAD)
    jaw = capsule(_in_head(0.0, -0.10, 0.06), _in_head(0.0, -0.125, 0.36), 0.085, 0.035)
    nose = ellipsoid(_in_head(0.0, -0.045, 0.475), (0.042, 0.034, 0.03), _HEAD)
    return [
        skull.joined(0.06),
        muzzle.with_relief(_rings(_HEAD[2], 0.05, 0.006), 0.01).joined(0.06),
        jaw.joined(0.03),
        mouth.cutting(0.01),
        helmet.with_relief(plates, 0.02).joined(0.01),
        nose.joined(0.012),
        *[part for side in (-1.0, 1.0) for part in _half_face(side)],
    ]


def _half_face(side: float) -> list[Part]:
    root = _in_head(side * 0.10, 0.12, -0.03)
    middle = _in_head(side * 0.17, 0.31, -0.06)
    blade = frame((0.3 * side + _HEAD[2][0], 0.0, _HEAD[2][2]), (0.18 * side, 1.0, -0.1))
    hollow = tuple(m + 0.042 * f for m, f in zip(middle, blade[2], strict=True))
    eye = _in_head(side * 0.104, 0.03, 0.140)
    gaze = tuple(0.75 * side * s + 0.1 * u + f for s, u, f in zip(*_HEAD, strict=True))
    return [
        ellipsoid(_in_head(side * 0.12, 0.03, 0.15), (0.045, 0.045, 0.07), _HEAD).cutting(0.03),
        sphere(eye, 0.036).joined(0.004),
        torus(eye, (gaze[0], gaze[1], gaze[2]), 0.040, 0.013).joined(0.012),
        capsule(_in_head(side * 0.07, 0.078, 0.18), _in_head(side * 0.135, 0.07, 0.08), 0.018, 0.022).joined(0.05),
        sphere(_in_head(side * 0.02, -0.04, 0.503), 0.014).cutting(0.006),
        capsule(root, middle, 0.06, 0.05).joined(0.04),
        ellipsoid(middle, (0.085, 0.215, 0.045), blade).joined(0.03),
        ellipsoid((hollow[0], hollow[1], hollow[2]), (0.055, 0.165, 0.045), blade).cutting(0.015),
    ]
