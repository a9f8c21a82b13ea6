"""VO's claims, measured: ``python benchmarks/bench_volumetric.py``, JSON and a picture beside the table.

Error: root mean square over the texels that see a surface, against the mean of 64 lines under five seeds; of each set
as it stands, and of the reflected ones (tiles of 4 x 4, mean over the seeds). Change: the camera moves by a quarter
texel four times; root mean square difference of occlusion from frame to frame, where all frames see a surface.
"""

import argparse
import json
from itertools import pairwise
from pathlib import Path

import numpy as np

from lfssao import Buffers, Camera, builtin_scene, estimate
from lfssao.gbuffer.caster import RayCaster
from lfssao.rendering.manifest import describe_machine
from lfssao.rendering.settings import diagonal
from lfssao.samples import repulsion_table

RESULTS = Path(__file__).parent / "results"
SETS = [("vo-lines", n) for n in (3, 5, 7, 9, 10, 12, 16)] + [("vo-points", n) for n in (6, 8, 12, 13, 24, 33, 48)]


def samples(name, n):
    made = repulsion_table("disk" if name == "vo-lines" else "ball", n)
    return made.points, made.weights


def frames(width, height, moves):
    """Buffers of the default scene, the camera moved to the right by so many texels."""
    mesh = builtin_scene()
    start = Camera.looking_at(mesh.bounds)
    texel = start.extent / height
    for move in moves:
        eye, target = ((p[0] + move * texel, p[1], p[2]) for p in (start.eye, start.target))
        camera = Camera(start.projection, eye, target, start.up, start.extent, start.near, start.far)
        view = camera.view(width, height)
        yield Buffers.of(RayCaster(mesh, view.cast_from_world).gbuffer(view), view), diagonal(mesh)


def rms(difference):
    return float(np.sqrt(np.mean(np.asarray(difference, np.float64) ** 2)))


def errors(buffers, radius, seeds=range(5)):
    """RMS error of each set, as it stands and randomized."""
    there = np.isfinite(buffers.depth)
    truth = np.mean([estimate("vo-lines", buffers, radius, *samples("vo-lines", 64), seed=s).texture for s in seeds], 0)
    rows = {}
    for name, n in SETS:
        points, weights = samples(name, n)
        plain = estimate(name, buffers, radius, points, weights, randomize=False).texture
        turned = [estimate(name, buffers, radius, points, weights, seed=s).texture for s in seeds]
        rows[f"{name}, {n}"] = {
            "fixed": rms((plain - truth)[there]),
            "randomized": float(np.mean([rms((t - truth)[there]) for t in turned])),
        }
    return rows


def flicker(seen, radius):
    """RMS change from frame to frame of each set, without reflections."""
    there = np.all([np.isfinite(b.depth) for b in seen], axis=0)
    rows = {}
    for name, n in SETS:
        points, weights = samples(name, n)
        made = [estimate(name, b, radius, points, weights, randomize=False).texture for b in seen]
        rows[f"{name}, {n}"] = rms([(b - a)[there] for a, b in pairwise(made)])
    return rows


def plot(result, path):
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, 2, figsize=(11, 4.5))
    for name in ("vo-lines", "vo-points"):
        keys = [key for key in result["errors"] if key.startswith(name)]
        n = [int(key.split(", ")[1]) for key in keys]
        axes[0].loglog(n, [result["errors"][key]["randomized"] for key in keys], "o-", label=name)
        axes[1].loglog(n, [result["flicker"][key] for key in keys], "o-", label=name)
    axes[0].set(xlabel="samples", ylabel="RMS error of occlusion, randomized")
    axes[1].set(xlabel="samples", ylabel="RMS change, camera moved by 1/4 texel")
    for axis in axes:
        axis.grid(visible=True, which="both", alpha=0.3)
        axis.legend()
    figure.tight_layout()
    figure.savefig(path, dpi=120)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", type=int, nargs=2, default=(512, 384))
    parser.add_argument("--radius", type=float, default=0.03, help="share of the scene's diagonal")
    parser.add_argument("--json", type=Path, default=RESULTS / "volumetric.json")
    options = parser.parse_args()
    seen = list(frames(*options.size, (0.0, 0.25, 0.5, 0.75, 1.0)))
    radius = options.radius * seen[0][1]
    buffers = [b for b, _ in seen]
    result = {
        "machine": describe_machine(1),
        "size": list(options.size),
        "radius": radius,
        "errors": errors(buffers[0], radius),
        "flicker": flicker(buffers, radius),
    }
    for key, row in result["errors"].items():
        line = f"{key:14s} error {row['fixed']:.4f}, randomized {row['randomized']:.4f}"
        print(f"{line}; change {result['flicker'][key]:.4f}")
    options.json.parent.mkdir(exist_ok=True)
    options.json.write_text(json.dumps(result, indent=1))
    plot(json.loads(options.json.read_text()), options.json.with_suffix(".png"))


if __name__ == "__main__":
    main()
