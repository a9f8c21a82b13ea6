"""The LF paper's section 6, measured and judged: which samples, how many, and what they cost."""

from functools import partial
from typing import Any

import numpy as np
from cpu_times import least
from papers_common import Claim, Found, Judged, Scale, moved
from papers_lf import model

import lfssao
from lfssao.bench.work_precision.figures import rms
from lfssao.rendering.passes import finish_view
from lfssao.samples import sample_set
from lfssao.viz.samplers import SamplingError, draw_sampling_error

SAMPLERS = ("random", "jittered", "latin", "poisson")
COUNTS = (4, 8, 16, 32, 64)


def whole_set(method: str, n: int, seed: int) -> Any:
    return sample_set("ball", method, n, seed).points


def shuffled_set(method: str, n: int, seed: int) -> Any:
    """Samples of a method, each a random one of a set of its own: placed as the method's, but not to each other."""
    drawn = np.random.default_rng(seed).integers(n, size=n)
    return np.stack([whole_set(method, n, n * seed + k)[each] for k, each in enumerate(drawn)])


def placement(scale: Scale, make_set: Any = whole_set) -> Found:
    """Generation of samples."""
    mesh = lfssao.builtin_scene("ammonite")
    view = lfssao.module_views(mesh, lfssao.find_display("sample-a").with_resolution(*scale.size(200, 120)), [10])[0]
    buffers = lfssao.Buffers.of(lfssao.RayCaster(mesh, view.cast_from_world).gbuffer(view), view)
    radius, seen = lfssao.default_radii(mesh)[3], np.isfinite(buffers.depth)

    def occlusion(points: Any) -> Any:
        return lfssao.estimate("lf", buffers, radius, points).texture[seen].astype(float)

    limit = occlusion(whole_set("sobol", 1024, 0))
    errors = {
        name: np.array([rms([occlusion(make_set(name, n, s)) - limit for s in range(16)]) for n in COUNTS])
        for name in SAMPLERS
    }
    scale.save("lf-section-6-placement", draw_sampling_error(SamplingError(np.array(COUNTS), errors, "1024 of sobol")))
    return {"rows": {name: dict(zip(map(str, COUNTS), each, strict=True)) for name, each in errors.items()}}


def judge_placement(found: Found, limit: float) -> Judged:
    random, *placed = (row["8"] for row in found["rows"].values())
    told = {"random": random, "low": min(placed), "high": max(placed)}
    return max(placed) <= limit * random, min(placed) <= limit * random, told


def few_samples(scale: Scale, place: Any = lambda ao, _: ao) -> Found:
    """Additional blur pass: the error that few samples leave, before and after it; place: where the ao is put."""
    m = model(lfssao.builtin_scene("ammonite"), scale.size(1024, 768))
    radii, seen = m.settings.radii, m.gbuffer.triangle >= 0
    many = lfssao.Settings(radii, lfssao.make_samples("sobol", 1024), rotation="none", layers=("merged",))
    limit = finish_view(m.gbuffer, m.view, many).merged[seen].astype(float)
    rows = {}
    for name, n in [*(("latin", n) for n in (2, 4, 8, 16, 32)), *((name, 8) for name in SAMPLERS if name != "latin")]:
        made = finish_view(m.gbuffer, m.view, lfssao.Settings(radii, lfssao.make_samples(name, n)))
        textures = {"before": made.merged, "after": made.blurred}
        rows[f"{n} samples, {name}"] = {key: rms(place(t, seen)[seen] - limit) for key, t in textures.items()}
    for name, value in (("the best constant", limit.mean()), ("no ao", 0.0)):
        rows[name] = dict.fromkeys(("before", "after"), rms(limit - value))
    return {"rows": rows}


def judge_few_samples(found: Found, limit: float) -> Judged:
    placed = [found["rows"][f"8 samples, {name}"] for name in SAMPLERS[1:]]
    best, none = (found["rows"][name]["before"] for name in ("the best constant", "no ao"))
    before, after = (max(row[key] for row in placed) for key in ("before", "after"))
    told = {"before": before, "after": after, "constant": best, "none": none}
    return before < min(best, none) and after <= limit * min(best, none), after < min(best, none), told


def cost(scale: Scale) -> Found:
    """Time by the number of samples."""
    mesh = lfssao.builtin_scene("ammonite")
    m = model(mesh, scale.size(1024, 768))
    arrays = m.gbuffer.depth, m.gbuffer.positions, m.view.world_to_image
    sets, radius = {str(n): lfssao.make_samples("latin", n) for n in COUNTS}, lfssao.default_radii(mesh)[3]
    times = least({n: partial(lfssao.algorithm2, *arrays, s, radius) for n, s in sets.items()}, scale.repeats(20))
    return {"rows": {"ms": {n: row["ms"] for n, row in times.items()}}}


def judge_cost(found: Found, limit: float) -> Judged:
    ms = found["rows"]["ms"]
    n, t = np.array([int(each) for each in ms]), np.array(list(ms.values()))
    bend = float(np.abs(np.polyval(np.polyfit(n, t, 1, w=1 / t), n) / t - 1).max())
    return bend <= limit, False, {"bend": bend}


def quadratic_times(_: Scale, found: Found) -> Found:
    """Times that grow as the square of the number of samples, from the same time of eight."""
    ms = found["rows"]["ms"]
    return {"rows": {"ms": {n: ms["8"] * (int(n) / 8) ** 2 for n in ms}}}


CLAIMS = {
    "LF section 6, placement": Claim(placement, judge_placement, lambda scale, _: placement(scale, shuffled_set)),
    "LF section 6, 8 samples": Claim(few_samples, judge_few_samples, lambda scale, _: few_samples(scale, moved)),
    "LF section 6, cost": Claim(cost, judge_cost, quadratic_times),
}
