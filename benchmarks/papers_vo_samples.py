"""The VO paper's samples, measured and judged: the gallery before an ordinary camera, float32."""

from typing import Any

import numpy as np
from papers_common import PAPERS, Claim, Found, Judged, Scale, curves
from papers_vo import SEEDS, limit_of, occlusion, samples

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
    pairs, number = {where: sum(holds) for where, holds in found["pairs"].items()}, len(found["rows"])
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


CLAIMS = {
    "VO figure 4": Claim(good_counts, judge_good_counts, next_counts),
}
