"""A whole display: ``python benchmarks/bench_display.py``.

All modules of c80, 1024x768, the embedded armadillo (about 213,000 faces), five radii of 8 samples, blur, EXR files:
wall and processor time and peak memory of ``lfssao render``; seconds of each pass; strong and weak scaling over
threads; and the program that one would write from ``trimesh.ray`` and NumPy, on one module, in turn with ours.

"lost" is the share of the wall clock that is not the sum of the passes on one thread, spread evenly over the threads.
On a loaded machine wall seconds say little: processor seconds over the cores are the wall clock of a quiet one, if
nothing is lost; ours are those of one more module, so without the start.
"""

import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from lfssao import builtin_scene, default_radii, find_display, make_samples, module_views
from lfssao.exr import read_exr
from lfssao.manifest import describe_machine

SCENE, DISPLAY = "armadillo", "c80"


def render(folder: Path, modules: int, threads: int) -> dict:
    """One command in a process of its own: seconds of wall and processor, peak memory, and the manifest's seconds."""
    first = 40 - modules // 2
    words = [SCENE, "--display", DISPLAY, "--modules", f"{first}:{first + modules}", "--threads", str(threads)]
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    command = [sys.executable, "-m", "lfssao", "render", *words, "-o", str(folder)]
    # A process between reports the peak of this command alone: that of children is the largest of all.
    done = subprocess.run(
        [sys.executable, "-c", PEAK, *command], check=True, stdout=subprocess.PIPE, text=True
    ).stdout.splitlines()[-1]  # fmt: skip
    wall, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = json.loads((folder / "manifest.json").read_text())["seconds"]
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return {"modules": modules, "threads": threads, "wall": wall, "cpu": cpu, "peak_mib": int(done) / 1024, **seconds}


PEAK = """
import resource, subprocess, sys
subprocess.run(sys.argv[1:], check=True, stdout=subprocess.DEVNULL)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""


def plain_module(mesh, view, samples, radii, path: Path) -> np.ndarray:
    """What one would write: trimesh casts the rays, NumPy does the rest, for all texels at once. Returns merged AO."""
    import trimesh

    m_x, m_z, y_o, z_o, u_scale, u_0, v_scale, v_0 = view.lens
    to_physical, to_world = np.vstack([view.cast_from_world, [0, 0, 0, 1]]), view.world_from_cast
    # Rays: through the screen point of each texel's centre, the module's line and the observers' line.
    s_x, s_y = np.meshgrid(
        (np.arange(view.width) + 0.5 - u_0) / u_scale, (np.arange(view.height) + 0.5 - v_0) / v_scale
    )
    directions = np.stack([(m_x - s_x) / m_z, (y_o - s_y) / z_o, np.ones_like(s_x)], axis=-1).reshape(-1, 3)
    origins = np.stack([s_x, s_y, np.zeros_like(s_x)], axis=-1).reshape(-1, 3) + z_o * directions
    scene = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    scene.apply_transform(to_physical)
    points, texels, _ = scene.ray.intersects_location(origins, directions, multiple_hits=False)
    depth = np.full(view.height * view.width, np.inf)
    depth[texels] = points[:, 2]
    world = np.full((view.height * view.width, 3), np.inf)
    world[texels] = points @ to_world[:, :3].T + to_world[:, 3]
    layers = []
    for radius in radii:
        occluded = np.zeros(len(texels))
        for offset in samples * radius:
            x, y, z = ((world[texels] + offset) @ to_physical[:3, :3].T + to_physical[:3, 3]).T
            u = u_0 + u_scale * (m_x + (x - m_x) * m_z / (m_z - z))
            v = v_0 + v_scale * (y_o + (y - y_o) * z_o / (z_o - z))
            i, j = np.floor(u).astype(int), np.floor(v).astype(int)
            inside = (i >= 0) & (i < view.width) & (j >= 0) & (j < view.height)
            there = np.clip(j, 0, view.height - 1) * view.width + np.clip(i, 0, view.width - 1)
            occluded += inside & (depth[there] < z)
        layer = np.zeros(view.height * view.width, np.float32)
        layer[texels] = occluded / len(samples)
        layers.append(layer.reshape(view.height, view.width))
    merged = np.max(layers, axis=0)
    weights = np.exp(-0.5 * np.arange(-3, 4) ** 2)
    padded = np.pad(merged, 3, mode="edge")
    rows = np.apply_along_axis(np.convolve, 1, padded, weights / weights.sum(), "valid")
    blurred = np.apply_along_axis(np.convolve, 0, rows, weights / weights.sum(), "valid").astype(np.float32)
    color = np.zeros((view.height * view.width, 3), np.float32)
    color[texels] = 1
    shaded = color.reshape(view.height, view.width, 3) * (1 - blurred[..., None])
    parts = {
        "shaded": (("R", "G", "B"), shaded),
        "depth": (("Z",), depth.reshape(view.height, view.width, 1)),
        "positions": (("P.X", "P.Y", "P.Z"), world.reshape(view.height, view.width, 3)),
    }
    named = [(f"ao_{k}", layer) for k, layer in enumerate(layers, 1)] + [("merged", merged), ("blurred", blurred)]
    write_plain(path, parts | {name: ((f"{name}.AO",), texture[..., None]) for name, texture in named})
    return merged


def write_plain(path: Path, parts: dict) -> None:
    """A multi-part EXR file as OpenImageIO's documentation has it."""
    import OpenImageIO as oiio

    specs = []
    for name, (channels, pixels) in parts.items():
        spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], oiio.FLOAT)
        spec.channelnames = channels
        spec.attribute("name", name)
        spec.attribute("compression", "zip")
        specs.append(spec)
    output = oiio.ImageOutput.create(str(path))
    for number, (_, pixels) in enumerate(parts.values()):
        opened = (
            output.open(str(path), specs[number], "AppendSubimage") if number else output.open(str(path), tuple(specs))
        )
        if not opened or not output.write_image(np.ascontiguousarray(pixels, np.float32)):
            raise OSError(output.geterror())
    if not output.close():
        raise OSError(output.geterror())


def compare_plain(folder: Path, modules: int, repeats: int) -> dict:
    """Ours and the plain program in turn: wall and processor seconds a module of each, and how far they agree."""
    mesh, display = builtin_scene(SCENE), find_display(DISPLAY)
    view, radii, samples = module_views(mesh, display, range(40, 41))[0], default_radii(mesh), make_samples()
    cores = len(os.sched_getaffinity(0))
    rows = []
    for _ in range(repeats):
        few, many = (render(folder / f"ours{n}", n, cores) for n in (modules, 2 * modules))
        start, cpu = time.perf_counter(), time.process_time()
        merged = plain_module(mesh, view, samples, radii, folder / "plain.exr")
        rows.append(
            {
                "ours_wall": many["render"] / many["modules"],
                "ours_cpu": (many["cpu"] - few["cpu"]) / modules,
                "plain_wall": time.perf_counter() - start,
                "plain_cpu": time.process_time() - cpu,
            }
        )
    reference = read_exr(folder / f"ours{modules}" / "module_040.exr")["merged"].pixels[..., 0]
    return {
        "rows": rows,
        **{name: statistics.median(row[name] for row in rows) for name in rows[0]},
        "wall_ratio": statistics.median(row["plain_wall"] / row["ours_wall"] for row in rows),
        "cpu_ratio": statistics.median(row["plain_cpu"] / (row["ours_cpu"] / cores) for row in rows),
        "texels_of_equal_merged_ao": float(np.mean(merged == reference)),
    }


def say(name: str, run: dict, one_thread: float | None = None) -> None:
    lost = ""
    if one_thread is not None:
        lost = f"  lost {100 * (1 - one_thread * run['modules'] / run['threads'] / run['render']):5.1f} %"
    print(
        f"{name:28s} {run['modules']:3d} modules {run['threads']} threads  wall {run['wall']:6.2f} s  "
        f"render {run['render']:6.2f} s  {run['render'] / run['modules']:.3f} s/module  processor {run['cpu']:6.2f} s  "
        f"peak {run['peak_mib']:5.0f} MiB{lost}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--modules", type=int, default=8, help="of the scaling runs")
    parser.add_argument("--alternate", type=int, default=3)
    parser.add_argument("--repeats", type=int, default=1, help="of the whole display")
    parser.add_argument("--json", type=Path, default=Path(__file__).parent / "results" / "display.json")
    options = parser.parse_args()
    cores = len(os.sched_getaffinity(0))
    with tempfile.TemporaryDirectory() as name:
        folder, n = Path(name), options.modules
        render(folder / "warm", 1, cores)  # the kernels' cache
        single = render(folder / "one", n, 1)
        one_thread = sum(single["passes"].values()) / n
        strong = [single, *(render(folder / f"strong{k}", n, k) for k in range(2, cores + 1))]
        weak = [render(folder / f"weak{k}", n * k, k) for k in range(2, cores + 1)]
        whole = [render(folder / "whole", 80, cores) for _ in range(options.repeats)]
        versus = compare_plain(folder, n, options.alternate)
    print(f"load of the machine {os.getloadavg()[0]:.1f}: wall seconds mean something near {cores} or less")
    for run in whole:
        say("whole display", run, one_thread)
    for run in strong:
        say("strong scaling", run, one_thread)
    for run in weak:
        say("weak scaling", run, one_thread)
    print("seconds a module by pass, one thread, and share")
    for key, value in single["passes"].items():
        print(f"  {key:10s} {value / n:.4f} s  {100 * value / n / one_thread:5.1f} %")
    print(f"  {'sum':10s} {one_thread:.4f} s, wall {single['render'] / n:.4f} s")
    print(
        f"trimesh.ray and NumPy on one module: wall {versus['plain_wall']:.2f} s, ours {versus['ours_wall']:.3f} s, "
        f"ratio {versus['wall_ratio']:.1f}; processor {versus['plain_cpu']:.2f} s, ours {versus['ours_cpu']:.3f} s on "
        f"{cores} cores, ratio {versus['cpu_ratio']:.1f}; equal merged AO in "
        f"{100 * versus['texels_of_equal_merged_ao']:.2f} % of the texels"
    )
    result = {
        "machine": describe_machine(cores, sys.argv), "load": os.getloadavg(), "whole": whole, "strong": strong,
        "weak": weak, "one_thread_seconds_a_module": one_thread, "plain": versus,
    }  # fmt: skip
    options.json.parent.mkdir(exist_ok=True)
    options.json.write_text(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
