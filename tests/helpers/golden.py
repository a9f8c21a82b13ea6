"""The textures whose digests are golden: ``python tests/helpers/golden.py [GROUP ...]`` prints them anew."""

import functools
import hashlib
import json
import sys
from pathlib import Path

import numpy as np

import lfssao
from lfssao.ao.estimators.registry import of_one_view

GOLDEN = Path(__file__).parents[1] / "project" / "golden" / "digests.json"
WIDTH = 160
HEIGHT = 120
DISPLAYS = ("c80", "convex", "picoarray", "sample-a", "sample-b", "virtual")
SCENES = ("ammonite", "armadillo", "gallery", "statue")
SAMPLINGS = ("random", "rejection", "jittered", "latin", "poisson", "sobol", "halton")
scene = functools.cache(lfssao.builtin_scene)


def settings(mesh, **more):
    return lfssao.Settings(lfssao.default_radii(mesh), normals="smooth", **more)


def camera_view(mesh, projection, guard=0):
    return lfssao.Camera.looking_at(mesh.bounds, projection).view(WIDTH, HEIGHT, guard)


def through_a_camera(mesh, projection, chosen, guard=0):
    view = camera_view(mesh, projection, guard)
    return lfssao.render_view(lfssao.RayCaster(mesh, view.cast_from_world), view, chosen)


def through_a_module(mesh, name, chosen, index=None):
    """One module of a display, by default one a third from its end, which sees the scene from the side."""
    display = lfssao.find_display(name).with_resolution(WIDTH, HEIGHT)
    index = (2 * len(display.modules)) // 3 if index is None else index
    (textures,) = lfssao.render(mesh, display, chosen, range(index, index + 1))
    return textures


def displays(name, **more):
    """Every embedded scene from one module of a display, the gallery from its first module too."""
    for label in SCENES:
        mesh = scene(label)
        yield f"{name} {label}", through_a_module(mesh, name, settings(mesh, **more))
    yield f"{name} gallery first", through_a_module(scene("gallery"), name, settings(scene("gallery"), **more), 0)


def cameras():
    """Both projections of every embedded scene, and a guard band."""
    for label in SCENES:
        mesh = scene(label)
        for projection in ("perspective", "orthographic"):
            yield f"{projection} {label}", through_a_camera(mesh, projection, settings(mesh))
    yield "perspective statue guard", through_a_camera(scene("statue"), "perspective", settings(scene("statue")), 8)


def estimators(where):
    """Every estimator with its own samples, on a display or on a camera."""
    mesh = scene("statue")
    for name in sorted(of_one_view()):
        chosen = settings(mesh, estimator=name)
        through, what = (through_a_module, "sample-a") if where == "display" else (through_a_camera, "perspective")
        yield f"{name} {where}", through(mesh, what, chosen)


def samplings():
    """Seven sampling methods, neighbouring modules, a wide blur, and textures read at the nearest texel."""
    mesh = scene("ammonite")
    for name in SAMPLINGS:
        chosen = settings(mesh, samples=lfssao.make_samples(name, 12, seed=5))
        yield f"sampling {name}", through_a_module(mesh, "sample-a", chosen)
    yield "neighbours", through_a_module(mesh, "sample-a", settings(mesh, neighbours=2))
    yield "blur", through_a_module(mesh, "sample-a", settings(mesh, blur=2.5))
    yield "few radii", through_a_module(mesh, "sample-a", lfssao.Settings((0.05, 0.0, 0.05, 1e-7)))
    many = settings(mesh, samples=lfssao.make_samples("sobol", 256, seed=2))
    yield "many samples", through_a_module(mesh, "sample-a", many)


GROUPS = {
    **{name: functools.partial(displays, name) for name in DISPLAYS},
    "not turned": functools.partial(displays, "virtual", rotation="none"),  # those of "virtual" before samples turned
    "cameras": cameras,
    "estimators display": functools.partial(estimators, "display"),
    "estimators camera": functools.partial(estimators, "camera"),
    "samplings": samplings,
}


def digest(texture):
    """SHA-256 of a texture's shape, dtype and bytes."""
    texture = np.ascontiguousarray(texture)
    return hashlib.sha256(f"{texture.shape} {texture.dtype} ".encode() + texture.tobytes()).hexdigest()


def digests_of(textures):
    seen = textures.gbuffer
    named = {"depth": seen.depth, "positions": seen.positions, "normals": seen.normals, "color": seen.color}
    named |= {f"ao_{number}": texture for number, texture in enumerate(textures.ao, start=1)}
    named |= {"merged": textures.merged, "blurred": textures.blurred, "shaded": textures.shaded}
    found = {name: digest(texture) for name, texture in named.items() if texture is not None}
    return {**found, "outside": [int(count) for count in textures.outside]}


def made(groups=()):
    """The digests of the textures of some groups, or of all."""
    return {group: {name: digests_of(seen) for name, seen in GROUPS[group]()} for group in groups or GROUPS}


if __name__ == "__main__":
    json.dump(made(sys.argv[1:]), sys.stdout, indent=1)
    print()
