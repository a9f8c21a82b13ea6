"""The registry of cases: one for each feature, sampler, singularity and estimator, each small."""

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from functools import partial
from math import inf, isfinite, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.camera import Camera
from lfssao.display import Display, Module
from lfssao.errors import InputError
from lfssao.estimators.buffers import Buffers
from lfssao.estimators.estimator import Estimator, Value
from lfssao.estimators.registry import ESTIMATORS
from lfssao.estimators.texel_lines import texel_lines
from lfssao.kernels.mapping import MATRIX
from lfssao.kernels.philox import random_unit
from lfssao.kit.borders import BORDERS, border_problem
from lfssao.kit.bounds import case_bounds
from lfssao.kit.case import Arrays, Case
from lfssao.kit.scenes import SCENE, Scene, textures
from lfssao.kit.specification import is_specified
from lfssao.kit.stages import STAGES
from lfssao.matrix import multiply, to_4x4
from lfssao.samples import METHODS, make_samples
from lfssao.view import KINDS, View, WorldToImage

Problem = tuple[dict[str, Any], Arrays]

_ROI = ((-0.4, -0.3, -0.3), (0.4, 0.3, 0.3))
_MODULE = Module(0.3, 0.05, 0.7, 32, 24)
# World -> physical: turned, mirrored and of a scale that differs from axis to axis, so that the ball is an ellipsoid.
_WORLD = np.array([[0.5, 0.1, 0.0, -0.1], [-0.1, 0.45, 0.05, 0.0], [0.0, 0.1, -0.6, 0.05]])
_RADIUS = 0.2


@dataclass(frozen=True)
class Recipe:
    """How a case is made.

    Attributes
    ----------
    name, stage, title : str
        As of ``Case``.
    build : callable
        ``build() -> (parameters, inputs)``.
    specified : bool
        As of ``Case``.
    """

    name: str
    stage: str
    title: str
    build: Callable[[], Problem]
    specified: bool = True


def _display(module: Module = _MODULE, **options: Any) -> Display:
    settings: dict[str, Any] = {
        "name": "kit", "screen_width": 1.0, "screen_height": 0.75, "observer_height": 0.1, "observer_z": -2.0,
        "modules": (module,), "roi": _ROI, **options,
    }  # fmt: skip
    return Display(**settings)


DISPLAYS = {
    "crossed_slits": _display(),
    "conical": _display(diffuser="conical"),
    "convex": _display(screen_curvature=0.7, observer_curvature=0.3),
    "concave": _display(screen_curvature=-0.6, observer_curvature=0.4),
    "projector": _display(replace(_MODULE, field_of_view=65.0, yaw=-20.0, pitch=3.0, roll=5.0)),
    "calibrated": _display(
        replace(_MODULE, homography=(32.5, 0.6, 16.2, -0.4, -31.2, 12.3, 0.02, -0.03, 1.0), k1=-0.06, k2=0.01)
    ),
    # All nine numbers of the other sign, w = 0 at a place that samples reach, and a fold that k2 alone makes.
    "negated": _display(
        replace(_MODULE, homography=(-32.5, -0.6, -16.2, 0.4, 31.2, -12.3, -0.9, 0.03, -1.0), k2=-0.02, width=30)
    ),
}
_DISPLAY_TITLES = {
    "crossed_slits": "flat screen, linear diffuser, texture aligned to the screen",
    "conical": "flat screen, conical diffuser",
    "convex": "convex screen, observers on an arc",
    "concave": "concave screen, observers on an arc",
    "projector": "module turned, with a field of view",
    "calibrated": "homography and radial distortion of a calibration",
    "negated": "homography whose ninth number is negative, distortion by k2 alone",
}


def _described(to_image: WorldToImage) -> dict[str, Any]:
    return {"kind": KINDS[to_image.kind], "numbers": to_image.numbers.tolist()}


def _module_view(display: Display, guard: int = 0) -> View:
    return display.view(0, _WORLD, guard)


def _module_problem(
    display: Display,
    samples: NDArray[np.float64] | None = None,
    radius: float = _RADIUS,
    scene: Scene = SCENE,
) -> Problem:
    """Algorithm 2 on the one module of a display."""
    view = _module_view(display)
    depth, positions = textures(view, scene)
    table = make_samples("latin", 8, 1) if samples is None else samples
    parameters = {"radius": radius, "mapping": _described(view.world_to_image)}
    return parameters, {"depth": depth, "positions": positions, "samples": table}


def _camera(projection: str, width: int = 32, height: int = 24) -> View:
    camera = Camera(projection, (1.0, 2.0, 5.0), (0.1, 0.0, 0.0), (0.0, 1.0, 0.1), 2.0, 3.0, 8.0)
    return camera.view(width, height)


# SCENE in a camera's eye space: twice as large, around the target.
_CAMERA_SCENE = SCENE.scaled(2.0, 5.4)


def _camera_problem(projection: str, view: View | None = None) -> Problem:
    view = _camera(projection) if view is None else view
    assert view.screen_to_world is not None
    parameters = {
        "radius": 0.5,
        "screen_to_world": view.screen_to_world.tolist(),
        "world_to_screen": view.world_to_image.numbers.reshape(4, 4).tolist(),
    }
    return parameters, {"depth": textures(view, _CAMERA_SCENE)[0], "samples": make_samples("latin", 8, 1)}


def _near_camera_problem() -> Problem:
    """Samples so far around surfaces that some lie behind the eye."""
    view = _camera("perspective", 16, 12)
    parameters, inputs = _camera_problem("perspective", view)
    table = make_samples("latin", 12, 3)
    table[:6] *= 0.03
    return {**parameters, "radius": 14.0}, {**inputs, "samples": table}


def _matrix_problem() -> Problem:
    """Algorithm 2 where the mapping is a matrix: positions are read, not made from depth."""
    view = _camera("perspective")
    depth, positions = textures(view, _CAMERA_SCENE)
    parameters = {"radius": 0.5, "mapping": _described(view.world_to_image)}
    return parameters, {"depth": depth, "positions": positions, "samples": make_samples("latin", 8, 1)}


def _small() -> Display:
    """The flat display with a texture of 16 x 12 texels."""
    return DISPLAYS["crossed_slits"].with_resolution(16, 12)


def _ties() -> Problem:
    """Every operation is exact here: samples land on borders of texels, and some are just as deep as the surface."""
    width, height = 8, 6
    column, row = np.meshgrid(np.arange(width), np.arange(height))
    depth = (0.25 * ((column + 2 * row) % 4)).astype(np.float32)
    positions = np.stack([column, row, depth], axis=-1).astype(np.float32)
    steps = [(0, 0, 0), (1, 0, 0), (-1, 0, 0.25), (0, 1, 0), (0, -1, -0.25), (0.5, 0.5, 0), (0, 0, 0.25), (1, 1, 0.5)]
    parameters = {"radius": 1.0, "mapping": {"kind": "matrix", "numbers": np.eye(4).ravel().tolist()}}
    return parameters, {"depth": depth, "positions": positions, "samples": np.array(steps, np.float64)}


def _background() -> Problem:
    parameters, inputs = _module_problem(_small())
    return parameters, {
        "depth": np.full_like(inputs["depth"], np.inf),
        "positions": np.full_like(inputs["positions"], np.inf),
        "samples": inputs["samples"],
    }


def _one_texel() -> Problem:
    return _module_problem(DISPLAYS["crossed_slits"].with_resolution(1, 1))


def _beyond(display: Display) -> Problem:
    """Samples far around surfaces: some reach where the mapping is not defined."""
    return _module_problem(display, make_samples("latin", 24, 3, 0.2, 1.0), 1.2)


# Lens and observers so near that samples pass them.
_NEAR = _display(replace(_MODULE, z=0.42), observer_z=-0.5)

# A lens outside the screen's cylinder: lines from it can pass beside it.
_MISSED = _display(replace(_MODULE, z=1.4), screen_curvature=1.8, observer_z=-0.5)

# The same with texels that look past the cylinder, along no line at all.
_WIDE = _display(replace(_MODULE, z=1.4, field_of_view=80.0), screen_curvature=1.8, observer_z=-0.5)


def _folding() -> Display:
    homography = (30.0, 0.0, 8.0, 0.0, -30.0, 3.0, 0.0, 0.0, 1.0)
    return _display(replace(_MODULE, homography=homography, k1=-0.1, width=16, height=6))


def _noise(stream: int, *shape: int) -> NDArray[np.float32]:
    """Numbers in (0, 1) by the counter-based generator."""
    flat = [random_unit(np.uint64(6), stream, k) for k in range(int(np.prod(shape)))]
    return np.array(flat, np.float64).reshape(shape).astype(np.float32)


def _points(scale: float) -> NDArray[np.float32]:
    """World points, most of them where a display has an image, and some where no display has one."""
    spread = np.array(2.0 * _noise(4, 60, 3) - 1.0, np.float32) * np.float32(scale)
    far = np.array([[0, 0, s] for s in (-3, -2, -1.1, 1.1, 2, 3.5)] + [[3, 0, 0], [-9, 0, 0], [0, 9, 0]], np.float32)
    return np.concatenate([spread, far])


def _mapping_problem(view: View) -> Problem:
    return {"mapping": _described(view.world_to_image)}, {"points": _points(1.0)}


def _numbers_problem(display: Display, guard: int) -> Problem:
    values = json.loads(json.dumps(asdict(display)))  # tuples as the lists that a file gives back
    return {"display": values, "module": 0, "guard": guard, "physical_from_world": _WORLD.tolist()}, {}


def _frame_problem() -> Problem:
    guard = 3
    view = _module_view(_small(), guard)
    depth, positions = textures(view, SCENE)
    image = _noise(5, *depth.shape, 3)
    image[np.isinf(depth)] = 0
    parameters = {
        "radii": [0.08, 0.2, 0.5], "sigma": 1.0, "guard": guard, "mapping": _described(view.world_to_image),
    }  # fmt: skip
    samples = make_samples("latin", 8, 1)
    return parameters, {"depth": depth, "positions": positions, "samples": samples, "image": image}


def _elementary_inputs(function: str) -> NDArray[np.float64]:
    units = [random_unit(np.uint64(7), 0, k) for k in range(240)]
    if function == "sincospi":
        borders = [k + 0.2499 * side for k in (-0.5, 0.0, 0.5) for side in (-1, 1)]  # just before a quarter's end
        return np.array(
            [8.0 * x - 4.0 for x in units] + [0.25 * k for k in range(-9, 10)] + [1e9 + 0.3, 2.0**50, *borders]
        )
    if function == "cbrt":
        return np.array(
            [x * 2.0 ** (10 * (k % 40) - 200) for k, x in enumerate(units)] + [0.0, 1.0, 8.0, 0.001, np.inf]
        )
    return np.array([80.0 * x - 60.0 for x in units] + [0.0, -0.5, 1.0, -700.0, 700.0, -746.0, 711.0])


def _philox_inputs() -> Arrays:
    words = [[int(random_unit(np.uint64(8), c, k) * 2**32) for c in range(6)] for k in range(20)]
    words += [[0] * 6, [2**32 - 1] * 6]
    table = np.array(words, np.uint32)
    return {"counters": np.ascontiguousarray(table[:, :4]), "keys": np.ascontiguousarray(table[:, 4:])}


def _estimator_problem(estimator: Estimator, camera: bool, changes: Mapping[str, Value]) -> Problem:
    """An estimator on a display's module or on a camera, some of its options changed.

    Changed options get more texels and a larger radius: filters of larger footprints are not reached otherwise.
    """
    large = DISPLAYS["crossed_slits"].with_resolution(48, 36)
    view = _camera("perspective") if camera else _module_view(large if changes else _small())
    radius = 0.5 if camera else 0.7 if changes else _RADIUS
    return _on_view(estimator, view, _CAMERA_SCENE if camera else SCENE, radius, changes, _own_tables(estimator))


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
    depth = exact + _noise(9, *exact.shape) * np.float32(0.02)  # so that it matters which of the two is read
    inputs: dict[str, NDArray[Any]] = {"depth": depth, "positions": positions}
    inputs["directions"] = Buffers(view, depth, positions).directions
    if estimator.normals:
        inputs["normals"] = _wall_normals(view, depth)
    inputs |= tables
    parameters = {
        "estimator": estimator.name, "radius": radius, "options": {**estimator.parameters, **changes},
        "mapping": _described(view.world_to_image), "viewer_distance": view.viewer_distance().tolist(),
        "view": _view_numbers(view),
    }  # fmt: skip
    return parameters, inputs


# One of them in the middle, one on the rim, where a line has no length.
_DISK = ((0.0, 0.0), (0.6, 0.1), (-0.3, 0.7), (0.2, -0.8), (-1.0, 0.0))


def _disk_problem(estimator: Estimator, changes: Mapping[str, Value], tables: Arrays) -> Problem:
    """An estimator over a disk where some of the disk has no image: beyond the screen, behind the lens."""
    view = _module_view(_MISSED.with_resolution(24, 18))
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


def _view_numbers(view: View) -> dict[str, Any]:
    """All of a view but its mapping, as JSON."""
    return {
        "name": view.name, "width": view.width, "height": view.height, "ray_kind": view.ray_kind,
        "lens": [number if isfinite(number) else None for number in view.lens.tolist()],
        "cast_from_world": view.cast_from_world.tolist(),
        "world_from_cast": view.world_from_cast.tolist(),
        "screen_to_world": None if view.screen_to_world is None else view.screen_to_world.tolist(),
        "depth_kind": view.depth_kind, "guard": view.guard,
    }  # fmt: skip


def _numbers() -> Iterator[Recipe]:
    for function in ("sincospi", "cbrt", "exp"):
        inputs = {"x": _elementary_inputs(function)}
        yield Recipe(f"elementary_{function}", "elementary", f"{function}, float64",
                     partial(lambda f, x: ({"function": f}, x), function, inputs))  # fmt: skip
    yield Recipe("philox", "philox", "Philox4x32-10", lambda: ({}, _philox_inputs()))
    for method in ("random", "jittered", "latin"):
        shape = {"method": method, "n": 12, "seed": str(2**40 + 7), "r_min": 0.8, "r_max": 1.0}
        yield Recipe(f"samples_{method}", "samples", f"the table of 12 samples, {method}", partial(_given, shape))
    for name, method, n, r_min, r_max in (
        ("ball", "jittered", 9, 0.0, 0.3), ("sphere", "jittered", 10, 0.9, 0.9000000000000001),
        ("point", "random", 2, 0.0, 0.0), ("one", "latin", 1, 0.5, 0.7),
    ):  # fmt: skip
        shape = {"method": method, "n": n, "seed": str(0xFEDCBA9DF6543215), "r_min": r_min, "r_max": r_max}
        title = f"{method}, {n} samples from {r_min:g} to {r_max:g}"
        yield Recipe(f"samples_{name}", "samples", title, partial(_given, shape))


def _given(parameters: dict[str, Any]) -> Problem:
    return parameters, {}


def _views() -> Iterator[Recipe]:
    for projection in ("perspective", "orthographic"):
        yield Recipe(f"algorithm1_{projection}", "algorithm1", f"{projection} camera",
                     partial(_camera_problem, projection))  # fmt: skip
        yield Recipe(f"mapping_{projection}", "mapping", f"world points in a {projection} camera",
                     partial(lambda p: _mapping_problem(_camera(p)), projection))  # fmt: skip
    for name, display in DISPLAYS.items():
        title = _DISPLAY_TITLES[name]
        for guard in (0, 5):
            guarded = f"_guard_{guard}" if guard else ""
            yield Recipe(f"numbers_{name}{guarded}", "numbers", f"the mapping's numbers: {title}",
                         partial(_numbers_problem, display, guard))  # fmt: skip
        yield Recipe(f"algorithm2_{name}", "algorithm2", title, partial(_module_problem, display))
        yield Recipe(f"mapping_{name}", "mapping", f"world points: {title}",
                     partial(lambda d: _mapping_problem(_module_view(d)), display))  # fmt: skip
    for name in BORDERS:
        yield Recipe(f"border_{name}", "mapping", f"world points on borders of the domain: {name.replace('_', ' ')}",
                     partial(border_problem, name))  # fmt: skip
    yield Recipe("behind_camera", "algorithm1", "samples behind a camera's eye", _near_camera_problem)
    yield Recipe("algorithm2_matrix", "algorithm2", "a camera, positions from a texture", _matrix_problem)
    for method in METHODS["ball"]:
        yield Recipe(f"table_{method}", "algorithm2", f"16 samples by the method {method}, the table an input",
                     partial(lambda m: _module_problem(_small(), make_samples(m, 16, 2)), method))  # fmt: skip


def _singular() -> Iterator[Recipe]:
    yield Recipe("ties", "algorithm2", "samples on borders of texels and just as deep as the surface", _ties)
    yield Recipe("background", "algorithm2", "no surface anywhere", _background)
    yield Recipe("one_texel", "algorithm2", "a texture of one texel", _one_texel)
    yield Recipe("zero_radius", "algorithm2", "radius 0: every sample is its point",
                 lambda: _module_problem(_small(), radius=0.0))  # fmt: skip
    yield Recipe("one_sample", "algorithm2", "one sample",
                 lambda: _module_problem(_small(), make_samples("random", 1, 4)))  # fmt: skip
    yield Recipe("outside", "algorithm2", "most samples outside the texture",
                 lambda: _module_problem(_small(), make_samples("latin", 16, 3), 1.2))  # fmt: skip
    for name, title, display in (
        ("behind_lens_and_observers", "samples behind the lens and behind the observers", _NEAR),
        (
            "conical_beyond",
            "conical diffuser: samples beyond where it has an image",
            replace(_NEAR, diffuser="conical"),
        ),
        ("convex_missed", "convex screen: samples that no point of it shows", _MISSED),
        ("folded", "samples beyond where the distortion folds", _folding()),
        ("behind_homography", "samples behind the line w = 0 of a homography", DISPLAYS["negated"]),
    ):
        small = display if name == "folded" else display.with_resolution(16, 12)
        yield Recipe(name, "algorithm2", title, partial(_beyond, small))


def _pictures() -> Iterator[Recipe]:
    yield Recipe("merge_three", "merge", "three radii", lambda: ({}, {"layers": _noise(0, 3, 12, 16)}))
    yield Recipe("merge_one", "merge", "one radius: a copy", lambda: ({}, {"layers": _noise(0, 1, 3, 5)}))
    for name, sigma, shape in (
        ("usual", 1.0, (12, 16)), ("wide", 2.5, (3, 2)), ("narrow", 0.01, (4, 4)), ("none", 0.0, (2, 3)),
        ("one_texel", 1.0, (1, 1)), ("row", 0.7, (1, 9)),
    ):  # fmt: skip
        title = f"sigma {sigma:g}, {shape[1]} x {shape[0]} texels"
        yield Recipe(f"blur_{name}", "blur", title,
                     partial(lambda s, n: ({"sigma": s}, {"source": _noise(1, *n)}), sigma, shape))  # fmt: skip
    yield Recipe("shade", "shade", "colours below, in and above 0 to 1",
                 lambda: ({}, {"image": _noise(2, 6, 8, 3) * 3 - 1, "occlusion": _occlusion_ramp()}))  # fmt: skip
    yield Recipe("frame", "frame", "three radii, merge, blur, shade, with a guard band", _frame_problem)


def _occlusion_ramp() -> NDArray[np.float32]:
    return (np.arange(48, dtype=np.float32) / np.float32(47)).reshape(6, 8)


def _remap_problem() -> Problem:
    """Depths so far before their positions that in some texels most samples are occluded, in others few."""
    estimator = ESTIMATORS["point"]
    tables = {"points": make_samples("latin", 8, 1)}
    view = _module_view(_small())
    parameters, inputs = _on_view(estimator, view, SCENE, _RADIUS, {"remap": True}, tables)
    return parameters, {**inputs, "depth": inputs["depth"] - _noise(12, *inputs["depth"].shape) * np.float32(0.1)}


def _remapped() -> Iterator[Recipe]:
    yield Recipe("remapped", "estimator", "remap where more than half of the samples are behind the surface, and fewer",
                 _remap_problem, is_specified("point"))  # fmt: skip


def _more(estimator: Estimator, option: str, value: float) -> float:
    """Another value of an option."""
    return min(1.5 * value, estimator.limits.get(option, (0.0, inf))[1])


# Options that are off by default, or take no multiple of it, and what cases set them to.
_OTHER: dict[str, Value] = {"thickness": 0.3, "second": 0.5, "seed": 7, "bias": 20.0, "directions": 5, "steps": 3}

# Options that show nothing unless another one is set.
_WITH = {"combine": "second"}


def _estimators() -> Iterator[Recipe]:
    """Every estimator of the registry but LF's, which is Algorithms 1 and 2: as it is, and each option changed."""
    for name, estimator in ESTIMATORS.items():
        if name == "lf":
            continue
        variants: list[tuple[str, bool, dict[str, Value]]] = [("", False, {}), ("_camera", True, {})]
        for option, default in estimator.parameters.items():
            if isinstance(default, bool):
                variants.append((f"_{option}", False, {option: not default}))
            others = [choice for choice in estimator.choices.get(option, ()) if choice != default]
            needed = {o: _OTHER[o] for o in estimator.parameters if o == _WITH.get(option)}
            variants += [(f"_{option}_{choice}", False, {**needed, option: choice}) for choice in others]
        numbers: dict[str, Value] = {
            o: _OTHER[o] if o in _OTHER else _more(estimator, o, float(v))
            for o, v in estimator.parameters.items()
            if o in _OTHER or isinstance(v, float)
        }
        if numbers:
            variants.append(("_numbers", False, numbers))
        for suffix, camera, changes in variants:
            yield Recipe(f"estimator_{name}{suffix}", "estimator", estimator.title,
                         partial(_estimator_problem, estimator, camera, changes), is_specified(name))  # fmt: skip


def _curved() -> Iterator[Recipe]:
    """Estimators over balls and disks where the mapping is any display's, and has no image of some of their places."""
    changes: dict[str, Value] = {"surface": "positions", "range_check": True, "rotation": "common"}
    for name in ("alchemy", "point", "hemisphere", "vo-points", "vo-points-normal"):
        estimator, view = ESTIMATORS[name], _module_view(_MISSED.with_resolution(16, 12))
        own = {option: value for option, value in changes.items() if option in estimator.parameters}
        yield Recipe(f"curved_{name}", "estimator", f"{estimator.title}: convex screen",
                     partial(_on_view, estimator, view, SCENE, 1.2, own, _own_tables(estimator)),
                     is_specified(name))  # fmt: skip


def _disks() -> Iterator[Recipe]:
    """Estimators over disks: several samples of which one has no weight, no weights at all, places without image."""
    ways: list[tuple[str, dict[str, Value], Arrays]] = [
        ("weighted", {"thickness": 0.4}, {"points": np.array(_DISK), "weights": np.array([2.0, 1.0, 1.5, 0.5, 3.0])}),
        ("unweighted", {"randomize": False}, {"points": np.array(_DISK)}),
        ("rim", {}, {"points": np.array(_DISK[-1:])}),
    ]
    for name in ("vo-lines", "vo-lines-normal", "vo-area", "vo-area-normal", "hbao"):
        estimator = ESTIMATORS[name]
        for suffix, changes, tables in (
            ways if estimator.dimensions else [("", {"bias": 60.0}, {}), ("turned", {"randomize": False}, {})]
        ):
            options = {o: v for o, v in changes.items() if o in estimator.parameters}
            yield Recipe(f"disk_{name}_{suffix}".rstrip("_"), "estimator", f"{estimator.title}: convex screen",
                         partial(_disk_problem, estimator, options, tables), is_specified(name))  # fmt: skip


# Passes over texels: views, whole numbers and places that the cases of single options do not come to.
_PASSES: dict[str, dict[str, Value]] = {
    "": {},
    "finer": {"taps": 13, "turns": 0, "log_q": 0, "max_level": 1, "z_min": 2.0, "packed": False},
    "coarser": {"taps": 100, "turns": 0, "log_q": 0, "max_level": 9, "mip": "harmonic"},
    "sampled": {"quad_edge": 0.0, "gauss": 0.0},
    "unbiased": {"beta": 0.0, "epsilon": 0.0},
}
_LEVELS: dict[str, dict[str, Value]] = {
    "": {}, "alone": {"levels": 1, "kernel": 3}, "many": {"levels": 7, "kernel": 1, "combine": "average"},
}  # fmt: skip


def _rough(view: View, radius: float, estimator: Estimator, changes: Mapping[str, Value]) -> Problem:
    """Surfaces with holes and, for estimators that read them, normals that differ and depths that are equal."""
    parameters, inputs = _on_view(estimator, view, SCENE, radius, changes, {})
    hole = _noise(10, *inputs["depth"].shape) < 0.1
    arrays = {name: np.where(hole if array.ndim == 2 else hole[..., None], np.float32(np.inf), array)
              for name, array in inputs.items() if name in ("depth", "positions")}  # fmt: skip
    if estimator.normals:
        normals = inputs["normals"] + np.float32(1.2) * _noise(11, *inputs["normals"].shape) - np.float32(0.6)
        x, y, z = (normals[..., k] for k in range(3))
        normals = normals / np.sqrt((x * x + y * y) + z * z)[..., None]
        arrays["normals"] = np.where(np.isfinite(arrays["depth"])[..., None], normals, np.float32(0))
        arrays["depth"] = np.round(arrays["depth"] * np.float32(16)) / np.float32(16)
    return parameters, {**inputs, **arrays}


def _beyond_planes(estimator: Estimator, projection: str) -> Problem:
    """A camera's depths of which some stand for no distance: none at all in perspective, otherwise one below 0."""
    parameters, inputs = _on_view(estimator, _camera(projection), _CAMERA_SCENE, 0.5, {"mip": "harmonic"}, {})
    depth = np.where(_noise(10, *inputs["depth"].shape) < 0.1, _BEYOND[projection], inputs["depth"])
    return parameters, {**inputs, "depth": depth}


def _endless(estimator: Estimator) -> Problem:
    """A camera whose far plane lies at infinity; some depths are 1 and more, which stands for no distance."""
    view = _camera("perspective", 20, 15)
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
    parameters, inputs = _on_view(estimator, view, _CAMERA_SCENE, 0.5, {"packed": False}, {})
    parameters |= {"mapping": _described(endless.world_to_image), "view": _view_numbers(endless)}
    a, b, c, d = view.cast_from_world[2].tolist()
    x, y, z = (inputs["positions"][..., k].astype(np.float64) for k in range(3))
    with np.errstate(invalid="ignore"):  # where there is no surface
        depth = (1 - near / (((a * x + b * y) + c * z) + d)).astype(np.float32)
    wild = _noise(10, *depth.shape)
    depth = np.where(wild < 0.05, np.float32(1.0), np.where(wild < 0.1, np.float32(1.75), depth))
    return parameters, {**inputs, "depth": np.where(np.isfinite(inputs["depth"]), depth, np.float32(inf))}


_BEYOND = {"perspective": np.float32(1.75), "orthographic": np.float32(-0.75)}


def _lines_problem(estimator: Estimator, display: Display, changes: Mapping[str, Value]) -> Problem:
    """An estimator on a display whose texels' lines are a table."""
    view = _module_view(display)
    parameters, inputs = _on_view(estimator, view, SCENE, 0.3, changes, {})
    lines = texel_lines(view, np.dtype(np.float32)).table
    return parameters, {**inputs, "lines": np.ascontiguousarray(lines.T).reshape(*inputs["depth"].shape, 4)}


def _no_line_problem(estimator: Estimator) -> Problem:
    """Surfaces also in texels that have no line, as no caster of rays along the lines would give them."""
    parameters, inputs = _lines_problem(estimator, _WIDE.with_resolution(20, 15), {})
    there = np.isnan(inputs["lines"][..., 0]) & (_noise(10, *inputs["depth"].shape) < 0.5)
    depth = np.where(there, _noise(12, *there.shape), inputs["depth"])
    positions = np.where(there[..., None], _noise(13, *there.shape, 3), inputs["positions"])
    return parameters, {**inputs, "depth": depth, "positions": positions}


def _passes() -> Iterator[Recipe]:
    """Estimators that pass over texels and their levels."""
    for name in ("sao", "sao-equation-1", "multiresolution"):
        estimator, specified = ESTIMATORS[name], is_specified(name)
        large, odd, one = (DISPLAYS["crossed_slits"].with_resolution(*size) for size in ((48, 36), (33, 21), (1, 1)))
        builds: dict[str, Callable[[], Problem]] = {
            f"holes_{suffix}".rstrip("_"): partial(_rough, _module_view(odd), 0.4, estimator, changes)
            for suffix, changes in (_LEVELS if estimator.normals else _PASSES).items()
        }
        builds["one_texel"] = partial(_on_view, estimator, _module_view(one), SCENE, 0.3, {}, {})
        builds["zero_radius"] = partial(_on_view, estimator, _module_view(_small()), SCENE, 0.0, {}, {})
        builds["wide"] = partial(_on_view, estimator, _module_view(large), SCENE, 1e7, {}, {})
        if not estimator.normals:
            builds |= {projection: partial(_beyond_planes, estimator, projection) for projection in _BEYOND}
            builds["infinite_far_plane"] = partial(_endless, estimator)
            builds["near"] = partial(_rough, _module_view(odd), 0.05, estimator, {})
            for kind in ("convex", "conical"):
                display = DISPLAYS[kind].with_resolution(20, 15)
                builds[kind] = partial(_lines_problem, estimator, display, {"mip": "harmonic", "log_q": 0})
            builds["no_line"] = partial(_no_line_problem, estimator)
        for suffix, build in builds.items():
            yield Recipe(f"passes_{name}_{suffix}", "estimator", f"{estimator.title}: {suffix.replace('_', ' ')}",
                         build, specified)  # fmt: skip


RECIPES = {
    recipe.name: recipe
    for family in (_numbers, _views, _singular, _pictures, _estimators, _remapped, _curved, _disks, _passes)
    for recipe in family()
}  # fmt: skip


def case_names() -> list[str]:
    """Names of all cases of the registry."""
    return list(RECIPES)


def make_case(name: str) -> Case:
    """A case of the registry, solved.

    Raises
    ------
    InputError
        If there is none of that name.
    """
    if name not in RECIPES:
        raise InputError(f"there is no case '{name}': choose one of {', '.join(RECIPES)}")
    recipe = RECIPES[name]
    parameters, inputs = recipe.build()
    outputs = STAGES[recipe.stage].run(parameters, inputs)
    bounds = case_bounds(recipe.stage, parameters, inputs)
    return Case(name, recipe.stage, recipe.title, parameters, inputs, outputs, bounds, recipe.specified)
