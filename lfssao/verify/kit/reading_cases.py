"""Cases in which wrong readings of the specification show, as others do not reach the numbers that they differ in.

Inputs of a case need not fit each other. So positions are chosen for sums that are exact, or that cancel.
"""

from collections.abc import Callable, Iterator
from math import inf
from typing import Any

import numpy as np

from lfssao.ao.estimators.registry import ESTIMATORS
from lfssao.optics.camera import Camera
from lfssao.optics.display import Module
from lfssao.samples import make_samples, texel_turns
from lfssao.verify.case import Arrays
from lfssao.verify.kit import views
from lfssao.verify.kit.estimator_cases import Changes, long_normals, on_view
from lfssao.verify.kit.scenes import SCENE, FloatTexture, Scene, textures
from lfssao.verify.kit.views import CAMERA_SCENE, Problem, Recipe, described, noise

_FAR = 2.0**20  # radius and shift, world units: a step of float32 is there half as wide as a texel
_SAMPLES = make_samples("latin", 8, 1)


def _far_points(inputs: Arrays, table: str, turned: bool) -> Arrays:
    """Positions so far away that one sample of each texel comes back to where they were."""
    depth = inputs["depth"]
    samples = inputs[table]
    turns = texel_turns("hash", *depth.shape, 7, np.dtype(np.float32))
    cosine, sine = turns if turned else (np.ones_like(depth), np.zeros_like(depth))
    x, y, z = np.moveaxis(_FAR * samples[np.arange(depth.size).reshape(depth.shape) % len(samples)], -1, 0)
    offsets = np.stack([x * cosine - y * sine, x * sine + y * cosine, z], axis=-1)
    positions = (inputs["positions"] - offsets).astype(np.float32)
    return {**inputs, "positions": positions, **({"turns": turns} if turned else {})}


def _far_module(turned: bool) -> Problem:
    view = views.module_view(views.SMALL)
    depth, positions = textures(view, SCENE)
    inputs: Arrays = {"depth": depth, "positions": positions, "samples": _SAMPLES}
    return {"radius": _FAR, "mapping": described(view.world_to_image)}, _far_points(inputs, "samples", turned)


def _far_estimator(name: str, turned: bool) -> Problem:
    changes: Changes = {"randomize": False} if name == "vo-points" else {}
    parameters, inputs = on_view(
        ESTIMATORS[name], views.module_view(views.SMALL), SCENE, _FAR, changes, {"points": _SAMPLES}
    )
    return parameters, _far_points(inputs, "points", turned)


def _far_camera() -> Problem:
    x = _FAR
    view = Camera("perspective", (1.0 + x, 2.0, 5.0), (0.1 + x, 0.0, 0.0), (0.0, 1.0, 0.1), 2.0, 3.0, 8.0).view(16, 12)
    assert view.screen_to_world is not None
    matrices = {"screen_to_world": view.screen_to_world, "world_to_screen": view.world_to_image.numbers.reshape(4, 4)}
    parameters = {"radius": 0.5, **{name: matrix.tolist() for name, matrix in matrices.items()}}
    return parameters, {"depth": textures(view, CAMERA_SCENE)[0], "samples": _SAMPLES}


def _far_recipes() -> Iterator[Recipe]:
    """Sums that cancel: rounding moves samples by a texel, and so the order of operations shows."""
    yield Recipe("far_algorithm1", "algorithm1", "a camera far from the world's origin", _far_camera)
    for suffix, turned in (("", False), ("_turned", True)):
        title = f"samples far from their points{', turned' if turned else ''}"
        yield Recipe(f"far_algorithm2{suffix}", "algorithm2", title, _far_module, turned)
        for name in ("point", "hemisphere", "vo-points"):
            yield Recipe(f"far_{name}{suffix}", "estimator", title, _far_estimator, name, turned)


# The world is physical space here, and every texel's normal looks at the viewers.
_PLAIN = views.make_display(Module(0.0, 0.0, 1.0, 8, 6), observer_height=0.0)
_SHAPE = 6, 8
_WALL = Scene((0.0, 0.0, 0.0, inf), ())


def _plain_problem(name: str, radius: float, changes: Changes, tables: Arrays | None, z: FloatTexture) -> Problem:
    """An estimator in a plain world: depths are 0 and positions (0, 0, z), in the texture's middle."""
    parameters, inputs = on_view(ESTIMATORS[name], _PLAIN.view(0, np.eye(3, 4)), _WALL, radius, changes, tables)
    zero = np.zeros(_SHAPE, np.float32)
    towards = np.full((*_SHAPE, 3), (0, 0, -1), np.float32)
    inputs = {**inputs, "depth": zero, "positions": np.stack([zero, zero, z], axis=-1), "normals": towards}
    return parameters, inputs


def _bias_problem() -> Problem:
    """Points at the bias, 0.1 * 0.3 in float64, and one and two steps of float32 before and behind."""
    z = np.float32(0.1 * 0.3) + np.spacing(np.float32(0.03)) * (np.indices(_SHAPE).sum(axis=0) % 5 - 2)
    points = {"points": np.zeros((1, 3))}
    return _plain_problem("oriented-hemisphere", 0.3, {"bias": 0.1}, points, z.astype(np.float32))


def _radius_problem() -> Problem:
    """Surfaces that are a radius apart, and less."""
    changes: Changes = {"attenuation": "none", "randomize": False}
    z = np.array([0.0, 0.5, 0.125], np.float32)[np.indices(_SHAPE).sum(axis=0) % 3]
    return _plain_problem("hbao", 0.5, changes, None, z)


def _alchemy_problem(changes: Changes, least: float, most: float) -> Problem:
    """Surfaces a quarter apart, some ``least`` apart and some ``most``."""
    parameters, inputs = _plain_problem("alchemy", 0.5, changes, None, np.zeros(_SHAPE, np.float32))
    away = np.array([0, 0.25, least, most], np.float32)[np.indices(_SHAPE).sum(axis=0) % 4]
    normals = np.full((*_SHAPE, 3), (-0.6, -0.6, -0.53), np.float32)
    return parameters, {**inputs, "positions": inputs["positions"] - away[..., None], "normals": normals}


def _behind_problem() -> Problem:
    """Points on both sides of the plane of an orthographic camera's eye."""
    view = views.make_camera("orthographic", 16, 12)
    parameters, inputs = on_view(ESTIMATORS["alchemy"], view, CAMERA_SCENE, 0.5, {"beta": 0.5})
    forward = view.cast_from_world[2, :3].astype(np.float32)
    return parameters, {**inputs, "positions": inputs["positions"] - np.float32(5.4) * forward}


def _background_problem(name: str, checks: bool | str) -> Problem:
    changes: Changes = {"background": "occludes", "range_check": checks}
    view = views.module_view(views.DISPLAYS["crossed_slits"].with_resolution(24, 18))
    tables = {"points": make_samples("latin", 8, 1)}
    return on_view(ESTIMATORS[name], view, SCENE, 0.7, changes, tables)


# Steps of a tap from its texel along u and v: before a border by less than float32 tells, and on halves.
_STEPS = np.array([-1e-9, 0.5, 1.5, 2.5, -0.5, -1.5, 3 - 2.0**-22], np.float32)


def _landing_problem(landing: str, sine: str) -> Problem:
    """One tap a texel at half of 2^20 texels, turned by so little that it lands at ``_STEPS``."""
    changes: Changes = {
        "taps": 1, "turns": 1, "landing": landing, "sine": sine, "normals": "buffer", "beta": 0.0, "epsilon": 0.0,
        "max_level": 0, "quad_edge": 0.0, "gauss": 0.0, "intensity": 1e-9,
    }  # fmt: skip
    parameters, inputs = on_view(ESTIMATORS["sao"], views.module_view(views.SMALL), SCENE, 1e7, changes)
    row, column = np.indices(inputs["depth"].shape)
    steps = _STEPS[np.stack([column + 2 * row, row + 3 * column]) % len(_STEPS)]
    return parameters, {**inputs, "turns": steps * np.float32(-(2.0**-19))}


def _packed_problem() -> Problem:
    """Light of which one texel's is a whole byte and a half, an even one, before it is packed."""
    changes: Changes = {"intensity": 2.1737, "quad_edge": 0.0}
    return on_view(ESTIMATORS["sao"], views.module_view(views.SMALL), SCENE, 0.4, changes)


def _long_problem(combine: str) -> Problem:
    """Normals so long that occlusion is infinite, and times a weight of 0 no number."""
    view = views.module_view(views.SMALL.with_resolution(33, 21))
    return long_normals(ESTIMATORS["multiresolution"], view, 3e38, {"combine": combine})


def _on_screen_problem() -> Problem:
    """A lens on the screen's cylinder, where its lines meet the screen at t_s = 0."""
    view = views.make_display(Module(0.0, 0.0, 1.0, 32, 24), screen_curvature=1.0).view(0, np.eye(3, 4))
    mapping = described(view.world_to_image)
    mapping["numbers"][12] = 1.0  # its x, which no display may have
    points = [(x, y, z) for x in (0.5, 1.25, 1.5) for y in (0.0, 0.25) for z in (0.25, 0.5, 0.75)]
    return {"mapping": mapping}, {"points": np.array(points, np.float32)}


def _turned_offsets(display: str) -> Problem:
    """Points and offsets, each turned by its own angle."""
    view = views.module_view(views.DISPLAYS[display])
    points, offsets = (np.float32(0.6) * noise(stream, 40, 3) - np.float32(0.3) for stream in (4, 7))
    turns = texel_turns("hash", 1, 40, 7, np.dtype(np.float32))[:, 0]
    inputs = {"points": points, "offsets": offsets, "turns": np.ascontiguousarray(turns)}
    return {"mapping": described(view.world_to_image)}, inputs


def _border_recipes() -> Iterator[Recipe]:
    """Comparisons of equal numbers, and conditions that little else reaches."""
    yield Recipe("border_on_screen", "mapping", "a lens on the curved screen", _on_screen_problem)
    for display in ("crossed_slits", "convex"):
        yield Recipe(f"offsets_turned_{display}", "mapping", "offsets that turn", _turned_offsets, display)
    about = "background that occludes, and a range check"
    name = "oriented-hemisphere"
    for kind in ("point", "hemisphere"):
        yield _recipe(f"background_{kind}", kind, about, _background_problem, kind, True)
    for check in ("distance", "smoothstep"):
        yield _recipe(f"background_{name}_{check}", name, about, _background_problem, name, check)
    yield _recipe("bias_at_surface", name, "samples behind the surface by the bias", _bias_problem)
    for landing in ("floor", "truncate", "nearest"):
        for sine, name in (("down", f"landing_{landing}"), ("up", f"landing_{landing}_up")):
            yield _recipe(name, "sao", "taps on borders and halves", _landing_problem, landing, sine)
    yield _recipe("packed_half", "sao", "light on a half of its byte", _packed_problem)
    for combine in ("both", "maximum", "average"):
        yield _recipe(f"longest_{combine}", "multiresolution", "normals of 3e38", _long_problem, combine)
    yield _recipe("radius_apart", "hbao", "surfaces a radius apart", _radius_problem)
    sizes: Changes = {"beta": 0.0, "epsilon": 0.0}
    yield _recipe("squares_alchemy", "alchemy", "squares of 0 and infinity", _alchemy_problem, sizes, 1e-30, 3e38)
    yield _recipe("eye_plane_alchemy", "alchemy", "points on both sides of the plane of the eye", _behind_problem)


def _recipe(case: str, name: str, about: str, build: Callable[..., Problem], *arguments: Any) -> Recipe:
    return Recipe(case, "estimator", f"{ESTIMATORS[name].title}: {about}", build, *arguments)


READING_FAMILIES = _far_recipes, _border_recipes
