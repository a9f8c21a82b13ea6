"""The SAO paper's tables and figures, measured and judged, before an ordinary camera, float32."""

from functools import cache, partial
from itertools import pairwise
from typing import Any

import numpy as np
from cpu_times import least
from kernel_baselines import BASELINES
from papers_common import PAPERS, Found, Judged, Scale, camera_buffers, curves, moved_buffers, tiles
from settings import relief
from stages import Arrays, ours, recorded

import lfssao
from lfssao.ao.estimators.sao import estimator as scalable
from lfssao.ao.estimators.sao.kernels.passes import bilateral
from lfssao.ao.estimators.sao.kernels.reconstruct import linear_depth
from lfssao.ao.estimators.sao.texel_rays import linear_z, plane_constants, texel_rays
from lfssao.ao.reference import gaussian_weights
from lfssao.bench.work_precision.figures import rms
from lfssao.samples import texel_angles

RAW = {"quad_edge": 0.0, "gauss": 0.0}  # without average and blur
WIDE, USUAL = 0.2, 0.04  # radii, shares of the scene's diagonal; the paper's 1 m in a hall of about 30 m is the latter


def sao(buffers: Any, radius: float, **parameters: Any) -> Any:
    return lfssao.estimate("sao", buffers.turned("sao-hash"), radius, **parameters).texture


def filters(scale: Scale) -> Found:
    """Table 1."""
    buffers, unit, _ = camera_buffers(*scale.size(1024, 768))
    seen = np.isfinite(buffers.depth)
    ao = {how: sao(buffers, WIDE * unit, mip=how, **RAW) for how in scalable.FILTERS}
    errors = {how: (ao[how].astype(float) - ao["none"])[seen] for how in ao if how != "none"}
    pictures = {"no hierarchy": 1 - ao["none"]}
    pictures |= {f"{how}, difference x 4": 1 - np.minimum(4 * np.abs(ao[how] - ao["none"]), 1) for how in errors}
    scale.save("sao-table-1", tiles(pictures, 3))
    return {"rows": {how: {"rmse": rms(e), "bias": float(e.mean())} for how, e in errors.items()}}


def judge_filters(found: Found) -> Judged:
    rows = found["rows"]
    rotated, *others = (row["rmse"] for row in rows.values())
    least_bias = min(rows, key=lambda how: abs(rows[how]["bias"]))
    told = {"rotated": rotated, "low": min(others), "high": max(others)}
    return rotated < min(others), least_bias == "rotated", told


def wide_bilateral(visibility: Any, keys: Any) -> Any:
    """Two passes of 13 neighbouring taps, AlchemyAO's by SAO's figure 2."""
    weights = gaussian_weights(6.0, 6).astype(visibility.dtype)
    for step in ((1, 0), (0, 1)):
        target = np.empty_like(visibility)
        bilateral(visibility, keys, weights, step, visibility.dtype.type(2048), target)
        visibility = target
    return visibility


def stages(buffers: Any, radius: float) -> dict[str, Any]:
    """Calls of the passes of AlchemyAO and SAO; SAO's sampling makes normals, positions and levels too."""
    buffers = buffers.turned("sao-hash")
    z = linear_z(buffers)
    origin, options = texel_rays(buffers.view, z.dtype).origin, scalable.AppendixOptions()
    keys, visibility = scalable.keys_of(z, origin, 0.0), scalable.sample(buffers, z, radius, options)[0]
    return {
        "Alchemy, sampling": partial(lfssao.estimate, "alchemy", buffers, radius),
        "Alchemy, bilateral": partial(wide_bilateral, visibility, keys),
        "SAO, level 0": partial(linear_z, buffers),
        "SAO, levels": partial(scalable.z_hierarchy, z, "rotated", 5, origin),
        "SAO, sampling": partial(scalable.sample, buffers, z, radius, options),
        "SAO, bilateral": partial(scalable.reconstruct, visibility, keys, 3.0, 2048.0, True),
    }


def pass_times(scale: Scale) -> Found:
    """Table 2."""
    buffers, unit, _ = camera_buffers(*scale.size(1920, 1080, 190))
    times = least(stages(buffers, USUAL * unit), scale.repeats(12))
    times["SAO, sampling"]["ms"] -= times["SAO, levels"]["ms"]  # it makes them
    for whole in ("Alchemy", "SAO"):
        total = sum(row["ms"] for name, row in times.items() if name.startswith(whole))
        times[f"{whole}, total"] = {"ms": total}
    return {"rows": {name: times[name] for name in PAPERS["SAO table 2"]["theirs"]}}


def judge_pass_times(found: Found, theirs: dict[str, float]) -> Judged:
    gain = found["rows"]["Alchemy, total"]["ms"] / found["rows"]["SAO, total"]["ms"]
    return gain >= theirs["Alchemy, total"] / theirs["SAO, total"] / 2, gain > 1, {"gain": gain}


def resolutions(scale: Scale) -> Found:
    """Table 3."""
    rows = {}
    for width, height, guard in ((1280, 720, 128), (1920, 1080, 192), (1920, 1200, 192), (2560, 1600, 256)):
        size = scale.size(width, height, guard)
        buffers, unit, _ = camera_buffers.__wrapped__(*size)  # too large to be kept
        runs = {"sao": partial(lfssao.estimate, "sao", buffers.turned("sao-hash"), USUAL * unit)}
        row = least(runs, scale.repeats(8))["sao"]
        row |= {"ns": 1e6 * row["ms"] / (size[0] * size[1]), "texels": buffers.depth.size}
        rows[f"{width}x{height}, guard {guard}"] = row
    return {"rows": rows}


def judge_resolutions(found: Found, limit: float, most: float, texels: list[int]) -> Judged:
    rows = list(found["rows"].values())
    ns, same = [row["ns"] for row in rows], [row["texels"] for row in rows] == texels
    told = {"low": min(ns), "high": max(ns), "spread": max(ns) / min(ns), "counts": "the paper's" if same else "others"}
    return told["spread"] <= limit and same, told["spread"] <= most, told


def tap_points(taps: int, turns: int, across: Any, radius: float = 100.0) -> Any:
    """All points that reach the texel (640, 480) by the filter's texels, (n, 2), texels from it: figure 2."""
    angle = texel_angles("sao-hash", 1024, 1280)
    alpha = (np.arange(taps) + 0.5) / taps
    y, x = (each.ravel() for each in np.meshgrid(across, across))
    turned = 2 * np.pi * alpha * turns + angle[480 + y, 640 + x][:, None]
    return np.stack([x[:, None] + radius * alpha * np.cos(turned), y[:, None] + radius * alpha * np.sin(turned)], -1)


def unevenness(points: Any, radius: float = 100.0) -> float:
    """Deviation over mean of the number of points in cells of distance and angle about the texel, 8 x 16."""
    distance, angle = np.hypot(*points.T) / radius, np.arctan2(*points.T[::-1])
    counts = np.histogram2d(distance, angle, (8, 16), ((0, 1), (-np.pi, np.pi)))[0]
    return float(counts.std() / counts.mean())


@cache
def many_taps(size: tuple[int, ...]) -> Any:
    """Occlusion that 500 taps without hierarchy find, and the surface."""
    buffers, unit, _ = camera_buffers(*size)
    return sao(buffers, WIDE * unit, taps=500, turns=0, mip="none", **RAW), np.isfinite(buffers.depth)


def reconstruction(scale: Scale) -> Found:
    """Figure 2: points that reach a texel, and errors."""
    sets = {"AlchemyAO": (12, 5, np.arange(-6, 7)), "SAO": (9, 7, np.add.outer(3 * np.arange(-3, 4), (0, 1)).ravel())}
    figure, axes = curves(2, 7.6)
    rows: dict[str, Any] = {}
    for panel, (name, args) in zip(axes, sets.items(), strict=True):
        points = tap_points(*args)
        own = points[len(points) // 2]
        rows[name] = {"points": points[..., 0].size, "uneven": unevenness(points.reshape(-1, 2))}
        level = np.floor(np.log2(np.maximum(np.hypot(*own.T), 8) / 8)) if name == "SAO" else np.zeros(len(own))
        panel.scatter(*points.reshape(-1, 2).T, s=1, c=np.tile(level, len(points)), cmap="viridis", vmin=0, vmax=5)
        panel.plot(*own.T, "ro", markersize=4)
        panel.set(title=f"{name}; one texel's own taps red", aspect="equal")
    scale.save("sao-figure-2", figure)
    size = scale.size(1024, 768)
    buffers, unit, _ = camera_buffers(*size)
    (limit, seen), radius, z = many_taps(size), WIDE * unit, linear_z(buffers)
    keys = scalable.keys_of(z, texel_rays(buffers.view, z.dtype).origin, 0.0)
    raw = {"AlchemyAO": sao(buffers, radius, taps=12, turns=5, mip="none", **RAW), "SAO": sao(buffers, radius, **RAW)}
    made = {"AlchemyAO": 1 - wide_bilateral(1 - raw["AlchemyAO"], keys), "SAO": sao(buffers, radius)}
    for name, row in rows.items():
        row |= {"rmse": rms((made[name] - limit)[seen]), "raw": rms((raw[name] - limit)[seen])}
    return {"rows": rows}


def judge_reconstruction(found: Found, limit: float, theirs: dict[str, int]) -> Judged:
    a, b = (found["rows"][name] for name in ("AlchemyAO", "SAO"))
    points = {name: row["points"] for name, row in found["rows"].items()}
    fits = b["rmse"] <= limit * a["rmse"], b["uneven"] < a["uneven"]
    told = {"alchemy": a["rmse"], "sao": b["rmse"], "alchemy_uneven": a["uneven"], "sao_uneven": b["uneven"]}
    return all(fits) and points == theirs, any(fits), told | {"points": " and ".join(map(str, points.values()))}


def stored(z: Any, near: float, far: float, bits: int) -> Any:
    """Depth buffer values: float32 projection row times the point, division, storage in 16 or 24 bits or float32."""
    one = np.float32
    a, b = (one(1), one(near)) if far == np.inf else (one(far / (far - near)), one(far * near / (far - near)))
    z = z.astype(np.float32)
    d = (a * z - b) / z
    if bits == 32:
        return d
    steps = 2.0**bits - 1
    return (np.floor(d.astype(float) * steps + 0.5) / steps).astype(np.float32)


def z_errors(scale: Scale, near: float = 0.1) -> Found:
    """Figure 3: error of z from a depth buffer, millimetres."""
    z = np.linspace(1, 60, 200_001).astype(np.float32)
    rows = {}
    figure, (axes,) = curves(1, 6.4)
    for bits in (16, 24, 32):
        for far in (100.0, np.inf):
            back = np.empty((1, len(z)), np.float32)
            constants = [np.float32(x) for x in plane_constants(near, far)]
            linear_depth(stored(z, near, far, bits)[None], True, *constants, back)
            error = 1e3 * np.abs(back[0].astype(float) - z)
            finite = np.where(np.isfinite(error), error, np.nan)
            name = f"{bits} bits, far plane {'infinite' if far == np.inf else '100 m'}"
            rows[name] = {"mean": float(np.nanmean(finite)), "worst": float(np.nanmax(finite))}
            axes.semilogy(z[:-1].reshape(-1, 2000).mean(1), np.nanmean(finite[:-1].reshape(-1, 2000), 1), label=name)
    axes.set(xlabel="z, m", ylabel="mean error of z, mm")
    axes.legend(fontsize="x-small")
    scale.save("sao-figure-3", figure)
    return {"rows": rows}


def judge_z_errors(found: Found, limit: float) -> Judged:
    mean = {tuple(name.split(" bits, far plane ")): row["mean"] for name, row in found["rows"].items()}
    far = min(max(a / b, b / a) for a, b in ((mean[bits, "100 m"], mean[bits, "infinite"]) for bits in ("24", "32")))
    form = max(mean["24", plane] / mean["32", plane] for plane in ("100 m", "infinite"))
    worst = found["rows"]["24 bits, far plane infinite"]["worst"]
    fits = far > form, worst <= limit
    return all(fits), any(fits), {"far": far, "form": form, "worst": worst}


def normal_errors(scale: Scale) -> Found:
    """Figure 4: angle between rebuilt and triangle normals where the texels of the differences see one triangle."""
    buffers, _, gbuffer = camera_buffers(*scale.size(1024, 768))
    true = gbuffer.normals.astype(float)
    view = scalable.sao_view(buffers, linear_z(buffers), scalable.AppendixOptions())
    made = view.normals.reshape(true.shape).astype(float)
    angle = np.degrees(np.arctan2(np.linalg.norm(np.cross(made, true), axis=-1), (made * true).sum(-1)))
    t = gbuffer.triangle
    pair = t.reshape(t.shape[0], -1, 2)[..., ::-1].reshape(t.shape)
    below = t.reshape(-1, 2, t.shape[1])[:, ::-1].reshape(t.shape)
    inside = (t >= 0) & (t == pair) & (t == below)
    steep = np.abs((true * buffers.directions).sum(-1)) <= np.cos(np.radians(80))
    shown = np.where(inside, 1 - np.minimum(angle / 0.02, 1), np.where(t >= 0, 0.8, 1))
    scale.save(
        "sao-figure-4", tiles({"grey: a texel beside an edge": shown[len(shown) // 4 : -len(shown) // 4]}, 1, 8.0)
    )
    cases = {"all": angle[inside], "seen within 80 degrees": angle[inside & ~steep]}
    quantiles = {"median": 50, "p999": 99.9, "worst": 100}
    return {"rows": {name: {k: np.percentile(a, q) for k, q in quantiles.items()} for name, a in cases.items()}}


def judge_normal_errors(found: Found, limit: float) -> Judged:
    worst, most = found["rows"]["all"]["worst"], found["rows"]["seen within 80 degrees"]["p999"]
    return worst <= limit, most <= limit, {"worst": worst, "most": most}


SERIES = {"hierarchy": {}, "no hierarchy": {"mip": "none"}, "no hierarchy, 12 taps": {"mip": "none", "taps": 12}}
RADII = (0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.4)  # shares of the scene's size


def over_radius(scale: Scale) -> Found:
    """Figure 5."""
    views = relief(*scale.size(2560, 1600))
    buffers, runs = views.camera.turned("sao-hash"), {}
    for name, changed in SERIES.items():
        for share in RADII:
            with recorded([each for each in BASELINES if each.label == "SAO taps"]) as calls:
                lfssao.estimate("sao", buffers, share * views.size, **changed, **RAW)
            runs[name, share] = ours(calls, Arrays(calls))
    times = least(runs, scale.repeats(6))
    rows = {name: {str(share): times[name, share]["ms"] for share in RADII} for name in SERIES}
    figure, (axes,) = curves(1, 6.4)
    for name, row in rows.items():
        axes.semilogx(RADII, list(row.values()), "o-", label=name)
    axes.set(xlabel="radius over the scene's size", ylabel="sampling, ms", ylim=(0, None))
    axes.legend()
    scale.save("sao-figure-5", figure)
    return {"rows": rows}


def judge_over_radius(found: Found, limit: float, gain: float) -> Judged:
    with_it, most = (list(found["rows"][name].values()) for name in ("hierarchy", "no hierarchy, 12 taps"))
    told = {"flat": max(with_it) / min(with_it), "gain": most[-1] / with_it[-1]}
    return told["flat"] <= limit and told["gain"] >= gain, told["gain"] > 1, told


def box(low: Any, high: Any) -> Any:
    """Corners and faces of a box."""
    corners = np.array([[(low, high)[k >> axis & 1][axis] for axis in range(3)] for k in range(8)])
    quads = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
    return corners, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])


GAPS = (0.05, 0.1, 0.2, 0.4, 0.8)  # of the bars from the wall, radii


def thin_features(scale: Scale) -> Found:
    """Figure 8: a wall and five thin bars before it."""
    radius = 0.3
    parts = [box((-2.5, -1, -0.1), (2.5, 1, 0))]
    parts += [box((k - 2, -1, radius * g), (k - 1.98, 1, radius * g + 0.02)) for k, g in enumerate(GAPS)]
    faces = np.concatenate([f + 8 * k for k, (_, f) in enumerate(parts)]).astype(np.int32)
    mesh = lfssao.Mesh(np.concatenate([v for v, _ in parts]).astype(float), faces)
    camera = lfssao.Camera.placed(mesh.bounds, eye=(2.0, 0.0, 6.0), target=(0.0, 0.0, 0.0), fov=22.0)
    frames = [moved_buffers(mesh, camera, *scale.size(1024, 512), move=move)[0] for move in (0.0, 0.25, 0.5, 0.75, 1.0)]
    rays = {"falloff": "quadratic", "tolerance": 0.02, "rounds": (2, 8)}
    truth = lfssao.ray_cast_occlusion(lfssao.Occluders(mesh), frames[0], radius, **rays).texture
    made = {name: [sao(b, radius, mip=how) for b in frames] for name, how in
            (("hierarchy", "rotated"), ("no hierarchy", "none"))}  # fmt: skip
    x, y, z = (frames[0].positions[..., k] for k in range(3))
    wall = (np.abs(z) < 1e-3) & (np.abs(y) < 0.6)
    near = {str(g): wall & (np.abs(x - (k - 1.99)) < radius / 2) for k, g in enumerate(GAPS)}
    there = np.all([np.isfinite(b.depth) for b in frames], axis=0)
    pictures = {name: t[0] for name, t in made.items()} | {"rays": truth}
    middle = slice(len(truth) // 4, -len(truth) // 4)
    scale.save("sao-figure-8", tiles({name: (1 - t)[middle] for name, t in pictures.items()}, 1, 6.0))
    rows = {name: {g: float(t[each].mean()) for g, each in near.items()} for name, t in pictures.items()}
    for name, textures in made.items():
        rows[name]["change"] = rms([(b - a)[there] for a, b in pairwise(textures)])
    return {"rows": rows}


def judge_thin_features(found: Found, limit: float) -> Judged:
    ours_, none, rays = found["rows"].values()
    near, far = str(GAPS[0]), str(GAPS[-1])
    fades = ours_[far] <= 0.5 * ours_[near]
    told = {"near": ours_[near], "far": ours_[far], "rays_near": rays[near], "rays_far": rays[far]}
    told |= {"change": ours_["change"], "none": none["change"]}
    return fades and told["change"] <= limit * told["none"], fades, told


def q_range(scale: Scale) -> Found:
    """Section 2.3."""
    size = scale.size(1024, 768)
    frames = [camera_buffers(*size, move=move) for move in (0.0, 0.25)]
    (limit, seen), radius = many_taps(size), WIDE * frames[0][1]
    first, second = (b.turned("sao-hash") for b, _, _ in frames)
    there, powers = seen & np.isfinite(second.depth), range(8)
    rows = least(
        {str(2**p): partial(lfssao.estimate, "sao", first, radius, log_q=p, **RAW) for p in powers}, scale.repeats(10)
    )
    for p in powers:
        before, after = (sao(b, radius, log_q=p, **RAW) for b in (first, second))
        whole = sao(first, radius, log_q=p)
        rows[str(2**p)] |= {"rmse": rms((whole - limit)[seen]), "change": rms((after - before)[there])}
    return {"rows": rows}


def judge_q_range(found: Found, limit: float) -> Judged:
    rows = found["rows"]
    good, eight = [rows[q]["rmse"] for q in ("8", "16", "32")], rows["8"]
    told = {"alike": max(good) / min(good), "error": rows["2"]["rmse"] / eight["rmse"]}
    told |= {"change": rows["2"]["change"] / eight["change"], "slow": rows["128"]["ms"] / eight["ms"]}
    rest = min(told["error"], told["change"]) > limit and told["slow"] > 1 + max(eight["spread"], rows["128"]["spread"])
    return told["alike"] <= limit and rest, told["alike"] <= limit, told


CLAIMS = {
    "SAO table 1": (filters, judge_filters),
    "SAO table 2": (pass_times, judge_pass_times),
    "SAO table 3": (resolutions, judge_resolutions),
    "SAO figure 2": (reconstruction, judge_reconstruction),
    "SAO figure 3": (z_errors, judge_z_errors),
    "SAO figure 4": (normal_errors, judge_normal_errors),
    "SAO figure 5": (over_radius, judge_over_radius),
    "SAO figure 8": (thin_features, judge_thin_features),
    "SAO range of q'": (q_range, judge_q_range),
}
