"""Does AO agree from module to module, and what do neighbours change: ``python benchmarks/bench_agreement.py [SCENE]``.

Points of the surface are followed through the textures of all modules of sample-a, and along a viewer's path, and
read there as they are shown. For each estimator, sampler and radius, and for LF's with 0, 2 and 4 neighbours: the
spread of a point's occlusion over the modules, over the path, the error against ray-cast occlusion, and the time.
Ray-cast occlusion, which is the same for all modules but for where it is read, shows the spread of the reading.

Errors are of 2 max(0, ao - 1/2) for LF's full ball, in which a flat surface has 1/2, and of ao as it is for estimators
of the half space; the truth has the same radius, uniform directions and no falloff.
"""

import argparse
import json
import sys
from pathlib import Path

import numba
import numpy as np

from lfssao import Occluders, RayCaster, Settings, builtin_scene, find_display, load_scene, module_views, samples
from lfssao.ao.ground_truth import ray_cast_occlusion
from lfssao.ao.textures import Buffers
from lfssao.gbuffer.caster import DepthCache
from lfssao.rendering.manifest import describe_machine
from lfssao.rendering.passes import render_view
from lfssao.rendering.points import places_of, read_at
from lfssao.rendering.settings import diagonal
from lfssao.rendering.viewer import LightField, eye_view
from lfssao.rendering.views import neighbour_views
from lfssao.viz import agreement

RADII = (0.01, 0.035, 0.1)  # shares of the diagonal
SAMPLERS = ("random", "jittered", "latin", "poisson")
MODULES = range(5, 16)
EYES = np.linspace(-0.5, 0.5, 11)


def path(display, mesh, world, eyes, width):
    """The surface itself as an eye at each place of the observer line, metres, sees it: (eye, view, G-buffer)."""
    views = [eye_view(display, world, eye, width) for eye in eyes]
    casters = [RayCaster(mesh, view.cast_from_world) for view in views]
    return [(e, v, caster.gbuffer(v, color=None)) for e, v, caster in zip(eyes, views, casters, strict=True)]


def along_path(points, display, textures, stops, same, blend="linear"):
    """The value that each point shows to the eye at each stop, (n, eyes) float64, NaN where it does not see the point.

    textures: (H, W) float32 by module; same: as of ``places_of``.
    """
    shown = LightField(display, textures, channels=1)
    for index, texture in textures.items():
        shown.put(index, np.ascontiguousarray(texture[..., None], np.float32))
    read = [
        read_at(places_of(points, view, seen.positions, same), shown.photograph(eye, view.width, blend).image[..., 0])
        for eye, view, seen in stops
    ]
    return np.stack(read, axis=1)


class Bench:
    """A scene, what all modules see of it, and points to follow."""

    def __init__(self, mesh, size):
        self.mesh = mesh
        self.display = find_display("sample-a").with_resolution(*size)
        self.views = module_views(mesh, self.display, MODULES)
        self.caster = RayCaster(mesh, self.views[0].cast_from_world, 2)
        self.gbuffers = [self.caster.gbuffer(view, color=None, normals="geometric") for view in self.views]
        self.middle = len(self.views) // 2
        self.points = agreement.surface_points(self.gbuffers[self.middle], 5000)
        self.path = path(self.display, mesh, self.views[0].cast_from_world, EYES, size[0])
        self.same = 2.0 * float(np.sqrt(((mesh.bounds[1] - mesh.bounds[0]) ** 2).sum())) / size[0]

    def shown(self, settings):
        """The occlusion textures of all modules, not blurred, and seconds a module for the AO pass."""
        asked = neighbour_views(self.mesh, self.display, settings.neighbours, MODULES)
        cache = DepthCache(self.caster, 2 * settings.neighbours + 1)
        textures = []
        seconds = []
        for view, others in zip(self.views, asked, strict=True):
            depths = cache.neighbours(others)
            made = render_view(self.caster, view, settings, depths)
            textures.append(made.ao[0])
            seconds.append(made.seconds["ao"])
        return textures, float(np.median(seconds))

    def measure(self, textures):
        """Spread over the modules and over the path."""
        over = agreement.over_modules(self.points, self.views, self.gbuffers, textures, self.same)
        shown = dict(zip(MODULES, textures, strict=True))
        along = along_path(self.points, self.display, shown, self.path, self.same)
        return agreement.spread(over), agreement.spread(along)

    def truth(self, radius, rounds):
        """Ray-cast occlusion of all modules' textures."""
        occluders = Occluders(self.mesh)
        return [
            ray_cast_occlusion(
                occluders, Buffers.of(gbuffer, view), radius, "uniform", tolerance=0.02, rounds=(2, rounds), strata=4
            ).texture
            for view, gbuffer in zip(self.views, self.gbuffers, strict=True)
        ]


def error(bench, textures, truth, estimator):
    """RMSE against ray-cast occlusion, over all modules' surface texels."""
    squares = []
    for texture, exact, gbuffer in zip(textures, truth, bench.gbuffers, strict=True):
        seen = gbuffer.triangle >= 0
        value = texture[seen].astype(np.float64)
        value = 2 * np.maximum(0, value - 0.5) if estimator == "lf" else value
        squares.append((value - exact[seen]) ** 2)
    return float(np.sqrt(np.concatenate(squares).mean()))


def cases(radius):
    for sampler in SAMPLERS:
        yield "lf", sampler, 0, radius
    for neighbours in (2, 4):
        yield "lf", "latin", neighbours, radius
    for estimator in ("hemisphere", "sao", "vo-lines-normal"):
        yield estimator, "own", 0, radius


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", nargs="?", default="statue", help="an embedded scene or a mesh file")
    parser.add_argument("--size", type=int, nargs=2, default=(250, 150), help="texels; the display itself has 1000 600")
    parser.add_argument("--rounds", type=int, default=16, help="most rounds of 16 rays a texel, for the truth")
    parser.add_argument("--json", type=Path, default=Path(__file__).parent / "results" / "agreement.json")
    options = parser.parse_args()
    numba.set_num_threads(min(2, numba.config.NUMBA_NUM_THREADS))
    mesh = load_scene(options.scene) if "." in options.scene else builtin_scene(options.scene)
    bench = Bench(mesh, options.size)
    rows = []
    print(f"{mesh.name}, sample-a at {options.size[0]} x {options.size[1]}, modules {MODULES.start}:{MODULES.stop}")
    print(f"{'estimator':12s} {'sampler':9s} {'K':>2s} {'R':>6s}  modules: sd  sd 95 %  range   path: sd   RMSE   ms")
    for share in RADII:
        radius = share * diagonal(mesh)
        truth = bench.truth(radius, options.rounds)
        over, path = bench.measure([t.astype(np.float32) for t in truth])
        rows.append(row("truth", "", 0, share, over, path, 0.0, 0.0))
        for estimator, sampler, neighbours, _ in cases(radius):
            points = None if sampler == "own" else samples.make_samples(sampler, 8)
            settings = Settings((radius,), points, 0.0, estimator=estimator, neighbours=neighbours)
            bench.shown(settings)  # compiled
            textures, seconds = bench.shown(settings)
            over, path = bench.measure(textures)
            rows.append(
                row(
                    estimator, sampler, neighbours, share, over, path, error(bench, textures, truth, estimator), seconds
                )
            )
    options.json.parent.mkdir(exist_ok=True)
    machine = describe_machine(2, sys.argv)
    options.json.write_text(json.dumps({"machine": machine, "scene": mesh.name, "rows": rows}, indent=1))
    draw(rows, options.json.with_suffix(".png"))


def row(estimator, sampler, neighbours, share, over, path, rmse, seconds):
    print(
        f"{estimator:12s} {sampler:9s} {neighbours:2d} {share:6.1%}      {over.deviation:7.4f} {over.deviation_95:8.4f}"
        f" {over.range:6.3f}     {path.deviation:7.4f} {rmse:6.3f} {1e3 * seconds:5.1f}"
    )
    return {
        "estimator": estimator, "sampler": sampler, "neighbours": neighbours, "radius": share,
        "modules": vars(over), "path": vars(path), "rmse": rmse, "ms": 1e3 * seconds,
    }  # fmt: skip


def draw(rows, path):
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 4), layout="constrained")
    for axes, key, title in zip(
        figure.subplots(1, 2, sharey=True), ("modules", "path"), ("over modules", "along a path"), strict=True
    ):
        names = dict.fromkeys((r["estimator"], r["sampler"], r["neighbours"]) for r in rows)
        for name in names:
            mine = [r for r in rows if (r["estimator"], r["sampler"], r["neighbours"]) == name]
            label = " ".join(str(part) for part in name[:2] if part) + (f", {name[2]} neighbours" if name[2] else "")
            style = "k--" if name[0] == "truth" else "o-"
            axes.plot([100 * r["radius"] for r in mine], [r[key]["deviation"] for r in mine], style, label=label)
        axes.set(
            xlabel="radius, % of the scene's diagonal", title=f"spread of a point's occlusion {title}", xscale="log"
        )
    figure.axes[0].set_ylabel("standard deviation, mean over points")
    figure.legend(loc="outside right center", fontsize="small")
    figure.savefig(path, dpi=120)


if __name__ == "__main__":
    main()
