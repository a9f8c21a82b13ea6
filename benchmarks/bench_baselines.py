"""SSAO by other programs: ``python benchmarks/bench_baselines.py``, JSON beside the printed tables.

glsl   LF Algorithm 2 as a GLSL 4.3 compute shader on any EGL driver; Mesa's llvmpipe runs it on the processor. Textures
       are in place: neither upload nor reading back is timed. Without rounding differences it gives lfssao's bits.
vtk    VTK's SSAO pass by pyvista, on the scene and camera of the hemisphere estimator. VTK draws the scene with and
       without the pass; the pass' time is the difference, turn by turn.

Both need ``pip install lfssao[bench]``. Baselines in C are in bench_algorithm2.py and bench_estimators.py, and Embree's
rays in bench_estimators.py and bench_gbuffer.py.
"""

import argparse
import json
import os
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from math import atan, degrees, dist
from pathlib import Path
from typing import Any

import numba
import numpy as np
from bench_algorithm2 import Case, gallery_case, image_offsets, ours
from c_baselines import SOURCES
from turns import Milliseconds, turns

from lfssao import Buffers, Camera, Mesh, Occluders, RayCaster, builtin_scene, estimate, ray_cast_occlusion
from lfssao.rendering.manifest import describe_machine
from lfssao.rendering.settings import diagonal
from lfssao.samples import sample_set

GROUP = 8  # texels a side of the shader's work groups
SIZE, SAMPLES = (512, 384), 32  # of VTK's picture
RADIUS = 0.02  # share of the scene's diagonal
EVERY = 4  # texel of each row and column is compared with ray-cast occlusion

Rows = dict[str, dict[str, Any]]


def row(warm: Milliseconds, **more: Any) -> dict[str, Any]:
    low, median, high = np.percentile(warm, [25, 50, 75]).tolist()
    return {"ms": median, "ms_25": low, "ms_75": high, **more}


def glsl(case: Case, repeats: int) -> Rows:
    """The shader's time beside ours, and the share of the texels with equal bits."""
    import moderngl

    context = moderngl.create_context(standalone=True, backend="egl", require=430)
    depth, positions, _, projection = case
    height, width = depth.shape
    program = context.compute_shader((SOURCES / "algorithm2.comp").read_text(encoding="utf-8"))
    offsets = image_offsets(case)
    program["size"], program["samples"] = (width, height), len(offsets)
    arrays = [depth, positions, offsets, projection.numbers, np.full_like(depth, np.nan)]
    buffers = [context.buffer(np.ascontiguousarray(array).tobytes()) for array in arrays]
    for binding, buffer in enumerate(buffers):
        buffer.bind_to_storage_buffer(binding)

    def run() -> None:
        program.run(-(-width // GROUP), -(-height // GROUP))
        context.finish()

    run_ours = ours(case)
    measured = turns({"lfssao": run_ours, "glsl": run}, repeats)
    made = np.frombuffer(buffers[-1].read(), np.int32).reshape(height, width)
    equal = float(np.mean(made == run_ours().view(np.int32)))
    renderer = context.info["GL_RENDERER"]
    context.release()
    return {
        "lfssao": row(measured["lfssao"][1]),
        "glsl": row(measured["glsl"][1], equal_bits=equal, renderer=renderer),
    }


def vtk(repeats: int, threads: int) -> Rows:
    """The pass' time beside the hemisphere estimator's, and both errors against ray-cast occlusion."""
    mesh = builtin_scene()
    camera = Camera.looking_at(mesh.bounds)
    radius = RADIUS * diagonal(mesh)
    without = plotter(mesh, camera)
    with_pass = plotter(mesh, camera)
    with_pass.enable_ssao(radius=radius, bias=0.0, kernel_size=SAMPLES, blur=False)
    view = camera.view(*SIZE)
    buffers = Buffers.of(RayCaster(mesh, view.cast_from_world, threads).gbuffer(view, normals="geometric"), view)
    points = sample_set("ball", "latin", SAMPLES, 0).points

    def ours() -> np.ndarray:
        return estimate("hemisphere", buffers, radius, points).texture

    def drawn(window: Any) -> None:
        window.render_window.Render()
        window.render_window.WaitForCompletion()

    runs: dict[str, Callable[[], object]]
    runs = {"lfssao": ours, "without": partial(drawn, without), "with": partial(drawn, with_pass)}
    warm = {name: times for name, (_, times) in turns(runs, repeats).items()}
    white = np.asarray(with_pass.screenshot(None, return_img=True))[..., 0]  # of a white scene: visibility
    chosen = np.zeros(buffers.depth.shape, bool)
    chosen[::EVERY, ::EVERY] = True
    some = replace(buffers, depth=np.where(chosen, buffers.depth, np.float32(np.inf)))
    truth = ray_cast_occlusion(Occluders(mesh), some, radius, tolerance=0.01).texture
    there = np.isfinite(some.depth)

    def error(texture: np.ndarray) -> float:
        return float(np.sqrt(np.mean((texture[there] - truth[there].astype(np.float64)) ** 2)))

    return {
        "lfssao": row(warm["lfssao"], model_error=error(ours())),
        "vtk": row(warm["with"] - warm["without"], model_error=error(1 - white / np.float64(255))),
        "vtk, whole picture": row(warm["with"]),
    }


def plotter(mesh: Mesh, camera: Camera) -> Any:
    """A window off screen that shows the mesh white and unlit, drawn once."""
    import pyvista

    made = pyvista.Plotter(off_screen=True, window_size=list(SIZE), lighting="none")
    made.render_window.SetMultiSamples(0)  # the pass switches it off: both pictures have one sample a texel
    made.set_background("white")
    made.add_mesh(pyvista.PolyData.from_regular_faces(mesh.vertices, mesh.faces), color="white", lighting=False)
    seen = made.camera
    seen.position, seen.focal_point, seen.up = camera.eye, camera.target, camera.up
    seen.view_angle = degrees(2 * atan(camera.extent / 2 / dist(camera.eye, camera.target)))
    seen.clipping_range = (camera.near, camera.far)
    made.show(auto_close=False)
    return made


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=20)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--json", type=Path, default=Path(__file__).parent / "results" / "baselines.json")
    options = parser.parse_args()
    os.environ["LP_NUM_THREADS"] = str(options.threads)  # llvmpipe's
    numba.set_num_threads(options.threads)
    result: dict[str, Any] = {"machine": describe_machine(options.threads, sys.argv)}
    baselines = {
        "LF Algorithm 2 as a GLSL compute shader": partial(glsl, gallery_case(), options.repeats),
        "VTK's SSAO pass": partial(vtk, options.repeats, options.threads),
    }
    for title, measure in baselines.items():
        rows = result[title] = measure()
        print(f"{title}:")
        for name, own in rows.items():
            more = ", ".join(f"{key} {own[key]}" for key in own if not key.startswith("ms"))
            times_ours = own["ms"] / rows["lfssao"]["ms"]
            print(f"  {name:20s} {own['ms']:7.2f} ms  [{own['ms_25']:.2f}, {own['ms_75']:.2f}]"
                  f"   {times_ours:5.2f} x lfssao   {more}")  # fmt: skip
    options.json.parent.mkdir(exist_ok=True)
    options.json.write_text(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
