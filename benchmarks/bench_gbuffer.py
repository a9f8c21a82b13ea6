"""The G-buffer against Embree alone and against trimesh: ``python benchmarks/bench_gbuffer.py [MESH]``.

One module of 1024x768 (depth and positions) in turn with ``EmbreeScene.run`` on the same rays (one a texel, float32,
those that miss the scene's box left out as the G-buffer leaves them out) and with
``trimesh.ray.intersects_location`` on the same.
"""

import argparse
import json
import sys
import time
from pathlib import Path

import numba
import numpy as np

from lfssao import builtin_scene, find_display, load_scene, module_views
from lfssao.core.vectors import transform_points
from lfssao.gbuffer.caster import RayCaster
from lfssao.optics.kernels import rays
from lfssao.rendering.manifest import describe_machine

ARMADILLO = Path(__file__).resolve().parents[2] / "shared" / "meshes" / "armadillo.ply"


def all_rays(caster, view):
    """Origin, direction and length of every texel's ray that meets the scene's box, float32."""
    n = view.height * view.width
    cells, lengths = np.empty(n, np.int32), np.empty(n, np.float32)
    origins, directions = np.empty((2, n, 3), np.float32)
    made = cells, origins, directions, lengths
    n = rays.make_rays(view.rays, caster._tree.bounds, view.width, view.height, 1, *made)
    return origins[:n], directions[:n], lengths[:n]


def trimesh_run(mesh, view, origins, directions):
    """A call of trimesh's hit locations on the same rays."""
    import trimesh

    vertices = np.empty_like(mesh.vertices)
    transform_points(np.ravel(view.cast_from_world), mesh.vertices, vertices)
    plain = trimesh.Trimesh(vertices, mesh.faces, process=False)
    return lambda: plain.ray.intersects_location(origins, directions)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("mesh", nargs="?", help="a mesh file (default: the armadillo beside the checkout, or ours)")
    parser.add_argument("--repeats", type=int, default=20)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--json", type=Path, default=Path(__file__).parent / "results" / "gbuffer.json")
    options = parser.parse_args()
    numba.set_num_threads(options.threads)
    path = options.mesh or (ARMADILLO if ARMADILLO.exists() else None)
    mesh = builtin_scene("armadillo") if path is None else load_scene(path)
    view = module_views(mesh, find_display("virtual"))[0]
    caster = RayCaster(mesh, view.cast_from_world, options.threads)
    origins, directions, lengths = all_rays(caster, view)
    runs = {
        "gbuffer": lambda: caster.gbuffer(view, color=None),
        "embree": lambda: caster._trace(origins, directions, lengths.copy()),
        "trimesh": trimesh_run(mesh, view, origins, directions),
    }
    times = {name: [] for name in runs}
    for _ in range(options.repeats + 1):
        for name, run in runs.items():
            start = time.perf_counter()
            run()
            times[name].append(1e3 * (time.perf_counter() - start))
    result = {"machine": describe_machine(options.threads, sys.argv), "mesh": mesh.name, "faces": len(mesh.faces)}
    print(f"{mesh.name}: {len(mesh.faces)} faces, {len(origins)} of {view.width * view.height} rays meet the box")
    for name, values in times.items():
        low, middle, high = np.percentile(values[1:], [25, 50, 75])
        result[name] = {"ms": middle, "ms_25": low, "ms_75": high}
        print(f"  {name:8s} {middle:7.1f} ms  [{low:.1f}, {high:.1f}]")
    middle = {name: values["ms"] for name, values in result.items() if isinstance(values, dict) and "ms" in values}
    print(f"gbuffer / embree {middle['gbuffer'] / middle['embree']:.2f}")
    print(f"trimesh / gbuffer {middle['trimesh'] / middle['gbuffer']:.1f}")
    options.json.parent.mkdir(exist_ok=True)
    options.json.write_text(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
