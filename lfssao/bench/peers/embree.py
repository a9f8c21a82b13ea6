"""Ray-cast occlusion by Embree's occlusion query, float32, on some texels of the default scene."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.bench.peers.case import compared
from lfssao.bench.sampling_error import rmse
from lfssao.display_file import find_display
from lfssao.errors import MissingPackageError
from lfssao.estimators.buffers import Buffers
from lfssao.ground_truth import Occluders, ray_cast_occlusion
from lfssao.raycast import RayCaster
from lfssao.rendering import diagonal, module_views
from lfssao.scene.builtin import builtin_scene

_EVERY = 32  # texel of each row and column
_RAYS = 256  # of each texel
_RADIUS = 0.02  # share of the scene's diagonal
_OFFSET = 1e-3  # rays begin so many radii off the surface, as ours do

Rays = NDArray[np.float32]


def measure(repeats: int, threads: int) -> dict[str, Any]:
    """The same texels, numbers of rays and weighting; ours makes its directions in the time, Embree's lie ready."""
    try:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene
    except ImportError as error:
        raise MissingPackageError("embreex is not installed") from error
    mesh = builtin_scene()
    view = module_views(mesh, find_display("virtual"))[0]
    buffers = Buffers.of(RayCaster(mesh, view.cast_from_world, threads).gbuffer(view, normals="geometric"), view)
    chosen = np.zeros(buffers.depth.shape, bool)
    chosen[::_EVERY, ::_EVERY] = True
    some = replace(buffers, depth=np.where(chosen, buffers.depth, np.float32(np.inf)))
    there, radius, occluders = np.isfinite(some.depth), _RADIUS * diagonal(mesh), Occluders(mesh)
    origins, directions = _rays(some, there, radius)
    scene = EmbreeScene(robust=True)
    TriangleMesh(scene, mesh.vertices.astype(np.float32), mesh.faces)
    parts = [slice(a, b) for a, b in pairwise(np.linspace(0, len(origins), threads + 1).astype(int).tolist())]

    def cast(part: slice) -> NDArray[np.bool_]:
        reach = np.full(part.stop - part.start, radius * (1 - _OFFSET), np.float32)
        hit: NDArray[np.bool_] = scene.run(origins[part], directions[part], dists=reach, query="OCCLUDED") >= 0
        return hit

    with ThreadPoolExecutor(threads) as pool:
        cast(slice(0, 2))  # builds the tree, which threads then share

        def theirs() -> NDArray[np.bool_]:
            return np.concatenate(list(pool.map(cast, parts)))

        def ours() -> NDArray[np.float64]:
            return ray_cast_occlusion(occluders, some, radius, rounds=(_RAYS // 64,) * 2, tolerance=0.0).texture

        rows = compared({"lfssao": ours, "embree": theirs}, repeats)
        shares = theirs().reshape(-1, _RAYS).mean(axis=1)
    rows["embree"]["rmse_to_lfssao"] = rmse(shares, ours()[there])
    for row in rows.values():
        row["ns_per_ray"] = 1e6 * row["median"] / len(origins)
    return {"rows": rows, "rays": len(origins)}


def _rays(buffers: Buffers, there: NDArray[np.bool_], radius: float) -> tuple[Rays, Rays]:
    """Origins and directions, (texels * rays, 3), by the cosine around each texel's normal."""
    assert buffers.normals is not None
    n = buffers.normals[there].astype(np.float64)
    rng = np.random.default_rng(0)
    turn, share = 2 * np.pi * rng.random((len(n), _RAYS)), rng.random((len(n), _RAYS))
    helper = np.where(np.abs(n[:, :1]) < 0.5, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    across = np.cross(n, helper)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    local = np.sqrt(share) * np.cos(turn), np.sqrt(share) * np.sin(turn), np.sqrt(1 - share)
    axes = across, np.cross(n, across), n
    directions = sum(a[..., None] * axis[:, None] for a, axis in zip(local, axes, strict=True))
    origins = np.repeat(buffers.positions[there] + _OFFSET * radius * n, _RAYS, axis=0)
    return origins.astype(np.float32), np.ascontiguousarray(directions.reshape(-1, 3), np.float32)
