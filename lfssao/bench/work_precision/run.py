"""Error against run time, of every estimator: the cost of a setting and its two errors, never mixed.

*Sampling* error: RMSE against the same estimator with very many samples of other samplers. *Model* error: RMSE against
ray-cast occlusion of the same radius. Both are over the texels that see a surface.
"""

import json
import os
import subprocess
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import product
from pathlib import Path
from typing import Any

from lfssao.ao import post
from lfssao.ao.estimators.estimator import Estimator
from lfssao.ao.estimators.registry import ESTIMATORS
from lfssao.ao.textures import Texture
from lfssao.bench.times import Times
from lfssao.bench.work_precision.advise import FORMAT
from lfssao.bench.work_precision.references import Reference, combine_others, rms, rmse
from lfssao.bench.work_precision.rotations import rotation_errors
from lfssao.bench.work_precision.scene import BenchScene, Inputs
from lfssao.bench.work_precision.setting_times import Setting, setting_times
from lfssao.bench.work_precision.settings import (
    FEW,
    REFERENCE_DTYPE,
    TIMED,
    TIMED_FOR_ALL,
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

# One texture for each radius.
Layers = dict[float, Texture]

# By radii and blur.
References = Mapping[tuple[tuple[float, ...], float], Reference]


def measure_estimator(scene: BenchScene, estimator: Estimator, grid: Grid, tick: Tick) -> dict[str, Any]:
    """Return all points of one estimator, as JSON holds them."""
    bench = _Bench(scene, estimator, grid, tick)
    points = bench.sampled() if takes_samples(estimator) else bench.unsampled()
    return {"source": estimator.source, "points": list(points)}


@dataclass(frozen=True)
class _Bench:
    """The points of one estimator on one scene."""

    scene: BenchScene
    estimator: Estimator
    grid: Grid
    tick: Tick

    def unsampled(self) -> Iterator[dict[str, Any]]:
        """Points of an estimator that makes its own samples, or none: no sampling error."""
        self.tick(self.estimator.name)
        inputs: dict[str, Inputs] = {}
        counts = own_counts_of(self.estimator, self.grid)
        for n, parameters in counts:
            inputs[str(n)] = (None, None), parameters
        times = setting_times(self.scene, self.estimator, self.grid, inputs)
        for n, _ in counts:
            facts = {"sampler": None, "samples": n, "time_of": None}
            yield from self._points(facts, [inputs[str(n)]], times[str(n)], {})

    def sampled(self) -> Iterator[dict[str, Any]]:
        """Points by sampler and number of samples."""
        references = self._references()
        for n in self.grid.counts:
            self.tick(f"{self.estimator.name}, time of {n} samples")
            own = [sampler for sampler in references if n in counts_of(self.estimator, sampler, self.grid)]
            timed = {sampler: self._samples(sampler, n, 0) for sampler in (own if n <= TIMED else [TIMED_FOR_ALL])}
            times = setting_times(self.scene, self.estimator, self.grid, timed)
            for sampler in own:
                self.tick(f"{self.estimator.name}, {n} samples by {sampler}")
                time_of = sampler if n <= TIMED else TIMED_FOR_ALL
                sets = [self._samples(sampler, n, seed) for seed in range(self.grid.seeds if n <= FEW else 1)]
                facts = {"sampler": sampler, "samples": n, "time_of": time_of}
                yield from self._points(facts, sets, times[time_of], references[sampler])

    def _samples(self, sampler: str, n: int, seed: int) -> Inputs:
        return samples_for(self.estimator, sampler, n, seed), {}

    def _references(self) -> dict[str, References]:
        """For each sampler the references by all others."""
        many = {}
        for sampler in self.grid.reference_samplers:
            self.tick(f"{self.estimator.name}, reference by {sampler}")
            samples = self._samples(sampler, self.grid.references_of(self.estimator.name), 2**32)
            many[sampler] = self._layers(REFERENCE_DTYPE, samples)
        made: dict[str, dict[tuple[tuple[float, ...], float], Reference]] = {}
        for radii, blur in product(self.grid.radii, self.grid.blurs):
            textures = {name: self.scene.of_surface(_finished(layers, radii, blur)) for name, layers in many.items()}
            for sampler in samplers_of(self.estimator, self.grid):
                made.setdefault(sampler, {})[radii, blur] = combine_others(textures, sampler)
        return {**made}

    def _layers(self, dtype: str, inputs: Inputs) -> Layers:
        return {radius: self.scene.occlusion(self.estimator, dtype, radius, inputs) for radius in self.grid.each_radius}

    def _points(
        self, facts: dict[str, Any], sets: Sequence[Inputs], times: Mapping[Setting, Times], references: References
    ) -> Iterator[dict[str, Any]]:
        """Points of some sample sets, by arithmetic, radii and blur; without references no sampling error."""
        for dtype in self.grid.dtypes:
            layers = [self._layers(dtype, inputs) for inputs in sets]
            for radii, blur in product(self.grid.radii, self.grid.blurs):
                textures = [_finished(each, radii, blur) for each in layers]
                taken = times[dtype, radii, blur]
                yield {
                    "estimator": self.estimator.name,
                    **facts,
                    "radii": len(radii),
                    "blur": blur,
                    "dtype": dtype,
                    "ms": taken.median,
                    "ms_25": taken.low,
                    "ms_75": taken.high,
                    "first_ms": taken.first,
                    "model": rms([self.scene.model_error(self.estimator, radii, texture) for texture in textures]),
                    **self._sampling_error(textures, references.get((radii, blur))),
                }

    def _sampling_error(self, textures: Sequence[Texture], reference: Reference | None) -> dict[str, Any]:
        if reference is None:
            return {"sampling": None, "reference_error": None, "reference_serves": None}
        error = rms([rmse(self.scene.of_surface(texture), reference.texture) for texture in textures])
        return {"sampling": error, "reference_error": reference.error, "reference_serves": reference.serves(error)}


def _finished(layers: Layers, radii: tuple[float, ...], blur: float) -> Texture:
    return post.blur(post.merge([layers[radius] for radius in radii]), blur)


def start(mesh: Mesh, grid: Grid, threads: int) -> dict[str, Any]:
    """Return a result that holds only its setup: figures of different setups do not go into one file."""
    machine = describe_machine(threads)
    machine.pop("command")
    scene = describe_scene(mesh)
    setup = {
        "scene": scene["name"],
        "vertices_sha256": scene["vertices_sha256"],
        "faces": scene["faces"],
        "width": grid.width,
        "height": grid.height,
        "grid": json.loads(json.dumps(asdict(grid))),
        "machine": machine,
        "commit": _commit(),
    }
    return {"work_precision": FORMAT, "setup": setup, "estimators": {}}


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


def run(mesh: Mesh, grid: Grid, threads: int, result: dict[str, Any], save: Callable[[], None], tick: Tick) -> None:
    """Measure the rotations and the estimators that a result of ``start`` does not hold yet, and save it after each.

    Threads are those of the ray caster, numba's are the caller's; tick is called with the name of each step.
    """
    if "rotations" not in result:
        result["rotations"] = list(rotation_errors(grid, threads, tick))
        save()
    missing = [name for name in ESTIMATORS if name not in result["estimators"]]
    if not missing:
        return
    tick("textures")
    scene = BenchScene(mesh, grid, threads)
    for name in missing:
        wall, cpu = time.perf_counter(), time.process_time()
        measured = measure_estimator(scene, ESTIMATORS[name], grid, tick)
        seconds = {"wall": time.perf_counter() - wall, "processor": time.process_time() - cpu}
        state = {"seconds": seconds, "load_average": os.getloadavg()[0], "truth_error": scene.truth_error()}
        result["estimators"][name] = {**measured, **state}
        save()
