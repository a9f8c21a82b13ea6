"""Cases of estimators: each as it is, each option changed, and places that options do not reach."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from math import inf, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.estimator import Estimator, Value
from lfssao.ao.estimators.look_ups import CLEARED, text_options
from lfssao.ao.estimators.registry import ESTIMATORS, of_one_view
from lfssao.ao.estimators.sao.texel_rays import texel_rays
from lfssao.ao.textures import Buffers
from lfssao.optics.camera import Camera
from lfssao.optics.display import Display
from lfssao.optics.view import View
from lfssao.samples import make_samples
from lfssao.verify.case import Arrays
from lfssao.verify.kit import views
from lfssao.verify.kit.scenes import SCENE, Scene, textures
from lfssao.verify.kit.views import CAMERA_SCENE, Problem, Recipe, described, make_camera, module_view, noise

Changes = Mapping[str, Value]  # of options


def estimator_problem(
    estimator: Estimator, projection: str, changes: Changes, width: int = 32, z: float = 5.0
) -> Problem:
    """An estimator on a display's module or, where a projection is named, a camera; some of its options changed.

    Changed options get more texels and a larger radius: filters of larger footprints are not reached otherwise.
    """
    if projection:
        return on_view(estimator, make_camera(projection, width, width * 3 // 4, z), CAMERA_SCENE, 0.5, changes)
    if changes:
        return on_view(estimator, _flat(48, 36), SCENE, 0.7, changes)
    return on_view(estimator, _flat(), SCENE, views.RADIUS, changes)


def _flat(width: int = 16, height: int = 12, guard: int = 0) -> View:
    return module_view(views.DISPLAYS["crossed_slits"].with_resolution(width, height), guard)


def on_view(
    estimator: Estimator, view: View, scene: Scene, radius: float, changes: Changes, tables: Arrays | None = None
) -> Problem:
    """An estimator with some of its options changed, and tables of samples, its own by default, on a scene."""
    exact, positions = textures(view, scene)
    depth = exact + noise(9, *exact.shape) * np.float32(0.02)  # so that it matters which of the two is read
    inputs: dict[str, NDArray[Any]] = {"depth": depth, "positions": positions}
    inputs["directions"] = Buffers(view, depth, positions).directions
    if estimator.reads_normals(changes):
        inputs["normals"] = _wall_normals(view, depth, scene)
    own = zip(("points", "weights"), estimator.default_samples(), strict=True)
    own_tables = {name: np.asarray(table, np.float64) for name, table in own if table is not None}
    parameters = {
        "estimator": estimator.name,
        "radius": radius,
        "options": {**text_options(estimator), **changes},
        "mapping": described(view.world_to_image),
        "viewer_distance": view.viewer_distance().tolist(),
        "view": views.view_numbers(view),
    }
    return parameters, {**inputs, **(own_tables if tables is None else tables)}


# One of them in the middle, one on the rim, where a line has no length.
_DISK = ((0.0, 0.0), (0.6, 0.1), (-0.3, 0.7), (0.2, -0.8), (-1.0, 0.0))


def _disk_problem(estimator: Estimator, changes: Changes, tables: Arrays) -> Problem:
    """An estimator over a disk where some of the disk has no image: beyond the screen, behind the lens."""
    view = module_view(views.MISSED.with_resolution(24, 18))
    parameters, inputs = on_view(estimator, view, SCENE, 1.2, changes, tables)
    turned = {"normals": -inputs["normals"]} if estimator.normals and "randomize" in changes else {}
    return parameters, {**inputs, **turned}  # turned away from the viewer, as in smoothed meshes


def _wall_normals(view: View, depth: NDArray[np.float32], scene: Scene) -> NDArray[np.float32]:
    """The wall's normal in world space wherever there is a surface: an input like any other."""
    _, b, c, _ = scene.wall
    rows = view.cast_from_world[:, :3]  # planes go to world space by the transposed map
    x, y, z = towards = (b * rows[0] + c * rows[1]) - rows[2]  # by (b, c, -1), in cast space to the viewers
    unit = (towards / sqrt((x * x + y * y) + z * z)).astype(np.float32)
    return np.where(np.isfinite(depth)[..., None], unit, np.float32(0))


def _remap_problem(estimator: Estimator) -> Problem:
    """Depths so far before their positions that in some texels most samples are occluded, in others few."""
    tables = {"points": make_samples("latin", 8, 1)}
    parameters, inputs = on_view(estimator, _flat(), SCENE, views.RADIUS, {"remap": True}, tables)
    return parameters, {**inputs, "depth": inputs["depth"] - noise(12, *inputs["depth"].shape) * np.float32(0.1)}


# All of one view but LF's, which is Algorithms 1 and 2.
_ESTIMATORS = {name: estimator for name, estimator in of_one_view().items() if name != "lf"}


def _recipe(case: str, name: str, about: str, build: Callable[..., Problem], *arguments: Any) -> Recipe:
    """A case of an estimator, and what of it the case is about."""
    title = f"{ESTIMATORS[name].title}{about and ': '}{about}"
    return Recipe(case, "estimator", title, build, ESTIMATORS[name], *arguments)


def _other(estimator: Estimator, option: str, value: Value) -> Value:
    """Another value of an option that is a number."""
    most, other = estimator.said("limits").get(option, (0.0, inf))[1], _OTHER.get(option)
    return min(1.5 * float(value), most) if other is None or other > most else other


# Options that are off by default, or take no multiple of it, and what cases set them to where they can.
_OTHER: dict[str, float] = {"thickness": 0.3, "second": 0.5, "seed": 7, "bias": 20.0, "directions": 5, "steps": 3}
_OTHER |= {"slices": 3, "start": 0.5, "falloff": 0.6, "thin": 0.5, "sectors": 16}

# Options that show nothing unless another one is set.
_WITH: dict[str, Changes] = {
    "combine": {"second": 0.5}, "background": {"range_check": "none"},
    "acos of visibility-bitmask": {"weighting": "uniform"},
}  # fmt: skip


def _own(estimator: Estimator, changes: Changes) -> Changes:
    """Those of some options that an estimator has, with values of that type."""
    return {o: v for o, v in changes.items() if type(estimator.parameters.get(o)) is type(v)}


def _option_recipes() -> Iterator[Recipe]:
    """Each estimator as it is, and each option changed."""
    for name, estimator in _ESTIMATORS.items():
        variants: list[tuple[str, str, Changes]] = [("", "", {}), ("_camera", "perspective", {})]
        own = text_options(estimator)
        for option, default in own.items():
            if isinstance(default, bool):
                variants.append((f"_{option}", "", {option: not default}))
            choices = estimator.said("choices").get(option, ())
            others = [choice for choice in choices if choice not in (default, CLEARED)]
            needed = _own(estimator, _WITH.get(f"{option} of {name}", _WITH.get(option, {})))
            variants += [(f"_{option}_{choice}", "", {**needed, option: choice}) for choice in others]
        if numbers := {o: _other(estimator, o, v) for o, v in own.items() if o in _OTHER or isinstance(v, float)}:
            variants.append(("_numbers", "", numbers))
        for suffix, projection, changes in variants:
            yield _recipe(f"estimator_{name}{suffix}", name, "", estimator_problem, projection, changes)
        yield _recipe(f"estimator_{name}_orthographic", name, "", estimator_problem, "orthographic", {}, 16)
    title = "remap where more than half of the samples are behind the surface, and fewer"
    yield Recipe("remapped", "estimator", title, _remap_problem, ESTIMATORS["point"])


def _curved_recipes() -> Iterator[Recipe]:
    """Estimators over balls and disks where the mapping is any display's, and has no image of some of their places."""
    changes: Changes = {"surface": "positions", "range_check": True}
    view = module_view(views.MISSED.with_resolution(16, 12))
    for name in ("alchemy", "point", "hemisphere", "oriented-hemisphere", "vo-points", "vo-points-normal"):
        own = _own(ESTIMATORS[name], changes)
        yield _recipe(f"curved_{name}", name, "convex screen", on_view, view, SCENE, 1.2, own)


def _disk_recipes() -> Iterator[Recipe]:
    """Estimators over disks: several samples, one without weight; no weights at all; places without image."""
    ways: list[tuple[str, Changes, Arrays]] = [
        ("weighted", {"thickness": 0.4}, {"points": np.array(_DISK), "weights": np.array([2.0, 1.0, 1.5, 0.5, 3.0])}),
        ("unweighted", {"randomize": False}, {"points": np.array(_DISK)}),
        ("rim", {}, {"points": np.array(_DISK[-1:])}),
    ]
    alone: list[tuple[str, Changes, Arrays]] = [("", {"bias": 60.0}, {}), ("turned", {"randomize": False}, {})]
    for name in ("vo-lines", "vo-lines-normal", "vo-area", "hbao"):
        estimator = ESTIMATORS[name]
        for suffix, changes, tables in ways if estimator.dimensions else alone:
            case, own = f"disk_{name}_{suffix}".rstrip("_"), _own(estimator, changes)
            yield _recipe(case, name, "convex screen", _disk_problem, own, tables)


# Passes over texels: views, whole numbers and places that the cases of single options do not reach.
_PASSES: dict[str, Changes] = {
    "": {},
    "finer": {"taps": 13, "turns": 0, "log_q": 0, "max_level": 1, "z_min": 2.0, "packed": False},
    "coarser": {"taps": 100, "turns": 0, "log_q": 0, "max_level": 9, "mip": "harmonic"},
    "sampled": {"quad_edge": 0.0, "gauss": 0.0},
    "unbiased": {"beta": 0.0, "epsilon": 0.0},
}
_LEVELS: dict[str, Changes] = {
    "": {},
    "alone": {"levels": 1, "kernel": 3},
    "many": {"levels": 7, "kernel": 1, "combine": "average"},
}


def _rough(estimator: Estimator, view: View, radius: float, changes: Changes) -> Problem:
    """Surfaces with holes and, for estimators that read them, normals that differ and depths that are equal."""
    parameters, inputs = on_view(estimator, view, SCENE, radius, changes)
    hole = noise(10, *inputs["depth"].shape) < 0.1
    depth = np.where(hole, np.float32(inf), inputs["depth"])
    arrays = {"depth": depth, "positions": np.where(hole[..., None], np.float32(inf), inputs["positions"])}
    if estimator.normals:
        normals = inputs["normals"] + np.float32(1.2) * noise(11, *inputs["normals"].shape) - np.float32(0.6)
        x, y, z = (normals[..., k] for k in range(3))
        normals = normals / np.sqrt((x * x + y * y) + z * z)[..., None]
        arrays["normals"] = np.where(np.isfinite(depth)[..., None], normals, np.float32(0))
        arrays["depth"] = np.round(depth * np.float32(16)) / np.float32(16)
    return parameters, {**inputs, **arrays}


def long_normals(estimator: Estimator, view: View, length: float = 1e19, changes: Changes | None = None) -> Problem:
    """Some long normals: of 10^19, the eighth power of their dot product with another one is infinite in float32."""
    parameters, inputs = _rough(estimator, view, 0.4, changes or {})
    lengths = np.where(noise(12, *inputs["depth"].shape) < 0.3, np.float32(length), np.float32(1))
    return parameters, {**inputs, "normals": lengths[..., None] * inputs["normals"]}


def _beyond_planes(estimator: Estimator, projection: str, share: float = 0.1) -> Problem:
    """A camera's depths, a share of them without distance: none exists in perspective, one below 0 in orthographic."""
    changes: Changes = {"mip": "harmonic", "log_q": 0}
    parameters, inputs = on_view(estimator, make_camera(projection), CAMERA_SCENE, 0.5, changes)
    depth = np.where(noise(10, *inputs["depth"].shape) < share, _BEYOND[projection], inputs["depth"])
    return parameters, {**inputs, "depth": depth}


def _endless(estimator: Estimator) -> Problem:
    """A camera whose far plane lies at infinity; some depths are 1 and more, which stands for no distance."""
    view = make_camera("perspective", 20, 15)
    endless, near = views.without_far_plane(view), float(view.lens[4])
    parameters, inputs = on_view(estimator, view, CAMERA_SCENE, 0.5, {"packed": False})
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


def _lines_problem(estimator: Estimator, display: Display, changes: Changes, scene: Scene = SCENE) -> Problem:
    """An estimator on a display whose texels' lines are a table."""
    view = module_view(display)
    parameters, inputs = on_view(estimator, view, scene, 0.3, changes)
    lines = texel_rays(view, np.dtype(np.float32)).table
    return parameters, {**inputs, "lines": np.ascontiguousarray(lines.T).reshape(*inputs["depth"].shape, 4)}


def _no_line_problem(estimator: Estimator) -> Problem:
    """Surfaces also in texels that have no line, as no caster of rays along the lines would give them."""
    parameters, inputs = _lines_problem(estimator, views.WIDE.with_resolution(20, 15), {})
    there = np.isnan(inputs["lines"][..., 0]) & (noise(10, *inputs["depth"].shape) < 0.5)
    depth = np.where(there, noise(12, *there.shape), inputs["depth"])
    positions = np.where(there[..., None], noise(13, *there.shape, 3), inputs["positions"])
    return parameters, {**inputs, "depth": depth, "positions": positions}


# Two taps along the columns land in the texture, 2^20 texels to a radius across: the number chooses their levels.
_CAPPED: Changes = {
    "taps": 998, "turns": 499, "log_q": 9, "mip": "max", "quad_edge": 0.0, "gauss": 0.0,
    "intensity": 100.0, "sigma": 100.0, "beta": 0.0, "epsilon": 0.0,
}  # fmt: skip

# Texels are covered or open, and those of the other depth count as much as their key says.
_SPREAD: Changes = {"normals": "buffer", "sharpness": 1.0, "quad_edge": 0.0, "intensity": 1e3, "sigma": 1e3}


def _at_lens(estimator: Estimator) -> Problem:
    """Surfaces just before the lens, where a radius is more than 2^22 texels across; each row has one depth."""
    parameters, inputs = on_view(estimator, _flat(8, 16), _plane(0.6993), 300.0, _own(estimator, _CAPPED))
    depth = np.float32(0.6993) + np.float32(6e-4) * (noise(12, 16, 1) - np.float32(0.5))
    return parameters, {**inputs, "depth": np.repeat(depth, 8, axis=1)}


def _at_observers(estimator: Estimator) -> Problem:
    """Surfaces less than 4e-7 from observers at -2.1, which is no float32; the nearer ones are open, others covered."""
    display = replace(views.DISPLAYS["convex"], observer_z=-2.1).with_resolution(20, 15)
    parameters, inputs = _lines_problem(estimator, display, _own(estimator, _SPREAD), _plane(-2.0))
    covered, nearest = noise(10, 15, 20) < 0.5, np.float32(-2.1)
    before = np.where(covered, np.float32(0), np.float32(0.12))[..., None] * inputs["normals"]
    depth = np.where(covered, np.nextafter(nearest, np.float32(0)), nearest)
    return parameters, {**inputs, "depth": depth, "positions": inputs["positions"] + before}


def _plane(z: float) -> Scene:
    return Scene((z, 0.0, 0.0, inf), ())


def _pass_recipes() -> Iterator[Recipe]:
    """Estimators that pass over texels and their levels."""
    for name in ("sao", "sao-equation-1", "multiresolution"):
        for suffix, *build in _pass_rows("multi" in name):
            yield _recipe(f"passes_{name}_{suffix}", name, suffix.replace("_", " "), *build)


def _pass_rows(multiresolution: bool) -> Iterator[tuple[Any, ...]]:
    """The end of a case's name, and how it is built from what."""
    odd, large = _flat(33, 21), _flat(48, 36)
    for suffix, changes in (_LEVELS if multiresolution else _PASSES).items():
        yield f"holes_{suffix}".rstrip("_"), _rough, odd, 0.4, changes
    for suffix, view, radius in (("one_texel", _flat(1, 1), 0.3), ("zero_radius", _flat(), 0.0), ("wide", large, 1e7)):
        yield suffix, on_view, view, SCENE, radius, {}
    if multiresolution:
        yield "long_normals", long_normals, odd
        return
    for projection in _BEYOND:
        yield projection, _beyond_planes, projection
    yield "infinite_far_plane", _endless
    yield "near", _rough, odd, 0.05, {}
    for kind in ("convex", "conical"):
        yield kind, _lines_problem, views.DISPLAYS[kind].with_resolution(20, 15), {"mip": "harmonic", "log_q": 0}
    yield "no_line", _no_line_problem
    far = replace(views.DISPLAYS["conical"], observer_z=-2.1)
    for suffix, size in (("edges", (9, 7)), ("column", (1, 6))):
        yield suffix, _lines_problem, far.with_resolution(*size), {"packed": False}, _ENDLESS
    yield "behind", _beyond_planes, "orthographic", 1.0
    near = module_view(views.NEAR.with_resolution(16, 12))
    for suffix, z_min in (("least_key", 1e-310), ("largest_key", 0.6)):
        yield suffix, on_view, near, SCENE, 0.3, {"z_min": z_min}
    yield "at_lens", _at_lens
    yield "at_observers", _at_observers


# Points and taps of few binary digits, of the radius 2: on borders of texels, at depths of surfaces, nearly edge-on.
_BALL = np.array([
    (0, 0, 0), (0, 0.5, 0), (0.125, -0.5, 0), (0, 0, 0.5), (-0.125, 0, -0.5), (0.125, 0.25, 0.25), (0.25, 0, 0),
    (0.25, 0.5, 0.5), (0, 0, 0.9375), (0.125, 0, -0.9375),
])  # fmt: skip
_FLAT = np.array([(0, 0), (0.5, 0), (0, 2.0**-21), (0, -0.5), (0.25, 0.75)])
_SINGLE: Changes = {"randomize": False, "thickness": 0.5}
_COARSE: Changes = {"quad_edge": 0.125, "mip": "harmonic", "log_q": 0, "reach": 3.0, "packed": False}
_EXACT: dict[str, Changes] = {
    "point": {"range_check": True}, "hemisphere": {"range_check": True}, "alchemy": {"beta": 0.0, "epsilon": 0.0},
    "oriented-hemisphere": {"bias": 0.0, "range_check": "distance"}, "sao": _COARSE, "sao-equation-1": _COARSE,
    "hbao": {"directions": 1, "steps": 5, "attenuation": "none", "randomize": False}, "multiresolution": {},
}  # fmt: skip


def _exact_problem(estimator: Estimator, radius: float, changes: Changes, projection: str) -> Problem:
    """Ties: textures and samples whose sums are exact, on a camera that looks along x; one texel lies in a pit."""
    camera = Camera(projection, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), 6.0, 1.0, 5.0)
    row, column = np.indices((6, 8))  # at the distance 1 texels are 1: all numbers have few binary digits
    z = 2 + 0.25 * ((column + 2 * row) % 4)
    z[2, 4], z[2, 1], z[2, 7], z[5, 6] = 4.5, 0.5, 0.5, 0.0  # the middle one lies 3, 4 and 5 from its two neighbours
    across = z if projection == "perspective" else 1.0
    positions = np.stack([z, (3.5 - column) * across, (2.5 - row) * across], -1).astype(np.float32)
    with np.errstate(divide="ignore"):
        depth = (1.25 - 1.25 / z if projection == "perspective" else 0.25 * z - 0.25).astype(np.float32)
    depth[5, 6] = np.float32(-0.25)  # in the plane of the eye, where a perspective has no image
    tables = {2: {"points": _FLAT}, 3: {"points": _BALL}, 0: {}}[estimator.dimensions]
    parameters, inputs = on_view(estimator, camera.view(8, 6), CAMERA_SCENE, radius, changes, tables)
    normals = np.where(((column + row) % 3 == 0)[..., None], [-(2.0**-22), 0.0, 1.0], [-1.0, 0.0, 0.0])
    own = {"depth": depth, "positions": positions, "normals": normals.astype(np.float32)}
    return parameters, {**inputs, **{name: array for name, array in own.items() if name in inputs}}


def _small_problem(
    estimator: Estimator, radius: float, changes: Changes, before: float = 0.01, tables: Arrays | None = None
) -> Problem:
    """Depths before their positions, by 0.01 some and others behind; by 0: the same, whose variance rounds below 0."""
    parameters, inputs = on_view(estimator, _flat(), SCENE, radius, _own(estimator, changes), tables)
    depth = inputs["depth"] if before else np.where(inputs["depth"] < inf, np.float32(0.15), np.float32(inf))
    return parameters, {**inputs, "depth": depth - np.float32(before)}


def _exact_recipes() -> Iterator[Recipe]:
    """Ties of every estimator, the radius 0, and radii so small or large that squares and quotients leave binary32."""
    for name, estimator in _ESTIMATORS.items():
        radius, changes = 5.0 if name == "hbao" else 2.0, _own(estimator, _EXACT.get(name, _SINGLE))
        yield _recipe(f"ties_{name}", name, "ties", _exact_problem, radius, changes, "orthographic")
        if not name.startswith(("sao", "multi")):
            yield _recipe(f"zero_{name}", name, "radius 0", _small_problem, 0.0, {"thickness": 0.4})
        if name in ("vo-points", "vo-lines", "vo-area"):
            points = np.array([(0.25, 0.75)] * 2 if estimator.dimensions == 2 else [(0.1, 0.1, 0.1)] * 10)
            given = 0.05, {"randomize": False}, 0.5, {"points": points}
            yield _recipe(f"covered_{name}", name, "sums that round to above 1", _small_problem, *given)
        if name in ("point", "hemisphere"):
            about, seen = "positions of a camera, one in the plane of its eye", {"surface": "positions"}
            yield _recipe(f"eye_plane_{name}", name, about, _exact_problem, 2.0, seen, "perspective")
        if name.startswith("vo-area"):
            yield _recipe(f"large_{name}", name, "radius 1e+25", _exact_problem, 1e25, _SINGLE, "orthographic")
            yield _recipe(f"even_{name}", name, "one depth", _small_problem, 0.3, {"prefilter": True}, 0.0)
            for size, radius in (("small", 1e-35), ("smallest", 1e-42)):
                yield _recipe(f"{size}_{name}", name, f"radius {radius:g}", _small_problem, radius, {"thickness": 0.4})


def _place_recipes() -> Iterator[Recipe]:
    """Guard bands, seeds beyond 32 bits, and cameras that look towards larger z."""
    guarded, flat = _flat(guard=3), {"k": 0.0, "sigma": 1e4}
    for name in ("vo-points", "hbao", "alchemy", "sao"):
        yield _recipe(f"guard_{name}", name, "a guard band of 3 texels", on_view, guarded, SCENE, views.RADIUS, {})
    for name in ("vo-points", "vo-lines", "hbao"):
        seed = {"seed": 5 * 2**40 + 2**31 + 9}
        yield _recipe(f"seed_{name}", name, "a seed of 43 bits", estimator_problem, "orthographic", seed, 12)
    for case, name, changes in (
        ("behind", "alchemy", {}), ("without_contrast", "alchemy", flat), ("without_contrast", "sao-equation-1", flat)
    ):  # fmt: skip
        about = case.replace("_", " ")
        yield _recipe(f"{case}_{name}", name, about, estimator_problem, "perspective", changes, 16, -5.0)


ESTIMATOR_FAMILIES = _option_recipes, _curved_recipes, _disk_recipes, _pass_recipes, _exact_recipes, _place_recipes
