"""Surfaces with known answers and the textures that views have of them, in closed form: no ray caster, no mesh.

World space has the viewers towards +z. Each surface is a few pieces of planes and spheres; the feature that it is
named after lies at the origin, its edges run along y. ``buffers(name, sight)`` intersects the rays of a sight with it
in float64 and rounds once. ``height`` is the surface seen from straight above, which is all that a depth texture knows
of it; ``mesh`` is the same surface in triangles, for those who cast rays.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from math import inf, sqrt

import numpy as np
import trimesh

from lfssao import Buffers, Camera, Display, Mesh, Module, View

WIDTH = 48
HEIGHT = 36
STEP = 0.125  # height of the step
BALL = 0.125  # radius of the sphere, which touches the plane at the origin
TILT = (0.25, -0.375)  # dz/dx, dz/dy of the tilted plane
_FAR = 4.0  # how far meshes go on


# Rays


@dataclass(frozen=True)
class Sight:
    """A view, and the rays of its texels as world points origin + t direction, near < t < far; t is z of cast space."""

    view: View
    origin: np.ndarray
    direction: np.ndarray
    near: float
    far: float
    depth: Callable[[np.ndarray], np.ndarray]


def texel_centres(width, height):
    v, u = np.mgrid[:height, :width] + 0.5
    return u, v


def camera(projection, width=WIDTH, height=HEIGHT):
    """From (0, 0, 2) straight down on the origin, 0.75 high there; planes at 1 and 3."""
    near = 1.0
    far = 3.0
    view = Camera(projection, (0, 0, 2), (0, 0, 0), (0, 1, 0), 0.75, near, far).view(width, height)
    u, v = texel_centres(width, height)
    x = (u - width / 2) * 0.75 / height
    y = (height / 2 - v) * 0.75 / height
    zero = np.zeros_like(x)
    one = np.ones_like(x)
    if projection == "orthographic":
        origin = np.stack([x, y, 2 * one], -1)
        direction = np.stack([zero, zero, -one], -1)
        return Sight(view, origin, direction, near, far, lambda t: (t - near) / (far - near))
    origin = np.stack([zero, zero, 2 * one], -1)
    direction = np.stack([x / 2, y / 2, -one], -1)
    return Sight(view, origin, direction, near, far, lambda t: far / (far - near) * (1 - near / t))


def module(diffuser, width=WIDTH, height=HEIGHT):
    """A module at (0.3, 0.1, 0.9) of a 1 m x 0.75 m screen, observers at (0.05, -2); physical (x, y, z) is (x, y, -z).

    The linear diffuser has the crossed slits' mapping, the conical one that of any display.
    """
    m_x = 0.3
    m_y = 0.1
    m_z = 0.9
    y_o = 0.05
    z_o = -2.0
    roi = ((-0.5, -0.375, -0.5), (0.5, 0.375, 0.5))
    display = Display("analytic", 1.0, 0.75, y_o, z_o, (Module(m_x, m_y, m_z, width, height),), roi, diffuser)
    u, v = texel_centres(width, height)
    s_x = u / width - 0.5
    s_y = 0.75 * (0.5 - v / height)
    slope_x = (m_x - s_x) / m_z
    far = m_z
    if diffuser == "conical":  # DESIGN section 2: the ray meets the observers at s_x + (s_x - m_x) h_e / h_m
        h_m = np.sqrt((s_y - m_y) ** 2 + m_z**2)
        h_e = np.sqrt((s_y - y_o) ** 2 + z_o**2)
        slope_x = (s_x - m_x) * h_e / h_m / z_o
        far = 0.75
    slope_y = (y_o - s_y) / z_o
    zero = np.zeros_like(s_x)
    one = np.ones_like(s_x)
    view = display.view(0, np.diag([1.0, 1.0, -1.0, 0.0])[:3])
    return Sight(
        view, np.stack([s_x, s_y, zero], -1), np.stack([slope_x, slope_y, -one], -1), z_o, far, lambda t: t
    )  # fmt: skip


SIGHTS = {
    "orthographic": lambda *size: camera("orthographic", *size),
    "perspective": lambda *size: camera("perspective", *size),
    "crossed slits": lambda *size: module("linear", *size),
    "display": lambda *size: module("conical", *size),
}


# Surfaces


def plane(normal, distance, part=lambda p: True):
    """The part of the plane normal . p = distance where ``part`` holds: a function of rays that gives t and normals."""

    def meet(origin, direction):
        t = (distance - origin @ normal) / (direction @ normal)
        with np.errstate(invalid="ignore"):
            there = np.isfinite(t) & part(origin + t[..., None] * direction)
        return np.where(there, t, inf), np.broadcast_to(normal, origin.shape)

    return meet


def sphere(middle, radius):
    """The side of a sphere that rays from outside meet."""

    def meet(origin, direction):
        a = (direction**2).sum(-1)
        b = ((origin - middle) * direction).sum(-1)
        c = ((origin - middle) ** 2).sum(-1) - radius**2
        with np.errstate(invalid="ignore"):
            t = (-b - np.sqrt(b * b - a * c)) / a
        t = np.where(np.isnan(t), inf, t)
        point = origin + np.where(t < inf, t, 0)[..., None] * direction
        return t, (point - middle) / radius

    return meet


@dataclass(frozen=True)
class Surface:
    """Pieces, the surface from straight above as a function of x and y, and its mesh."""

    pieces: tuple[Callable, ...]
    height: Callable[[np.ndarray, np.ndarray], np.ndarray]
    mesh: Callable[[], Mesh]


def strip(*corners):
    """Rectangles along y between points (x, z), as a mesh."""
    pairs = list(pairwise(corners))
    quads = [[(x, y, z) for x, z in pair for y in (-_FAR, _FAR)] for pair in pairs]
    faces = [[4 * k + n for n in face] for k in range(len(pairs)) for face in ((0, 2, 1), (1, 2, 3))]
    return Mesh(np.reshape(quads, (-1, 3)), np.array(faces))


def tilted_mesh():
    corners = [(x, y, TILT[0] * x + TILT[1] * y) for x in (-_FAR, _FAR) for y in (-_FAR, _FAR)]
    return Mesh(np.array(corners), np.array([(0, 2, 1), (1, 2, 3)]))


def sphere_mesh(times=5):
    """The sphere in 20 * 4^times triangles, corners on it, and the plane."""
    ball = trimesh.creation.icosphere(times, BALL).apply_translation((0, 0, BALL))
    ground = strip((-_FAR, 0.0), (_FAR, 0.0))
    vertices = np.concatenate([ball.vertices, ground.vertices])
    return Mesh(vertices, np.concatenate([ball.faces, ground.faces + len(ball.vertices)]))


UP = np.array([0.0, 0.0, 1.0])
HALF = sqrt(0.5)
TILTED = np.array([-TILT[0], -TILT[1], 1.0]) / sqrt(1 + TILT[0] ** 2 + TILT[1] ** 2)
RIGHT, LEFT = np.array([-HALF, 0.0, HALF]), np.array([HALF, 0.0, HALF])  # normals of z = x and of z = -x

SURFACES = {
    "facing plane": Surface((plane(UP, 0.0),), lambda x, y: 0 * x, lambda: strip((-_FAR, 0.0), (_FAR, 0.0))),
    "tilted plane": Surface((plane(TILTED, 0.0),), lambda x, y: TILT[0] * x + TILT[1] * y, tilted_mesh),
    "concave crease": Surface(
        (plane(RIGHT, 0.0, lambda p: p[..., 0] >= 0), plane(LEFT, 0.0, lambda p: p[..., 0] < 0)),
        lambda x, y: abs(x),
        lambda: strip((-_FAR, _FAR), (0.0, 0.0), (_FAR, _FAR)),
    ),
    "convex crease": Surface(
        (plane(LEFT, 0.0, lambda p: p[..., 0] >= 0), plane(RIGHT, 0.0, lambda p: p[..., 0] < 0)),
        lambda x, y: -abs(x),
        lambda: strip((-_FAR, -_FAR), (0.0, 0.0), (_FAR, -_FAR)),
    ),
    "step": Surface(
        (
            plane(UP, 0.0, lambda p: p[..., 0] < 0),
            plane(UP, STEP, lambda p: p[..., 0] >= 0),
            plane(np.array([-1.0, 0.0, 0.0]), 0.0, lambda p: (p[..., 2] >= 0) & (p[..., 2] < STEP)),
        ),
        lambda x, y: np.where(x < 0, 0.0, STEP),
        lambda: strip((-_FAR, 0.0), (0.0, 0.0), (0.0, STEP), (_FAR, STEP)),
    ),
    "sphere on a plane": Surface(
        (plane(UP, 0.0), sphere(np.array([0.0, 0.0, BALL]), BALL)),
        lambda x, y: np.where(x * x + y * y < BALL**2, BALL + np.sqrt(np.maximum(BALL**2 - x * x - y * y, 0)), 0.0),
        sphere_mesh,
    ),
}


def buffers(name, sight, dtype=np.float64, hole=None):
    """Textures of a surface in a sight; ``hole``, a boolean (H, W), makes background of some texels."""
    t = np.full(sight.origin.shape[:2], inf)
    normals = np.zeros_like(sight.origin)
    with np.errstate(divide="ignore", invalid="ignore"):
        for piece in SURFACES[name].pieces:
            at, normal = piece(sight.origin, sight.direction)
            first = (sight.near < at) & (at < np.minimum(t, sight.far))
            t[first], normals[first] = at[first], normal[first]
    t[np.zeros_like(t, bool) if hole is None else hole] = inf
    there = t < inf
    normals = np.where(((normals * sight.direction).sum(-1) > 0)[..., None], -normals, normals) * there[..., None]
    safe = np.where(there, t, 0.5 * (sight.near + sight.far))
    positions = np.where(there[..., None], sight.origin + safe[..., None] * sight.direction, inf)
    depth = np.where(there, sight.depth(safe), inf)
    return Buffers(sight.view, depth.astype(dtype), positions.astype(dtype), (normals + 0.0).astype(dtype))


def nearest(buffers_, x, y=0.0):
    """The texel whose surface point is nearest to (x, y), as (j, i), and that point."""
    with np.errstate(invalid="ignore"):
        away = (buffers_.positions[..., 0] - x) ** 2 + (buffers_.positions[..., 1] - y) ** 2
    j, i = np.unravel_index(np.argmin(away), away.shape)
    return int(j), int(i), buffers_.positions[j, i]
