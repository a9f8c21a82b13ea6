"""The registry of cases: one for each feature, sampler, singularity and estimator, each small."""

import json
from collections.abc import Iterator
from dataclasses import asdict, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.display import Display
from lfssao.errors import InputError
from lfssao.kernels.philox import random_unit
from lfssao.kit.borders import BORDERS, border_problem
from lfssao.kit.estimator_cases import curved_recipes, disk_recipes, option_recipes, pass_recipes, remapped_recipes
from lfssao.kit.scenes import SCENE, Scene, textures
from lfssao.kit.stages import STAGES
from lfssao.kit.views import (
    CAMERA_SCENE,
    DISPLAYS,
    MISSED,
    MODULE,
    NEAR,
    RADIUS,
    WORLD,
    Problem,
    Recipe,
    described,
    make_camera,
    make_display,
    module_view,
    noise,
    small_display,
)
from lfssao.oracle.case import Arrays, Case
from lfssao.samples import METHODS, make_samples
from lfssao.view import View

_DISPLAY_TITLES = {
    "crossed_slits": "flat screen, linear diffuser, texture aligned to the screen",
    "conical": "flat screen, conical diffuser",
    "convex": "convex screen, observers on an arc",
    "concave": "concave screen, observers on an arc",
    "projector": "module turned, with a field of view",
    "calibrated": "homography and radial distortion of a calibration",
    "negated": "homography whose ninth number is negative, distortion by k2 alone",
}


def _module_problem(
    display: Display,
    samples: NDArray[np.float64] | None = None,
    radius: float = RADIUS,
    scene: Scene = SCENE,
) -> Problem:
    """Algorithm 2 on the one module of a display."""
    view = module_view(display)
    depth, positions = textures(view, scene)
    table = make_samples("latin", 8, 1) if samples is None else samples
    parameters = {"radius": radius, "mapping": described(view.world_to_image)}
    return parameters, {"depth": depth, "positions": positions, "samples": table}


def _camera_problem(projection: str, view: View | None = None) -> Problem:
    view = make_camera(projection) if view is None else view
    assert view.screen_to_world is not None
    parameters = {
        "radius": 0.5,
        "screen_to_world": view.screen_to_world.tolist(),
        "world_to_screen": view.world_to_image.numbers.reshape(4, 4).tolist(),
    }
    return parameters, {"depth": textures(view, CAMERA_SCENE)[0], "samples": make_samples("latin", 8, 1)}


def _near_camera_problem() -> Problem:
    """Samples so far around surfaces that some lie behind the eye."""
    view = make_camera("perspective", 16, 12)
    parameters, inputs = _camera_problem("perspective", view)
    table = make_samples("latin", 12, 3)
    table[:6] *= 0.03
    return {**parameters, "radius": 14.0}, {**inputs, "samples": table}


def _matrix_problem() -> Problem:
    """Algorithm 2 where the mapping is a matrix: positions are read, not made from depth."""
    view = make_camera("perspective")
    depth, positions = textures(view, CAMERA_SCENE)
    parameters = {"radius": 0.5, "mapping": described(view.world_to_image)}
    return parameters, {"depth": depth, "positions": positions, "samples": make_samples("latin", 8, 1)}


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
    parameters, inputs = _module_problem(small_display())
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


def _folding() -> Display:
    homography = (30.0, 0.0, 8.0, 0.0, -30.0, 3.0, 0.0, 0.0, 1.0)
    return make_display(replace(MODULE, homography=homography, k1=-0.1, width=16, height=6))


def _points(scale: float) -> NDArray[np.float32]:
    """World points, most of them where a display has an image, and some where no display has one."""
    spread = np.array(2.0 * noise(4, 60, 3) - 1.0, np.float32) * np.float32(scale)
    far = np.array([[0, 0, s] for s in (-3, -2, -1.1, 1.1, 2, 3.5)] + [[3, 0, 0], [-9, 0, 0], [0, 9, 0]], np.float32)
    return np.concatenate([spread, far])


def _mapping_problem(view: View) -> Problem:
    return {"mapping": described(view.world_to_image)}, {"points": _points(1.0)}


def _numbers_problem(display: Display, guard: int) -> Problem:
    values = json.loads(json.dumps(asdict(display)))  # tuples as the lists that a file gives back
    return {"display": values, "module": 0, "guard": guard, "physical_from_world": WORLD.tolist()}, {}


def _frame_problem() -> Problem:
    guard = 3
    view = module_view(small_display(), guard)
    depth, positions = textures(view, SCENE)
    image = noise(5, *depth.shape, 3)
    image[np.isinf(depth)] = 0
    parameters = {
        "radii": [0.08, 0.2, 0.5], "sigma": 1.0, "guard": guard, "mapping": described(view.world_to_image),
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
                     partial(lambda p: _mapping_problem(make_camera(p)), projection))  # fmt: skip
    for name, display in DISPLAYS.items():
        title = _DISPLAY_TITLES[name]
        for guard in (0, 5):
            guarded = f"_guard_{guard}" if guard else ""
            yield Recipe(f"numbers_{name}{guarded}", "numbers", f"the mapping's numbers: {title}",
                         partial(_numbers_problem, display, guard))  # fmt: skip
        yield Recipe(f"algorithm2_{name}", "algorithm2", title, partial(_module_problem, display))
        yield Recipe(f"mapping_{name}", "mapping", f"world points: {title}",
                     partial(lambda d: _mapping_problem(module_view(d)), display))  # fmt: skip
    for name in BORDERS:
        yield Recipe(f"border_{name}", "mapping", f"world points on borders of the domain: {name.replace('_', ' ')}",
                     partial(border_problem, name))  # fmt: skip
    yield Recipe("behind_camera", "algorithm1", "samples behind a camera's eye", _near_camera_problem)
    yield Recipe("algorithm2_matrix", "algorithm2", "a camera, positions from a texture", _matrix_problem)
    for method in METHODS["ball"]:
        yield Recipe(f"table_{method}", "algorithm2", f"16 samples by the method {method}, the table an input",
                     partial(lambda m: _module_problem(small_display(), make_samples(m, 16, 2)), method))  # fmt: skip


def _singular() -> Iterator[Recipe]:
    yield Recipe("ties", "algorithm2", "samples on borders of texels and just as deep as the surface", _ties)
    yield Recipe("background", "algorithm2", "no surface anywhere", _background)
    yield Recipe("one_texel", "algorithm2", "a texture of one texel", _one_texel)
    yield Recipe("zero_radius", "algorithm2", "radius 0: every sample is its point",
                 lambda: _module_problem(small_display(), radius=0.0))  # fmt: skip
    yield Recipe("one_sample", "algorithm2", "one sample",
                 lambda: _module_problem(small_display(), make_samples("random", 1, 4)))  # fmt: skip
    yield Recipe("outside", "algorithm2", "most samples outside the texture",
                 lambda: _module_problem(small_display(), make_samples("latin", 16, 3), 1.2))  # fmt: skip
    for name, title, display in (
        ("behind_lens_and_observers", "samples behind the lens and behind the observers", NEAR),
        (
            "conical_beyond",
            "conical diffuser: samples beyond where it has an image",
            replace(NEAR, diffuser="conical"),
        ),
        ("convex_missed", "convex screen: samples that no point of it shows", MISSED),
        ("folded", "samples beyond where the distortion folds", _folding()),
        ("behind_homography", "samples behind the line w = 0 of a homography", DISPLAYS["negated"]),
    ):
        small = display if name == "folded" else display.with_resolution(16, 12)
        yield Recipe(name, "algorithm2", title, partial(_beyond, small))


def _pictures() -> Iterator[Recipe]:
    yield Recipe("merge_three", "merge", "three radii", lambda: ({}, {"layers": noise(0, 3, 12, 16)}))
    yield Recipe("merge_one", "merge", "one radius: a copy", lambda: ({}, {"layers": noise(0, 1, 3, 5)}))
    for name, sigma, shape in (
        ("usual", 1.0, (12, 16)), ("wide", 2.5, (3, 2)), ("narrow", 0.01, (4, 4)), ("none", 0.0, (2, 3)),
        ("one_texel", 1.0, (1, 1)), ("row", 0.7, (1, 9)),
    ):  # fmt: skip
        title = f"sigma {sigma:g}, {shape[1]} x {shape[0]} texels"
        yield Recipe(f"blur_{name}", "blur", title,
                     partial(lambda s, n: ({"sigma": s}, {"source": noise(1, *n)}), sigma, shape))  # fmt: skip
    yield Recipe("shade", "shade", "colours below, in and above 0 to 1",
                 lambda: ({}, {"image": noise(2, 6, 8, 3) * 3 - 1, "occlusion": _occlusion_ramp()}))  # fmt: skip
    yield Recipe("frame", "frame", "three radii, merge, blur, shade, with a guard band", _frame_problem)


def _occlusion_ramp() -> NDArray[np.float32]:
    return (np.arange(48, dtype=np.float32) / np.float32(47)).reshape(6, 8)


_FAMILIES = (
    _numbers, _views, _singular, _pictures, option_recipes, remapped_recipes, curved_recipes, disk_recipes, pass_recipes
)  # fmt: skip
RECIPES = {recipe.name: recipe for family in _FAMILIES for recipe in family()}


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
    stage = STAGES[recipe.stage]
    parameters, inputs = recipe.build()
    outputs = stage.run(parameters, inputs)
    bounds = {name: b for name, b in stage.bounds(parameters, inputs).items() if b is not None}
    return Case(name, recipe.stage, recipe.title, parameters, inputs, outputs, bounds, recipe.specified)
