"""The registry of cases: one for each feature, sampler, singularity and estimator, each small."""

import json
from collections.abc import Callable, Iterator
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from lfssao.ao.estimators.registry import ESTIMATORS
from lfssao.core.philox import random_unit
from lfssao.errors import check_choice
from lfssao.optics.display import Display
from lfssao.optics.view import View
from lfssao.samples import METHODS, ROTATIONS, make_samples, texel_turns
from lfssao.verify.case import Case
from lfssao.verify.kit import views
from lfssao.verify.kit.borders import BORDERS, border_problem
from lfssao.verify.kit.estimator_cases import ESTIMATOR_FAMILIES, estimator_problem
from lfssao.verify.kit.reading_cases import READING_FAMILIES
from lfssao.verify.kit.scenes import NOTHING, SCENE, Scene, textures
from lfssao.verify.kit.stages import STAGES, stage_bounds
from lfssao.verify.kit.views import CAMERA_SCENE, MISSED, NEAR, Problem, Recipe, make_camera, module_view

_DISPLAY_TITLES = {
    "crossed_slits": "flat screen, linear diffuser, texture aligned to the screen",
    "conical": "flat screen, conical diffuser",
    "convex": "convex screen, observers on an arc",
    "concave": "concave screen, observers on an arc",
    "projector": "module turned, with a field of view",
    "calibrated": "homography and radial distortion of a calibration",
    "negated": "homography whose ninth number is negative, distortion by k2 alone",
}
_SEED = 0xFEDCBA9DF6543215
_TIE = 0.47273688628671334  # a sigma whose outermost weight is 1794.5 * 2^-24
_Table = tuple[str, int, int] | tuple[str, int, int, float, float]  # arguments of ``make_samples``
_LATIN = "latin", 8, 1
_MATRIX = make_camera("perspective"), CAMERA_SCENE, _LATIN, 0.5  # arguments of ``_module_problem``
_FOLDING = views.make_display(
    replace(views.MODULE, homography=(30.0, 0.0, 8.0, 0.0, -30.0, 3.0, 0.0, 0.0, 1.0), k1=-0.1, width=16, height=6)
)


def _module_problem(view: View, scene: Scene = SCENE, table: _Table = _LATIN, radius: float = views.RADIUS) -> Problem:
    """Algorithm 2 on a view, with a table of ``make_samples``; a camera's mapping is a matrix."""
    depth, positions = textures(view, scene)
    parameters = {"radius": radius, "mapping": views.described(view.world_to_image)}
    return parameters, {"depth": depth, "positions": positions, "samples": make_samples(*table)}


def _camera_problem(projection: str, *size: int) -> Problem:
    """Algorithm 1 on a camera."""
    view = make_camera(projection, *size)
    assert view.screen_to_world is not None
    parameters = {
        "radius": 0.5,
        "screen_to_world": view.screen_to_world.tolist(),
        "world_to_screen": view.world_to_image.numbers.reshape(4, 4).tolist(),
    }
    return parameters, {"depth": textures(view, CAMERA_SCENE)[0], "samples": make_samples(*_LATIN)}


def _near_camera_problem() -> Problem:
    """Samples so far around surfaces that some lie behind the eye."""
    parameters, inputs = _camera_problem("perspective", 16, 12)
    table = make_samples("latin", 12, 3)
    table[:6] *= 0.03
    return {**parameters, "radius": 14.0}, {**inputs, "samples": table}


def _ties() -> Problem:
    """Every operation is exact here: samples land on borders of texels, and some are just as deep as the surface."""
    width = 8
    height = 6
    column, row = np.meshgrid(np.arange(width), np.arange(height))
    depth = (0.25 * ((column + 2 * row) % 4)).astype(np.float32)
    positions = np.stack([column, row, depth], axis=-1).astype(np.float32)
    steps = [(0, 0, 0), (1, 0, 0), (-1, 0, 0.25), (0, 1, 0), (0, -1, -0.25), (0.5, 0.5, 0), (0, 0, 0.25), (1, 1, 0.5)]
    parameters = {"radius": 1.0, "mapping": {"kind": "matrix", "numbers": np.eye(4).ravel().tolist()}}
    return parameters, {"depth": depth, "positions": positions, "samples": np.array(steps, np.float64)}


def _mapping_problem(view: View, offset: bool = False) -> Problem:
    """World points, most of them where a view has an image, some where it has none; offset: with offsets."""
    spread = np.array(2.0 * views.noise(4, 60, 3) - 1.0, np.float32)
    far = np.array([[0, 0, s] for s in (-3, -2, -1.1, 1.1, 2, 3.5)] + [[3, 0, 0], [-9, 0, 0], [0, 9, 0]], np.float32)
    points = np.concatenate([spread, far])
    offsets = {"offsets": np.float32(0.3) * views.noise(7, *points.shape) - np.float32(0.15)} if offset else {}
    return {"mapping": views.described(view.world_to_image)}, {"points": points, **offsets}


def _without_inputs(parameters: dict[str, Any]) -> Problem:
    return parameters, {}


def _frame_problem() -> Problem:
    parameters, inputs = _module_problem(module_view(views.SMALL, 3))
    image = views.noise(5, *inputs["depth"].shape, 3)
    image[np.isinf(inputs["depth"])] = 0
    passes = {"radii": [0.08, 0.2, 0.5], "sigma": 1.0, "guard": 3}
    return {**passes, "mapping": parameters["mapping"]}, {**inputs, "image": image}


def _blur_problem(sigma: float, height: int, width: int, least: float = 0.0) -> Problem:
    return {"sigma": sigma}, {"source": np.maximum(views.noise(1, height, width), np.float32(least))}


def _merge_problem(count: int, height: int, width: int) -> Problem:
    return {}, {"layers": views.noise(0, count, height, width)}


def _shade_problem() -> Problem:
    ramp = (np.arange(48, dtype=np.float32) / np.float32(47)).reshape(6, 8)
    return {}, {"image": views.noise(2, 6, 8, 3) * 3 - 1, "occlusion": ramp}


def _light_problem(occlude: str, ambient: float) -> Problem:
    """Normals on both sides of the light, some of which are 0 or no unit vectors."""
    _, inputs = _shade_problem()
    normals = views.noise(6, 6, 8, 3) * 2 - 1
    x, y, z = normals[:5].T
    normals[:5] /= np.sqrt(x * x + y * y + z * z).T[..., None]
    normals[0, ::3] = 0
    return {"direction": [1.0, -2.0, 3.0], "ambient": ambient, "occlude": occlude}, {**inputs, "normals": normals}


def _turning(build: Callable[..., Problem], *arguments: Any) -> Problem:
    """A problem whose samples turn from texel to texel, as the hash has it."""
    parameters, inputs = build(*arguments)
    height, width = inputs["depth"].shape
    return parameters, {**inputs, "turns": texel_turns("hash", height, width, _SEED, np.dtype(np.float32))}


def _elementary_problem(function: str) -> Problem:
    """Numbers of a function's domain, spread and special ones."""
    k, units = np.arange(240), np.array([random_unit(np.uint64(7), 0, k) for k in range(240)])
    border = [k + 0.2499 * side for k in (-0.5, 0.0, 0.5) for side in (-1, 1)]  # just before a quarter's end
    around = [np.nextafter(x, x + side) for x in (0.5**0.5, 2.0**0.5) for side in (-1, 0, 1)]
    logs = [*np.ldexp(units, k % 60 - 40), 1.0, 2.0**-1022, *around]
    far = [1834183, 1890379225, 2**31 - 1, 2**31, 2**32 - 1, 2**32, 2**40 + 5]  # the first two carry far
    tables: dict[str, list[Any]] = {
        "sincospi": [*(8.0 * units - 4.0), *(0.25 * np.arange(-9, 10)), 1e9 + 0.3, 2.0**50, *border],
        "acos": [*(2.0 * units - 1.0), -1.0, -0.5, 0.0, 0.5, 1.0, np.nextafter(0.5, 1.0), np.nextafter(1.0, 0.0)],
        "cbrt": [*np.ldexp(units, 10 * (k % 40) - 200), 0.0, 1.0, 8.0, 0.001, np.inf],
        "exp": [*(80.0 * units - 60.0), 0.0, -0.5, 1.0, -700.0, 700.0, -746.0, 711.0],
        "log": [*logs, 5e-324],
        "log2": [*logs, -1.0, 0.0, 5e-324, np.inf, np.nan],
        "reduced": [sign * whole for sign in (1, -1) for whole in (*range(30), *far)],
        "turns": list(range(1, 201)),
    }
    whole = function in ("reduced", "turns")
    return {"function": function}, {"x": np.array(tables[function], np.int64 if whole else np.float64)}


def _philox_problem() -> Problem:
    words = [[int(random_unit(np.uint64(8), c, k) * 2**32) for c in range(6)] for k in range(20)]
    words += [[0] * 6, [2**32 - 1] * 6]
    table = np.array(words, np.uint32)
    return {}, {"counters": np.ascontiguousarray(table[:, :4]), "keys": np.ascontiguousarray(table[:, 4:])}


_ELEMENTARY = {
    **{name: f"{name}, float64" for name in ("sincospi", "acos", "cbrt", "exp", "log", "log2")},
    "reduced": "whole radians as half-turns, wrapped to 32 bits",
    "turns": "turns of spirals of 1 to 200 taps",
}

# Displays that one field alone makes other than crossed slits, and the branches by which a distortion folds.
_ALONE = {
    "screen_curvature": (views.make_display(screen_curvature=0.7), "curved screen alone"),
    "observer_curvature": (views.make_display(observer_curvature=0.3), "observers on an arc alone"),
    "homography": (
        views.make_display(replace(views.MODULE, homography=(32.0, 0.0, 16.0, 0.0, -32.0, 12.0, 0.0, 0.0, 1.0))),
        "homography alone, of the plain screen",
    ),
} | {
    f"fold_{name}": (views.make_display(replace(views.MODULE, k1=k1, k2=k2)), f"k1 = {k1:g}, k2 = {k2:g}")
    for name, k1, k2 in (
        ("k1", -0.08, 0.0), ("k2", 0.0, -0.02), ("never", 0.1, 0.0), ("far", -1e-39, 0.0),
        ("first_of_two", -0.095, 0.0034), ("one_of_two", 0.1, -0.02), ("none_of_two", 0.6, 0.05),
        ("two_in_one", -1 / 24, 1 / 1280),
    )
}  # fmt: skip


def _numbers() -> Iterator[Recipe]:
    for function, title in _ELEMENTARY.items():
        yield Recipe(f"elementary_{function}", "elementary", title, _elementary_problem, function)
    yield Recipe("philox", "philox", "Philox4x32-10", _philox_problem)
    for name, method, n, seed, low, high in (
        *((method, method, 12, 2**40 + 7, 0.8, 1.0) for method in ("random", "jittered", "latin")),
        ("ball", "jittered", 9, _SEED, 0.0, 0.3),
        ("sphere", "jittered", 10, _SEED, 0.9, 0.9000000000000001),
        ("point", "random", 2, _SEED, 0.0, 0.0),
        ("one", "latin", 1, _SEED, 0.5, 0.7),
    ):
        about = f"{method}, {n} samples from {low:g} to {high:g}"
        title = f"the table of 12 samples, {method}" if name == method else about
        table = {"method": method, "n": n, "seed": str(seed), "r_min": low, "r_max": high}
        yield Recipe(f"samples_{name}", "samples", title, _without_inputs, table)


def _turned() -> Iterator[Recipe]:
    for name, height, width in (
        ("hash", 9, 12), ("tiles", 5, 7), ("ign", 12, 16), ("blue-noise", 66, 65), ("sao-hash", 13, 11),
        ("common-hash", 13, 11), ("r2", 9, 12),
    ):  # fmt: skip
        title = f"turns of a texture's samples: {ROTATIONS[name].title}"
        texture = {"rotation": name, "height": height, "width": width, "seed": str(_SEED)}
        yield Recipe(f"turns_{name}", "turns", title, _without_inputs, texture)
    title = "samples that turn from texel to texel"
    convex = views.DISPLAYS["convex"]
    for name, build, *arguments in (
        ("algorithm1", _camera_problem, "perspective"),
        ("algorithm2", _module_problem, module_view(views.SMALL)),
        ("algorithm2_convex", _module_problem, module_view(convex)),
        ("algorithm2_matrix", _module_problem, *_MATRIX),
        ("frame", _frame_problem),
    ):
        yield Recipe(f"turned_{name}", name.partition("_")[0], title, _turning, build, *arguments)
    for name in (
        "point", "hemisphere", "vo-points-normal", "vo-lines-normal", "vo-area", "hbao", "alchemy", "sao",
        "oriented-hemisphere", "gtao", "visibility-bitmask",
    ):  # fmt: skip
        seen = ESTIMATORS[name], "perspective" if name == "point" else ""
        yield Recipe(f"turned_{name}", "estimator", title, _turning, estimator_problem, *seen, {})


def _numbers_recipe(name: str, title: str, display: Display, guard: int = 0) -> Recipe:
    values = json.loads(json.dumps(asdict(display)))  # tuples as the lists that a file gives back
    given = {"display": values, "module": 0, "guard": guard, "physical_from_world": views.WORLD.tolist()}
    return Recipe(f"numbers_{name}", "numbers", f"the mapping's numbers: {title}", _without_inputs, given)


def _views() -> Iterator[Recipe]:
    for projection in ("perspective", "orthographic"):
        yield Recipe(f"algorithm1_{projection}", "algorithm1", f"{projection} camera", _camera_problem, projection)
        title = f"world points in a {projection} camera"
        yield Recipe(f"mapping_{projection}", "mapping", title, _mapping_problem, make_camera(projection))
    seen = {name: module_view(display) for name, display in views.DISPLAYS.items()}
    for name, display in views.DISPLAYS.items():
        title = _DISPLAY_TITLES[name]
        yield _numbers_recipe(name, title, display)
        yield _numbers_recipe(f"{name}_guard_5", title, display, 5)
        yield Recipe(f"algorithm2_{name}", "algorithm2", title, _module_problem, seen[name])
        yield Recipe(f"mapping_{name}", "mapping", f"world points: {title}", _mapping_problem, seen[name])
    seen["perspective"] = make_camera("perspective")
    for name in ("perspective", "crossed_slits", "convex"):
        title = "world points and offsets, whose sums are formed apart and then added"
        yield Recipe(f"offsets_{name}", "mapping", title, _mapping_problem, seen[name], True)
    for name, (display, title) in _ALONE.items():
        yield _numbers_recipe(name, title, display)
    for name in BORDERS:
        title = f"world points on borders of the domain: {name.replace('_', ' ')}"
        yield Recipe(f"border_{name}", "mapping", title, border_problem, name)
    yield Recipe("behind_camera", "algorithm1", "samples behind a camera's eye", _near_camera_problem)
    yield Recipe("algorithm2_matrix", "algorithm2", "a camera, positions from a texture", _module_problem, *_MATRIX)
    small = module_view(views.SMALL)
    for method in METHODS["ball"]:
        title = f"16 samples by the method {method}, the table an input"
        yield Recipe(f"table_{method}", "algorithm2", title, _module_problem, small, SCENE, (method, 16, 2))


def _singular() -> Iterator[Recipe]:
    yield Recipe("ties", "algorithm2", "samples on borders of texels and just as deep as the surface", _ties)
    flat = views.DISPLAYS["crossed_slits"]
    small, one = (module_view(flat.with_resolution(*size)) for size in ((16, 12), (1, 1)))
    for name, title, *arguments in (
        ("background", "no surface anywhere", small, NOTHING),
        ("one_texel", "a texture of one texel", one),
        ("zero_radius", "radius 0: every sample is its point", small, SCENE, _LATIN, 0.0),
        ("one_sample", "one sample", small, SCENE, ("random", 1, 4)),
        ("outside", "most samples outside the texture", small, SCENE, ("latin", 16, 3), 1.2),
    ):
        yield Recipe(name, "algorithm2", title, _module_problem, *arguments)
    # Samples far around surfaces; some reach where the mapping is not defined.
    for name, title, display in (
        ("behind_lens_and_observers", "samples behind the lens and behind the observers", NEAR),
        ("conical_beyond", "conical diffuser: samples beyond where it has an image", replace(NEAR, diffuser="conical")),
        ("convex_missed", "convex screen: samples that no point of it shows", MISSED),
        ("folded", "samples beyond where the distortion folds", _FOLDING),
        ("behind_homography", "samples behind the line w = 0 of a homography", views.DISPLAYS["negated"]),
    ):
        view = module_view(display if name == "folded" else display.with_resolution(16, 12))
        yield Recipe(name, "algorithm2", title, _module_problem, view, SCENE, ("latin", 24, 3, 0.2, 1.0), 1.2)


def _pictures() -> Iterator[Recipe]:
    yield Recipe("merge_three", "merge", "three radii", _merge_problem, 3, 12, 16)
    yield Recipe("merge_one", "merge", "one radius: a copy", _merge_problem, 1, 3, 5)
    for name, sigma, height, width in (
        ("usual", 1.0, 12, 16), ("wide", 2.5, 3, 2), ("narrow", 0.01, 4, 4), ("none", 0.0, 2, 3),
        ("one_texel", 1.0, 1, 1), ("row", 0.7, 1, 9), ("tie", _TIE, 1, 9),
    ):  # fmt: skip
        title = f"sigma {sigma:g}, {width} x {height} texels"
        yield Recipe(f"blur_{name}", "blur", title, _blur_problem, sigma, height, width)
    yield Recipe("blur_covered", "blur", "sigma 3, all covered: exactly 1", _blur_problem, 3.0, 5, 7, 1.0)
    yield Recipe("shade", "shade", "colours below, in and above 0 to 1", _shade_problem)
    for place, ambient in (("ambient", 0.3), ("all", 0.6)):
        title = f"AO on {place}, colours as of shade"
        yield Recipe(f"light_{place}", "light", title, _light_problem, place, ambient)
    yield Recipe("frame", "frame", "three radii, merge, blur, shade, with a guard band", _frame_problem)


RECIPES = {
    recipe.name: recipe
    for family in (_numbers, _turned, _views, _singular, _pictures, *ESTIMATOR_FAMILIES, *READING_FAMILIES)
    for recipe in family()
}


def make_case(name: str) -> Case:
    """A case of the registry, solved; InputError if there is none of that name.

    >>> sorted(lfssao.testing.make_case("frame").outputs)[:2]
    ['ao_1', 'ao_2']
    """
    check_choice("case", name, RECIPES)
    recipe = RECIPES[name]
    parameters, inputs = recipe.build(*recipe.arguments)
    outputs = STAGES[recipe.stage](parameters, inputs)
    bounds = stage_bounds(recipe.stage, parameters, inputs)
    return Case(name, recipe.stage, recipe.title, parameters, inputs, outputs, bounds)
