"""Inputs for kernels whose bits the golden textures do not show, and the SHA-256 of each output.

As a program it prints a JSON object: for each group of kernels its digests with one thread and with two, those of the
golden textures with two, and the faults of the code of each kernel that it compiled for them.
"""

import gc
import hashlib
import json
from dataclasses import replace

import analytic_scenes
import golden
import machine_code
import numba
import numpy as np

from lfssao import Camera, Display, Mesh, Module, Occluders, make_samples, ray_cast_occlusion
from lfssao.ao.estimators.neighbours import algorithm2_with_neighbours
from lfssao.ao.kernels import truth as truth_kernels
from lfssao.ao.post import blur, merge, shade, shade_white
from lfssao.ao.ssao import algorithm1, algorithm2
from lfssao.ao.textures import Buffers
from lfssao.core import elementary, philox
from lfssao.core.threads import kernel_threads
from lfssao.samples import METHODS, ROTATIONS, sample_set, texel_angles, texel_turns
from lfssao.samples.kernels import ball
from lfssao.verify.bounds import post
from lfssao.verify.bounds import ssao as ssao_bounds
from lfssao.verify.bounds.kernels import depth_bounds as depth_kernels
from lfssao.verify.bounds.points import point_bounds
from lfssao.verify.kit.cases import RECIPES
from lfssao.verify.kit.stages import STAGES

HEIGHT = 43
WIDTH = 85
FACES = np.arange(90, dtype=np.int32).reshape(30, 3)
ROI = ((-0.4, -0.3, -0.3), (0.4, 0.3, 0.3))
DISPLAY = Display("batch", 1.0, 0.75, 0.1, -2.0, (Module(0.3, 0.0, 0.7, WIDTH, HEIGHT),), ROI)
WORLD = np.array([[0.5, 0.1, 0.0, -0.1], [-0.1, 0.5, 0.05, 0.0], [0.0, 0.1, -0.5, 0.05]])  # world -> physical
CAMERA = Camera("perspective", (1.0, 2.0, 5.0), (0.1, 0.0, 0.0), (0.0, 1.0, 0.1), 2.0, 1.0, 9.0)


def depth_texture(rng, dtype, low, high):
    """Rows of waves with noise, a tenth background, some subnormal numbers."""
    wave = np.linspace(low, high, HEIGHT * WIDTH).reshape(HEIGHT, WIDTH) + rng.uniform(-0.02, 0.02, (HEIGHT, WIDTH))
    depth = wave.astype(dtype)
    chance = rng.random(depth.shape)
    depth[chance < 0.1] = np.inf
    depth[chance > 0.97] = np.finfo(dtype).smallest_subnormal * 3
    return depth


def occlusions():
    """AO and what follows it in float64."""
    rng = np.random.default_rng(1)
    samples = make_samples("latin", 12, 9, 0.2, 1.0)
    module = DISPLAY.view(0, WORLD)
    camera = CAMERA.view(WIDTH, HEIGHT)
    depth = depth_texture(rng, np.float64, -0.3, 0.3)
    positions = rng.uniform(-0.7, 0.7, (HEIGHT, WIDTH, 3))
    forth = camera.world_to_image.numbers.reshape(4, 4)
    layers = []
    turns = texel_turns("hash", HEIGHT, WIDTH, 2**63 + 1, depth.dtype)
    for radius in (0.05, 0.4):
        layers.append(algorithm2(depth, positions, module.world_to_image, samples, radius, turns))
        layers.append(algorithm2(depth, positions, module.world_to_image, samples, radius))
        layers.append(algorithm2(depth, positions, camera.world_to_image, samples, radius))
        screen = depth_texture(rng, np.float64, 0.2, 0.8)
        layers.append(algorithm1(screen, camera.screen_to_world, forth, samples, radius))
        layers.append(algorithm1(screen, camera.screen_to_world, forth, samples, radius, turns))
    others = [
        (camera.world_to_image, screen),
        (replace(DISPLAY, diffuser="conical").view(0, WORLD).world_to_image, depth),
    ]
    layers.append(algorithm2_with_neighbours(depth, positions, module.world_to_image, others, samples, 0.4))
    merged = merge([layer.texture for layer in layers])
    rgb = rng.random((HEIGHT, WIDTH, 3))
    yield "ssao", np.array([layer.texture for layer in layers])
    yield "outside", np.array([layer.outside for layer in layers])
    yield "merge", merged
    yield "blur", np.array([blur(merged, sigma) for sigma in (0.01, 0.7, 2.5)])
    yield "shade", shade(rgb, merged)
    yield "shade white", shade_white(depth, merged)


def accepted():
    """The oracle's bounds: of AO for each kind of mapping and both algorithms, of the blur, of the depth stage."""
    rng = np.random.default_rng(7)
    samples = make_samples("latin", 12, 9, 0.2, 1.0)
    camera = CAMERA.view(WIDTH, HEIGHT)
    general = replace(DISPLAY, diffuser="conical").view(0, WORLD)
    depth = depth_texture(rng, np.float32, -0.3, 0.3)
    positions = rng.uniform(-0.7, 0.7, (HEIGHT, WIDTH, 3)).astype(np.float32)
    for view in (DISPLAY.view(0, WORLD), general, camera):
        for back in (None,) if view.screen_to_world is None else (None, view.screen_to_world):
            found = ssao_bounds.ao_bounds(depth, positions, view.world_to_image, samples, 0.4, "shader", back)
            kind = f"{view.world_to_image.kind} {back is None}"
            yield f"accepted {kind}", np.array([found.lower, found.upper, found.undecided])
    given = Buffers(general, depth, positions)
    options = {"range_check": True, "surface": "positions", "background": "open"}
    found = point_bounds("point", given, 0.4, samples, None, options)
    yield "accepted points", np.array([found.lower, found.upper, found.undecided])
    blurred = post.blur_bounds(found, 0.7)
    yield "accepted blur", np.array([blurred.lower, blurred.upper])
    vertices = rng.uniform(-0.3, 0.3, (40, 3))
    faces = rng.integers(0, 40, (30, 3)).astype(np.int32)
    triangles = rng.integers(0, 30, (9, HEIGHT * WIDTH)).astype(np.int32)
    lower = np.empty(triangles.shape)
    upper = np.empty(triangles.shape)
    view = DISPLAY.view(0, WORLD)
    depth_kernels.depth_ranges(view.rays, WIDTH, 0.01, vertices, faces, triangles, lower, upper)
    yield "depth ranges", np.array([lower, upper])


def scalars():
    rng = np.random.default_rng(3)
    yield "sincospi", np.array([elementary.sincospi(x) for x in rng.uniform(-20, 20, 500)])
    yield "cbrt", np.array([elementary.cbrt(x) for x in 2.0 ** rng.uniform(-1074, 1000, 500)])
    yield "exp", np.array([elementary.exp(x) for x in rng.uniform(-745, 709, 500)])
    yield "philox", np.array([philox.random_below(np.uint64(2**63 + 5), 2, k, 1000) for k in range(500)])
    yield "ball", np.array([ball.algorithm3(x, y) for x, y in rng.uniform(-1, 1, (500, 2))])
    for domain, methods in METHODS.items():
        for method in methods:
            yield f"{method}, {domain}", sample_set(domain, method, 60, 4).points
    for method in METHODS["ball"]:
        yield f"{method}, shell", make_samples(method, 60, 4, 0.1, 1.0)
    for name in ROTATIONS:
        yield f"angles {name}", texel_angles(name, 64, 64)


def truth():
    """Ray-cast occlusion of a crease and of triangles anywhere."""
    rng = np.random.default_rng(6)
    seen = analytic_scenes.buffers("concave crease", analytic_scenes.SIGHTS["perspective"](9, 7))
    meshes = [analytic_scenes.SURFACES["concave crease"].mesh(), Mesh(rng.uniform(-0.4, 0.4, (90, 3)), FACES)]
    for mesh in meshes:
        for weighting, falloff in (("cosine", "constant"), ("uniform", "quadratic")):
            made = ray_cast_occlusion(Occluders(mesh), seen, 0.2, weighting, falloff, rounds=(2, 4), strata=4)
            assert made.texture.max() > 0
            yield f"truth {len(mesh.faces)} {weighting}", np.stack([made.texture, made.error, made.rays])


def batches():
    """Rays of rounds as arrays, and the sums of distances that are drawn."""
    rng = np.random.default_rng(7)
    seen = analytic_scenes.buffers("tilted plane", analytic_scenes.SIGHTS["perspective"](9, 7))
    positions = seen.positions.reshape(-1, 3)
    normals = seen.normals.reshape(-1, 3)
    begun = truth_kernels.Begun(np.empty(63, np.int64), np.empty((63, 3)), np.empty((63, 3, 3)))
    assert truth_kernels.begin_texels(np.arange(63), positions, normals, 0.01, begun) == 63
    totals = np.zeros(63)
    squares = np.zeros(63)
    errors = np.zeros(63)
    for number, weighting in ((0, 0), (1, 1)):
        rays_of = np.empty((2, 63 * 16, 3), np.float32)
        cast = truth_kernels.Cast(1.0, 0.01, weighting, 0, 4, 2, 2, 0.0, np.uint64(5))
        truth_kernels.write_round(np.arange(63), begun, number, cast, np.ones(3), 0.5, *rays_of)
        yield f"batch {number}", rays_of
        distances = rng.uniform(0, 2, 63 * 16).astype(np.float32)
        truth_kernels.add_round(np.arange(63), number, 4, distances, 1.5, 2, totals, squares, errors)
    yield "batch sums", np.stack([totals, squares, errors])


def conformance():
    """The conformance kit's main passes: textures, every kind of display, every singularity."""
    for recipe in RECIPES.values():
        if recipe.stage in ("algorithm1", "algorithm2", "frame") and not recipe.name.startswith("table_"):
            parameters, inputs = recipe.build(*recipe.arguments)
            outputs = STAGES[recipe.stage](parameters, inputs)
            yield f"kit, {recipe.name}", np.concatenate([np.ravel(a) for a in (*inputs.values(), *outputs.values())])


GROUPS = {
    "scalars": scalars,
    "truth": lambda: (*truth(), *batches()),
    "kit": lambda: (*conformance(), *accepted()),
    "float64": occlusions,
}


def digests(group, threads):
    """SHA-256 of the bytes of every output of a group, by its name."""
    with kernel_threads(threads):
        named = list(GROUPS[group]())
    assert not any(np.isnan(a).any() for _, a in named)
    made = {name: hashlib.sha256(np.ascontiguousarray(a).tobytes()).hexdigest() for name, a in named}
    assert len(made) == len(named)
    return made


if __name__ == "__main__":
    assert numba.config.NUMBA_NUM_THREADS >= 2
    gc.set_threshold(100_000, 50, 50)  # as in the tests' own processes
    made = {group: [digests(group, 1), digests(group, 2)] for group in GROUPS} | {"golden": golden.made()}
    print(json.dumps({**made, "code": {name: sorted(machine_code.faults(code))
                                       for name, code in machine_code.compiled_kernels()}}))  # fmt: skip
