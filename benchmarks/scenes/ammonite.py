"""An ammonite: Raup's model of the coiled shell, with ribs."""

from math import sqrt

import numpy as np
from assembly import sky_lit, vertex_normals
from implicit import wave
from numpy.typing import NDArray

from lfssao.core.elementary import cbrt, sincospi
from lfssao.scene.mesh import Mesh, Paint

FloatArray = NDArray[np.float64]

# Raup's parameters (D. M. Raup, "Geometric analysis of shell coiling", Journal of Paleontology 40, 1966).
EXPANSION = 1.8  # W: by how much a whorl's size grows in one turn
AXIS_DISTANCE = 0.5  # D: the tube's inner margin from the coiling axis over its outer margin
TRANSLATION = 0.0  # T: how far the tube moves along the axis for what it moves away from it; 0 is planispiral
SHAPE = 0.92  # S: the generating curve's width along the axis over its height away from it

RIBS_PER_TURN = 24
STEPS_PER_RIB = 6
STEPS_PER_TURN = RIBS_PER_TURN * STEPS_PER_RIB
RINGS = 615  # generating curves, of which the last LIP_RINGS lie inside the mouth
LIP_RINGS = 9
STEPS = 24  # points of a generating curve
OUTER_RADIUS = 0.8  # of the mouth's outer margin from the coiling axis, scene units
RIB_HEIGHT = 0.115  # over the generating curve's radius

_CREAM = (0.80, 0.66, 0.46)
_BROWN = (0.42, 0.20, 0.09)
_INSIDE = (0.30, 0.20, 0.14)


def ammonite() -> Mesh:
    """Planispiral shell that shows one side to +Z and stands with its outermost whorl on y = 0.

    Returns
    -------
    Mesh
        29,520 faces (2 x RINGS x STEPS), closed, with linear RGB at the vertices; about 1.4 scene units wide.
        Neighbouring whorls run through each other where they touch, as Raup's model has it.
    """
    vertices, ridge = _shell()
    faces = _tube_faces()
    lowest = vertices[:, 1].min()
    vertices[:, 1] -= lowest
    colors = sky_lit(_albedo(ridge), vertex_normals(vertices, faces))
    return Mesh(vertices, faces, Paint.from_vertex_colors(colors, len(faces)), name="ammonite")


def _shell() -> tuple[FloatArray, FloatArray]:
    """Vertices (V, 3): all generating curves and the two end points; and the ribs' height there, -1 to 1."""
    number, depth = _ring_positions()
    outer = _outer_radii(number)
    turn = np.array([sincospi(2.0 * (n / STEPS_PER_TURN) - 0.25) for n in number.tolist()])
    curve = np.array([sincospi(2.0 * k / STEPS) for k in range(STEPS)])  # sine: along the axis, cosine: outwards
    axial = curve[None, :, 0]
    outward = curve[None, :, 1]

    # Ribs lean forwards from the umbilicus to the venter, and fade on the side that the next whorl covers.
    phase = number[:, None] / STEPS_PER_RIB - 0.55 * outward * outward * outward
    strength = np.minimum(np.maximum(0.9 + 0.9 * outward, 0.0), 1.0)
    ridge = wave(phase) * strength
    swell = (1.0 - depth)[:, None] * (1.0 + RIB_HEIGHT * ridge)

    # The first whorl has nothing to coil around: it comes as near to the axis as leaves no hole to be seen.
    inner = AXIS_DISTANCE * np.minimum(np.maximum(number / STEPS_PER_TURN - 1.0, 0.01), 1.0)
    middle = (outer * (1.0 + inner) / 2.0)[:, None]
    radius = (outer * (1.0 - inner) / 2.0)[:, None]
    from_axis = middle + radius * swell * outward
    along_axis = SHAPE * radius * swell * axial + TRANSLATION * middle
    sine = turn[:, 0:1]
    cosine = turn[:, 1:2]
    grid = np.stack([cosine * from_axis, sine * from_axis, np.broadcast_to(along_axis, from_axis.shape)], axis=2)
    ends = np.stack([_middle_of(grid[0]), _middle_of(grid[-1])])
    vertices = np.concatenate([grid.reshape(-1, 3), ends])
    darkness = np.where(depth[:, None] > 0.0, -2.0, ridge).ravel()
    return vertices, np.concatenate([darkness, [0.0, -2.0]])


def _ring_positions() -> tuple[FloatArray, FloatArray]:
    """Places of the rings along the spiral, in steps; and how much smaller than the tube the lip's are.

    Past the mouth's edge the rings go back into the tube and shrink: a hollow mouth from one closed surface.
    """
    tube = RINGS - LIP_RINGS
    back = np.arange(1, LIP_RINGS + 1, dtype=np.float64)
    number = np.concatenate([np.arange(tube, dtype=np.float64), tube - 1.0 - 1.6 * (back - 1.0)])
    depth = np.concatenate([np.zeros(tube), 0.10 + 0.012 * back])
    return number, depth


def _outer_radii(number: FloatArray) -> FloatArray:
    """Distance of each ring's outer margin from the axis: it grows by EXPANSION in a turn, scene units."""
    # A turn has 144 = 2**4 * 3**2 steps: the growth in one step comes from four square and two cube roots.
    step_growth = cbrt(cbrt(sqrt(sqrt(sqrt(sqrt(EXPANSION))))))
    last = RINGS - LIP_RINGS - 1
    radii = [OUTER_RADIUS]
    for _ in range(last):
        radii.append(radii[-1] / step_growth)
    table = np.array(radii[::-1])
    low = np.minimum(np.floor(number).astype(np.int64), last - 1)
    fraction = number - low
    between: FloatArray = table[low] * (1.0 - fraction) + table[low + 1] * fraction
    return between


def _middle_of(ring: FloatArray) -> FloatArray:
    """Point halfway between the curve's innermost and outermost points."""
    middle: FloatArray = (ring[0] + ring[STEPS // 2]) / 2.0
    return middle


def _tube_faces() -> NDArray[np.int32]:
    """Two triangles for each cell of the grid and a fan at either end, (2 RINGS STEPS, 3) int32."""
    ring = np.arange(RINGS - 1)[:, None] * STEPS
    step = np.arange(STEPS)[None, :]
    following = (step + 1) % STEPS
    a = (ring + step).ravel()
    b = (ring + following).ravel()
    c = b + STEPS
    d = a + STEPS
    first = RINGS * STEPS
    last = RINGS * STEPS + 1
    s = step.ravel()
    n = following.ravel()
    end = (RINGS - 1) * STEPS
    faces = [
        np.stack([a, c, b], axis=1),
        np.stack([a, d, c], axis=1),
        np.stack([np.full(STEPS, first), s, n], axis=1),
        np.stack([np.full(STEPS, last), end + n, end + s], axis=1),
    ]
    return np.concatenate(faces).astype(np.int32)


def _albedo(ridge: FloatArray) -> FloatArray:
    """Cream on the ribs, brown between them, dark within the mouth (ridge -2), (V, 3)."""
    share = np.minimum(np.maximum(0.5 + 0.5 * ridge, 0.0), 1.0)[:, None]
    shell = share * np.array(_CREAM) + (1.0 - share) * np.array(_BROWN)
    return np.where(ridge[:, None] < -1.5, np.array(_INSIDE), shell)
