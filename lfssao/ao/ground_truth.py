"""Ray-cast ambient occlusion, which the estimators from textures estimate: the mesh itself around each visible point.

    AO(P) = integral over the half space above P of w(omega) (1 - rho(t(P, omega) / R)) d omega

t is the distance to the first triangle, rho rises from 0 to 1 at R (VO section 3), beyond which nothing occludes; w is
cos(theta) / pi, or 1 / (2 pi). (VO writes the open fraction, and rho itself; occlusion is one minus that.)

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

The user chooses what finds the hits. With our own tree rays, hits and sums are IEEE float64 in a written order, so that
texture and error have equal bits on every machine for equal textures, mesh and seed. With Embree the rays and sums are
the same, but hits are decided in float32, about the middle of the mesh: that takes less time, and grazing rays may hit
otherwise than in the tree, and on other processors.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from lfssao.ao.kernels import truth
from lfssao.ao.kernels.truth import Begun, Cast
from lfssao.ao.ssao import check_radius
from lfssao.ao.textures import Buffers
from lfssao.core.affine import unit_vectors
from lfssao.core.arguments import as_number, check_seed, check_whole
from lfssao.core.threads import in_chunks
from lfssao.errors import InputError, check_choice, check_type, shown
from lfssao.gbuffer.trees import CentredScene, TriangleTree
from lfssao.scene.builtin import find_scene
from lfssao.scene.mesh import Mesh
from lfssao.summary import Arrayed, Table, size_of

WEIGHTINGS = ("cosine", "uniform")
FALLOFFS = ("constant", "linear", "quadratic", "cubic", "shell")
INTERSECTORS = ("tree", "embree")

# Rays of a thread at a time: long enough to hide a call of Embree; between calls the work can be interrupted.
_BATCH = 65_536
# How far off the surface rays must begin for Embree, in the unit of its scene, whose coordinates are below 1: the point
# and the triangle are each rounded by up to 2^-25 in x, y and z, and its distance is worked out from numbers like that.
_CLEAR = 2.0**-21


@dataclass(frozen=True, eq=False, repr=False)
class GroundTruth(Arrayed, Table):
    """Ray-cast occlusion of one view; NumPy takes it for its texture.

    Attributes
    ----------
    texture : (H, W) float64
        Occlusion, 0 open to 1 covered; 0 where there is no surface or no normal.
    error : (H, W) float64
        Its standard error, from the spread of the rounds' means; 0 where all rounds agree.
    rays : (H, W) int64
        Number of rays that each texel has cast.
    bent : (H, W, 3) float64 or None
        Bent normals if they were asked for: unit vectors in world space of the mean of the rays' directions, each times
        its visibility; 0 where there is no surface, no normal or no light.

    Examples
    --------
    >>> display = lfssao.find_display("virtual").with_resolution(32, 24)
    >>> textures = lfssao.render("corner", display, lfssao.Settings((0.1,), normals="geometric"))[0]
    >>> buffers = lfssao.Buffers.of(textures.gbuffer, textures.view)
    >>> truth = lfssao.ray_cast_occlusion(lfssao.Occluders("corner"), buffers, radius=0.1)
    >>> bool(truth.error.max() < 0.06)
    True
    """

    texture: NDArray[np.float64]
    error: NDArray[np.float64]
    rays: NDArray[np.int64]
    bent: NDArray[np.float64] | None = None

    def _array(self) -> NDArray[np.float64]:
        return self.texture

    def _facts(self) -> dict[str, object]:
        numbers = {"mean": f"{self.texture.mean():.3g}", "largest error": f"{self.error.max():.2g}"}
        return {"texels": size_of(self.texture), **numbers, "rays": f"{self.rays.sum():,}"}


class Occluders:
    """A mesh ready for rays in world space; tree and Embree's scene are built once, when first used.

    >>> occluders = lfssao.Occluders("corner")
    """

    def __init__(self, mesh: Mesh | str | Path) -> None:
        self.mesh = find_scene(mesh)

    @cached_property
    def tree(self) -> TriangleTree:
        """Our own tree, float64."""
        return TriangleTree(self.mesh.vertices, self.mesh.faces)

    @cached_property
    def embree(self) -> CentredScene:
        """Embree's scene, float32."""
        return CentredScene(self.mesh)


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
    intersector: str = "tree",
    bent: bool = False,
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
        1 - rho at t / R: 'constant' 1, 'linear' 1 - t / R, 'quadratic' 1 - (t / R)^2, 'cubic' 1 - (t / R)^3; 'shell' as
        of max(t / R, 0.8), over 1 - 0.8^3. With uniform weighting the last two are the parts of VO's ball and of LF's
        shell, 0.8 R to R, that lie beyond the hits.
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
    intersector : str
        Finder of the triangles that rays hit: 'tree', our own in float64, with equal bits on every machine; 'embree',
        in float32: no promise of bits, and rays have to begin 5e-7 of the mesh's size off the surface or more.
    bent : bool
        Whether to make bent normals, too (``lfssao.ao.bent``).

    Raises
    ------
    InputError
        If normals are missing, a number or a name is wrong, or rays begin too near to the surface for Embree.
    MissingPackageError
        If Embree is asked for and embreex is not installed.

    Examples
    --------
    >>> display = lfssao.find_display("virtual").with_resolution(32, 24)
    >>> textures = lfssao.render("corner", display, lfssao.Settings((0.1,), normals="geometric"))[0]
    >>> buffers = lfssao.Buffers.of(textures.gbuffer, textures.view)
    >>> truth = lfssao.ray_cast_occlusion(lfssao.Occluders("corner"), buffers, radius=0.1)
    >>> truth.texture.shape
    (24, 32)
    """
    check_type("occluders", occluders, Occluders)
    check_type("buffers", buffers, Buffers)
    if buffers.normals is None:
        raise InputError("ray-cast occlusion reads normals, and there is no normals texture")
    check_choice("weighting", weighting, WEIGHTINGS)
    check_choice("falloff", falloff, FALLOFFS)
    check_choice("intersector", intersector, INTERSECTORS)
    if not (as_number(radius) == np.inf and falloff == "constant"):
        check_radius(radius)
    if not isinstance(rounds, tuple | list) or len(rounds) != 2:
        raise InputError(f"rounds is {shown(rounds)}, it must be the least and the most number of rounds")
    most = check_whole("most rounds", rounds[1], 2, 2**16)
    rounds = check_whole("least rounds", rounds[0], 2, most), most
    strata = check_whole("strata", strata, 1, 256)
    seed = check_seed("seed", seed)
    if not as_number(tolerance) >= 0 or not 0 <= as_number(offset) < np.inf:
        raise InputError(f"tolerance {shown(tolerance)} and offset {shown(offset)} must be at least 0")
    low, high = occluders.mesh.bounds
    step = offset * (radius if radius < np.inf else float(np.sqrt(np.sum((high - low) ** 2))))
    names = WEIGHTINGS.index(weighting), FALLOFFS.index(falloff)
    cast = Cast(float(radius), step, *names, strata, *rounds, float(tolerance), np.uint64(seed))
    scene = occluders.tree if intersector == "tree" else occluders.embree
    if isinstance(scene, CentredScene) and cast.radius > 0 and cast.step < _CLEAR * scene.unit:
        raise InputError(
            f"rays begin {cast.step:.3g} off the surface, and Embree's float32 needs {_CLEAR * scene.unit:.3g} in this "
            "scene: choose a larger offset or the intersector 'tree'"
        )
    positions, normals = (np.ascontiguousarray(a).reshape(-1, 3) for a in (buffers.positions, buffers.normals))
    seen = np.flatnonzero(buffers.depth < np.inf)
    shape = buffers.depth.shape
    made = GroundTruth(np.zeros(shape), np.zeros(shape), np.zeros(shape, np.int64))
    open_sums = np.zeros((*shape, 3)) if bent else None

    def work(start: int, stop: int) -> None:
        n = stop - start
        begun = Begun(np.empty(n, np.int64), np.empty((n, 3)), np.empty((n, 3, 3)))
        n = truth.begin_texels(seen[start:stop], positions, normals, cast.step, begun)
        sums = np.zeros((n, 3)) if bent else None
        found = _rounds(scene, cast, begun, n, sums)
        for texture, values in zip((made.texture, made.error, made.rays), found, strict=True):
            texture.reshape(-1)[begun.texels[:n]] = values
        if open_sums is not None:
            open_sums.reshape(-1, 3)[begun.texels[:n]] = sums

    in_chunks(work, len(seen), max(_BATCH // strata**2, 1), numba.get_num_threads())
    return made if open_sums is None else replace(made, bent=unit_vectors(open_sums))


def _rounds(
    scene: TriangleTree | CentredScene, cast: Cast, begun: Begun, n: int, sums: NDArray[np.float64] | None
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Cast rounds from the first n texels until each is done: occlusion, standard error and rays, (n,) each.

    sums: (n, 3), in and out, of the rays' directions, each times its visibility; None where nobody asks.
    """
    totals = np.zeros(n)
    squares = np.zeros(n)
    errors = np.zeros(n)
    done = np.zeros(n, np.int64)
    chosen = np.arange(n)
    number = 0
    while len(chosen) and number < cast.most:
        distances, far = _distances(scene, cast, begun, chosen, number)
        truth.add_round(chosen, number, cast.strata, distances, far, cast.falloff, totals, squares, errors)
        if sums is not None:
            truth.add_directions(chosen, begun, number, cast, distances, far, sums)
        number += 1
        done[chosen] = number
        if number >= cast.least:
            chosen = chosen[errors[chosen] > cast.tolerance]
    return totals / done, errors, done * cast.strata**2


def _distances(
    scene: TriangleTree | CentredScene, cast: Cast, begun: Begun, chosen: NDArray[np.int64], number: int
) -> tuple[NDArray[Any], float]:
    """How far the rays of a round go to their hits, infinity for none, and the radius in the same unit."""
    rays = len(chosen) * cast.strata**2
    if isinstance(scene, TriangleTree):
        distances = np.empty(rays)
        truth.tree_distances(chosen, begun, number, cast, scene.arrays, distances)
        return distances, cast.radius
    (origins, directions), far = np.empty((2, rays, 3), np.float32), cast.radius / scene.unit
    truth.write_round(chosen, begun, number, cast, scene.middle, scene.unit, origins, directions)
    return scene.distances(origins, directions, far, FALLOFFS[cast.falloff] == "constant"), far
