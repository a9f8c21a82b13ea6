"""The VO paper's samples, measured and judged: the gallery before an ordinary camera, float32."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from papers_common import PAPERS, Claim, Found, Judged, Scale, changed, curves
from papers_vo import SEEDS, limit_of, occlusion, samples
from scipy.spatial import cKDTree

import lfssao
from lfssao.bench.work_precision.figures import rms

KINDS = {
    "lines with the centre": ("vo-lines", True),
    "lines without": ("vo-lines", False),
    "points": ("vo-points", None),
}
COUNTS = range(3, 37)
NEXT = ", one more"


def plane_error(name: str, n: int, centre: bool | None) -> float:
    """Error of a set's occlusion by a plane through the ball's centre, over 4,000 normals; it is a half."""
    normals = lfssao.samples.sample_set("sphere", "sobol", 4096, 0).points
    points, weights = samples(name, n, centre)
    if name == "vo-points":
        share = (normals @ points.T > 0).astype(float)
    else:
        half = np.sqrt(np.maximum(1 - (points**2).sum(1), 0))
        across = normals[:, :2] @ points.T / np.where(normals[:, 2:] == 0, 1e-9, normals[:, 2:])
        share = np.clip((half + across) / np.maximum(2 * half, 1e-9), 0, 1)
    return rms(share @ weights / weights.sum() - 0.5)


def good_counts(scale: Scale) -> Found:
    """Figure 4."""
    buffers, radius, there, truth = limit_of(scale.size(512, 384), 0.03)
    errors: dict[str, Any] = {}
    figure, axes = curves(2)
    for kind, (name, centre) in KINDS.items():
        made = {n: [occlusion(name, buffers, radius, n, centre, seed=s) - truth for s in SEEDS] for n in COUNTS}
        errors[kind] = {
            "scene": {n: rms([each[there] for each in made[n]]) for n in COUNTS},
            "planes": {n: plane_error(name, n, centre) for n in COUNTS},
        }
        for panel, (where, by_count) in zip(axes, errors[kind].items(), strict=True):
            (line,) = panel.semilogy(COUNTS, np.maximum(list(by_count.values()), 1e-3), "-", label=kind)
            good = PAPERS["VO figure 4"]["good"][kind]
            panel.plot(good, [max(by_count[n], 1e-3) for n in good], "o", color=line.get_color())
            panel.set(xlabel="samples (dots: the paper's good counts)", ylabel="RMS error of ao", title=where)
    axes[0].legend(fontsize="small")
    scale.save("vo-figure-4", figure)
    shares = {
        f"{kind}, {n}": {
            f"{where}{word}": against_its_neighbours(by_count, n + more)
            for where, by_count in errors[kind].items() for word, more in (("", 0), (NEXT, 1))
        } for kind, counts in PAPERS["VO figure 4"]["good"].items() for n in counts
    }  # fmt: skip
    pairs = {
        where: [errors[kind][where][a] < errors[kind][where][a + 1] for kind, a in
                (("lines with the centre", 9), ("points", 12))] for where in ("scene", "planes")
    }  # fmt: skip
    return {"rows": shares, "pairs": pairs}


def against_its_neighbours(errors: dict[int, float], n: int) -> float:
    """A count's error over the mean of that of the counts up to three away."""
    return errors[n] / float(np.mean([errors[k] for k in errors if 0 < abs(k - n) <= 3]))


def judge_good_counts(found: Found) -> Judged:
    good, others = (
        {where: sum(row[where + word] < 1 for row in found["rows"].values()) for where in ("scene", "planes")}
        for word in ("", NEXT)
    )
    pairs = {where: sum(holds) for where, holds in found["pairs"].items()}
    number = len(found["rows"])
    told = good | {"all": number, "pairs": pairs["scene"], "plane_pairs": pairs["planes"]}
    told |= {f"{where}_next": n for where, n in others.items()}
    whole = good["scene"] == number > others["scene"] and pairs["scene"] == 2
    return whole, any(good[where] > max(number / 2, others[where]) for where in good), told


def next_counts(_: Scale, found: Found) -> Found:
    """Counts one above the good ones in their place, and the other way round; pairs as far off."""
    rows = {
        name: {f"{where}{word}": row[f"{where}{other}"] for where in ("scene", "planes")
               for word, other in (("", NEXT), (NEXT, ""))} for name, row in found["rows"].items()
    }  # fmt: skip
    return found | {
        "rows": rows,
        "pairs": {where: [not each for each in holds] for where, holds in found["pairs"].items()},
    }


GRID = 128
DISK_SETS = ("repulsion", "lloyd", "halton", "sobol", "poisson")
FEW = (3, 4, 5, 6, 7, 8, 9, 10, 12, 13, 15, 16)


@cache
def disk_cells() -> tuple[Any, Any]:
    """Middles of small squares of the disk, and the ball's extent along z there."""
    across = (np.arange(GRID) + 0.5) * 2 / GRID - 1
    places = np.stack(np.meshgrid(across, across), axis=-1).reshape(-1, 2)
    places = places[(places**2).sum(axis=1) < 1]
    return places, 2 * np.sqrt(1 - (places**2).sum(axis=1))


def relaxed(n: int, seed: int) -> Any:
    """Lloyd's relaxation of independent points, 100 steps, by cells that hold the same integral."""
    points, (places, extent) = lfssao.samples.sample_set("disk", "random", n, seed).points, disk_cells()
    for _ in range(100):
        nearest = cKDTree(points).query(places)[1]
        mass = np.maximum(np.bincount(nearest, extent, n), 1e-9)
        points = np.stack([np.bincount(nearest, extent * places[:, k], n) / mass for k in range(2)], axis=-1)
    return points


def disk_set(name: str, n: int, seed: int) -> tuple[Any, Any]:
    """Points of the disk, weighted by the integrals of their cells."""
    if name == "repulsion":
        return samples("vo-lines", n)
    points = relaxed(n, seed) if name == "lloyd" else lfssao.samples.sample_set("disk", name, n, seed).points
    places, extent = disk_cells()
    return points, np.bincount(cKDTree(points).query(places)[1], extent, n)


def generators(scale: Scale) -> Found:
    """Section 4.5: errors of sets of lines by how they were made."""
    buffers, radius, there, truth = limit_of(scale.size(512, 384), 0.03)
    figure, (axes,) = curves(1, 6.4)
    rows: dict[str, Any] = {}
    for name in DISK_SETS:
        errors = {}
        for n in FEW:
            made = [lfssao.estimate("vo-lines", buffers, radius, *disk_set(name, n, s), seed=s).texture for s in SEEDS]
            errors[str(n)] = rms([(texture - truth)[there] for texture in made])
        axes.loglog(FEW, list(errors.values()), "o-", label=name)
        rows[name] = errors
    axes.set(xlabel="lines", ylabel="RMS error of ao")
    axes.legend()
    scale.save("vo-section-45-sample-generation", figure)
    return {"rows": rows}


def judge_generators(found: Found, limit: float) -> Judged:
    own = found["rows"]["repulsion"]
    others = {n: row for n, row in found["rows"].items() if n != "repulsion"}
    gains = {name: [row[n] / own[n] for n in own] for name, row in others.items()}
    told = {name: float(np.mean(gain)) for name, gain in gains.items()}
    told |= {"least": min(map(min, gains.values())), "poisson_least": min(gains["poisson"])}
    return min(told[name] for name in gains) >= limit and told["least"] > 1, max(told[n] for n in gains) >= limit, told


def poisson_as_repulsion(_: Scale, found: Found) -> Found:
    """Poisson sets under the name of repulsion."""
    return changed(found, {"repulsion": found["rows"]["poisson"]})


TILES = (1, 2, 4, 8, 16, 64)


def random_textures(scale: Scale) -> Found:
    """Section 4.5: error by the size of the random texture that turns the samples."""
    buffers, radius, there, truth = limit_of(scale.size(512, 384), 0.03)
    sizes = buffers.depth.shape
    rows = {}
    for n in TILES:
        errors: dict[str, Any] = {"raw": [], "blurred": []}
        for seed in range(8):
            angles = np.random.default_rng(seed).uniform(0, 2 * np.pi, (n, n))
            turned = replace(buffers, turns=lfssao.samples.noise_turns(angles, *sizes, buffers.depth.dtype))
            made = occlusion("vo-lines", turned, radius, 9, randomize=False)
            errors["raw"].append((made - truth)[there])
            errors["blurred"].append((lfssao.blur(made, 1.0) - lfssao.blur(truth.astype(made.dtype), 1.0))[there])
        rows[f"{n}x{n}"] = {key: rms(each) for key, each in errors.items()}
    return {"rows": rows}


def judge_random_textures(found: Found, limit: float) -> Judged:
    sizes = [row for name, row in found["rows"].items() if name not in ("1x1", "2x2")]
    told = {key: max(row[key] for row in sizes) / min(row[key] for row in sizes) for key in ("raw", "blurred")}
    told["one"] = found["rows"]["1x1"]["blurred"] / found["rows"]["64x64"]["blurred"]
    return max(told["raw"], told["blurred"]) <= limit, told["raw"] <= limit, told


def one_turn(_: Scale, found: Found) -> Found:
    """The same turn for all texels under the name of a texture of 16 x 16."""
    return changed(found, {"16x16": found["rows"]["1x1"]})


CLAIMS = {
    "VO section 4.5, sample generation": Claim(generators, judge_generators, poisson_as_repulsion),
    "VO section 4.5, random texture": Claim(random_textures, judge_random_textures, one_turn),
    "VO figure 4": Claim(good_counts, judge_good_counts, next_counts),
}
