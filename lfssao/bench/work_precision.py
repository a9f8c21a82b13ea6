"""Error against run time, of every estimator: what a setting costs and what it gets wrong.

Two errors, never mixed. *Sampling*: RMSE against the same estimator with very many samples of other samplers.
*Model*: RMSE against ray-cast occlusion of the same radius. Both are over the texels that see a surface.
"""

import subprocess
from collections.abc import Callable, Iterator
from dataclasses import asdict
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao import passes
from lfssao.bench import plans
from lfssao.bench.advise import FORMAT
from lfssao.bench.face_counts import measure_face_counts
from lfssao.bench.plans import Plan
from lfssao.bench.sampling_error import Reference, combine, rmse
from lfssao.bench.times import in_turn
from lfssao.display_file import find_display
from lfssao.estimators.buffers import Buffers, Texture
from lfssao.estimators.estimator import Estimator, FloatArray
from lfssao.estimators.registry import ESTIMATORS, estimate
from lfssao.figures.truth import half_space
from lfssao.ground_truth import Occluders, ray_cast_occlusion
from lfssao.manifest import describe_machine, describe_scene
from lfssao.raycast import RayCaster
from lfssao.rendering import diagonal, module_views
from lfssao.scene.mesh import Mesh

Tick = Callable[[str], None]

# Shares of the whole ball: a plane hides half of it. The model error is that of the half space's share.
WHOLE_BALL = ("lf", "point", "vo-points", "vo-lines", "vo-area")

# Falloff of ray-cast occlusion that is nearest to the estimator's own; the others' is constant.
_FALLOFFS = dict.fromkeys(("multiresolution", "hbao", "sao", "sao-equation-1", "alchemy"), "quadratic")


class Scene:
    """One view of a mesh, its textures in each arithmetic and its ray-cast occlusion.

    Parameters
    ----------
    mesh : Mesh
        What is seen.
    plan : Plan
        Sizes.
    threads : int
        Threads of the ray caster.
    """

    def __init__(self, mesh: Mesh, plan: Plan, threads: int) -> None:
        self.mesh = mesh
        self.unit = diagonal(mesh)
        view = module_views(mesh, find_display("virtual").with_resolution(plan.width, plan.height))[0]
        gbuffer = RayCaster(mesh, view.cast_from_world, threads).gbuffer(view, normals="geometric")
        single = Buffers.of(gbuffer, view)
        assert single.normals is not None
        textures = (single.depth, single.positions, single.normals)
        self.buffers = {
            name: Buffers(view, *(texture.astype(name) for texture in textures)) for name in ("float32", "float64")
        }
        self.surface: NDArray[np.bool_] = np.isfinite(single.depth)
        self._truth: dict[tuple[float, str], NDArray[np.float64]] = {}

    @cached_property
    def occluders(self) -> Occluders:
        """The mesh for rays."""
        return Occluders(self.mesh)

    def truth(self, share: float, falloff: str) -> NDArray[np.float64]:
        """Ray-cast occlusion, (H, W), of a radius that is a share of the scene's diagonal."""
        if (share, falloff) not in self._truth:
            buffers = self.buffers["float32"]
            made = ray_cast_occlusion(self.occluders, buffers, share * self.unit, falloff=falloff, tolerance=0.01)
            self._truth[share, falloff] = made.texture
        return self._truth[share, falloff]

    def of_surface(self, texture: Texture) -> FloatArray:
        """A texture's numbers where there is a surface, float64."""
        return np.asarray(texture[self.surface], np.float64)


def measure_estimator(scene: Scene, estimator: Estimator, plan: Plan, tick: Tick) -> dict[str, Any]:
    """All points of one estimator, as JSON holds them."""
    points: list[dict[str, Any]] = []
    for shares in plan.radii:
        if plans.takes_samples(estimator):
            points += _sampled(scene, estimator, plan, shares, tick)
        else:
            tick(f"{estimator.name}, {len(shares)} radii")
            points += _fixed(scene, estimator, plan, shares)
    return {"source": estimator.source, "points": points}


def _fixed(scene: Scene, estimator: Estimator, plan: Plan, shares: tuple[float, ...]) -> list[dict[str, Any]]:
    times = _times(scene, estimator, plan, shares, None)
    out = []
    for dtype in plan.dtypes:
        layers = _layers(scene, estimator, dtype, shares, None)
        for blur in plan.blurs:
            texture = _finished(layers, blur)
            model = _model_error(scene, estimator, shares, texture)
            out.append(_point(estimator, None, None, shares, blur, dtype, times, model))
    return out


def _sampled(
    scene: Scene, estimator: Estimator, plan: Plan, shares: tuple[float, ...], tick: Tick
) -> Iterator[dict[str, Any]]:
    many: dict[str, list[Texture]] = {}
    for sampler in plans.REFERENCE_SAMPLERS:
        tick(f"{estimator.name}, {len(shares)} radii, reference by {sampler}")
        samples = plans.samples_for(estimator, sampler, plan.reference_count, 2**32)
        many[sampler] = _layers(scene, estimator, plan.reference_dtype, shares, samples)
    samplers = plans.samplers_of(estimator, plan)
    times = {}
    for n in plan.counts:
        tick(f"{estimator.name}, {len(shares)} radii, time of {n} samples")
        times[n] = _times(scene, estimator, plan, shares, plans.samples_for(estimator, "random", n, 0))
    for sampler in samplers:
        references = {blur: _reference(scene, many, sampler, blur) for blur in plan.blurs}
        for n in plans.counts_of(estimator, sampler, plan):
            tick(f"{estimator.name}, {len(shares)} radii, {n} samples by {sampler}")
            seeds = plan.seeds if n <= plans.FEW else 1
            for dtype in plan.dtypes:
                sets = [
                    _layers(scene, estimator, dtype, shares, plans.samples_for(estimator, sampler, n, seed))
                    for seed in range(seeds)
                ]
                for blur in plan.blurs:
                    finished = [_finished(layers, blur) for layers in sets]
                    reference = references[blur]
                    sampling = _rms([rmse(scene.of_surface(t), reference.texture) for t in finished])
                    model = _rms([_model_error(scene, estimator, shares, t) for t in finished])
                    yield {
                        **_point(estimator, sampler, n, shares, blur, dtype, times[n], model),
                        "sampling": sampling,
                        "reference_error": reference.error,
                        "reference_serves": reference.serves(sampling),
                    }


def _reference(scene: Scene, many: dict[str, list[Texture]], sampler: str, blur: float) -> Reference:
    """What a sampler is compared with: the references by all others."""
    others = [layers for name, layers in many.items() if name != sampler]
    return combine([scene.of_surface(_finished(layers, blur)) for layers in others])


def _layers(
    scene: Scene, estimator: Estimator, dtype: str, shares: tuple[float, ...], samples: Any
) -> list[Texture]:  # fmt: skip
    """Occlusion of each radius."""
    points, weights = (None, None) if samples is None else samples
    buffers = scene.buffers[dtype]
    return [estimate(estimator.name, buffers, share * scene.unit, points, weights).texture for share in shares]


def _finished(layers: list[Texture], blur: float) -> Texture:
    return passes.blur(passes.merge(layers), blur)


def _times(scene: Scene, estimator: Estimator, plan: Plan, shares: tuple[float, ...], samples: Any) -> dict[str, Any]:
    """Times of both arithmetics and blurs in turn, by 'dtype blur'."""

    def run(dtype: str, blur: float) -> Callable[[], object]:
        return lambda: _finished(_layers(scene, estimator, dtype, shares, samples), blur)

    variants = {f"{dtype} {blur}": run(dtype, blur) for dtype in plan.dtypes for blur in plan.blurs}
    return {name: asdict(times) for name, times in in_turn(variants, plan.repeats).items()}


def _model_error(scene: Scene, estimator: Estimator, shares: tuple[float, ...], texture: Texture) -> float:
    falloff = _FALLOFFS.get(estimator.name, "constant")
    truth = np.maximum.reduce([scene.truth(share, falloff) for share in shares])  # merged as the layers are
    ours = half_space(texture) if estimator.name in WHOLE_BALL else texture
    return rmse(scene.of_surface(ours), scene.of_surface(truth))


def _rms(errors: list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(errors))))


def _point(
    estimator: Estimator, sampler: str | None, n: int | None, shares: tuple[float, ...], blur: float, dtype: str,
    times: dict[str, Any], model: float,
) -> dict[str, Any]:  # fmt: skip
    measured = times[f"{dtype} {blur}"]
    return {
        "estimator": estimator.name, "sampler": sampler, "samples": n, "radii": len(shares), "blur": blur,
        "dtype": dtype, "ms": measured["median"], "ms_25": measured["low"], "ms_75": measured["high"],
        "first_ms": measured["first"], "model": model, "sampling": None, "reference_error": None,
        "reference_serves": None,
    }  # fmt: skip


def setup(mesh: Mesh, plan: Plan, threads: int) -> dict[str, Any]:
    """What a run is of: figures of different ones do not go into one file."""
    machine = describe_machine(threads)
    machine.pop("command")
    scene = describe_scene(mesh)
    return {
        "scene": scene["name"], "vertices_sha256": scene["vertices_sha256"], "faces": scene["faces"],
        "width": plan.width, "height": plan.height, "plan": _plain(asdict(plan)),
        "time_sampler": "random", "machine": machine, "commit": _commit(),
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
        scene = Scene(mesh, plan, threads)
        for name in missing:
            result["estimators"][name] = measure_estimator(scene, ESTIMATORS[name], plan, tick)
            save()
    if plan.frames and result["face_counts"] is None:
        result["face_counts"] = measure_face_counts(plan.frames, threads, tick)
        save()


def start(mesh: Mesh, plan: Plan, threads: int) -> dict[str, Any]:
    """A result that holds nothing yet."""
    return {
        "work_precision": FORMAT, "setup": setup(mesh, plan, threads), "estimators": {}, "face_counts": None,
    }  # fmt: skip


def steps(plan: Plan, done: dict[str, Any]) -> int:
    """How often ``run`` will tick, for a progress bar."""
    total = 1
    for name in (name for name in ESTIMATORS if name not in done["estimators"]):
        estimator = ESTIMATORS[name]
        one = 1
        if plans.takes_samples(estimator):
            sets = sum(len(list(plans.counts_of(estimator, s, plan))) for s in plans.samplers_of(estimator, plan))
            one = len(plans.REFERENCE_SAMPLERS) + len(plan.counts) + sets
        total += one * len(plan.radii)
    return total + (3 if plan.frames and done["face_counts"] is None else 0)
