"""Ray-cast ambient occlusion, what the estimators from textures estimate: the mesh itself around each visible point.

    AO(P) = integral over the half space above P of w(omega) (1 - rho(t(P, omega) / R)) d omega

t is the distance to the first triangle, rho rises from 0 to 1 at R (VO section 3), beyond which nothing occludes; w is
cos(theta) / pi, or 1 / (2 pi). (VO writes the open share, and rho itself; occlusion is one minus that.)

Exact answers for constant falloff; c = d / R, 0 for an infinite radius; S(c) = (arccos c - c sqrt(1 - c^2)) / pi:

===========================================  ========================================  ===============================
surface, from P                              cosine                                    uniform
===========================================  ========================================  ===============================
plane, convex crease, top of a step          0                                         0
face of a right-angle crease, d to the other  S(c): the other's directions, projected   (1 - c) / 2, half a zone
                                             along n, fill a segment of the disk
floor at a before a wall of height h, R inf  (1 - a / sqrt(a^2 + h^2)) / 2             arctan(h / a) / pi, a lune
plane under a sphere of radius s, R inf,     (s / D)^3, as (s / D)^2 of a sphere seen  1 - sqrt(1 - (s / D)^2),
P at distance D from its middle              whole times the cosine of its middle      its solid angle over 2 pi
===========================================  ========================================  ===============================

With linear falloff a crease gives S(c) - (2 c / pi) (ln((1 + sqrt(1 - c^2)) / c) - sqrt(1 - c^2)) by cosine and
(1 - c + c ln c) / 2 uniformly: at direction omega_x across the crease, t / R = c / omega_x.

The bits: rays, hits and sums are IEEE float64 in a written order, so texture and error have equal bits on every machine
for equal textures, mesh and seed. Embree is not asked.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lfssao.errors import InputError
from lfssao.estimators.buffers import Buffers
from lfssao.passes import check_radius
from lfssao.scene.mesh import Mesh
from lfssao.tree import TriangleTree

WEIGHTINGS = ("cosine", "uniform")
FALLOFFS = ("constant", "linear", "quadratic")

# Rows that are cast in one call: between calls the work can be interrupted.
_ROWS = 16


@dataclass(frozen=True, eq=False)
class GroundTruth:
    """Ray-cast occlusion of one view.

    Attributes
    ----------
    texture : (H, W) float64
        Occlusion, 0 open to 1 covered; 0 where there is no surface or no normal.
    error : (H, W) float64
        Its standard error, from the spread of the rounds' means; 0 where all rounds agree.
    rays : (H, W) int64
        How many rays each texel has cast.
    """

    texture: NDArray[np.float64]
    error: NDArray[np.float64]
    rays: NDArray[np.int64]


class Occluders:
    """A mesh ready to be met by rays in world space; its tree is built once.

    Parameters
    ----------
    mesh : Mesh
        What occludes.
    """

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        self.tree = TriangleTree(mesh.vertices, mesh.faces)


def ray_cast_occlusion(
    occluders: Occluders,
    buffers: Buffers,
    radius: float,
    weighting: str = "cosine",
    falloff: str = "constant",
    tolerance: float = 0.005,
    rounds: tuple[int, int] = (8, 128),
    strata: int = 8,
    offset: float = 1e-3,
    seed: int = 0,
) -> GroundTruth:
    """Ambient occlusion of one view by rays through the mesh, with its standard error.

    Each texel casts rounds of strata^2 rays, one in each cell of a grid over (u, v), which directions are made of; the
    rounds are independent, so that their spread gives the error. Both sides of triangles occlude.

    Parameters
    ----------
    occluders : Occluders
        The scene.
    buffers : Buffers
        The view's textures; depth says where there is a surface, positions and normals where rays begin.
    radius : float
        R, world units; infinity with falloff 'constant'.
    weighting : str
        'cosine' or 'uniform': how directions are weighed.
    falloff : str
        1 - rho at t / R: 'constant' 1, 'linear' 1 - t / R, 'quadratic' 1 - (t / R)^2.
    tolerance : float
        A texel casts rounds until its standard error is no more than this. (Texels stop at an error that may be small
        by chance, the more so the fewer the least rounds are.)
    rounds : (int, int)
        Rounds of each texel, at least, 2 or more, and at most.
    strata : int
        Cells along an edge of the grid, 1 to 256.
    offset : float
        Rays begin at P + offset R n (offset times the diagonal of the mesh's box for an infinite R): n is the unit
        normal. It has to be more than positions are off the mesh: float32 positions some 1e-7 of their size.
    seed : int
        0 to 2**64 - 1, key of the random numbers (Philox4x32-10).

    Raises
    ------
    InputError
        If normals are missing, or a number or a name is wrong.
    """
    from lfssao.kernels import truth  # late: compiled for this alone

    if buffers.normals is None:
        raise InputError("ray-cast occlusion reads normals, and there is no normals texture")
    if not (radius == np.inf and falloff == "constant"):
        check_radius(radius)
    for name, value, choices in (("weighting", weighting, WEIGHTINGS), ("falloff", falloff, FALLOFFS)):
        if value not in choices:
            raise InputError(f"{name} is '{value}': choose one of {', '.join(choices)}")
    if not 2 <= rounds[0] <= rounds[1] <= 2**16 or not 1 <= strata <= 256:
        raise InputError(f"rounds {rounds} must be 2 <= least <= most <= 65536, and strata {strata} from 1 to 256")
    if not tolerance >= 0 or not 0 <= offset < np.inf:
        raise InputError(f"tolerance {tolerance} and offset {offset} must be at least 0")
    if not 0 <= seed < 2**64:
        raise InputError(f"the seed is {seed}, it must be a whole number between 0 and 2**64 - 1")
    low, high = occluders.mesh.bounds
    step = offset * (radius if radius < np.inf else float(np.sqrt(np.sum((high - low) ** 2))))
    shape, tree = buffers.depth.shape, occluders.tree
    made = GroundTruth(np.empty(shape), np.empty(shape), np.empty(shape, np.int64))
    textures = [np.ascontiguousarray(a) for a in (buffers.depth, buffers.positions, buffers.normals)]
    for first in range(0, shape[0], _ROWS):
        truth.ray_cast_rows(
            first, min(first + _ROWS, shape[0]), *textures, float(radius), step, WEIGHTINGS.index(weighting),
            FALLOFFS.index(falloff), strata, *rounds, float(tolerance), np.uint64(seed), tree.corners, tree.boxes,
            made.texture, made.error, made.rays,
        )  # fmt: skip
    return made
