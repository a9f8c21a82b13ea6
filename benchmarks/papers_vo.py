"""The VO paper's table and figures, measured and judged: the gallery before an ordinary camera, float32."""

from dataclasses import replace
from functools import cache, partial
from itertools import pairwise
from typing import Any

import numpy as np
from cpu_times import least, loaded_machine
from papers_common import (
    Claim,
    Found,
    Judged,
    Scale,
    camera_buffers,
    changed,
    correlation,
    curves,
    fine,
    mean_of,
    moved,
    renamed,
    tiles,
)
from scipy import ndimage

import lfssao
from lfssao.ao.estimators.sao.texel_rays import linear_z
from lfssao.bench.work_precision.figures import rms
from lfssao.samples import repulsion_table
from lfssao.viz.truth import half_space

SETS = [("lines", n) for n in (3, 5, 7, 9, 12, 16)] + [("points", n) for n in (6, 8, 12, 13, 24, 33, 48)]
SEEDS = range(3)


def samples(name: str, n: int, centre: bool | None = None) -> Any:
    made = repulsion_table("disk" if name.startswith("vo-lines") else "ball", n, centre)
    return made.points, made.weights


def occlusion(name: str, buffers: Any, radius: float, n: int, centre: bool | None = None, **parameters: Any) -> Any:
    return lfssao.estimate(name, buffers, radius, *samples(name, n, centre), **parameters).texture


@cache
def limit_of(size: tuple[int, ...], share: float) -> Any:
    """The buffers, the radius, the surface, and the texture that sets of lines and points tend to."""
    buffers, unit, _ = camera_buffers(*size)
    truth = np.mean([occlusion("vo-lines", buffers, share * unit, 64, seed=s) for s in range(8)], axis=0)
    return buffers, share * unit, np.isfinite(buffers.depth), truth


@cache
def rays_of(size: tuple[int, ...], share: float) -> Any:
    """Ray-cast occlusion at a radius, and the surface of the view."""
    buffers, unit, gbuffer = camera_buffers(*size)
    occluders = lfssao.Occluders(lfssao.builtin_scene())
    truth = lfssao.ray_cast_occlusion(occluders, buffers, share * unit, tolerance=0.03, rounds=(2, 8))
    return truth.texture, gbuffer.triangle >= 0


def times(scale: Scale) -> Found:
    """Table 1."""
    buffers, unit, _ = camera_buffers(*scale.size(1024, 1024))
    sets = (("lines", 5), ("lines", 9), ("points", 12), ("points", 33))
    runs = {f"{name}, {n}": partial(occlusion, f"vo-{name}", buffers, 0.02 * unit, n) for name, n in sets}
    runs["horizons"] = partial(lfssao.estimate, "hbao", buffers, 0.02 * unit)
    rows = least(runs, scale.repeats(90))
    with loaded_machine():
        loaded = least(runs, scale.repeats(90))
    return {"rows": {n: row | {f"loaded {k}": x for k, x in loaded[n].items()} for n, row in rows.items()}}


def judge_times(found: Found, theirs: dict[str, float]) -> Judged:
    rows = found["rows"]
    alone, loaded = (sorted(rows, key=lambda name, key=key: rows[name][key]) for key in ("ms", "loaded ms"))
    grows = [
        order.index("lines, 5") < order.index("lines, 9") and order.index("points, 12") < order.index("points, 33")
        and order[-1] == "horizons" for order in (alone, loaded)
    ]  # fmt: skip
    same = "it is the same" if alone == loaded else "it is " + " < ".join(loaded)
    told = {"order": " < ".join(alone), "same": same, "ratio": rows["horizons"]["ms"] / rows["lines, 5"]["ms"]}
    return alone == loaded == list(theirs), all(grows), told


def thickness(scale: Scale) -> Found:
    """Figure 5: with the normal, as a flat surface has ao 0 then."""
    buffers, unit, _ = camera_buffers(*scale.size(512, 384))
    radius = 0.03 * unit
    z = linear_z(buffers)
    reach = int(buffers.view.lens[0] * radius / float(np.median(z[np.isfinite(z)])))
    nearest = ndimage.minimum_filter(z, 2 * reach + 1)
    beside = np.isfinite(z) & (nearest < z - 2 * radius)
    made = {"without thickness": occlusion("vo-lines-normal", buffers, radius, 16)}
    made["with thickness"] = occlusion("vo-lines-normal", buffers, radius, 16, thickness=radius)
    scale.save("vo-figure-5", tiles({f"1 - ao, {name}": 1 - t for name, t in made.items()}, 2, 8.0))
    places = {"beside": beside, "elsewhere": np.isfinite(z) & ~beside}
    return {"rows": {n: {where: float(t[texels].mean()) for where, texels in places.items()} for n, t in made.items()}}


def judge_thickness(found: Found, limit: float, kept: float) -> Judged:
    before, after = found["rows"].values()
    left = {where: after[where] / before[where] for where in before}
    return left["beside"] <= limit and left["elsewhere"] >= kept, left["beside"] < left["elsewhere"], left


def lightened(_: Scale, found: Found) -> Found:
    """All ao without thickness, times what thickness leaves beside nearer surfaces."""
    before, after = found["rows"].values()
    left = after["beside"] / before["beside"]
    return changed(found, {"with thickness": {where: left * ao for where, ao in before.items()}})


OTHERS = "normals of other texels"


def with_normals(scale: Scale) -> Found:
    """Figure 6."""
    size = scale.size(512, 384)
    buffers, unit, _ = camera_buffers(*size)
    truth, seen = rays_of(size, 0.05)
    made = {"normal": occlusion("vo-lines-normal", buffers, 0.05 * unit, 16)}
    others = replace(buffers, normals=moved(buffers.normals, seen))
    made[OTHERS] = occlusion("vo-lines-normal", others, 0.05 * unit, 16)
    made["no normal"] = half_space(occlusion("vo-lines", buffers, 0.05 * unit, 16))
    scale.save("vo-figure-6", tiles({k: 1 - t for k, t in {**made, "rays": np.where(seen, truth, 0)}.items()}, 3))
    parts = {"fine": lambda t: fine(t, seen)[seen], "whole": lambda t: t[seen]}
    return {"rows": {n: {k: correlation(of(t), of(truth)) for k, of in parts.items()} for n, t in made.items()}}


def judge_with_normals(found: Found, limit: float) -> Judged:
    normal, others, none = (row["fine"] for row in found["rows"].values())
    return normal >= limit * max(others, none), normal > max(others, none), {
        "normal": normal, "others": others, "none": none,
    }  # fmt: skip


def others_normals(_: Scale, found: Found) -> Found:
    """The numbers with normals of other texels under the name of the own."""
    return changed(found, {"normal": found["rows"][OTHERS]})


def lines_against_points(scale: Scale) -> Found:
    """Figure 7."""
    buffers, radius, there, truth = limit_of(scale.size(512, 384), 0.03)
    rows = least({f"{name}, {n}": partial(occlusion, f"vo-{name}", buffers, radius, n) for name, n in SETS},
                 scale.repeats(15))  # fmt: skip
    figure, (axes,) = curves(1, 6.4)
    for name, n in SETS:
        made = [occlusion(f"vo-{name}", buffers, radius, n, seed=s) for s in SEEDS]
        rows[f"{name}, {n}"]["error"] = rms([(texture - truth)[there] for texture in made])
        place = [rows[f"{name}, {n}"][key] for key in ("ms", "error")]
        axes.annotate(str(n), place, xytext=(3, 3), textcoords="offset points")
    for kind in ("lines", "points"):
        own = [row for name, row in rows.items() if name.startswith(kind)]
        axes.loglog(*([row[key] for row in own] for key in ("ms", "error")), "o-", label=kind)
    axes.set(xlabel="processor time, ms", ylabel="RMS error of ao")
    axes.legend()
    scale.save("vo-figure-7", figure)
    return {"rows": rows}


def judge_lines_against_points(found: Found, limit: float) -> Judged:
    rows = found["rows"]
    lines, points = ([row for name, row in rows.items() if name.startswith(kind)] for kind in ("lines", "points"))
    beaten = [any(a["ms"] < b["ms"] and a["error"] < b["error"] for a in lines) for b in points]
    five = rows["lines, 5"]
    twelve = rows["points, 12"]
    fits = all(beaten), five["error"] <= limit * twelve["error"]
    told = {"five": five["error"], "five_ms": five["ms"], "twelve": twelve["error"], "twelve_ms": twelve["ms"]}
    return all(fits), any(fits), told | {"beaten": sum(beaten), "all": len(beaten)}


def points_as_lines(_: Scale, found: Found) -> Found:
    """The numbers of 12 points under the name of each set of lines."""
    return changed(found, {name: found["rows"]["points, 12"] for name in found["rows"] if name.startswith("lines")})


def flicker(scale: Scale, shown: Any = None) -> Found:
    """Sections 4.1 and 5; shown: what is seen in place of the lines' ao."""
    size = scale.size(512, 384)
    seen = [camera_buffers(*size, move=move) for move in (0.0, 0.25, 0.5, 0.75, 1.0)]
    there = np.all([np.isfinite(b.depth) for b, _, _ in seen], axis=0)
    rows = {}
    truth = limit_of(size, 0.03)[-1]
    for name, n in SETS:
        made = [occlusion(f"vo-{name}", b, 0.03 * unit, n, randomize=False) for b, unit, _ in seen]
        if shown and name == "lines":
            made = [shown(each, there) for each in made]
        rows[f"{name}, {n}"] = {"change": rms([(b - a)[there] for a, b in pairwise(made)])}
        rows[f"{name}, {n}"]["error"] = rms((made[0] - truth)[there])
    return {"rows": rows}


def judge_flicker(found: Found, limit: float, error: float) -> Judged:
    five, twelve = (found["rows"][name] for name in ("lines, 5", "points, 12"))
    told = {"five": five["change"], "twelve": twelve["change"], "ratio": five["change"] / twelve["change"]}
    told["error"] = five["error"] / twelve["error"]
    as_good = told["error"] <= error
    return as_good and told["ratio"] <= limit, as_good and told["ratio"] < 1, told


def two_radii(scale: Scale) -> Found:
    """Figure 8: the combination's estimator has the large radius, and the small one as its quarter."""
    size = scale.size(512, 384)
    shares = {"small": 0.02, "large": 0.08}
    buffers, unit, _ = camera_buffers(*size)
    truths = {name: rays_of(size, share) for name, share in shares.items()}
    alone = shares | {"middle": 0.04}
    made = {name: occlusion("vo-lines-normal", buffers, share * unit, 9) for name, share in alone.items()}
    for how in ("product", "minimum"):
        made[how] = occlusion("vo-lines-normal", buffers, 0.08 * unit, 9, second=0.25, combine=how)
    scale.save("vo-figure-8", tiles({f"{name}: 1 - ao": 1 - t for name, t in made.items()}, 3))
    return {"rows": {n: {to: correlation(t[seen], truth[seen]) for to, (truth, seen) in truths.items()}
                     for n, t in made.items()}}  # fmt: skip


def judge_two_radii(found: Found) -> Judged:
    worse = {name: min(row.values()) for name, row in found["rows"].items()}
    both = max(worse["product"], worse["minimum"])
    better = both > worse["middle"]
    return better and both > max(worse["small"], worse["large"]), better, worse | {"both": both}


def middle_radius(_: Scale, found: Found) -> Found:
    """The numbers of one radius under the names of both together."""
    return changed(found, dict.fromkeys(("product", "minimum"), found["rows"]["middle"]))


CLAIMS = {
    "VO table 1": Claim(times, judge_times, lambda _, found: renamed(found)),
    "VO figure 5": Claim(thickness, judge_thickness, lightened),
    "VO figure 6": Claim(with_normals, judge_with_normals, others_normals),
    "VO figure 7": Claim(lines_against_points, judge_lines_against_points, points_as_lines),
    "VO sections 4.1 and 5": Claim(flicker, judge_flicker, lambda scale, _: flicker(scale, mean_of)),
    "VO figure 8": Claim(two_radii, judge_two_radii, middle_radius),
}
