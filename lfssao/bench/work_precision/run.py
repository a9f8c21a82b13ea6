"""Error against run time, of every estimator: the cost of a setting and its errors, never mixed.

*Sampling* error: RMSE against the same estimator with very many samples of other samplers. *Own* error: against
ray-cast occlusion of the integrand that the estimator is after. *Visibility* error: against ray-cast occlusion,
weighted by the cosine, of all that is within R. All are over the texels that see a surface, of all scenes and seeds.
"""

import json
import subprocess
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import asdict
from functools import partial
from itertools import chain, product
from pathlib import Path
from shutil import which
from time import perf_counter, process_time
from typing import Any, TypeVar

import numpy as np

from lfssao.ao import post
from lfssao.ao.estimators.estimator import Estimator
from lfssao.ao.estimators.registry import of_one_view
from lfssao.ao.textures import Texture
from lfssao.bench.work_precision.advise import FORMAT
from lfssao.bench.work_precision.figures import FIGURES, combine_others, figures, null_lines, pooled, rms
from lfssao.bench.work_precision.scene import VISIBILITY, BenchScene
from lfssao.bench.work_precision.settings import Grid, Inputs, Variant, inputs_of, samples_for, takes_samples
from lfssao.core.threads import kernel_threads
from lfssao.rendering.manifest import describe_machine, describe_scene
from lfssao.scene.mesh import Mesh
from lfssao.viz.truth import half_space

Setting = tuple[Variant, tuple[float, ...], float]  # with radii and blur
_MANY = 2**32  # seed of the references, which no measured set has
Key = TypeVar("Key", bound=Hashable)
_AGREE = 3  # runs that have to agree


def least_times(
    runs: Mapping[Key, Callable[[], object]],
    spread: float = 0.03,
    most: int = 60,
    clock: Callable[[], float] = process_time,
) -> dict[Key, tuple[float, float]]:
    """Return the least milliseconds of each run, and by which fraction the third least is above it.

    All run once, which may compile, and then turn by turn, each second turn in reverse, until the fraction is at most
    ``spread``, or ``most`` times. The clock returns seconds: of this process's work, by default.
    """
    for run in runs.values():
        run()
    taken: dict[Key, list[float]] = {name: [] for name in runs}
    for turn in range(most):
        left = [name for name in runs if turn < _AGREE or _spread(taken[name]) > spread]
        for name in left if turn % 2 else reversed(left):
            start = clock()
            runs[name]()
            taken[name].append(1e3 * (clock() - start))
    return {name: (min(times), _spread(times)) for name, times in taken.items()}


def _spread(times: list[float]) -> float:
    least = sorted(times)[:_AGREE]
    return least[-1] / least[0] - 1 if least[0] > 0 else 0.0


def times_of(scene: BenchScene, estimator: Estimator, threads: int) -> dict[Setting, tuple[float, float, float]]:
    """Return milliseconds of one thread's work, their spread, and milliseconds of all threads, of each setting."""
    grid = scene.grid
    inputs = inputs_of(estimator, scene.grid, 0)
    texture = scene.buffers.depth.clip(0, 1)  # any: its numbers do not change the time
    passes: dict[Any, Callable[[], object]] = {
        ("ao", variant, radius): partial(scene.occlusion, estimator, radius, inputs[variant])
        for variant, radius in product(inputs, grid.each_radius)
    }
    passes |= {("merge", len(radii)): partial(post.merge, [texture] * len(radii)) for radii in grid.radii}
    passes |= {("blur", blur): partial(post.blur, texture, blur) for blur in grid.blurs}
    times: list[dict[Any, tuple[float, float]]] = []
    for count, clock in ((1, process_time), (threads, perf_counter)):
        with kernel_threads(count):
            times.append(least_times(passes, grid.spread, grid.most, clock))
    out = {}
    for variant, radii, blur in product(inputs, grid.radii, grid.blurs):
        keys = [*(("ao", variant, radius) for radius in radii), ("merge", len(radii)), ("blur", blur)]
        work, wall = (sum(each[key][0] for key in keys) for each in times)
        out[variant, radii, blur] = work, max(times[0][key][1] for key in keys[:-2]), wall
    return out


def _textures(
    scene: BenchScene, estimator: Estimator, inputs: Inputs, seed: int
) -> dict[tuple[tuple[float, ...], float], Texture]:
    layers = {radius: scene.occlusion(estimator, radius, inputs, seed) for radius in scene.grid.each_radius}
    merged = {radii: post.merge([layers[radius] for radius in radii]) for radii in scene.grid.radii}
    return {(radii, blur): post.blur(merged[radii], blur) for radii in merged for blur in scene.grid.blurs}


def errors_of(scene: BenchScene, estimator: Estimator) -> dict[Setting, list[Any]]:
    """Return figures against both truths, sampling error and the reference's own, of each setting, by seed."""
    grid = scene.grid
    surface = scene.surface
    many: dict[Any, dict[str, Texture]] = {}  # references, the surface texels' occlusion
    for by in grid.reference_samplers if takes_samples(estimator) else ():
        samples = samples_for(estimator, by, grid.reference_count, _MANY)
        for key, texture in _textures(scene, estimator, (samples, {}), 0).items():
            many.setdefault(key, {})[by] = texture[surface].astype(np.float64)
    out: dict[Setting, list[Any]] = {}
    for seed in range(grid.seeds):
        for (sampler, n), inputs in inputs_of(estimator, grid, seed).items():
            for (radii, blur), texture in _textures(scene, estimator, inputs, seed).items():
                ours = np.where(surface, half_space(texture) if estimator.whole_ball else texture, 0)
                truths = (scene.truth(radii, integrand)[0] for integrand in (VISIBILITY, estimator.integrand))
                sampling = np.nan
                own = np.nan
                if sampler is not None:
                    reference, own = combine_others(many[radii, blur], sampler)
                    sampling = rms(texture[surface] - reference)
                found = *(figures(ours, truth, surface, seed == 0) for truth in truths), sampling, own
                out.setdefault(((sampler, n), radii, blur), []).append(found)
    return out


def summary(estimator: Estimator, times: Sequence[dict[Setting, Any]], errors: Sequence[dict[Setting, Any]]) -> Any:
    """All points of one estimator, as JSON holds them, from the times and errors on each scene."""
    points = []
    for setting in errors[0]:
        (sampler, n), radii, blur = setting
        work, spread, wall = np.mean([each[setting] for each in times], axis=0).tolist()
        found = chain.from_iterable(each[setting] for each in errors)
        visibility, own, sampling, reference = zip(*found, strict=True)
        point = {"estimator": estimator.name, "sampler": sampler, "samples": n, "radii": list(radii), "blur": blur}
        point |= {"ms": _short(work), "spread": _short(spread), "wall_ms": _short(wall)}
        point |= {"visibility": [*map(_short, pooled(visibility))], "own": [*map(_short, pooled(own))]}
        point |= {"sampling": None, "reference": None}
        if sampler is not None:
            point |= {"sampling": _short(rms(sampling)), "reference": _short(rms(reference))}
        points.append(point)
    return {"source": estimator.source, "integrand": list(estimator.integrand), "points": points}


def _short(number: float) -> float:
    """Four digits of a number: more are noise, and make the file twice as long."""
    return float(f"{number:.4g}")


def integrands() -> list[tuple[str, str]]:
    """Those of all truths: visibility, and each estimator's own."""
    return list(dict.fromkeys([VISIBILITY, *(estimator.integrand for estimator in of_one_view().values())]))


def start(meshes: Sequence[Mesh], grid: Grid, threads: int) -> dict[str, Any]:
    """Return a result that holds only its setup: figures of different setups do not go into one file."""
    kept = ("name", "faces", "vertices_sha256")
    machine = describe_machine(threads)
    setup = {
        "scenes": [{key: each[key] for key in kept} for each in map(describe_scene, meshes)],
        "grid": json.loads(json.dumps(asdict(grid))),
        "machine": {name: value for name, value in machine.items() if name != "command"},
        "commit": _commit(),
    }
    return {"work_precision": FORMAT, "setup": setup, "figures": FIGURES, "estimators": {}}


def _commit() -> str | None:
    """Return the commit of the source, if it is a checkout."""
    top = Path(__file__).parents[3]
    git = which("git")
    if git is None or not (top / ".git").exists():
        return None
    done = subprocess.run([git, "-C", str(top), "rev-parse", "HEAD"], capture_output=True, text=True, check=False)
    return done.stdout.strip() or None


def steps(result: dict[str, Any]) -> int:
    """Number of steps that a result has left, which ``run`` names."""
    missing = len(set(of_one_view()) - set(result["estimators"]))
    return missing * len(result["setup"]["scenes"]) + (0 if "nulls" in result else len(integrands()))


def run(
    meshes: Sequence[Mesh], grid: Grid, threads: int, result: dict[str, Any], save: Callable[[], None]
) -> Iterator[str]:
    """Measure what a result of ``start`` lacks, and save it after each estimator; gives the name of each step first."""
    if not steps(result):
        return
    scenes = [BenchScene(mesh, grid, threads) for mesh in meshes]
    if "nulls" not in result:
        nulls: dict[str, list[dict[str, float]]] = {}
        for integrand in integrands():
            yield f"rays, {' '.join(integrand)}"
            for radii in grid.radii:
                truths = [(scene, *scene.truth(radii, integrand)) for scene in scenes]
                lines = null_lines([(truth[s.surface], error[s.surface]) for s, truth, error in truths])
                nulls.setdefault(" ".join(integrand), []).append({name: _short(n) for name, n in lines.items()})
        result["nulls"] = nulls
        save()
    for name, estimator in of_one_view().items():
        if name not in result["estimators"]:
            times = []
            found = []
            for scene in scenes:
                yield f"{name}, {scene.mesh.name}"
                with kernel_threads(threads):
                    found.append(errors_of(scene, estimator))
                times.append(times_of(scene, estimator, threads))
            result["estimators"][name] = summary(estimator, times, found)
            save()
