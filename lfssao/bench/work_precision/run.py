"""Error against run time, of every estimator: what a setting costs and what it gets wrong.

Two errors, never mixed. *Sampling*: RMSE against the same estimator with very many samples of other samplers.
*Model*: RMSE against ray-cast occlusion of the same radius. Both are over the texels that see a surface.
"""

import json
import os
import subprocess
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from lfssao.ao import passes
from lfssao.ao.estimators.estimator import Estimator, FloatArray, Value
from lfssao.ao.estimators.registry import ESTIMATORS
from lfssao.ao.textures import Texture
from lfssao.bench.times import Times
from lfssao.bench.work_precision.advise import FORMAT
from lfssao.bench.work_precision.references import Reference, combine, rmse
from lfssao.bench.work_precision.scene import BenchScene, Samples
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
    """All points of one estimator, as JSON holds them."""
    measure = _sampled if takes_samples(estimator) else _fixed
    return {"source": estimator.source, "points": list(measure(scene, estimator, grid, tick))}


def _fixed(scene: BenchScene, estimator: Estimator, grid: Grid, tick: Tick) -> Iterator[dict[str, Any]]:
    """Points of an estimator that makes its own samples, or none: no sampling error."""
    tick(estimator.name)
    none: Samples = (None, None)
    counts = own_counts_of(estimator, grid)
    times = setting_times(scene, estimator, grid, {str(n): (none, parameters) for n, parameters in counts})
    for n, parameters in counts:
        about = {"sampler": None, "samples": n, "time_of": None}
        yield from _points(scene, estimator, grid, about, [none], parameters, times, str(n), {})


def _sampled(scene: BenchScene, estimator: Estimator, grid: Grid, tick: Tick) -> Iterator[dict[str, Any]]:
    """Points of an estimator by sampler and number of samples."""
    many = {}
    for sampler in grid.reference_samplers:
        tick(f"{estimator.name}, reference by {sampler}")
        samples = samples_for(estimator, sampler, grid.references_of(estimator.name), 2**32)
        many[sampler] = _layers(scene, estimator, grid, REFERENCE_DTYPE, samples, {})
    references = {sampler: _references(scene, many, grid, sampler) for sampler in samplers_of(estimator, grid)}
    for n in grid.counts:
        tick(f"{estimator.name}, time of {n} samples")
        own = [sampler for sampler in references if n in counts_of(estimator, sampler, grid)]
        timed = own if n <= TIMED else [TIMED_FOR_ALL]
        times = setting_times(scene, estimator, grid, {s: (samples_for(estimator, s, n, 0), {}) for s in timed})
        for sampler in own:
            tick(f"{estimator.name}, {n} samples by {sampler}")
            time_of = sampler if n <= TIMED else TIMED_FOR_ALL
            sets = [samples_for(estimator, sampler, n, seed) for seed in range(grid.seeds if n <= FEW else 1)]
            about = {"sampler": sampler, "samples": n, "time_of": time_of}
            yield from _points(scene, estimator, grid, about, sets, {}, times, time_of, references[sampler])


def _points(
    scene: BenchScene, estimator: Estimator, grid: Grid, about: dict[str, Any], sets: Sequence[Samples],
    parameters: dict[str, Value], times: Mapping[Setting, Times], timed: str, references: References,
) -> Iterator[dict[str, Any]]:  # fmt: skip
    """Points of some sample sets, by arithmetic, radii and blur; without references no sampling error."""
    for dtype in grid.dtypes:
        layers = [_layers(scene, estimator, grid, dtype, samples, parameters) for samples in sets]
        for radii, blur in product(grid.radii, grid.blurs):
            finished = [_finished(each, radii, blur) for each in layers]
            taken = times[dtype, timed, radii, blur]
            yield {
                "estimator": estimator.name, **about, "radii": len(radii), "blur": blur, "dtype": dtype,
                "ms": taken.median, "ms_25": taken.low, "ms_75": taken.high, "first_ms": taken.first,
                "model": _rms([scene.model_error(estimator, radii, texture) for texture in finished]),
                **_sampling_error([scene.of_surface(texture) for texture in finished], references.get((radii, blur))),
            }  # fmt: skip


def _sampling_error(textures: list[FloatArray], reference: Reference | None) -> dict[str, Any]:
    if reference is None:
        return {"sampling": None, "reference_error": None, "reference_serves": None}
    error = _rms([rmse(texture, reference.texture) for texture in textures])
    return {"sampling": error, "reference_error": reference.error, "reference_serves": reference.serves(error)}


def _references(scene: BenchScene, many: dict[str, Layers], grid: Grid, sampler: str) -> References:
    """The references of a sampler: those by all other samplers."""
    others = [layers for name, layers in many.items() if name != sampler]
    return {
        (radii, blur): combine([scene.of_surface(_finished(layers, radii, blur)) for layers in others])
        for radii, blur in product(grid.radii, grid.blurs)
    }


def _layers(
    scene: BenchScene, estimator: Estimator, grid: Grid, dtype: str, samples: Samples, parameters: dict[str, Value]
) -> Layers:
    return {share: scene.occlusion(estimator, dtype, share, samples, parameters) for share in grid.shares}


def _finished(layers: Layers, radii: tuple[float, ...], blur: float) -> Texture:
    return passes.blur(passes.merge([layers[share] for share in radii]), blur)


def _rms(errors: list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(errors))))


def start(mesh: Mesh, grid: Grid, threads: int) -> dict[str, Any]:
    """A result that holds nothing yet but its setup: figures of different setups do not go into one file."""
    machine = describe_machine(threads)
    machine.pop("command")
    scene = describe_scene(mesh)
    setup = {
        "scene": scene["name"], "vertices_sha256": scene["vertices_sha256"], "faces": scene["faces"],
        "width": grid.width, "height": grid.height, "grid": json.loads(json.dumps(asdict(grid))),
        "machine": machine, "commit": _commit(),
    }  # fmt: skip
    return {"work_precision": FORMAT, "setup": setup, "estimators": {}}


def _commit() -> str | None:
    """The commit of the source, where it is a checkout."""
    top = Path(__file__).parents[3]
    command = ["git", "-C", str(top), "rev-parse", "HEAD"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False) if (top / ".git").exists() else None
    except OSError:
        return None
    return (done.stdout.strip() or None) if done else None


def run(
    mesh: Mesh, grid: Grid, threads: int, result: dict[str, Any], save: Callable[[], None], tick: Tick
) -> None:  # fmt: skip
    """Measure what a result does not hold yet, and save it after each estimator.

    Parameters
    ----------
    mesh : Mesh
        The scene.
    grid : Grid
        Sizes.
    threads : int
        Threads of the ray caster; numba's are the caller's.
    result : dict
        As ``start`` makes it; grows.
    save : callable
        Writes it.
    tick : callable
        Called before each step with what it is.
    """
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


def steps(grid: Grid, done: dict[str, Any]) -> int:
    """How often ``run`` will tick, for a progress bar."""
    total = 1
    for name in (name for name in ESTIMATORS if name not in done["estimators"]):
        estimator, sets = ESTIMATORS[name], 1
        if takes_samples(estimator):
            samplers = samplers_of(estimator, grid)
            sets = sum(len(list(counts_of(estimator, sampler, grid))) for sampler in samplers)
            sets += len(grid.reference_samplers) + len(grid.counts)
        total += sets
    return total
