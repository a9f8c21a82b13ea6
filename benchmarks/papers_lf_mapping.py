"""The LF paper's section 5, measured and judged: the mapping of a module, and what is read of its textures."""

from dataclasses import replace
from typing import Any

import numpy as np
from papers_common import Claim, Found, Judged, Scale
from scipy.optimize import least_squares

import lfssao
from lfssao.bench.work_precision.figures import rms


def by_matrix(matrix: Any, points: Any) -> Any:
    """Texels (n, 2) of points by a matrix (3, 4)."""
    u, v, w = matrix @ np.column_stack([points, np.ones(len(points))]).T
    return np.column_stack([u / w, v / w])


def best_matrix(points: Any, texels: Any) -> Any:
    """The matrix that misses the texels of points least, root mean square: linear first, then refined."""
    ones = np.column_stack([points, np.ones(len(points))])
    none = np.zeros((len(points), 4))
    middle = texels.mean(axis=0)
    scale = texels.std()
    a, b = ((texels - middle) / scale).T[..., None]
    equations = np.vstack([np.hstack([ones, none, -a * ones]), np.hstack([none, ones, -b * ones])])
    start = np.linalg.eigh(equations.T @ equations)[1][:, 0]

    def missed(numbers: Any) -> Any:
        return (by_matrix(numbers.reshape(3, 4), points) * scale + middle - texels).ravel()

    numbers = least_squares(missed, start, x_scale="jac", max_nfev=200).x.reshape(3, 4)
    return np.array([[scale, 0, middle[0]], [0, scale, middle[1]], [0, 0, 1]]) @ numbers


def matrix_misses(view: Any, world: Any) -> dict[str, float]:
    """Texels by which the best matrix misses those of points of a box that the view has."""
    points = np.random.default_rng(0).uniform(*world, (4000, 3))
    texels = np.asarray(view.world_to_image(points), float)
    inside = np.isfinite(texels).all(axis=1) & (texels[:, 0] >= 0) & (texels[:, 0] <= view.width)
    inside &= (texels[:, 1] >= 0) & (texels[:, 1] <= view.height)
    points = points[inside]
    texels = texels[inside, :2]
    missed = np.linalg.norm(by_matrix(best_matrix(points, texels), points) - texels, axis=1)
    return {"points": len(points), "rms": rms(missed), "worst": float(missed.max())}


def no_matrix(scale: Scale) -> Found:
    """The mapping of a display's modules, against the best matrix for each."""
    mesh = lfssao.builtin_scene("statue")
    rows = {}
    for name, modules in (("virtual", [0]), ("sample-a", [0, 10, 20]), ("sample-b", [0])):
        display = lfssao.find_display(name).with_resolution(*scale.size(1024, 768))
        for k, view in zip(modules, lfssao.module_views(mesh, display, modules), strict=True):
            rows[f"{name}, module {k}"] = matrix_misses(view, mesh.bounds)
    return {"rows": rows}


def camera_as_module(scale: Scale, _: Found) -> Found:
    """An ordinary camera's mapping, which is a matrix."""
    mesh = lfssao.builtin_scene("statue")
    view = lfssao.Camera.looking_at(mesh.bounds).view(*scale.size(1024, 768))
    return {"rows": {"camera": matrix_misses(view, mesh.bounds)}}


def judge_no_matrix(found: Found, limit: float) -> Judged:
    each = [row["rms"] for row in found["rows"].values()]
    told = {"low": min(each), "high": max(each), "worst": max(row["worst"] for row in found["rows"].values())}
    return min(each) > limit, max(each) > limit, told


def other_line_7(scale: Scale, shift: int = 0) -> Found:
    """The depth texture against the mapped positions texture; shift: texels by which positions are moved in control."""
    mesh = lfssao.builtin_scene("statue")
    rows = {}
    size = scale.size(500, 300)
    display = lfssao.find_display("sample-a")
    views = lfssao.module_views(mesh, display.with_resolution(*size), [0, 10, 20])
    seen = {f"sample-a, module {k}": view for k, view in zip((0, 10, 20), views, strict=True)}
    for name, view in seen.items():
        buffers = lfssao.Buffers.of(lfssao.RayCaster(mesh, view.cast_from_world, 2).gbuffer(view), view)
        moved = replace(buffers, positions=np.roll(buffers.positions, shift, axis=1)) if shift else buffers
        made = [
            lfssao.estimate("point", b.turned("hash"), lfssao.default_radii(mesh)[2], surface=surface).texture
            for b, surface in ((buffers, "depth"), (moved, "positions"))
        ]
        surface = np.isfinite(buffers.depth)
        differs = made[0] != made[1]
        rows[name] = {"texels": int(surface.sum()), "differ": int((differs & surface).sum())}
        rows[name]["largest"] = float(np.abs(made[0] - made[1])[surface].max())
    return {"rows": rows}


def judge_other_line_7(found: Found, limit: float) -> Judged:
    texels, differ = (sum(row[key] for row in found["rows"].values()) for key in ("texels", "differ"))
    return differ <= limit * texels, False, {"differ": differ, "texels": texels, "share": differ / texels}


CLAIMS = {
    "LF section 5, no matrix": Claim(no_matrix, judge_no_matrix, camera_as_module),
    "LF section 5, line 7": Claim(other_line_7, judge_other_line_7, lambda scale, _: other_line_7(scale, 1)),
}
