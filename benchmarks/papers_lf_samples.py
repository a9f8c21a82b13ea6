"""The LF paper's section 6, measured and judged: which samples, how many, and what they cost."""

from functools import partial
from typing import Any

import numpy as np
from cpu_times import least
from papers_common import Claim, Found, Judged, Scale, changed, correlation, moved
from papers_lf import EYES, model

import lfssao
from lfssao.bench.work_precision.figures import rms
from lfssao.rendering.passes import finish_view
from lfssao.samples import sample_set
from lfssao.viz.samplers import SamplingError, draw_sampling_error

SPHERE_SETS = ("rejection", "random", "jittered", "latin", "poisson")
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
    radius = lfssao.default_radii(mesh)[3]
    seen = np.isfinite(buffers.depth)

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
    radii = m.settings.radii
    seen = m.gbuffer.triangle >= 0
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
    sets = {str(n): lfssao.make_samples("latin", n) for n in COUNTS}
    radius = lfssao.default_radii(mesh)[3]
    times = least({n: partial(lfssao.algorithm2, *arrays, s, radius) for n, s in sets.items()}, scale.repeats(20))
    return {"rows": {"ms": {n: row["ms"] for n, row in times.items()}}}


def judge_cost(found: Found, limit: float) -> Judged:
    ms = found["rows"]["ms"]
    n = np.array([int(each) for each in ms])
    t = np.array(list(ms.values()))
    bend = float(np.abs(np.polyval(np.polyfit(n, t, 1, w=1 / t), n) / t - 1).max())
    return bend <= limit, False, {"bend": bend}


def quadratic_times(_: Scale, found: Found) -> Found:
    """Times that grow as the square of the number of samples, from the same time of eight."""
    ms = found["rows"]["ms"]
    return {"rows": {"ms": {n: ms["8"] * (int(n) / 8) ** 2 for n in ms}}}


def empty_parts(method: str, n: int) -> float:
    """Share of the sphere's octants without a sample of a set, over 2,000 sets, turned at random."""
    rng = np.random.default_rng(0)
    empty = []
    for seed in range(2000):
        axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        signs = sample_set("sphere", method, n, seed).points @ axes > 0
        empty.append(1 - len(np.unique(signs, axis=0)) / 8)
    return float(np.mean(empty))


def rejection(scale: Scale) -> Found:
    """Generation of samples: parts of the sphere that a small set leaves empty."""
    return {"rows": {name: {str(n): empty_parts(name, n) for n in (8, 16, 32)} for name in SPHERE_SETS}}


def judge_rejection(found: Found, limit: float) -> Judged:
    rejected, random, *placed = (row["8"] for row in found["rows"].values())
    told = {"rejected": rejected, "random": random, "low": min(placed), "high": max(placed)}
    return max(placed) <= limit * rejected, min(placed) <= limit * rejected, told


def unplaced(_: Scale, found: Found) -> Found:
    """Independent points under the names of placed ones."""
    return changed(found, {name: found["rows"]["random"] for name in SAMPLERS[1:]})


SHELLS = (0.0, 0.2, 0.4, 0.6, 0.8, 0.9)


def inner_radius(scale: Scale, place: Any = lambda ao, _: ao) -> Found:
    """Algorithm 4's r_min, against rays of the same radius; place: where the ao of 0.8 is put."""
    mesh = lfssao.builtin_scene("statue")
    view = lfssao.module_views(mesh, lfssao.find_display("sample-a").with_resolution(*scale.size(500, 300)), [10])[0]
    gbuffer = lfssao.RayCaster(mesh, view.cast_from_world, 2).gbuffer(view, normals="geometric")
    buffers = lfssao.Buffers.of(gbuffer, view)
    seen = gbuffer.triangle >= 0
    radius = lfssao.default_radii(mesh)[3]
    rays = lfssao.ray_cast_occlusion(lfssao.Occluders(mesh), buffers, radius, "uniform", tolerance=0.03, rounds=(2, 8))
    rows: dict[str, Any] = {}
    for inner in SHELLS:
        row = rows[f"{inner:g} R"] = {}
        for n in (8, 64):
            sets = [lfssao.make_samples("latin", n, seed, inner) for seed in range(4)]
            made = [lfssao.estimate("lf", buffers.turned("hash", k), radius, s).texture for k, s in enumerate(sets)]
            textures = [place(each, seen) if inner == 0.8 else each for each in made]
            row[str(n)] = float(np.mean([correlation(each[seen], rays.texture[seen]) for each in textures]))
    return {"rows": rows}


def judge_inner_radius(found: Found, limit: float) -> Judged:
    rows = found["rows"]
    best = {n: max(rows, key=lambda name, n=n: rows[name][n]) for n in ("8", "64")}
    few, many = (rows["0.8 R"][n] / rows[best[n]][n] for n in best)
    told = {"few": few, "many": many, "best_few": best["8"], "best_many": best["64"]}
    return min(few, many) >= limit, max(few, many) >= limit, told


def seen_light(scale: Scale, settings: Any, display: Any) -> Any:
    """The shaded picture of the middle eye before the display, (h, w, 3) in light."""
    mesh = lfssao.builtin_scene("statue")
    field = lfssao.LightField(display, range(len(display.modules)), 3)
    for k, made in enumerate(lfssao.render(mesh, display, settings, threads=2)):
        field.put(k, made.shaded)
    return np.clip(field.photograph(EYES[-1], scale.size(500)[0]).image, 0, 1)


def flip(reference: Any, test: Any) -> float:
    """Mean FLIP of two pictures in linear light, on pictures of low dynamic range at 67 pixels a degree."""
    import OpenImageIO as oiio

    first, second = (oiio.ImageBuf(np.ascontiguousarray(each, np.float32)) for each in (reference, test))
    return float(oiio.ImageBufAlgo.FLIP_diff(first, second, hdr=0, ppd=67.0).get_pixels().mean())


def perceived(scale: Scale) -> Found:
    """FLIP at the eye, of samplers and counts."""
    radii = lfssao.default_radii(lfssao.builtin_scene("statue"))
    display = lfssao.find_display("sample-a").with_resolution(*scale.size(500, 300))
    many = lfssao.Settings(radii, lfssao.make_samples("sobol", 256), layers=("shaded",))
    limit = seen_light(scale, many, display)
    rows = {}
    for name, n in [*((name, 8) for name in SAMPLERS), ("latin", 2), ("latin", 4), ("latin", 16)]:
        light = seen_light(scale, lfssao.Settings(radii, lfssao.make_samples(name, n), layers=("shaded",)), display)
        rows[f"{n} samples, {name}"] = {"flip": flip(limit, light), "rmse": rms(light - limit)}
    return {"rows": rows}


def judge_perceived(found: Found, limit: float) -> Judged:
    placed = [found["rows"][f"8 samples, {name}"]["flip"] for name in SAMPLERS[1:]]
    ratio = max(placed) / min(placed)
    told = {"low": min(placed), "high": max(placed), "ratio": ratio, "four": found["rows"]["4 samples, latin"]["flip"]}
    return ratio <= limit, False, told


def half_as_many(_: Scale, found: Found) -> Found:
    """Four samples under the name of eight."""
    return changed(found, {"8 samples, latin": found["rows"]["4 samples, latin"]})


CLAIMS = {
    "LF section 6, placement": Claim(placement, judge_placement, lambda scale, _: placement(scale, shuffled_set)),
    "LF section 6, 8 samples": Claim(few_samples, judge_few_samples, lambda scale, _: few_samples(scale, moved)),
    "LF section 6, rejection": Claim(rejection, judge_rejection, unplaced),
    "LF section 6, 0.8 R": Claim(inner_radius, judge_inner_radius, lambda scale, _: inner_radius(scale, moved)),
    "LF section 6, perceived quality": Claim(perceived, judge_perceived, half_as_many),
    "LF section 6, cost": Claim(cost, judge_cost, quadratic_times),
}
