"""The SAO paper's tables and figures, measured and judged, before an ordinary camera, float32."""

from functools import cache, partial
from itertools import pairwise
from typing import Any

import numpy as np
from cpu_times import least
from papers_common import (
    Claim,
    Found,
    Judged,
    Scale,
    camera_buffers,
    changed,
    curves,
    mean_of,
    moved_buffers,
    renamed,
    tiles,
)

import lfssao
from lfssao.ao.estimators.sao import estimator as scalable
from lfssao.ao.estimators.sao import hierarchy
from lfssao.ao.estimators.sao.kernels.passes import bilateral
from lfssao.ao.estimators.sao.texel_rays import linear_z, texel_rays
from lfssao.ao.reference import gaussian_weights
from lfssao.bench.work_precision.figures import rms
from lfssao.samples import spiral_discrepancy, texel_angles

RAW = {"quad_edge": 0.0, "gauss": 0.0}  # without average and blur
WIDE, USUAL = 0.2, 0.04  # radii, shares of the scene's diagonal; the paper's 1 m in a hall of about 30 m is the latter


def sao(buffers: Any, radius: float, **parameters: Any) -> Any:
    return lfssao.estimate("sao", buffers.turned("sao-hash"), radius, **parameters).texture


def filters(scale: Scale) -> Found:
    """Table 1."""
    buffers, unit, _ = camera_buffers(*scale.size(1024, 768))
    seen = np.isfinite(buffers.depth)
    ao = {how: sao(buffers, WIDE * unit, mip=how, **RAW) for how in hierarchy.FILTERS}
    errors = {how: (ao[how].astype(float) - ao["none"])[seen] for how in ao if how != "none"}
    pictures = {"no hierarchy": 1 - ao["none"]}
    pictures |= {f"{how}, difference x 4": 1 - np.minimum(4 * np.abs(ao[how] - ao["none"]), 1) for how in errors}
    scale.save("sao-table-1", tiles(pictures, 3))
    limit = many_taps(scale.size(1024, 768))[0]
    whole = {how: rms((sao(buffers, WIDE * unit, mip=how) - limit)[seen]) for how in ao}
    rows = {how: {"rmse": rms(e), "bias": float(e.mean()), "whole": whole[how]} for how, e in errors.items()}
    return {"rows": rows, "none": whole["none"]}


def judge_filters(found: Found, limit: float) -> Judged:
    rows = found["rows"]
    rotated, *others = (row["rmse"] for row in rows.values())
    least_bias = min(rows, key=lambda how: abs(rows[how]["bias"]))
    whole = rows["rotated"]["whole"] / found["none"]
    told = {"rotated": rotated, "low": min(others), "high": max(others), "whole": whole}
    return rotated < min(others) and whole <= limit, least_bias == "rotated", told


def wide_bilateral(visibility: Any, keys: Any) -> Any:
    """Two passes of 13 neighbouring taps, AlchemyAO's by SAO's figure 2."""
    weights = gaussian_weights(6.0, 6).astype(visibility.dtype)
    for step in ((1, 0), (0, 1)):
        target = np.empty_like(visibility)
        bilateral(visibility, keys, weights, step, visibility.dtype.type(2048), target)
        visibility = target
    return visibility


def tap_points(taps: int, turns: int, across: Any, radius: float = 100.0) -> Any:
    """All points that reach the texel (640, 480) by the filter's texels, (n, 2), texels from it: figure 2."""
    angle = texel_angles("sao-hash", 1024, 1280)
    alpha = (np.arange(taps) + 0.5) / taps
    y, x = (each.ravel() for each in np.meshgrid(across, across))
    turned = 2 * np.pi * alpha * turns + angle[480 + y, 640 + x][:, None]
    return np.stack([x[:, None] + radius * alpha * np.cos(turned), y[:, None] + radius * alpha * np.sin(turned)], -1)


def unevenness(points: Any, radius: float = 100.0) -> float:
    """Deviation over mean of the number of points in cells of distance and angle about the texel, 8 x 16."""
    distance = np.hypot(*points.T) / radius
    angle = np.arctan2(*points.T[::-1])
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


def box(low: Any, high: Any) -> Any:
    """Corners and faces of a box."""
    corners = np.array([[(low, high)[k >> axis & 1][axis] for axis in range(3)] for k in range(8)])
    quads = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
    return corners, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])


def unfiltered(_: Scale, found: Found) -> Found:
    """SAO's numbers before its filter."""
    return changed(found, {"SAO": {"rmse": found["rows"]["SAO"]["raw"]}})


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
    occluders = lfssao.Occluders(mesh)
    made = {name: [sao(b, radius, mip=how) for b in frames] for name, how in
            (("hierarchy", "rotated"), ("no hierarchy", "none"))}  # fmt: skip
    made["multi-resolution"] = [lfssao.estimate("multiresolution", b, radius).texture for b in frames]
    made["rays"] = [lfssao.ray_cast_occlusion(occluders, b, radius, **rays).texture for b in frames[:2]]
    made["mean"] = [mean_of(t, np.isfinite(b.depth)) for t, b in zip(made["hierarchy"], frames, strict=True)]
    x, y, z = (frames[0].positions[..., k] for k in range(3))
    wall = (np.abs(z) < 1e-3) & (np.abs(y) < 0.6)
    near = {str(g): wall & (np.abs(x - (k - 1.99)) < radius / 2) for k, g in enumerate(GAPS)}
    there = np.all([np.isfinite(b.depth) for b in frames], axis=0)
    pictures = {name: t[0] for name, t in made.items() if name != "mean"}
    middle = slice(len(wall) // 4, -len(wall) // 4)
    scale.save("sao-figure-8", tiles({name: (1 - t)[middle] for name, t in pictures.items()}, 1, 6.0))
    rows = {name: {g: float(t[0][each].mean()) for g, each in near.items()} for name, t in made.items()}
    for name, textures in made.items():
        rows[name]["change"] = rms([(b - a)[there] for a, b in pairwise(textures)])
    return {"rows": rows}


def judge_thin_features(found: Found) -> Judged:
    own, _, several, rays, _ = found["rows"].values()
    near = str(GAPS[0])
    far = str(GAPS[-1])
    fades = own[far] <= 0.5 * own[near]
    told = {"near": own[near], "far": own[far], "rays_near": rays[near], "rays_far": rays[far]}
    told |= {"change": own["change"], "several": several["change"], "rays": rays["change"]}
    return fades and own["change"] < several["change"], fades, told


def q_range(scale: Scale) -> Found:
    """Section 2.3."""
    size = scale.size(1024, 768)
    frames = [camera_buffers(*size, move=move) for move in (0.0, 0.25)]
    (limit, seen), radius = many_taps(size), WIDE * frames[0][1]
    first, second = (b.turned("sao-hash") for b, _, _ in frames)
    there = seen & np.isfinite(second.depth)
    powers = range(8)
    rows = least(
        {str(2**p): partial(lfssao.estimate, "sao", first, radius, log_q=p, **RAW) for p in powers}, scale.repeats(10)
    )
    for p in powers:
        before, after = (sao(b, radius, log_q=p, **RAW) for b in (first, second))
        whole = sao(first, radius, log_q=p)
        rows[str(2**p)] |= {"rmse": rms((whole - limit)[seen]), "change": rms((after - before)[there])}
    return {"rows": rows}


def mean_as_sao(_: Scale, found: Found) -> Found:
    """The mean of SAO's ao everywhere."""
    return changed(found, {"hierarchy": found["rows"]["mean"]})


def only_one_q(_: Scale, found: Found) -> Found:
    """The numbers of q' = 8, whatever q' is."""
    return {"rows": dict.fromkeys(found["rows"], found["rows"]["8"])}


def judge_q_range(found: Found, limit: float) -> Judged:
    rows = found["rows"]
    good = [rows[q]["rmse"] for q in ("8", "16", "32")]
    eight = rows["8"]
    told = {"alike": max(good) / min(good), "error": rows["2"]["rmse"] / eight["rmse"]}
    told |= {"change": rows["2"]["change"] / eight["change"], "slow": rows["128"]["ms"] / eight["ms"]}
    rest = min(told["error"], told["change"]) > limit and told["slow"] > 1 + max(eight["spread"], rows["128"]["spread"])
    return told["alike"] <= limit and rest, told["alike"] <= limit, told


def numbers_of_turns(scale: Scale) -> Found:
    """Section 2.3: tau, the turns of the spiral of nine taps."""
    buffers, unit, _ = camera_buffers(*scale.size(1024, 768))
    limit, seen = many_taps(scale.size(1024, 768))
    rows = {}
    for turns in range(1, 10):
        made = {"raw": sao(buffers, WIDE * unit, turns=turns, **RAW), "whole": sao(buffers, WIDE * unit, turns=turns)}
        rows[str(turns)] = {key: rms((t - limit)[seen]) for key, t in made.items()}
        rows[str(turns)]["uneven"] = spiral_discrepancy(9, turns)
    return {"rows": rows}


def judge_turns(found: Found, limit: float) -> Judged:
    rows = found["rows"]
    told = {key: rows["7"][key] / min(row[key] for row in rows.values()) for key in ("uneven", "whole")}
    worst = max(rows.values(), key=lambda row: row["uneven"])
    told |= {"worst": worst["uneven"] / rows["7"]["uneven"], "worst_whole": worst["whole"] / rows["7"]["whole"]}
    return max(told["uneven"], told["whole"]) <= limit, told["uneven"] <= limit, told


def six_turns(_: Scale, found: Found) -> Found:
    """Six turns, which put nine taps in three directions, under the name of seven."""
    return changed(found, {"7": found["rows"]["6"]})


DISTANCES = (0.0, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.75, 1.0)


def falloffs(scale: Scale) -> Found:
    """The appendix: ao of a floor by the distance from a wall, of both falloffs."""
    radius = 0.5
    parts = [box((-2, -0.1, 0), (2, 0, 2)), box((-2, -0.1, -0.1), (2, 2, 0))]
    faces = np.concatenate([f + 8 * k for k, (_, f) in enumerate(parts)]).astype(np.int32)
    mesh = lfssao.Mesh(np.concatenate([v for v, _ in parts]).astype(float), faces)
    camera = lfssao.Camera.placed(mesh.bounds, eye=(0.0, 3.0, 4.0), target=(0.0, 0.2, 0.3), fov=35.0)
    buffers = moved_buffers(mesh, camera, *scale.size(1024, 768))[0].turned("sao-hash")
    x, y, z = (buffers.positions[..., k] for k in range(3))
    floor = np.isfinite(buffers.depth) & (np.abs(y) < 1e-3) & (np.abs(x) < 1)
    rows = {}
    weak: dict[str, Any] = {  # so that nothing is cut off at 1
        "equation 1, epsilon 0.01": ("sao-equation-1", {"sigma": 0.1}),
        "equation 1, epsilon 0.0001": ("sao-equation-1", {"sigma": 0.1, "epsilon": 1e-4}),
        "appendix, epsilon 0.01": ("sao", {"intensity": 0.1}),
    }
    for name, (form, strength) in weak.items():
        made = lfssao.estimate(form, buffers, radius, taps=64, turns=0, mip="none", **strength, **RAW).texture
        bins = {f"{low:g}": floor & (z >= low * radius) & (z < high * radius) for low, high in pairwise(DISTANCES)}
        ao = {low: float(made[each].mean()) for low, each in bins.items()}
        mean = float(made[floor & (z < radius)].mean())
        rows[name] = {low: each / mean for low, each in ao.items()}
    return {"rows": rows}


def judge_falloffs(found: Found, limit: float) -> Judged:
    *first, new = (np.array(list(row.values())) for row in found["rows"].values())
    alike = min(float(np.corrcoef(each, new)[0, 1]) for each in first)
    *steep, own = (each[0] - each[4] for each in (*first, new))
    told = {"alike": alike, "low": min(steep), "high": max(steep), "new": own}
    return alike >= limit and own < min(steep), alike >= limit and own < max(steep), told


def reversed_falloff(_: Scale, found: Found) -> Found:
    """The appendix' ao by the distance from where it ends."""
    own = found["rows"]["appendix, epsilon 0.01"]
    return changed(found, {"appendix, epsilon 0.01": dict(zip(own, reversed(own.values()), strict=True))})


CLAIMS = {
    "SAO section 2.3, tau": Claim(numbers_of_turns, judge_turns, six_turns),
    "SAO appendix": Claim(falloffs, judge_falloffs, reversed_falloff),
    "SAO table 1": Claim(filters, judge_filters, lambda _, found: renamed(found)),
    "SAO figure 2": Claim(reconstruction, judge_reconstruction, unfiltered),
    "SAO figure 8": Claim(thin_features, judge_thin_features, mean_as_sao),
    "SAO range of q'": Claim(q_range, judge_q_range, only_one_q),
}
