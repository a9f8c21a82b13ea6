"""Times of SAO's passes, measured and judged, before an ordinary camera, float32."""

from functools import partial
from typing import Any

from cpu_times import least
from kernel_baselines import BASELINES
from papers_common import PAPERS, Claim, Found, Judged, Scale, camera_buffers, changed, curves
from papers_sao import RAW, USUAL, wide_bilateral
from settings import relief
from stages import Arrays, ours, recorded

import lfssao
from lfssao.ao.estimators.sao import estimator as scalable
from lfssao.ao.estimators.sao import hierarchy
from lfssao.ao.estimators.sao.texel_rays import linear_z, texel_rays


def stages(buffers: Any, radius: float) -> dict[str, Any]:
    """Calls of the passes of AlchemyAO and SAO; SAO's sampling makes normals, positions and levels too."""
    buffers = buffers.turned("sao-hash")
    z = linear_z(buffers)
    origin = texel_rays(buffers.view, z.dtype).origin
    options = scalable.AppendixOptions()
    keys = scalable.keys_of(z, origin, 0.0)
    visibility = scalable.sample(buffers, z, radius, options)[0]
    return {
        "Alchemy, sampling": partial(lfssao.estimate, "alchemy", buffers, radius),
        "Alchemy, bilateral": partial(wide_bilateral, visibility, keys),
        "SAO, level 0": partial(linear_z, buffers),
        "SAO, levels": partial(hierarchy.z_hierarchy, z, "rotated", 5, origin),
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
    ns = [row["ns"] for row in rows]
    same = [row["texels"] for row in rows] == texels
    told = {"low": min(ns), "high": max(ns), "spread": max(ns) / min(ns), "counts": "the paper's" if same else "others"}
    return told["spread"] <= limit and same, told["spread"] <= most, told


SERIES = {"hierarchy": {}, "no hierarchy": {"mip": "none"}, "no hierarchy, 12 taps": {"mip": "none", "taps": 12}}
RADII = (0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.4)  # shares of the scene's size


def over_radius(scale: Scale) -> Found:
    """Figure 5."""
    views = relief(*scale.size(2560, 1600))
    buffers = views.camera.turned("sao-hash")
    runs = {}
    for name, parameters in SERIES.items():
        for share in RADII:
            with recorded([each for each in BASELINES if each.label == "SAO taps"]) as calls:
                lfssao.estimate("sao", buffers, share * views.size, **parameters, **RAW)
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


def alchemy_as_sao(_: Scale, found: Found) -> Found:
    """Alchemy's time under SAO's name."""
    return changed(found, {"SAO, total": found["rows"]["Alchemy, total"]})


def same_time(_: Scale, found: Found) -> Found:
    """The first resolution's time for all."""
    ms = next(iter(found["rows"].values()))["ms"]
    return changed(found, {n: {"ms": ms, "ns": ms * row["ns"] / row["ms"]} for n, row in found["rows"].items()})


def without_hierarchy(_: Scale, found: Found) -> Found:
    """The times without the hierarchy under its name."""
    return changed(found, {"hierarchy": found["rows"]["no hierarchy"]})


CLAIMS = {
    "SAO table 2": Claim(pass_times, judge_pass_times, alchemy_as_sao),
    "SAO table 3": Claim(resolutions, judge_resolutions, same_time),
    "SAO figure 5": Claim(over_radius, judge_over_radius, without_hierarchy),
}
