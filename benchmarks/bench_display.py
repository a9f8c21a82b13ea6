"""A whole display: ``python benchmarks/bench_display.py [SCENE]``.

All modules of c80, 1024x768, the embedded armadillo (about 213,000 faces), five radii of 8 samples, blur, EXR files:
wall and processor time and peak memory of ``lfssao render``; seconds of each pass; strong and weak scaling over
threads; and the program that one would write from ``trimesh.ray`` and NumPy, in turn with ours. Ours renders the whole
display before and after each turn of the plain program, which takes a second a module: it renders modules spread over
the display, whose mean stands for all.

"lost" is the share of the wall clock, from the first ray to the manifest, that is not the sum of the passes on one
thread, and of the contact sheet's five rows, spread evenly over the threads.

Ratios of the plain program's seconds to ours:
display         the whole display from the first ray to the last file, without the plain program's start, with its
                packages, and without our packages and tree; ours loads its compiled kernels meanwhile
command         the wall clock of the whole commands: packages, the mesh, the tree, and all of the above
passes          the textures alone, without files, contact sheet and manifest
processor       as display and passes, from processor seconds over the cores: the wall clock of a quiet machine, if
                nothing is lost; ours are those of further modules, so without the start
files           processor, if our passes took no time at all
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
from plain_program import Plain, save_scene, write_plain

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
from lfssao.files.exr import read_exr
from lfssao.rendering.manifest import describe_machine

DISPLAY = "c80"
MODULES = 80
COMPARED = range(0, MODULES, 11)  # modules that the plain program renders

# Threads of BLAS that wait in a loop would count as work; they are of no use to products with 3 x 3 matrices.
WAITING = {"OPENBLAS_NUM_THREADS": "1"}


def render(scene: str, folder: Path, modules: int, threads: int) -> dict:
    """One command in a process of its own: seconds of wall and processor, peak memory, and the manifest's seconds.

    "render" begins with the tree, which is taken out of it.
    """
    first = (MODULES - modules) // 2
    words = [scene, "--display", DISPLAY, "--modules", f"{first}:{first + modules}", "--threads", str(threads)]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [sys.executable, "-m", "lfssao", "render", *words, "-o", str(folder)]
    # A process between reports the peak of this command alone: that of children is the largest of all.
    words = [sys.executable, "-c", PEAK, *command]
    wall, peak = map(float, subprocess.run(words, check=True, stdout=subprocess.PIPE, text=True).stdout.split())
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = json.loads((folder / "manifest.json").read_text())["seconds"]
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    seconds["render"] -= seconds["passes"].pop("build_bvh")
    return {"modules": modules, "threads": threads, "wall": wall, "cpu": cpu, "peak_mib": peak / 1024, **seconds}


PEAK = """
import resource, subprocess, sys, time
start = time.perf_counter()
subprocess.run(sys.argv[1:], check=True, stdout=subprocess.DEVNULL)
print(time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""


def clocked(work) -> tuple:
    """The value that a call returns, and its seconds of wall and processor."""
    start = time.perf_counter()
    cpu = time.process_time()
    result = work()
    return result, time.perf_counter() - start, time.process_time() - cpu


def start_plain(folder: Path, mesh, view) -> float:
    """Wall seconds of the plain program's start, in a process of its own."""
    save_scene(folder / "scene.npz", mesh, view)
    command = [sys.executable, str(Path(__file__).with_name("plain_program.py")), str(folder / "scene.npz")]
    return clocked(lambda: subprocess.run(command, check=True))[1]


def compare_plain(scene: str, folder: Path, few: int, turns: int) -> dict:
    """The whole display and the plain program in turn: seconds of each, their ratios, and how far they agree."""
    cores = len(os.sched_getaffinity(0))
    numba.set_num_threads(cores)
    mesh = load_scene(scene) if "." in scene else builtin_scene(scene)
    settings = Settings(default_radii(mesh))
    display = find_display(DISPLAY)
    views = [module_views(mesh, display, range(k, k + 1))[0] for k in COMPARED]
    caster = RayCaster(mesh, views[0].cast_from_world, cores)
    plain = Plain(mesh, views[0], make_samples(), settings.radii)
    render_view(caster, views[0], settings)  # compiled
    wholes = [render(scene, folder / "whole", MODULES, cores)]
    rows = []
    for _ in range(turns):
        row = {"plain_start_wall": start_plain(folder, mesh, views[0]), "equal": []}
        of_plain = []
        for number, view in zip(COMPARED, views, strict=True):
            parts, *passes = clocked(lambda view=view: plain.textures(view))
            _, *file = clocked(lambda parts=parts: write_plain(folder / "plain.exr", parts))
            of_plain.append((*passes, *file))
            reference = read_exr(folder / "whole" / f"module_{number:03d}.exr")["merged"].pixels
            row["equal"].append(float(np.mean(parts["merged"][1] == reference)))
        _, *passes = clocked(lambda: [render_view(caster, view, settings) for view in views])
        some = render(scene, folder / "some", few, cores)
        wholes.append(render(scene, folder / "whole", MODULES, cores))
        rows.append(row | _seconds(np.mean(of_plain, axis=0), np.array(passes) / len(views), some, wholes[-2:]))
    ratios = {name: [ratio(row, cores) for row in rows] for name, ratio in RATIOS.items()}
    return {
        "whole": wholes,
        "rows": rows,
        **{name: statistics.median(row[name] for row in rows) for name in rows[0] if name != "equal"},
        **{name: statistics.median(values) for name, values in ratios.items()},
        "spread": {name: [min(values), max(values)] for name, values in ratios.items()},
        "texels_of_equal_merged_ao": float(np.mean([row["equal"] for row in rows])),
    }


def _seconds(of_plain, passes, some: dict, around: list[dict]) -> dict[str, float]:
    """One turn's seconds a module, and of our whole commands: ``around`` are the one before and the one after."""
    passes_wall, passes_cpu, file_wall, file_cpu = map(float, of_plain)
    wall, cpu, command = (statistics.mean(run[name] for run in around) for name in ("render", "cpu", "wall"))
    return {
        "plain_passes_wall": passes_wall,
        "plain_passes_cpu": passes_cpu,
        "plain_wall": passes_wall + file_wall,
        "plain_cpu": passes_cpu + file_cpu,
        "ours_passes_wall": float(passes[0]),
        "ours_passes_cpu": float(passes[1]),
        "ours_wall": wall / MODULES,
        "ours_cpu": (cpu - some["cpu"]) / (MODULES - some["modules"]),
        "ours_command_wall": command,
    }


def alone(row: dict, cores: int) -> float:
    """The plain program's wall clock on a quiet machine: only OpenImageIO runs on several threads."""
    return row["plain_passes_cpu"] + (row["plain_cpu"] - row["plain_passes_cpu"]) / cores


RATIOS = {
    "display_ratio": lambda row, _: row["plain_wall"] / row["ours_wall"],
    "command_ratio": lambda row, _: (row["plain_start_wall"] + MODULES * row["plain_wall"]) / row["ours_command_wall"],
    "passes_ratio": lambda row, _: row["plain_passes_wall"] / row["ours_passes_wall"],
    "display_processor_ratio": lambda row, cores: alone(row, cores) / (row["ours_cpu"] / cores),
    "passes_processor_ratio": lambda row, cores: row["plain_passes_cpu"] / (row["ours_passes_cpu"] / cores),
    "files_processor_ratio": lambda row, cores: (
        alone(row, cores) / ((row["ours_cpu"] - row["ours_passes_cpu"]) / cores)
    ),
}


def say_plain(versus: dict) -> None:
    print(f"{'a module, seconds':34s} {'wall':>8s} {'processor':>10s}")
    for name in ("plain_passes", "ours_passes", "plain", "ours"):
        label = f"{name.partition('_')[0]:6s}" + ("without files" if "_" in name else "with files")
        print(f"  {label:32s} {versus[f'{name}_wall']:8.3f} {versus[f'{name}_cpu']:10.3f}")
    print(f"  start of the plain program {versus['plain_start_wall']:.2f} s, "
          f"our whole command {versus['ours_command_wall']:.2f} s")  # fmt: skip
    for name in RATIOS:
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
    parser.add_argument("--alternate", type=int, default=3, help="turns of the plain program, between whole displays")
    parser.add_argument("--json", type=Path, default=Path(__file__).parent / "results" / "display.json")
    options = parser.parse_args()
    cores = len(os.sched_getaffinity(0))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        n = options.modules
        render(options.scene, folder / "warm", 2, cores)  # the kernels' cache
        single = render(options.scene, folder / "one", n, 1)
        contact = single["passes"].pop("contact")
        one_thread = sum(single["passes"].values()) / n
        strong = [single, *(render(options.scene, folder / f"strong{k}", n, k) for k in range(2, cores + 1))]
        weak = [render(options.scene, folder / f"weak{k}", n * k, k) for k in range(2, cores + 1)]
        versus = compare_plain(options.scene, folder, n, options.alternate)
    print(f"load of the machine {os.getloadavg()[0]:.1f}: wall seconds mean something near {cores} or less")
    for run in versus["whole"]:
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
        "machine": describe_machine(cores, sys.argv), "load": os.getloadavg(), "strong": strong,
        "weak": weak, "one_thread_seconds_a_module": one_thread, "contact_sheet": contact, "plain": versus,
    }  # fmt: skip
    options.json.parent.mkdir(exist_ok=True)
    options.json.write_text(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
