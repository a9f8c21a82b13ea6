"""Hemisphere and Alchemy AO against C, and ray-cast truth: ``python benchmarks/bench_point.py``, JSON and a table.

One run, 1024x768, float32, the papers' numbers of samples, all peers in turn; median and quartiles in milliseconds. The
peers are compiled here with gcc -O3 -march=native; a second build with -ffp-contract=off must give lfssao's bits. The
C peer of Alchemy is handed each texel's axes and the cosine and sine of its turn; lfssao makes them in its time.
"""

import argparse
import ctypes
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numba
import numpy as np
from bench_algorithm2 import interleaved

from lfssao import (
    Buffers,
    Occluders,
    RayCaster,
    builtin_scene,
    estimate,
    find_display,
    module_views,
    ray_cast_occlusion,
)
from lfssao.estimators.registry import ESTIMATORS
from lfssao.kernels import spiral
from lfssao.kernels.elementary import sincospi
from lfssao.kernels.frames import disk_axes
from lfssao.manifest import describe_machine
from lfssao.rendering import diagonal

SOURCE = Path(__file__).with_name("point.c")
RADIUS = 0.02  # share of the scene's diagonal


def compile_peers(folder: Path, *options: str) -> ctypes.CDLL:
    library = folder / f"point{len(options)}.so"
    command = ["gcc", "-O3", "-march=native", "-fopenmp", "-shared", "-fPIC", *options]
    subprocess.run([*command, "-o", str(library), str(SOURCE)], check=True)
    return ctypes.CDLL(str(library))


def hemisphere_arrays(seen: Buffers, radius: float) -> tuple[int, list[np.ndarray]]:
    """Offsets, the same after the mapping's linear half, and the mapping."""
    points, _ = ESTIMATORS["hemisphere"].default_samples()
    m = seen.view.world_to_image.as_type(np.float32)
    offsets = (radius * points).astype(np.float32)
    rows = m[:12].reshape(3, 4)
    ends = (offsets[:, :1] * rows[:, 0] + offsets[:, 1:2] * rows[:, 1]) + offsets[:, 2:] * rows[:, 2]
    return len(points), [offsets, ends, m]


def alchemy_arrays(seen: Buffers, radius: float) -> tuple[int, list[np.ndarray]]:
    """Turns, axes, taps, mapping, distance from the viewers, numbers."""
    entry, f = ESTIMATORS["alchemy"], np.float32
    points, _ = entry.default_samples()
    height, width = seen.depth.shape
    turns, axes = np.empty((height, width, 2), f), np.empty((height, width, 6), f)
    for j in range(height):
        for i in range(width):
            sine, cosine = sincospi(spiral.hash_angle.py_func(i, j, spiral.PAPER))
            turns[j, i] = cosine, sine
    d = seen.directions.reshape(-1, 3)
    for k, (x, y, z) in enumerate(d):
        axes.reshape(-1, 6)[k] = [f(radius) * a for a in disk_axes.py_func(x, y, z)]
    p = entry.parameters
    numbers = np.array([p["beta"], p["epsilon"] * radius * radius, 2 * p["sigma"] * radius / len(points)], f)
    m, away = seen.view.world_to_image.as_type(f), seen.view.viewer_distance().astype(f)
    return len(points), [turns, axes, points.astype(f), m, away, numbers]


def peer(library: ctypes.CDLL, name: str, seen: Buffers, n: int, arrays: list[np.ndarray]) -> Callable[[], np.ndarray]:
    ao = np.empty_like(seen.depth)
    every = [np.ascontiguousarray(a) for a in (seen.depth, seen.positions, seen.normals, *arrays)] + [ao]
    pointers = [a.ctypes.data_as(ctypes.c_void_p) for a in every]
    height, width = seen.depth.shape

    def run() -> np.ndarray:
        getattr(library, name)(width, height, n, *pointers)
        return ao

    return run


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=40)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--json", type=Path, default=Path(__file__).parent / "results" / "point.json")
    options = parser.parse_args()
    os.environ["OMP_NUM_THREADS"] = str(options.threads)
    numba.set_num_threads(options.threads)
    mesh = builtin_scene()
    view = module_views(mesh, find_display("virtual"))[0]
    seen = Buffers.of(RayCaster(mesh, view.cast_from_world).gbuffer(view, None, "geometric"), view)
    radius = RADIUS * diagonal(mesh)
    result: dict[str, object] = {
        "machine": describe_machine(options.threads, sys.argv),
        "load": os.getloadavg(),
        "surface": float(np.isfinite(seen.depth).mean()),
    }
    with tempfile.TemporaryDirectory() as folder:
        fast, exact = compile_peers(Path(folder)), compile_peers(Path(folder), "-ffp-contract=off")
        for name, make in (("hemisphere", hemisphere_arrays), ("alchemy", alchemy_arrays)):
            n, arrays = make(seen, radius)
            reference = estimate(name, seen, radius).texture
            if not np.array_equal(peer(exact, name, seen, n, arrays)(), reference):
                raise SystemExit(f"{name} in C without contraction does not give lfssao's bits: not the same algorithm")
            runs = {
                "lfssao": lambda name=name: estimate(name, seen, radius).texture,
                "plain_c": peer(fast, name, seen, n, arrays),
            }
            rows = {}
            for who, values in interleaved(runs, options.repeats).items():
                low, middle, high = np.percentile(values, [25, 50, 75])
                rows[who] = {"ms": middle, "ms_25": low, "ms_75": high}
                print(f"{name:12s} {who:8s} {middle:7.2f} ms  [{low:.2f}, {high:.2f}]")
            print(f"{name:12s} C takes {rows['plain_c']['ms'] / rows['lfssao']['ms']:.2f} times as long")
            result[name] = {"samples": n, **rows}
    occluders = Occluders(mesh)
    ray_cast_occlusion(occluders, seen, radius, rounds=(2, 2), strata=1)
    start = time.perf_counter()
    rays = int(ray_cast_occlusion(occluders, seen, radius, rounds=(2, 2), strata=2).rays.sum())
    seconds = time.perf_counter() - start
    print(f"truth: {rays} rays in {seconds:.2f} s, {rays / seconds / 1e6:.2f} million a second")
    result["truth"] = {"rays": rays, "seconds": seconds, "triangles": len(mesh.faces)}
    options.json.parent.mkdir(exist_ok=True)
    options.json.write_text(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
