"""Ray-cast occlusion through Embree, float32, beside our own tree's, on some texels of the default scene."""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from baselines.case import compared

from lfssao.bench.sampling_error import rmse
from lfssao.display_file import find_display
from lfssao.estimators.buffers import Buffers
from lfssao.ground_truth import Occluders, ray_cast_occlusion
from lfssao.raycast import RayCaster
from lfssao.rendering import diagonal, module_views
from lfssao.scene.builtin import builtin_scene

_EVERY = 32  # texel of each row and column
_ROUNDS = 4  # of 64 rays
_RADIUS = 0.02  # share of the scene's diagonal


def measure(repeats: int, threads: int) -> dict[str, Any]:
    """The same rays, which both make in the time; the first calls build the trees."""
    mesh = builtin_scene()
    view = module_views(mesh, find_display("virtual"))[0]
    buffers = Buffers.of(RayCaster(mesh, view.cast_from_world, threads).gbuffer(view, normals="geometric"), view)
    chosen = np.zeros(buffers.depth.shape, bool)
    chosen[::_EVERY, ::_EVERY] = True
    some = replace(buffers, depth=np.where(chosen, buffers.depth, np.float32(np.inf)))
    cast = partial(
        ray_cast_occlusion, Occluders(mesh), some, _RADIUS * diagonal(mesh), tolerance=0.0, rounds=(_ROUNDS, _ROUNDS)
    )
    rows = compared({"lfssao": cast, "embree": partial(cast, intersector="embree")}, repeats)
    ours, theirs = cast(), cast(intersector="embree")
    there, rays = ours.rays > 0, int(ours.rays.sum())
    rows["embree"]["rmse_to_lfssao"] = rmse(ours.texture[there], theirs.texture[there])
    for row in rows.values():
        row["ns_per_ray"] = 1e6 * row["median"] / rays
    return {"rows": rows, "rays": rays}
