"""Cases of estimators: each as it is, each option changed, and places that options do not reach."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from math import inf, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.estimator import Estimator, Value
from lfssao.ao.estimators.registry import ESTIMATORS
from lfssao.ao.estimators.sao.texel_rays import texel_rays
from lfssao.ao.textures import Buffers
from lfssao.core.affine import multiply, to_4x4
from lfssao.optics.display import Display
from lfssao.optics.kernels.projection import MATRIX
from lfssao.optics.view import View, WorldToImage
from lfssao.samples import make_samples
from lfssao.verify.case import Arrays
from lfssao.verify.kit import views
from lfssao.verify.kit.scenes import SCENE, Scene, textures
from lfssao.verify.kit.views import CAMERA_SCENE, Problem, Recipe, described, module_view, noise


def estimator_problem(estimator: Estimator, camera: bool, changes: Mapping[str, Value]) -> Problem:
    """An estimator on a display's module or on a camera, some of its options changed.

    Changed options get more texels and a larger radius: filters of larger footprints are not reached otherwise.
    """
    large = views.DISPLAYS["crossed_slits"].with_resolution(48, 36)
    view = views.make_camera("perspective") if camera else module_view(large if changes else views.small_display())
    radius = 0.5 if camera else 0.7 if changes else views.RADIUS
    return _on_view(estimator, view, CAMERA_SCENE if camera else SCENE, radius, changes, _own_tables(estimator))


def _own_tables(estimator: Estimator) -> Arrays:
    """An estimator's own samples and their weights, where it has them."""
    points, weights = estimator.default_samples()
    given = {"points": points, "weights": weights}
    return {name: np.asarray(table, np.float64) for name, table in given.items() if table is not None}


def _on_view(
    estimator: Estimator, view: View, scene: Scene, radius: float, changes: Mapping[str, Value], tables: Arrays
) -> Problem:
    """An estimator with some of its options changed, and its tables of samples, on a scene."""
    exact, positions = textures(view, scene)
    depth = exact + noise(9, *exact.shape) * np.float32(0.02)  # so that it matters which of the two is read
    inputs: dict[str, NDArray[Any]] = {"depth": depth, "positions": positions}
    inputs["directions"] = Buffers(view, depth, positions).directions
    if estimator.reads_normals(changes):
        inputs["normals"] = _wall_normals(view, depth)
    inputs |= tables
    parameters = {
        "estimator": estimator.name,
        "radius": radius,
        "options": {**estimator.parameters, **changes},
        "mapping": described(view.world_to_image),
        "viewer_distance": view.viewer_distance().tolist(),
        "view": views.view_numbers(view),
    }
    return parameters, inputs


# One of them in the middle, one on the rim, where a line has no length.
_DISK = ((0.0, 0.0), (0.6, 0.1), (-0.3, 0.7), (0.2, -0.8), (-1.0, 0.0))


def _disk_problem(estimator: Estimator, changes: Mapping[str, Value], tables: Arrays) -> Problem:
    """An estimator over a disk where some of the disk has no image: beyond the screen, behind the lens."""
    view = module_view(views.MISSED.with_resolution(24, 18))
    parameters, inputs = _on_view(estimator, view, SCENE, 1.2, changes, tables)
    turned = {"normals": -inputs["normals"]} if estimator.normals and "randomize" in changes else {}
    return parameters, {**inputs, **turned}  # turned away from the viewer, as in smoothed meshes


def _wall_normals(view: View, depth: NDArray[np.float32]) -> NDArray[np.float32]:
    """The wall's normal in world space wherever there is a surface: an input like any other."""
    _, b, c, _ = SCENE.wall
    towards = (b, c, -1.0)  # cast space, to the viewers; planes go to world space by the transposed map
    rows = view.cast_from_world.tolist()
    x, y, z = ((towards[0] * rows[0][k] + towards[1] * rows[1][k]) + towards[2] * rows[2][k] for k in range(3))
    length = sqrt((x * x + y * y) + z * z)
    unit = np.array([x / length, y / length, z / length], np.float32)
    return np.where(np.isfinite(depth)[..., None], unit, np.float32(0))


def _remap_problem() -> Problem:
    """Depths so far before their positions that in some texels most samples are occluded, in others few."""
    tables = {"points": make_samples("latin", 8, 1)}
    parameters, inputs = _on_view(
        ESTIMATORS["point"], module_view(views.small_display()), SCENE, views.RADIUS, {"remap": True}, tables
    )
    return parameters, {**inputs, "depth": inputs["depth"] - noise(12, *inputs["depth"].shape) * np.float32(0.1)}


def estimator_recipes() -> Iterator[Recipe]:
    """Cases of every estimator of the registry but LF's, which is Algorithms 1 and 2."""
    yield from _option_recipes()
    title = "remap where more than half of the samples are behind the surface, and fewer"
    yield Recipe("remapped", "estimator", title, _remap_problem)
    yield from _curved_recipes()
    yield from _disk_recipes()
    yield from _pass_recipes()


def _other(estimator: Estimator, option: str, value: Value) -> Value:
    """Another value of an option that is a number."""
    most, other = estimator.limits.get(option, (0.0, inf))[1], _OTHER.get(option)
    return min(1.5 * float(value), most) if other is None or other > most else other


# Options that are off by default, or take no multiple of it, and what cases set them to where they can.
_OTHER: dict[str, float] = {"thickness": 0.3, "second": 0.5, "seed": 7, "bias": 20.0, "directions": 5, "steps": 3}

# Options that show nothing unless another one is set.
_WITH: dict[str, dict[str, Value]] = {"combine": {"second": 0.5}, "background": {"range_check": "none"}}


def _own(estimator: Estimator, changes: Mapping[str, Value]) -> dict[str, Value]:
    """Those of some options that an estimator has, with values of that type."""
    return {o: v for o, v in changes.items() if type(estimator.parameters.get(o)) is type(v)}


def _option_recipes() -> Iterator[Recipe]:
    """Each estimator as it is, and each option changed."""
    for name, estimator in ESTIMATORS.items():
        if name == "lf":
            continue
        variants: list[tuple[str, bool, dict[str, Value]]] = [("", False, {}), ("_camera", True, {})]
        for option, default in estimator.parameters.items():
            if isinstance(default, bool):
                variants.append((f"_{option}", False, {option: not default}))
            others = [choice for choice in estimator.choices.get(option, ()) if choice != default]
            needed = _own(estimator, _WITH.get(option, {}))
            variants += [(f"_{option}_{choice}", False, {**needed, option: choice}) for choice in others]
        numbers: dict[str, Value] = {
            o: _other(estimator, o, v) for o, v in estimator.parameters.items() if o in _OTHER or isinstance(v, float)
        }
        if numbers:
            variants.append(("_numbers", False, numbers))
        for suffix, camera, changes in variants:
            build = estimator_problem, estimator, camera, changes
            yield Recipe(f"estimator_{name}{suffix}", "estimator", estimator.title, *build)


def _curved_recipes() -> Iterator[Recipe]:
    """Estimators over balls and disks where the mapping is any display's, and has no image of some of their places."""
    changes: dict[str, Value] = {"surface": "positions", "range_check": True}
    for name in ("alchemy", "point", "hemisphere", "oriented-hemisphere", "vo-points", "vo-points-normal"):
        estimator, view = ESTIMATORS[name], module_view(views.MISSED.with_resolution(16, 12))
        build = _on_view, estimator, view, SCENE, 1.2, _own(estimator, changes), _own_tables(estimator)
        yield Recipe(f"curved_{name}", "estimator", f"{estimator.title}: convex screen", *build)


def _disk_recipes() -> Iterator[Recipe]:
    """Estimators over disks: several samples, one without weight; no weights at all; places without image."""
    ways: list[tuple[str, dict[str, Value], Arrays]] = [
        ("weighted", {"thickness": 0.4}, {"points": np.array(_DISK), "weights": np.array([2.0, 1.0, 1.5, 0.5, 3.0])}),
        ("unweighted", {"randomize": False}, {"points": np.array(_DISK)}),
        ("rim", {}, {"points": np.array(_DISK[-1:])}),
    ]
    alone: list[tuple[str, dict[str, Value], Arrays]] = [("", {"bias": 60.0}, {}), ("turned", {"randomize": False}, {})]
    for name in ("vo-lines", "vo-lines-normal", "vo-area", "vo-area-normal", "hbao"):
        estimator = ESTIMATORS[name]
        for suffix, changes, tables in ways if estimator.dimensions else alone:
            title, case = f"{estimator.title}: convex screen", f"disk_{name}_{suffix}".rstrip("_")
            yield Recipe(case, "estimator", title, _disk_problem, estimator, _own(estimator, changes), tables)


# Passes over texels: views, whole numbers and places that the cases of single options do not reach.
_PASSES: dict[str, dict[str, Value]] = {
    "": {},
    "finer": {"taps": 13, "turns": 0, "log_q": 0, "max_level": 1, "z_min": 2.0, "packed": False},
    "coarser": {"taps": 100, "turns": 0, "log_q": 0, "max_level": 9, "mip": "harmonic"},
    "sampled": {"quad_edge": 0.0, "gauss": 0.0},
    "unbiased": {"beta": 0.0, "epsilon": 0.0},
}
_LEVELS: dict[str, dict[str, Value]] = {
    "": {},
    "alone": {"levels": 1, "kernel": 3},
    "many": {"levels": 7, "kernel": 1, "combine": "average"},
}


def _rough(view: View, radius: float, estimator: Estimator, changes: Mapping[str, Value]) -> Problem:
    """Surfaces with holes and, for estimators that read them, normals that differ and depths that are equal."""
    parameters, inputs = _on_view(estimator, view, SCENE, radius, changes, {})
    hole = noise(10, *inputs["depth"].shape) < 0.1
    arrays = {
        name: np.where(hole if array.ndim == 2 else hole[..., None], np.float32(np.inf), array)
        for name, array in inputs.items()
        if name in ("depth", "positions")
    }
    if estimator.normals:
        normals = inputs["normals"] + np.float32(1.2) * noise(11, *inputs["normals"].shape) - np.float32(0.6)
        x, y, z = (normals[..., k] for k in range(3))
        normals = normals / np.sqrt((x * x + y * y) + z * z)[..., None]
        arrays["normals"] = np.where(np.isfinite(arrays["depth"])[..., None], normals, np.float32(0))
        arrays["depth"] = np.round(arrays["depth"] * np.float32(16)) / np.float32(16)
    return parameters, {**inputs, **arrays}


def _beyond_planes(estimator: Estimator, projection: str) -> Problem:
    """A camera's depths, some without a distance: none exists in perspective, one below 0 in orthographic."""
    parameters, inputs = _on_view(estimator, views.make_camera(projection), CAMERA_SCENE, 0.5, {"mip": "harmonic"}, {})
    depth = np.where(noise(10, *inputs["depth"].shape) < 0.1, _BEYOND[projection], inputs["depth"])
    return parameters, {**inputs, "depth": depth}


def _endless(estimator: Estimator) -> Problem:
    """A camera whose far plane lies at infinity; some depths are 1 and more, which stands for no distance."""
    view = views.make_camera("perspective", 20, 15)
    f_u, f_v, c_u, c_v, near = view.lens[:5].tolist()
    forth = np.array([[f_u, 0, c_u, 0], [0, -f_v, c_v, 0], [0, 0, 1, -near], [0, 0, 1, 0]])
    back = np.array(
        [[1 / f_u, 0, 0, -c_u / f_u], [0, -1 / f_v, 0, c_v / f_v], [0, 0, 0, 1], [0, 0, -1 / near, 1 / near]]
    )
    endless = replace(
        view,
        lens=np.array([*view.lens[:5], inf, *view.lens[6:]]),
        world_to_image=WorldToImage(MATRIX, multiply(forth, to_4x4(view.cast_from_world)).ravel()),
        screen_to_world=multiply(to_4x4(view.world_from_cast), back),
        depth_kind="screen space z: 0 at the near plane, 1 at infinity, perspective",
    )
    parameters, inputs = _on_view(estimator, view, CAMERA_SCENE, 0.5, {"packed": False}, {})
    parameters |= {"mapping": described(endless.world_to_image), "view": views.view_numbers(endless)}
    a, b, c, d = view.cast_from_world[2].tolist()
    x, y, z = (inputs["positions"][..., k].astype(np.float64) for k in range(3))
    with np.errstate(invalid="ignore"):  # where there is no surface
        depth = (1 - near / (((a * x + b * y) + c * z) + d)).astype(np.float32)
    wild = noise(10, *depth.shape)
    depth = np.where(wild < 0.05, np.float32(1.0), np.where(wild < 0.1, np.float32(1.75), depth))
    return parameters, {**inputs, "depth": np.where(np.isfinite(inputs["depth"]), depth, np.float32(inf))}


_BEYOND = {"perspective": np.float32(1.75), "orthographic": np.float32(-0.75)}


def _lines_problem(estimator: Estimator, display: Display, changes: Mapping[str, Value]) -> Problem:
    """An estimator on a display whose texels' lines are a table."""
    view = module_view(display)
    parameters, inputs = _on_view(estimator, view, SCENE, 0.3, changes, {})
    lines = texel_rays(view, np.dtype(np.float32)).table
    return parameters, {**inputs, "lines": np.ascontiguousarray(lines.T).reshape(*inputs["depth"].shape, 4)}


def _no_line_problem(estimator: Estimator) -> Problem:
    """Surfaces also in texels that have no line, as no caster of rays along the lines would give them."""
    parameters, inputs = _lines_problem(estimator, views.WIDE.with_resolution(20, 15), {})
    there = np.isnan(inputs["lines"][..., 0]) & (noise(10, *inputs["depth"].shape) < 0.5)
    depth = np.where(there, noise(12, *there.shape), inputs["depth"])
    positions = np.where(there[..., None], noise(13, *there.shape, 3), inputs["positions"])
    return parameters, {**inputs, "depth": depth, "positions": positions}


def _pass_recipes() -> Iterator[Recipe]:
    """Estimators that pass over texels and their levels."""
    large, odd, one = (views.DISPLAYS["crossed_slits"].with_resolution(*size) for size in ((48, 36), (33, 21), (1, 1)))
    for name in ("sao", "sao-equation-1", "multiresolution"):
        estimator = ESTIMATORS[name]
        builds: dict[str, tuple[Any, ...]] = {
            f"holes_{suffix}".rstrip("_"): (_rough, module_view(odd), 0.4, estimator, changes)
            for suffix, changes in (_LEVELS if estimator.normals else _PASSES).items()
        }
        builds["one_texel"] = _on_view, estimator, module_view(one), SCENE, 0.3, {}, {}
        builds["zero_radius"] = _on_view, estimator, module_view(views.small_display()), SCENE, 0.0, {}, {}
        builds["wide"] = _on_view, estimator, module_view(large), SCENE, 1e7, {}, {}
        if not estimator.normals:
            builds |= {projection: (_beyond_planes, estimator, projection) for projection in _BEYOND}
            builds["infinite_far_plane"] = _endless, estimator
            builds["near"] = _rough, module_view(odd), 0.05, estimator, {}
            for kind in ("convex", "conical"):
                display = views.DISPLAYS[kind].with_resolution(20, 15)
                builds[kind] = _lines_problem, estimator, display, {"mip": "harmonic", "log_q": 0}
            builds["no_line"] = _no_line_problem, estimator
        for suffix, build in builds.items():
            title = f"{estimator.title}: {suffix.replace('_', ' ')}"
            yield Recipe(f"passes_{name}_{suffix}", "estimator", title, *build)
