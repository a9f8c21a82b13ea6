"""The viewer against a direct ray cast from the eye, by number of modules: ``python benchmarks/bench_viewer.py``.

Scenes: a sheet with smooth colours at three depths before a display with sample-a's screen, observers and module line,
and the embedded gallery as it is fitted into sample-a (silhouettes, so no order of convergence is to be expected).
Errors are root mean squares over pixels and channels of linear colour, 0 to 1, over several eyes. Measured beside it:
by how much points appear displaced in x, against |z| p / (m_z sqrt(12)). Writes JSON, and a plot from the JSON.
"""

import argparse
import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from lfssao import LightField, Mesh, Paint, RayCaster, builtin_scene, eye_view, find_display, fit_roi
from lfssao.bench.work_precision.figures import rms
from lfssao.rendering.manifest import describe_machine
from lfssao.rendering.viewer import BLENDS

COUNTS = (5, 9, 17, 33, 65, 129, 257)
EYES = (-0.41, -0.1, 0.123, 0.3)
DEPTHS = (-0.25, 0.05, 0.25)
WIDTH = 200
RESULTS = Path(__file__).parent / "results"


def display_of(count, width, height, screen_height):
    """sample-a with so many modules on its line."""
    display = replace(find_display("sample-a"), screen_height=screen_height).with_resolution(width, height)
    modules = tuple(replace(display.modules[0], x=-1 + 2 * k / (count - 1)) for k in range(count))
    return replace(display, modules=modules)


def sheet(z):
    """A sheet at depth z, in physical space, with colours 0.5 + 0.4 sin(k x + 0.7)."""
    n = 8001
    x, y = np.meshgrid(np.linspace(-2, 2, n), [-1.0, 1.0])
    vertices = np.stack([x, y, np.full_like(x, z)], axis=-1).reshape(-1, 3)
    i = np.arange(n - 1)
    faces = np.concatenate([np.stack([i, i + 1, i + n], 1), np.stack([i + 1, i + n + 1, i + n], 1)]).astype(np.int32)
    colors = np.stack([0.5 + 0.4 * np.sin(k * vertices[:, 0] + 0.7) for k in (4, 6, 9)], 1).astype(np.float32)
    return Mesh(vertices, faces, Paint.from_vertex_colors(colors, len(faces)))


def measure(mesh, physical_from_world, display, layers):
    """RMS error of every layer and blend over the eyes, and of x for the nearest module where there are positions."""
    caster = RayCaster(mesh, physical_from_world, threads=2)
    fields = {layer: LightField(display, range(len(display.modules))) for layer in layers}
    for k in range(len(display.modules)):
        gbuffer = caster.gbuffer(display.view(k, physical_from_world))
        for layer, field in fields.items():
            field.put(k, getattr(gbuffer, layer))
    found = {blend: [] for blend in BLENDS} | {"displacement": []}
    for eye in EYES:
        view = eye_view(display, physical_from_world, eye, WIDTH)
        true = RayCaster(mesh, view.cast_from_world, threads=2).gbuffer(view)
        for blend in BLENDS:
            found[blend].append(rms(fields["color"].photograph(eye, WIDTH, blend).image - true.color))
        if "positions" in layers:
            seen = fields["positions"].photograph(eye, WIDTH, "nearest").image
            found["displacement"].append(rms((seen - true.positions)[..., 0]))
    return {name: rms(values) for name, values in found.items() if values}


def order(rows, name):
    """Slope of log error against log pitch over the last four numbers of modules."""
    last = rows[-4:]
    return float(np.polyfit([-np.log(r["modules"] - 1) for r in last], [np.log(r[name]) for r in last], 1)[0])


def plot(result, path):
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, 3, figsize=(15, 4.6))
    for axis, key in zip(axes[:2], ("z=0.25", "gallery"), strict=True):
        for blend in BLENDS:
            rows = result["scenes"][key]["rows"]
            slope = result["scenes"][key]["orders"][blend]
            label = f"{blend}, order {slope:.2f}"
            axis.loglog([r["modules"] for r in rows], [r[blend] for r in rows], "o-", label=label)
        axis.set(title=key, xlabel="modules on 2 m", ylabel="RMS error of linear colour")
    for key, scene in result["scenes"].items():
        if key != "gallery":
            n = [r["modules"] for r in scene["rows"]]
            line = axes[2].loglog(n, [1e3 * r["displacement"] for r in scene["rows"]], "o", label=key)
            axes[2].loglog(n, [1e3 * r["foretold"] for r in scene["rows"]], "-", color=line[0].get_color())
    axes[2].set(title="nearest: displaced by (line: |z| p / (m_z sqrt 12))", xlabel="modules on 2 m", ylabel="RMS, mm")
    for axis in axes:
        axis.grid(visible=True, which="both", alpha=0.3)
        axis.legend()
    figure.tight_layout()
    figure.savefig(path, dpi=120)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path, default=RESULTS / "viewer.json")
    options = parser.parse_args()
    scenes = {}
    for z in DEPTHS:
        mesh = sheet(z)
        rows = []
        for count in COUNTS:
            found = measure(mesh, np.eye(3, 4), display_of(count, WIDTH, 2, 0.01), ("color", "positions"))
            foretold = abs(z) * 2 / (count - 1) / (0.7 * np.sqrt(12))
            rows.append({"modules": count, **found, "foretold": foretold})
        scenes[f"z={z}"] = {"rows": rows}
    mesh = builtin_scene("gallery")
    rows = []
    for count in COUNTS:
        display = display_of(count, WIDTH, 120, 0.6)
        rows.append({"modules": count, **measure(mesh, fit_roi(mesh.bounds, display.roi), display, ("color",))})
    scenes["gallery"] = {"rows": rows}
    for name, scene in scenes.items():
        scene["orders"] = {blend: order(scene["rows"], blend) for blend in BLENDS}
        print(name, {blend: round(slope, 3) for blend, slope in scene["orders"].items()})
        for row in scene["rows"]:
            print("  ", {key: float(f"{value:.3g}") for key, value in row.items()})
    options.json.parent.mkdir(exist_ok=True)
    result = {"machine": describe_machine(2), "eyes": EYES, "scenes": scenes}
    options.json.write_text(json.dumps(result, indent=1))
    plot(json.loads(options.json.read_text()), options.json.with_suffix(".png"))


if __name__ == "__main__":
    main()
