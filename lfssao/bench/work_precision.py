"""Error against run time, of every estimator: what a setting costs and what it gets wrong.

Two errors, never mixed. *Sampling*: RMSE against the same estimator with very many samples of other samplers.
*Model*: RMSE against ray-cast occlusion of the same radius. Both are over the texels that see a surface.
"""

import os
import subprocess
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from lfssao import passes
from lfssao.bench import settings_grid as grid
from lfssao.bench.advise import FORMAT
from lfssao.bench.bench_scene import BenchScene, Samples
from lfssao.bench.sampling_error import Reference, combine, rmse
from lfssao.bench.setting_times import setting_times
from lfssao.bench.settings_grid import Plan
from lfssao.bench.times import Times
from lfssao.estimators.buffers import Texture
from lfssao.estimators.estimator import Estimator, Value
from lfssao.estimators.registry import ESTIMATORS
from lfssao.manifest import describe_machine, describe_scene
from lfssao.scene.mesh import Mesh

Tick = Callable[[str], None]

# One texture for each radius.
Layers = dict[float, Texture]


def measure_estimator(scene: BenchScene, estimator: Estimator, plan: Plan, tick: Tick) -> dict[str, Any]:
    """All points of one estimator, as JSON holds them."""
    measure = _sampled if grid.takes_samples(estimator) else _fixed
    return {"source": estimator.source, "points": list(measure(scene, estimator, plan, tick))}


def _fixed(scene: BenchScene, estimator: Estimator, plan: Plan, tick: Tick) -> Iterator[dict[str, Any]]:
    """Points of an estimator that makes its own samples, or none: no sampling error."""
    tick(estimator.name)
    none: Samples = (None, None)
    counts = grid.own_counts_of(estimator, plan)
    times = setting_times(scene, estimator, plan, {str(n): (none, parameters) for n, parameters in counts})
    for n, parameters in counts:
        for dtype in plan.dtypes:
            layers = _layers(scene, estimator, plan, dtype, none, parameters)
            for radii in plan.radii:
                for blur in plan.blurs:
                    model = scene.model_error(estimator, radii, _finished(layers, radii, blur))
                    measured = times[dtype, str(n), radii, blur]
                    yield _point(estimator, None, n, radii, blur, dtype, measured, None, model)


def _sampled(scene: BenchScene, estimator: Estimator, plan: Plan, tick: Tick) -> Iterator[dict[str, Any]]:
    """Points of an estimator by sampler and number of samples."""
    many = {}
    for sampler in plan.reference_samplers:
        tick(f"{estimator.name}, reference by {sampler}")
        samples = grid.samples_for(estimator, sampler, plan.references_of(estimator.name), 2**32)
        many[sampler] = _layers(scene, estimator, plan, plan.reference_dtype, samples, {})
    references = _references(scene, many, plan, grid.samplers_of(estimator, plan))
    for n in plan.counts:
        tick(f"{estimator.name}, time of {n} samples")
        own = [s for s in grid.samplers_of(estimator, plan) if n in grid.counts_of(estimator, s, plan)]
        timed = own if n <= plan.timed else [grid.TIMED_FOR_ALL]
        times = setting_times(scene, estimator, plan, {s: (grid.samples_for(estimator, s, n, 0), {}) for s in timed})
        for sampler in own:
            tick(f"{estimator.name}, {n} samples by {sampler}")
            time_of = sampler if n <= plan.timed else grid.TIMED_FOR_ALL
            seeds = range(plan.seeds if n <= grid.FEW else 1)
            for dtype in plan.dtypes:
                sets = [
                    _layers(scene, estimator, plan, dtype, grid.samples_for(estimator, sampler, n, seed), {})
                    for seed in seeds
                ]
                for radii in plan.radii:
                    for blur in plan.blurs:
                        finished = [_finished(layers, radii, blur) for layers in sets]
                        reference = references[sampler, radii, blur]
                        sampling = _rms([rmse(scene.of_surface(t), reference.texture) for t in finished])
                        model = _rms([scene.model_error(estimator, radii, t) for t in finished])
                        measured = times[dtype, time_of, radii, blur]
                        yield {
                            **_point(estimator, sampler, n, radii, blur, dtype, measured, time_of, model),
                            "sampling": sampling,
                            "reference_error": reference.error,
                            "reference_serves": reference.serves(sampling),
                        }


def _references(
    scene: BenchScene, many: dict[str, Layers], plan: Plan, samplers: tuple[str, ...]
) -> dict[tuple[str, tuple[float, ...], float], Reference]:
    """What each sampler, radii and blur are compared with: the references by all other samplers."""
    out = {}
    for radii in plan.radii:
        for blur in plan.blurs:
            finished = {name: scene.of_surface(_finished(layers, radii, blur)) for name, layers in many.items()}
            whole = combine(list(finished.values()))
            for sampler in samplers:
                others = [texture for name, texture in finished.items() if name != sampler]
                out[sampler, radii, blur] = combine(others) if sampler in finished else whole
    return out


def _layers(
    scene: BenchScene, estimator: Estimator, plan: Plan, dtype: str, samples: Samples, parameters: dict[str, Value]
) -> Layers:
    return {share: scene.occlusion(estimator, dtype, share, samples, parameters) for share in plan.shares}


def _finished(layers: Layers, radii: tuple[float, ...], blur: float) -> Texture:
    return passes.blur(passes.merge([layers[share] for share in radii]), blur)


def _rms(errors: list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(errors))))


def _point(
    estimator: Estimator, sampler: str | None, n: int | None, radii: tuple[float, ...], blur: float, dtype: str,
    times: Times, time_of: str | None, model: float,
) -> dict[str, Any]:  # fmt: skip
    return {
        "estimator": estimator.name, "sampler": sampler, "samples": n, "radii": len(radii), "blur": blur,
        "dtype": dtype, "ms": times.median, "ms_25": times.low, "ms_75": times.high, "first_ms": times.first,
        "time_of": time_of, "model": model, "sampling": None, "reference_error": None, "reference_serves": None,
    }  # fmt: skip


def setup(mesh: Mesh, plan: Plan, threads: int) -> dict[str, Any]:
    """What a run is of: figures of different ones do not go into one file."""
    machine = describe_machine(threads)
    machine.pop("command")
    scene = describe_scene(mesh)
    return {
        "scene": scene["name"], "vertices_sha256": scene["vertices_sha256"], "faces": scene["faces"],
        "width": plan.width, "height": plan.height, "plan": _plain(asdict(plan)),
        "machine": machine, "commit": _commit(),
    }  # fmt: skip


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(entry) for key, entry in value.items()}
    return [_plain(entry) for entry in value] if isinstance(value, list | tuple) else value


def _commit() -> str | None:
    """The commit of the source, where it is a checkout."""
    top = Path(__file__).parents[2]
    if not (top / ".git").exists():
        return None
    try:
        done = subprocess.run(
            ["git", "-C", str(top), "rev-parse", "HEAD"], capture_output=True, text=True, check=False
        )  # fmt: skip
    except OSError:
        return None
    return done.stdout.strip() or None


def run(
    mesh: Mesh, plan: Plan, threads: int, result: dict[str, Any], save: Callable[[], None], tick: Tick
) -> None:  # fmt: skip
    """Measure what a result does not hold yet, and save it after each estimator.

    Parameters
    ----------
    mesh : Mesh
        The scene.
    plan : Plan
        Sizes.
    threads : int
        Threads of the ray caster; numba's are the caller's.
    result : dict
        Of ``start``; grows.
    save : callable
        Writes it.
    tick : callable
        Called before each step with what it is.
    """
    missing = [name for name in ESTIMATORS if name not in result["estimators"]]
    if missing:
        tick("textures")
        scene = BenchScene(mesh, plan, threads)
        for name in missing:
            points = partial(measure_estimator, scene, ESTIMATORS[name], plan, tick)
            result["estimators"][name] = {**_watched(points), "truth_error": scene.truth_error()}
            save()


def _watched(measure: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """A part of the result, with how long it took and how busy the machine was."""
    wall, cpu = time.perf_counter(), time.process_time()
    measured = measure()
    seconds = {"wall": time.perf_counter() - wall, "processor": time.process_time() - cpu}
    return {**measured, "seconds": seconds, "load_average": os.getloadavg()[0]}


def start(mesh: Mesh, plan: Plan, threads: int) -> dict[str, Any]:
    """A result that holds nothing yet."""
    return {"work_precision": FORMAT, "setup": setup(mesh, plan, threads), "estimators": {}}


def steps(plan: Plan, done: dict[str, Any]) -> int:
    """How often ``run`` will tick, for a progress bar."""
    total = 1
    for name in (name for name in ESTIMATORS if name not in done["estimators"]):
        estimator = ESTIMATORS[name]
        if not grid.takes_samples(estimator):
            total += 1
            continue
        sets = sum(len(list(grid.counts_of(estimator, s, plan))) for s in grid.samplers_of(estimator, plan))
        total += len(plan.reference_samplers) + len(plan.counts) + sets
    return total
