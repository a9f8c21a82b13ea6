"""How sharp the oracle's bounds are and what they cost: ``python benchmarks/bench_oracle.py``, JSON beside the table.

1024x768, the default samples and radii. For each embedded scene, as a module and as a camera: the fraction of
the samples around visible points that rounding decides, the fraction of the visible texels whose count is certain, in
the worst radius and in all radii at once; and the time of the bounds over that of the AO itself, both taking turns.
"""

import argparse
import json
import sys
import time
from pathlib import Path

import numba
import numpy as np

from lfssao import Camera, RayCaster, View, builtin_scene, default_radii, find_display, make_samples, module_views
from lfssao.gbuffer.caster import GBuffer
from lfssao.rendering.manifest import describe_machine
from lfssao.scene.builtin import BUILTIN
from lfssao.scene.mesh import Mesh
from lfssao.verify.bounds.ssao import ao_bounds

MODELS = ("shader", "sampler", "nearest")
DISPLAYS = ("virtual", "sample-a", "c80", "picoarray", "convex")


def views(mesh: Mesh, size: tuple[int, int], displays: tuple[str, ...]) -> dict[str, View]:
    """The first of a display's modules by its name, and a camera."""
    found = {}
    for name in displays:
        display = find_display(name).with_resolution(*size)
        found[name] = module_views(mesh, display, range(len(display.modules) // 4, len(display.modules) // 4 + 1))[0]
    found["camera"] = Camera.looking_at(mesh.bounds).view(*size)
    return found


def sharpness(mesh: Mesh, view: View, gbuffer: GBuffer, model: str) -> dict[str, float]:
    """Shares of undecided samples and of certain texels, of what sees a surface."""
    samples = make_samples()
    surface = gbuffer.depth < np.inf
    undecided = [
        ao_bounds(
            gbuffer.depth, gbuffer.positions, view.world_to_image, samples, radius, model, view.screen_to_world
        ).undecided[surface]
        for radius in default_radii(mesh)
    ]
    return {
        "undecided_samples_worst_radius": max(float(o.mean()) / len(samples) for o in undecided),
        "certain_texels_worst_radius": min(float((o == 0).mean()) for o in undecided),
        "certain_texels_all_radii": float((np.sum(undecided, axis=0) == 0).mean()),
    }


def cost(mesh: Mesh, view: View, gbuffer: GBuffer, repeats: int) -> dict[str, float]:
    """Median milliseconds of the bounds and of the AO, and quartiles of their ratio."""
    radius = default_radii(mesh)[2]
    samples = make_samples()
    given = gbuffer.depth, gbuffer.positions, view.world_to_image, samples, radius
    times: dict[str, list[float]] = {"shader": [], "strict": []}
    for _ in range(repeats + 1):
        for model, spent in times.items():
            start = time.perf_counter()
            ao_bounds(*given, model, view.screen_to_world)
            spent.append(1e3 * (time.perf_counter() - start))
    bounds, ao = (np.array(spent[1:]) for spent in times.values())
    low, middle, high = np.percentile(bounds / ao, [25, 50, 75])
    medians = {"bounds_ms": float(np.median(bounds)), "ao_ms": float(np.median(ao))}
    return {**medians, "ratio": float(middle), "ratio_25": float(low), "ratio_75": float(high)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=10)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--size", type=int, nargs=2, default=(1024, 768))
    parser.add_argument("--json", type=Path, default=Path(__file__).parent / "results" / "oracle.json")
    options = parser.parse_args()
    numba.set_num_threads(options.threads)
    rows = []
    print("scene      view       model    undecided     certain texels  in all radii   bounds      AO   ratio")
    for scene in BUILTIN:
        mesh = builtin_scene(scene)
        for name, view in views(mesh, tuple(options.size), DISPLAYS if scene == "gallery" else DISPLAYS[:1]).items():
            gbuffer = RayCaster(mesh, view.cast_from_world).gbuffer(view)
            spent = cost(mesh, view, gbuffer, options.repeats)
            for model in MODELS:
                row = {"scene": scene, "view": name, "model": model, **sharpness(mesh, view, gbuffer, model), **spent}
                rows.append(row)
                print(
                    f"{scene:10s} {name:10s} {model:8s} {row['undecided_samples_worst_radius']:12.4%} "
                    f"{row['certain_texels_worst_radius']:15.3%} {row['certain_texels_all_radii']:13.3%} "
                    f"{row['bounds_ms']:6.1f}ms {row['ao_ms']:5.1f}ms {row['ratio']:7.1f}"
                )
    options.json.parent.mkdir(exist_ok=True)
    machine = describe_machine(options.threads, sys.argv)
    options.json.write_text(json.dumps({"machine": machine, "size": options.size, "rows": rows}, indent=1))


if __name__ == "__main__":
    main()
