"""Cases of estimators: each as it is, each option changed, and places that options do not reach."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
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


def estimator_problem(
    estimator: Estimator, projection: str, changes: Mapping[str, Value], width: int = 32, z: float = 5.0
) -> Problem:
    """An estimator on a display's module or, where a projection is named, a camera; some of its options changed.

    Changed options get more texels and a larger radius: filters of larger footprints are not reached otherwise.
    """
    large = views.DISPLAYS["crossed_slits"].with_resolution(48, 36)
    if projection:
        view, scene, radius = views.make_camera(projection, width, width * 3 // 4, z), CAMERA_SCENE, 0.5
    else:
        view, scene = module_view(large if changes else views.small_display()), SCENE
        radius = 0.7 if changes else views.RADIUS
    return _on_view(estimator, view, scene, radius, changes, _own_tables(estimator))


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


def _recipe(case: str, estimator: Estimator, about: str, build: Callable[..., Problem], *arguments: Any) -> Recipe:
    """A case of an estimator, and what of it the case is about."""
    return Recipe(case, "estimator", f"{estimator.title}{about and ': '}{about}", build, *arguments)


def estimator_recipes() -> Iterator[Recipe]:
    """Cases of every estimator of the registry but LF's, which is Algorithms 1 and 2."""
    yield from _option_recipes()
    title = "remap where more than half of the samples are behind the surface, and fewer"
    yield Recipe("remapped", "estimator", title, _remap_problem)
    yield from _curved_recipes()
    yield from _disk_recipes()
    yield from _pass_recipes()
    yield from _exact_recipes()
    yield from _place_recipes()


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
        variants: list[tuple[str, str, dict[str, Value]]] = [("", "", {}), ("_camera", "perspective", {})]
        for option, default in estimator.parameters.items():
            if isinstance(default, bool):
                variants.append((f"_{option}", "", {option: not default}))
            others = [choice for choice in estimator.choices.get(option, ()) if choice != default]
            needed = _own(estimator, _WITH.get(option, {}))
            variants += [(f"_{option}_{choice}", "", {**needed, option: choice}) for choice in others]
        numbers: dict[str, Value] = {
            o: _other(estimator, o, v) for o, v in estimator.parameters.items() if o in _OTHER or isinstance(v, float)
        }
        if numbers:
            variants.append(("_numbers", "", numbers))
        for suffix, projection, changes in variants:
            case = f"estimator_{name}{suffix}"
            yield _recipe(case, estimator, "", estimator_problem, estimator, projection, changes)
        yield _recipe(
            f"estimator_{name}_orthographic", estimator, "", estimator_problem, estimator, "orthographic", {}, 16
        )


def _curved_recipes() -> Iterator[Recipe]:
    """Estimators over balls and disks where the mapping is any display's, and has no image of some of their places."""
    changes: dict[str, Value] = {"surface": "positions", "range_check": True}
    for name in ("alchemy", "point", "hemisphere", "oriented-hemisphere", "vo-points", "vo-points-normal"):
        estimator, view = ESTIMATORS[name], module_view(views.MISSED.with_resolution(16, 12))
        given = view, SCENE, 1.2, _own(estimator, changes), _own_tables(estimator)
        yield _recipe(f"curved_{name}", estimator, "convex screen", _on_view, estimator, *given)


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
            case, own = f"disk_{name}_{suffix}".rstrip("_"), _own(estimator, changes)
            yield _recipe(case, estimator, "convex screen", _disk_problem, estimator, own, tables)


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


def _long_normals(view: View, estimator: Estimator) -> Problem:
    """Some normals of 10^19: the eighth power of their dot product with another one is infinite in float32."""
    parameters, inputs = _rough(view, 0.4, estimator, {})
    lengths = np.where(noise(12, *inputs["depth"].shape) < 0.3, np.float32(1e19), np.float32(1))
    return parameters, {**inputs, "normals": lengths[..., None] * inputs["normals"]}


def _beyond_planes(estimator: Estimator, projection: str, share: float = 0.1) -> Problem:
    """A camera's depths, a share of them without distance: none exists in perspective, one below 0 in orthographic."""
    changes: dict[str, Value] = {"mip": "harmonic", "log_q": 0}
    parameters, inputs = _on_view(estimator, views.make_camera(projection), CAMERA_SCENE, 0.5, changes, {})
    depth = np.where(noise(10, *inputs["depth"].shape) < share, _BEYOND[projection], inputs["depth"])
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


_ENDLESS = replace(SCENE, wall=(0.16, 0.2, -0.1, inf))  # at the texture's borders too
_BEYOND = {"perspective": np.float32(1.75), "orthographic": np.float32(-0.75)}


def _lines_problem(
    estimator: Estimator, display: Display, changes: Mapping[str, Value], scene: Scene = SCENE
) -> Problem:
    """An estimator on a display whose texels' lines are a table."""
    view = module_view(display)
    parameters, inputs = _on_view(estimator, view, scene, 0.3, changes, {})
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
        if estimator.normals:
            builds["long_normals"] = _long_normals, module_view(odd), estimator
        else:
            builds |= {projection: (_beyond_planes, estimator, projection) for projection in _BEYOND}
            builds["infinite_far_plane"] = _endless, estimator
            builds["near"] = _rough, module_view(odd), 0.05, estimator, {}
            for kind in ("convex", "conical"):
                display = views.DISPLAYS[kind].with_resolution(20, 15)
                builds[kind] = _lines_problem, estimator, display, {"mip": "harmonic", "log_q": 0}
            builds["no_line"] = _no_line_problem, estimator
            far = replace(views.DISPLAYS["conical"], observer_z=-2.1)
            for suffix, size in (("edges", (9, 7)), ("column", (1, 6))):
                builds[suffix] = _lines_problem, estimator, far.with_resolution(*size), {"packed": False}, _ENDLESS
            builds["behind"] = _beyond_planes, estimator, "orthographic", 1.0
            near = module_view(views.NEAR.with_resolution(16, 12))
            for suffix, z_min in (("least_key", 1e-310), ("largest_key", 0.6)):
                builds[suffix] = _on_view, estimator, near, SCENE, 0.3, {"z_min": z_min}, {}
        for suffix, build in builds.items():
            yield _recipe(f"passes_{name}_{suffix}", estimator, suffix.replace("_", " "), *build)


# Points and taps of few binary digits, of the radius 2: on borders of texels, at depths of surfaces, nearly edge-on.
_BALL = np.array([
    (0, 0, 0), (0, 0.5, 0), (0.125, -0.5, 0), (0, 0, 0.5), (-0.125, 0, -0.5), (0.125, 0.25, 0.25), (0.25, 0, 0),
    (0.25, 0.5, 0.5), (0, 0, 0.9375), (0.125, 0, -0.9375),
])  # fmt: skip
_FLAT = np.array([(0, 0), (0.5, 0), (0, 2.0**-21), (0, -0.5), (0.25, 0.75)])
_SINGLE: dict[str, Value] = {"randomize": False, "thickness": 0.5}
_COARSE: dict[str, Value] = {"quad_edge": 0.125, "mip": "harmonic", "log_q": 0, "reach": 3.0, "packed": False}
_EXACT: dict[str, dict[str, Value]] = {
    "point": {"range_check": True}, "hemisphere": {"range_check": True}, "alchemy": {"beta": 0.0, "epsilon": 0.0},
    "oriented-hemisphere": {"bias": 0.0, "range_check": "distance"}, "sao": _COARSE, "sao-equation-1": _COARSE,
    "hbao": {"directions": 1, "steps": 5, "attenuation": "none", "randomize": False}, "multiresolution": {},
}  # fmt: skip


def _exact_problem(estimator: Estimator, radius: float, changes: Mapping[str, Value], projection: str) -> Problem:
    """Ties: textures and samples whose sums are exact, on a camera that looks along x; one texel lies in a pit."""
    view, (row, column) = views.make_exact(projection), np.indices((6, 8))
    z = 2 + 0.25 * ((column + 2 * row) % 4)
    z[2, 4], z[2, 1], z[2, 7], z[5, 6] = 4.5, 0.5, 0.5, 0.0  # the middle one lies 3, 4 and 5 from its two neighbours
    across = z if projection == "perspective" else 1.0
    positions = np.stack([z, (3.5 - column) * across, (2.5 - row) * across], -1).astype(np.float32)
    with np.errstate(divide="ignore"):
        depth = (1.25 - 1.25 / z if projection == "perspective" else 0.25 * z - 0.25).astype(np.float32)
    depth[5, 6] = np.float32(-0.25)  # in the plane of the eye, where a perspective has no image
    tables = {2: {"points": _FLAT}, 3: {"points": _BALL}, 0: {}}[estimator.dimensions]
    parameters, inputs = _on_view(estimator, view, CAMERA_SCENE, radius, changes, tables)
    normals = np.where(((column + row) % 3 == 0)[..., None], [-(2.0**-22), 0.0, 1.0], [-1.0, 0.0, 0.0])
    own = {"depth": depth, "positions": positions, "normals": normals.astype(np.float32)}
    return parameters, {**inputs, **{name: array for name, array in own.items() if name in inputs}}


def _small_problem(
    estimator: Estimator, radius: float, changes: dict[str, Value], before: float = 0.01, tables: Arrays | None = None
) -> Problem:
    """Depths before their positions, by 0.01 some and others behind; by 0: the same, whose variance rounds below 0."""
    view, tables = module_view(views.small_display()), _own_tables(estimator) if tables is None else tables
    parameters, inputs = _on_view(estimator, view, SCENE, radius, _own(estimator, changes), tables)
    depth = inputs["depth"] if before else np.where(inputs["depth"] < inf, np.float32(0.15), np.float32(inf))
    return parameters, {**inputs, "depth": depth - np.float32(before)}


def _exact_recipes() -> Iterator[Recipe]:
    """Ties of every estimator, the radius 0, and radii so small or large that squares and quotients leave binary32."""
    for name, estimator in ESTIMATORS.items():
        if name == "lf":
            continue
        exact, small = partial(_exact_problem, estimator), partial(_small_problem, estimator)
        radius, changes = 5.0 if name == "hbao" else 2.0, _own(estimator, _EXACT.get(name, _SINGLE))
        yield _recipe(f"ties_{name}", estimator, "ties", exact, radius, changes, "orthographic")
        if not name.startswith(("sao", "multi")):
            yield _recipe(f"zero_{name}", estimator, "radius 0", small, 0.0, {"thickness": 0.4})
        if name in ("vo-points", "vo-lines", "vo-area"):
            points = np.array([(0.25, 0.75)] * 2 if estimator.dimensions == 2 else [(0.1, 0.1, 0.1)] * 10)
            given = 0.05, {"randomize": False}, 0.5, {"points": points}
            yield _recipe(f"covered_{name}", estimator, "sums that round to above 1", small, *given)
        if name in ("point", "hemisphere"):
            changes, about = {"surface": "positions"}, "positions of a camera, one in the plane of its eye"
            yield _recipe(f"eye_plane_{name}", estimator, about, exact, 2.0, changes, "perspective")
        if name.startswith("vo-area"):
            yield _recipe(f"large_{name}", estimator, "radius 1e+25", exact, 1e25, _SINGLE, "orthographic")
            yield _recipe(f"even_{name}", estimator, "one depth", small, 0.3, {"prefilter": True}, 0.0)
            for size, radius in (("small", 1e-35), ("smallest", 1e-42)):
                yield _recipe(f"{size}_{name}", estimator, f"radius {radius:g}", small, radius, {"thickness": 0.4})


def _place_recipes() -> Iterator[Recipe]:
    """Guard bands, seeds beyond 32 bits, and cameras that look towards larger z."""
    view = module_view(views.small_display(), 3)
    for name in ("vo-points", "hbao", "alchemy", "sao"):
        given: tuple[Any, ...] = ESTIMATORS[name], view, SCENE, views.RADIUS, {}, _own_tables(ESTIMATORS[name])
        yield _recipe(f"guard_{name}", ESTIMATORS[name], "a guard band of 3 texels", _on_view, *given)
    seed, flat = {"seed": 5 * 2**40 + 2**31 + 9}, {"k": 0.0, "sigma": 1e4}
    for case, name, about, *more in (
        ("seed", "vo-points", "a seed of 43 bits", "orthographic", seed, 12),
        ("seed", "vo-lines", "a seed of 43 bits", "orthographic", seed, 12),
        ("seed", "hbao", "a seed of 43 bits", "orthographic", seed, 12),
        ("behind", "alchemy", "behind", "perspective", {}, 16, -5.0),
        ("without_contrast", "alchemy", "without contrast", "perspective", flat, 16, -5.0),
        ("without_contrast", "sao-equation-1", "without contrast", "perspective", flat, 16, -5.0),
    ):
        yield _recipe(f"{case}_{name}", ESTIMATORS[name], about, estimator_problem, ESTIMATORS[name], *more)
