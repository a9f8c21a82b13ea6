"""Error against run time, of every estimator: the cost of a setting and its errors, never mixed.

*Sampling* error: RMSE against the same estimator with very many samples of other samplers. *Own* error: against
ray-cast occlusion of the integrand that the estimator is after. *Visibility* error: against ray-cast occlusion,
weighted by the cosine, of all that is within R. All are over the texels that see a surface, of all scenes and seeds.
"""

import json
import subprocess
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from itertools import product
from pathlib import Path
from time import perf_counter, process_time
from typing import Any, TypeVar

import numba
import numpy as np

from lfssao.ao import post
from lfssao.ao.estimators.estimator import Estimator
from lfssao.ao.estimators.registry import ESTIMATORS
from lfssao.ao.textures import Texture
from lfssao.bench.work_precision.advise import FORMAT
from lfssao.bench.work_precision.figures import FIGURES, combine_others, figures, null_lines, pooled, rms
from lfssao.bench.work_precision.scene import VISIBILITY, BenchScene, Inputs
from lfssao.bench.work_precision.settings import (
    Grid,
    counts_of,
    own_counts_of,
    samplers_of,
    samples_for,
    takes_samples,
)
from lfssao.rendering.manifest import describe_machine, describe_scene
from lfssao.scene.mesh import Mesh

Tick = Callable[[str], None]
Variant = tuple[str | None, int | None]  # sampler and number of samples
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


@dataclass(frozen=True)
class _Bench:
    """One estimator on one scene."""

    scene: BenchScene
    estimator: Estimator
    grid: Grid
    threads: int

    def variants(self) -> Iterator[Variant]:
        """Samplers and numbers of samples, or numbers of taps of its own."""
        if not takes_samples(self.estimator):
            yield from ((None, n) for n, _ in own_counts_of(self.estimator, self.grid))
        else:
            for sampler in samplers_of(self.estimator, self.grid):
                yield from ((sampler, n) for n in counts_of(self.estimator, sampler, self.grid))

    def inputs(self, variant: Variant, seed: int) -> Inputs:
        sampler, n = variant
        if sampler is None:
            return (None, None), dict(own_counts_of(self.estimator, self.grid))[n]
        assert n is not None
        return samples_for(self.estimator, sampler, n, seed), {}

    def times(self) -> dict[Setting, tuple[float, float, float]]:
        """Milliseconds of one thread's work, their spread, and milliseconds of all threads, of each setting."""
        made: list[dict[Any, tuple[float, float]]] = []
        for threads, clock in ((1, process_time), (self.threads, perf_counter)):
            numba.set_num_threads(threads)
            made.append(least_times(self._passes(), self.grid.spread, self.grid.most, clock))
        out = {}
        for variant, radii, blur in product(self.variants(), self.grid.radii, self.grid.blurs):
            keys = [*(("ao", variant, radius) for radius in radii), ("merge", len(radii)), ("blur", blur)]
            work, wall = (sum(each[key][0] for key in keys) for each in made)
            out[variant, radii, blur] = work, max(made[0][key][1] for key in keys[:-2]), wall
        return out

    def _passes(self) -> dict[Any, Callable[[], object]]:
        """Every pass that a setting needs, once."""
        texture = self.scene.buffers.depth.clip(0, 1)  # any: its numbers do not change the time
        out: dict[Any, Callable[[], object]] = {}
        for variant, radius in product(self.variants(), self.grid.each_radius):
            inputs = self.inputs(variant, 0)
            out["ao", variant, radius] = partial(self.scene.occlusion, self.estimator, radius, inputs)
        for radii in self.grid.radii:
            out["merge", len(radii)] = partial(post.merge, [texture] * len(radii))
        return out | {("blur", blur): partial(post.blur, texture, blur) for blur in self.grid.blurs}

    def _settings(self, inputs: Inputs, seed: int) -> dict[tuple[tuple[float, ...], float], Texture]:
        """Textures by radii and blur."""
        layers = {r: self.scene.occlusion(self.estimator, r, inputs, seed) for r in self.grid.each_radius}
        merged = {radii: post.merge([layers[radius] for radius in radii]) for radii in self.grid.radii}
        return {(radii, blur): post.blur(merged[radii], blur) for radii in merged for blur in self.grid.blurs}

    def references(self) -> dict[tuple[tuple[float, ...], float], dict[str, Any]]:
        """Textures of many samples, the surface texels' occlusion, by radii and blur, then by sampler."""
        out: dict[Any, dict[str, Any]] = {}
        for sampler in self.grid.reference_samplers if takes_samples(self.estimator) else ():
            samples = samples_for(self.estimator, sampler, self.grid.reference_count, _MANY)
            for key, texture in self._settings((samples, {}), 0).items():
                out.setdefault(key, {})[sampler] = texture[self.scene.surface].astype(np.float64)
        return out

    def errors(self) -> Iterator[tuple[Setting, list[float], list[float], float, float]]:
        """Figures against both truths, sampling error and the reference's own, by setting and seed."""
        many, surface = self.references(), self.scene.surface
        for variant, seed in product(self.variants(), range(self.grid.seeds)):
            for (radii, blur), texture in self._settings(self.inputs(variant, seed), seed).items():
                ours = self.scene.compared(self.estimator, texture)
                both = [
                    figures(ours, self.scene.truth(radii, integrand)[0], surface, seed == 0)
                    for integrand in (VISIBILITY, self.estimator.integrand)
                ]
                sampling, own = np.nan, np.nan
                if variant[0] is not None:
                    reference = combine_others(many[radii, blur], variant[0])
                    sampling, own = rms(texture[surface] - reference.texture), reference.error
                yield (variant, radii, blur), both[0], both[1], sampling, own


def measure_estimator(
    scenes: Sequence[BenchScene], estimator: Estimator, grid: Grid, threads: int, tick: Tick
) -> dict[str, Any]:
    """Return all points of one estimator, as JSON holds them."""
    times: list[dict[Setting, tuple[float, float, float]]] = []
    errors: dict[Setting, list[Any]] = {}
    for scene in scenes:
        tick(f"{estimator.name}, {scene.mesh.name}")
        bench = _Bench(scene, estimator, grid, threads)
        numba.set_num_threads(threads)
        for setting, *found in bench.errors():
            errors.setdefault(setting, []).append(found)
        times.append(bench.times())
    points = []
    for setting, found in errors.items():
        (sampler, n), radii, blur = setting
        work, spread, wall = np.mean([each[setting] for each in times], axis=0).tolist()
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
    return list(dict.fromkeys([VISIBILITY, *(estimator.integrand for estimator in ESTIMATORS.values())]))


def measure_nulls(scenes: Sequence[BenchScene], grid: Grid, tick: Tick) -> dict[str, list[dict[str, float]]]:
    """Null lines by integrand, one for each set of radii."""
    out: dict[str, list[dict[str, float]]] = {}
    for integrand in integrands():
        tick(f"rays, {' '.join(integrand)}")
        for radii in grid.radii:
            textures, errors = zip(*(scene.truth(radii, integrand) for scene in scenes), strict=True)
            lines = null_lines(textures, errors, [scene.surface for scene in scenes])
            out.setdefault(" ".join(integrand), []).append({name: _short(value) for name, value in lines.items()})
    return out


def start(meshes: Sequence[Mesh], grid: Grid, threads: int) -> dict[str, Any]:
    """Return a result that holds only its setup: figures of different setups do not go into one file."""
    machine = describe_machine(threads)
    machine.pop("command")
    described = [describe_scene(mesh) for mesh in meshes]
    setup = {
        "scenes": [{key: each[key] for key in ("name", "faces", "vertices_sha256")} for each in described],
        "grid": json.loads(json.dumps(asdict(grid))),
        "machine": machine,
        "commit": _commit(),
    }
    return {"work_precision": FORMAT, "setup": setup, "figures": FIGURES, "estimators": {}}


def _commit() -> str | None:
    """The commit of the source, if it is a checkout."""
    top = Path(__file__).parents[3]
    if not (top / ".git").exists():
        return None
    try:
        done = subprocess.run(["git", "-C", str(top), "rev-parse", "HEAD"], capture_output=True, text=True, check=False)
    except OSError:
        return None
    return done.stdout.strip() or None


def steps(result: dict[str, Any]) -> int:
    """Number of steps that a result has left, each of which ``run`` ticks."""
    missing = len(set(ESTIMATORS) - set(result["estimators"]))
    return missing * len(result["setup"]["scenes"]) + (0 if "nulls" in result else len(integrands()))


def run(
    meshes: Sequence[Mesh], grid: Grid, threads: int, result: dict[str, Any], save: Callable[[], None], tick: Tick
) -> None:
    """Measure what a result of ``start`` lacks, and save it after each estimator; ``tick`` takes each step's name."""
    if not steps(result):
        return
    scenes = [BenchScene(mesh, grid, threads) for mesh in meshes]
    if "nulls" not in result:
        result["nulls"] = measure_nulls(scenes, grid, tick)
        save()
    for name in ESTIMATORS:
        if name not in result["estimators"]:
            result["estimators"][name] = measure_estimator(scenes, ESTIMATORS[name], grid, threads, tick)
            save()
