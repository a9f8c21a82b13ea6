"""The G-buffer against Embree alone and against trimesh: ``python benchmarks/bench_gbuffer.py [MESH]``.

One module of 1024x768 (depth and positions) in turn with ``EmbreeScene.run`` on the same rays (one a texel, float32,
those that miss the scene's box left out as the G-buffer leaves them out) and with
``trimesh.ray.intersects_location`` on the same. Each follows each other equally often: the call after trimesh's takes
up to 9 ms more.
"""

import argparse
import json
import sys
from pathlib import Path

import numba
import numpy as np
from turns import in_turn

from lfssao import builtin_scene, find_display, load_scene, module_views
from lfssao.core.affine import transform_points
from lfssao.gbuffer.caster import RayCaster
from lfssao.optics.kernels import rays
from lfssao.rendering.manifest import describe_machine

ARMADILLO = Path(__file__).resolve().parents[2] / "shared" / "meshes" / "armadillo.ply"


def all_rays(caster, view):
    """Origin, direction and length of every texel's ray that meets the scene's box, float32."""
    n = view.height * view.width
    texels = np.empty(n, np.int32)
    lengths = np.empty(n, np.float32)
    origins, directions = np.empty((2, n, 3), np.float32)
    made = texels, origins, directions, lengths
    n = rays.make_rays(view.rays, caster._tree.bounds, view.width, view.height, 1, *made)
    return origins[:n], directions[:n], lengths[:n]


def trimesh_run(mesh, view, origins, directions):
    """A call of trimesh's hit locations on the same rays."""
    import trimesh

    vertices = transform_points(view.cast_from_world, mesh.vertices)
    plain = trimesh.Trimesh(vertices, mesh.faces, process=False)
    return lambda: plain.ray.intersects_location(origins, directions)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("mesh", nargs="?", help="a mesh file (default: the armadillo beside the checkout, or ours)")
    parser.add_argument("--repeats", type=int, default=42)
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
    result = {"machine": describe_machine(options.threads, sys.argv), "mesh": mesh.name, "faces": len(mesh.faces)}
    print(f"{mesh.name}: {len(mesh.faces)} faces, {len(origins)} of {view.width * view.height} rays meet the box")
    times = in_turn(runs, options.repeats)
    for name, each in times.items():
        result[name] = {"ms": each.median, "ms_25": each.low, "ms_75": each.high}
        print(f"  {name:8s} {each.median:7.1f} ms  [{each.low:.1f}, {each.high:.1f}]")
    print(f"gbuffer / embree {times['gbuffer'].median / times['embree'].median:.2f}")
    print(f"trimesh / gbuffer {times['trimesh'].median / times['gbuffer'].median:.1f}")
    options.json.parent.mkdir(exist_ok=True)
    options.json.write_text(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
