"""What a plan saves: ``python benchmarks/bench_plan.py``.

All passes of one view, with everything run (``--no-plan``), with the plan, and with one of its cuts alone, in turn in
one thread of one process; processor time, so that other work on the machine counts little. A ratio is the median of
those of each turn. The scenes: as they are fitted into the display, seen at a tenth of the texture, beside it, and a
wall that fills it, where nothing can be left out.

The kernels skip background whether there is a plan or not. Where a tenth of the texture is seen, the wall that fills
it is rendered in the same turns, with as many radii and samples: "built in" is its time over that without a plan, what
the kernels' own skipping saves, and "full" its time over that with the plan, what both save of work on every texel.
The wall has 131,072 triangles, fewer than the gallery and the armadillo, whose ratios are the smaller for it, and more
than the statue, whose ratios are the larger; the wall itself, seen at a tenth, has as many.
"""

import argparse
import json
import sys
import time
from dataclasses import replace
from pathlib import Path

import numba
import numpy as np

from lfssao import Mesh, RayCaster, Settings, builtin_scene, default_radii, find_display, module_views, render_view
from lfssao.manifest import describe_machine
from lfssao.view_plan import ViewPlan

TENTH, EVERY = "a tenth", "every texel"


def around(mesh, size, moved=(0.0, 0.0, 0.0)):
    """A box ``size`` times as large as the scene's, moved by shares of it: fitted instead, it makes the scene small."""
    low, high = mesh.bounds
    middle = 0.5 * (low + high)
    return np.stack([middle + (low - middle) * size, middle + (high - middle) * size]) + np.array(moved) * (high - low)


def wall(n=256):
    """A bumpy sheet of 2 n^2 triangles, before the middle of a box that is half as wide and high."""
    y, x = (k.ravel() for k in np.mgrid[: n + 1, : n + 1] / n * 4.0 - 2.0)
    z = 0.05 * np.sin(9 * x) * np.cos(7 * y)
    a = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    faces = np.concatenate([np.stack([a, a + 1, a + n + 1], 1), np.stack([a + 1, a + n + 2, a + n + 1], 1)])
    return Mesh(np.stack([x, y, z], 1), faces, name="wall")


def cases(display):
    """Name, mesh, box to fit and settings."""
    for name in ("gallery", "statue", "armadillo"):
        mesh = builtin_scene(name)
        fitted = Settings(default_radii(mesh))
        yield f"{name}, fitted", mesh, mesh.bounds, fitted
        yield f"{name}, {TENTH}", mesh, tenth(mesh, display), fitted
    yield "armadillo, beside", mesh, around(mesh, 3, (40, 0, 0)), fitted
    radii = default_radii(mesh)
    yield "armadillo, a radius twice and one 0", mesh, mesh.bounds, Settings((0.0, *radii[:2], *radii[:2]))
    yield "armadillo, one radius, no blur", mesh, mesh.bounds, Settings(radii[:1], blur=0.0)
    sheet, box, options = full_cover()
    yield "wall", sheet, box, options
    yield f"wall, {TENTH}", sheet, tenth(sheet, display), options


def full_cover():
    """Mesh, box to fit and settings of a scene that every texel sees."""
    return wall(), np.array([[-1.0, -0.75, -0.3], [1.0, 0.75, 0.3]]), Settings((0.03, 0.06, 0.1, 0.18, 0.3))


def tenth(mesh, display):
    """The box to fit where the mesh is to cover a tenth of the texture."""
    size = np.sqrt(10 * cover(mesh, display, mesh.bounds))
    for _ in range(6):
        size *= np.sqrt(cover(mesh, display, around(mesh, size)) / 0.1)
    return around(mesh, size)


def cover(mesh, display, box):
    """Share of a view's texels that see the scene."""
    view = middle_view(mesh, display, box)
    return (RayCaster(mesh, view.cast_from_world).gbuffer(view, None).triangle >= 0).mean()


def middle_view(mesh, display, box):
    """The view of the display's middle module."""
    views = module_views(mesh, display, None, 0, box)
    return views[len(views) // 2]


def variants(plan, everything):
    """The plan, and each of its cuts alone."""
    yield "plan", plan
    yield "rays", replace(everything, window=plan.window)
    yield "border", replace(everything, cut=True)
    yield "radii", replace(everything, same_as=plan.same_as, one_sample=plan.one_sample)


def jobs(name, mesh, box, settings, display):
    """What is rendered in turn: arguments of render_view."""
    view = middle_view(mesh, display, box)
    caster = RayCaster(mesh, view.cast_from_world)
    everything = ViewPlan.everything(view, settings)
    yield "all", (caster, view, settings, (), everything)
    for cut, plan in variants(ViewPlan.of(view, caster.bounds, settings), everything):
        yield cut, (caster, view, settings, (), plan)
    if name.endswith(TENTH):
        sheet, box, options = full_cover()
        view = middle_view(sheet, display, box)
        yield EVERY, (RayCaster(sheet, view.cast_from_world), view, options, (), ViewPlan.everything(view, options))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--display", default="virtual")
    parser.add_argument("--repeats", type=int, default=25)
    parser.add_argument("--json", type=Path, default=Path(__file__).parent / "results" / "plan.json")
    options = parser.parse_args()
    numba.set_num_threads(1)
    display, result = find_display(options.display), {"machine": describe_machine(1, sys.argv), "scenes": []}
    print(
        f"{'processor ms without a plan, and how many times less with':46s}  plan   rays border  radii built in  full"
    )
    for name, mesh, box, settings in cases(display):
        work = dict(jobs(name, mesh, box, settings, display))
        times = {key: [] for key in work}
        for turn in range(options.repeats + 2):
            for key, arguments in work.items():
                start = time.process_time()
                made = render_view(*arguments)
                if turn > 1:
                    times[key].append(1e3 * (time.process_time() - start))
                if key == "all":
                    covered = float((made.gbuffer.triangle >= 0).mean())
        pairs = {key: ("all", key) for key in work if key not in ("all", EVERY)}
        if EVERY in work:
            pairs |= {"built in": (EVERY, "all"), "full": (EVERY, "plan")}
        ratios = {
            key: np.percentile(np.divide(times[more], times[less]), [25, 50, 75]).tolist()
            for key, (more, less) in pairs.items()
        }
        milliseconds = {key: float(np.median(values)) for key, values in times.items()}
        result["scenes"].append({"scene": name, "cover": covered, "milliseconds": milliseconds, "ratios": ratios})
        line = " ".join(f"{middle:6.2f}" for _, middle, _ in ratios.values())
        print(f"{name:36s} {100 * covered:3.0f} %{milliseconds['all']:6.1f}{line}  (plan {ratios['plan'][0]:.2f} to "
              f"{ratios['plan'][2]:.2f})", flush=True)  # fmt: skip
    options.json.parent.mkdir(exist_ok=True)
    options.json.write_text(json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    main()
