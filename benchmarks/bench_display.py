"""A whole display: ``python benchmarks/bench_display.py [SCENE]``.

All modules of c80, 1024x768, the embedded armadillo (about 213,000 faces), five radii of 8 samples, blur, EXR files:
wall and processor time and peak memory of ``lfssao render``; seconds of each pass; strong and weak scaling over
threads; and the program that one would write from ``trimesh.ray`` and NumPy, on one module, in turn with ours: with
its file and without, as the file's compression and digests, which both need, bound what can be gained.

"lost" is the share of the wall clock, from the first ray to the manifest, that is not the sum of the passes on one
thread, and of the contact sheet's five rows, spread evenly over the threads.
On a loaded machine wall seconds say little: processor seconds over the cores are the wall clock of a quiet one, if
nothing is lost; ours are those of one more module, so without the start. Neither's building of the tree counts.
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

import numba
import numpy as np

from lfssao import (
    RayCaster,
    Settings,
    builtin_scene,
    default_radii,
    find_display,
    load_scene,
    make_samples,
    module_views,
    render_view,
)
from lfssao.exr import read_exr
from lfssao.manifest import describe_machine

DISPLAY = "c80"

# Threads that wait in a loop would count as work: those of OpenMP, and those of BLAS, which are of no use to products
# with 3 x 3 matrices.
WAITING = {"OMP_WAIT_POLICY": "passive", "OPENBLAS_NUM_THREADS": "1"}


def render(scene: str, folder: Path, modules: int, threads: int) -> dict:
    """One command in a process of its own: seconds of wall and processor, peak memory, and the manifest's seconds.

    Of these "render" begins with the tree, which is taken out of it.
    """
    first = 40 - modules // 2
    words = [scene, "--display", DISPLAY, "--modules", f"{first}:{first + modules}", "--threads", str(threads)]
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    command = [sys.executable, "-m", "lfssao", "render", *words, "-o", str(folder)]
    # A process between reports the peak of this command alone: that of children is the largest of all.
    done = subprocess.run(
        [sys.executable, "-c", PEAK, *command], check=True, stdout=subprocess.PIPE, text=True
    ).stdout.splitlines()[-1]  # fmt: skip
    wall, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = json.loads((folder / "manifest.json").read_text())["seconds"]
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    seconds["render"] -= seconds["build_bvh"]
    return {"modules": modules, "threads": threads, "wall": wall, "cpu": cpu, "peak_mib": int(done) / 1024, **seconds}


PEAK = """
import resource, subprocess, sys
subprocess.run(sys.argv[1:], check=True, stdout=subprocess.DEVNULL)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""


class Plain:
    """What one would write: trimesh casts the rays, NumPy does the rest, for all texels at once."""

    def __init__(self, mesh, view, samples, radii):
        import trimesh

        self.to_physical = np.vstack([view.cast_from_world, [0, 0, 0, 1]])
        self.scene = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
        self.scene.apply_transform(self.to_physical)
        self.scene.ray.intersects_any([[0.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]])  # builds the tree, once for all modules
        self.samples, self.radii = samples, radii

    def textures(self, view) -> dict:
        """Channels and pixels of each part of a module's file."""
        m_x, m_z, y_o, z_o, u_scale, u_0, v_scale, v_0 = view.lens
        to_physical, to_world = self.to_physical, view.world_from_cast
        # Rays: through the screen point of each texel's centre, the module's line and the observers' line.
        s_x, s_y = np.meshgrid(
            (np.arange(view.width) + 0.5 - u_0) / u_scale, (np.arange(view.height) + 0.5 - v_0) / v_scale
        )
        directions = np.stack([(m_x - s_x) / m_z, (y_o - s_y) / z_o, np.ones_like(s_x)], axis=-1).reshape(-1, 3)
        origins = np.stack([s_x, s_y, np.zeros_like(s_x)], axis=-1).reshape(-1, 3) + z_o * directions
        points, texels, _ = self.scene.ray.intersects_location(origins, directions, multiple_hits=False)
        depth = np.full(view.height * view.width, np.inf)
        depth[texels] = points[:, 2]
        surface = points @ to_world[:, :3].T + to_world[:, 3]
        world = np.full((view.height * view.width, 3), np.inf)
        world[texels] = surface
        layers = []
        for radius in self.radii:
            occluded = np.zeros(len(texels))
            for offset in self.samples * radius:
                x, y, z = ((surface + offset) @ to_physical[:3, :3].T + to_physical[:3, 3]).T
                u = u_0 + u_scale * (m_x + (x - m_x) * m_z / (m_z - z))
                v = v_0 + v_scale * (y_o + (y - y_o) * z_o / (z_o - z))
                i, j = np.floor(u).astype(int), np.floor(v).astype(int)
                inside = (i >= 0) & (i < view.width) & (j >= 0) & (j < view.height)
                there = np.clip(j, 0, view.height - 1) * view.width + np.clip(i, 0, view.width - 1)
                occluded += inside & (depth[there] < z)
            layer = np.zeros(view.height * view.width, np.float32)
            layer[texels] = occluded / len(self.samples)
            layers.append(layer.reshape(view.height, view.width))
        merged = np.max(layers, axis=0)
        weights = np.exp(-0.5 * np.arange(-3, 4) ** 2)
        padded = np.pad(merged, 3, mode="edge")
        rows = np.apply_along_axis(np.convolve, 1, padded, weights / weights.sum(), "valid")
        blurred = np.apply_along_axis(np.convolve, 0, rows, weights / weights.sum(), "valid").astype(np.float32)
        color = np.zeros((view.height * view.width, 3), np.float32)
        color[texels] = 1
        shaded = color.reshape(view.height, view.width, 3) * (1 - blurred[..., None])
        named = [(f"ao_{k}", layer) for k, layer in enumerate(layers, 1)] + [("merged", merged), ("blurred", blurred)]
        return {
            "shaded": (("R", "G", "B"), shaded),
            "depth": (("Z",), depth.reshape(view.height, view.width, 1)),
            "positions": (("P.X", "P.Y", "P.Z"), world.reshape(view.height, view.width, 3)),
            **{name: ((f"{name}.AO",), texture[..., None]) for name, texture in named},
        }


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


def clocked(work) -> tuple:
    """What a call returns, and its seconds of wall and processor."""
    start, cpu = time.perf_counter(), time.process_time()
    result = work()
    return result, time.perf_counter() - start, time.process_time() - cpu


def compare_plain(scene: str, folder: Path, modules: int, repeats: int) -> dict:
    """Ours and the plain program in turn: wall and processor seconds a module of each, and how far they agree."""
    cores = len(os.sched_getaffinity(0))
    numba.set_num_threads(cores)
    mesh = load_scene(scene) if "." in scene else builtin_scene(scene)
    view, settings = module_views(mesh, find_display(DISPLAY), range(40, 41))[0], Settings(default_radii(mesh))
    caster = RayCaster(mesh, view.cast_from_world, cores)
    plain = Plain(mesh, view, make_samples(), settings.radii)
    render_view(caster, view, settings)  # compiled
    rows = []
    for _ in range(repeats):
        few, many = (render(scene, folder / f"ours{n}", n, cores) for n in (modules, 2 * modules))
        _, passes_wall, passes_cpu = clocked(lambda: [render_view(caster, view, settings) for _ in range(modules)])
        parts, plain_wall, plain_cpu = clocked(lambda: plain.textures(view))
        _, file_wall, file_cpu = clocked(lambda parts=parts: write_plain(folder / "plain.exr", parts))
        rows.append(
            {
                "ours_wall": many["render"] / many["modules"],
                "ours_cpu": (many["cpu"] - few["cpu"]) / modules,
                "ours_passes_wall": passes_wall / modules,
                "ours_passes_cpu": passes_cpu / modules,
                "plain_wall": plain_wall + file_wall,
                "plain_cpu": plain_cpu + file_cpu,
                "plain_passes_wall": plain_wall,
                "plain_passes_cpu": plain_cpu,
            }
        )

    def alone(row):
        """The plain program's wall clock on a quiet machine: only OpenImageIO runs on several threads."""
        return row["plain_passes_cpu"] + (row["plain_cpu"] - row["plain_passes_cpu"]) / cores

    reference = read_exr(folder / f"ours{modules}" / "module_040.exr")["merged"].pixels
    ratios = {
        "wall_ratio": [row["plain_wall"] / row["ours_wall"] for row in rows],
        "cpu_ratio": [alone(row) / (row["ours_cpu"] / cores) for row in rows],
        "passes_wall_ratio": [row["plain_passes_wall"] / row["ours_passes_wall"] for row in rows],
        "passes_cpu_ratio": [row["plain_passes_cpu"] / (row["ours_passes_cpu"] / cores) for row in rows],
        # What would be left if our passes took no time at all: our files against the whole of the plain program.
        "cpu_ratio_of_files": [alone(r) / ((r["ours_cpu"] - r["ours_passes_cpu"]) / cores) for r in rows],
    }
    return {
        "rows": rows,
        **{name: statistics.median(row[name] for row in rows) for name in rows[0]},
        **{name: statistics.median(values) for name, values in ratios.items()},
        "spread": {name: [min(values), max(values)] for name, values in ratios.items()},
        "texels_of_equal_merged_ao": float(np.mean(parts["merged"][1] == reference)),
    }


def say_plain(versus: dict) -> None:
    print(f"{'a module, seconds':34s} {'wall':>8s} {'processor':>10s}")
    for name in ("plain_passes", "ours_passes", "plain", "ours"):
        label = f"{name.partition('_')[0]:6s}" + ("without files" if "_" in name else "with files")
        print(f"  {label:32s} {versus[f'{name}_wall']:8.3f} {versus[f'{name}_cpu']:10.3f}")
    for name in ("passes_wall_ratio", "passes_cpu_ratio", "wall_ratio", "cpu_ratio", "cpu_ratio_of_files"):
        low, high = versus["spread"][name]
        print(f"  {name:32s} {versus[name]:8.1f}   ({low:.1f} to {high:.1f})")
    print(f"  equal merged AO in {100 * versus['texels_of_equal_merged_ao']:.2f} % of the texels")


def say(name: str, run: dict, one_thread: float, contact: float) -> None:
    run["lost"] = 1 - (one_thread * run["modules"] + contact) / (run["threads"] * run["render"])
    print(
        f"{name:28s} {run['modules']:3d} modules {run['threads']} threads  wall {run['wall']:6.2f} s  "
        f"render {run['render']:6.2f} s  {run['render'] / run['modules']:.3f} s/module  processor {run['cpu']:6.2f} s  "
        f"peak {run['peak_mib']:5.0f} MiB  lost {100 * run['lost']:5.1f} %"
    )


def main() -> None:
    if WAITING.items() - os.environ.items():
        os.execve(sys.executable, [sys.executable, *sys.argv], {**os.environ, **WAITING})
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", nargs="?", default="armadillo", help="an embedded scene or a mesh file")
    parser.add_argument("--modules", type=int, default=8, help="of the scaling runs")
    parser.add_argument("--alternate", type=int, default=3)
    parser.add_argument("--repeats", type=int, default=1, help="of the whole display")
    parser.add_argument("--json", type=Path, default=Path(__file__).parent / "results" / "display.json")
    options = parser.parse_args()
    cores = len(os.sched_getaffinity(0))
    with tempfile.TemporaryDirectory() as name:
        folder, n = Path(name), options.modules
        render(options.scene, folder / "warm", 1, cores)  # the kernels' cache
        single = render(options.scene, folder / "one", n, 1)
        contact = single["passes"].pop("contact")
        one_thread = sum(single["passes"].values()) / n
        strong = [single, *(render(options.scene, folder / f"strong{k}", n, k) for k in range(2, cores + 1))]
        weak = [render(options.scene, folder / f"weak{k}", n * k, k) for k in range(2, cores + 1)]
        whole = [render(options.scene, folder / "whole", 80, cores) for _ in range(options.repeats)]
        versus = compare_plain(options.scene, folder, n, options.alternate)
    print(f"load of the machine {os.getloadavg()[0]:.1f}: wall seconds mean something near {cores} or less")
    for run in whole:
        say("whole display", run, one_thread, contact)
    for run in strong:
        say("strong scaling", run, one_thread, contact)
    for run in weak:
        say("weak scaling", run, one_thread, contact)
    print("seconds a module by pass, one thread, and share")
    for key, value in single["passes"].items():
        print(f"  {key:10s} {value / n:.4f} s  {100 * value / n / one_thread:5.1f} %")
    print(f"  {'sum':10s} {one_thread:.4f} s, wall {(single['render'] - contact) / n:.4f} s")
    print(f"the contact sheet's rows {contact:.2f} s")
    print("trimesh.ray and NumPy, and ours, in turn")
    say_plain(versus)
    result = {
        "machine": describe_machine(cores, sys.argv), "load": os.getloadavg(), "whole": whole, "strong": strong,
        "weak": weak, "one_thread_seconds_a_module": one_thread, "contact_sheet": contact, "plain": versus,
    }  # fmt: skip
    options.json.parent.mkdir(exist_ok=True)
    options.json.write_text(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
