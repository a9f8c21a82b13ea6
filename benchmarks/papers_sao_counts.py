"""SAO's claims that are counted, or follow from times of other claims: bytes, guard bands, small radii, figure 1."""

from typing import Any

import numpy as np
from papers_common import Claim, Found, Judged, Scale, changed, measured_before

DEPTH, KEY, POSITION, NORMAL = 4, 4, 12, 4  # bytes of a texel: float z; ao and z packed; three floats; three bytes


def traffic(levels: float, sampling: float, taps: int, packed: int) -> dict[str, float]:
    """Bytes a pixel that passes read and write, no read served by a cache; two passes of a filter of so many taps."""
    filtering = 2 * (taps * packed + packed)
    return {"levels": levels, "sampling": sampling, "filter": filtering, "total": levels + sampling + filtering}


def bytes_a_pixel(_: Scale) -> Found:
    """Table 2's memory traffic, counted."""
    coarser = 1 / 3  # texels of all coarser levels, each of which is one texel of the finer one
    return {
        "rows": {
            "AlchemyAO": traffic(0, 12 * POSITION + POSITION + NORMAL + KEY, 13, KEY),
            "SAO": traffic(2 * DEPTH + 2 * coarser * DEPTH, 9 * DEPTH + DEPTH + KEY, 7, KEY),
        }
    }


def taps_of_positions(_: Scale, found: Found) -> Found:
    """SAO that reads positions in place of z."""
    own = found["rows"]["SAO"]
    return changed(found, {"SAO": {"total": own["total"] + 9 * (POSITION - DEPTH)}})


def judge_bytes(found: Found, limit: float, theirs: dict[str, float]) -> Judged:
    total = {name: row["total"] for name, row in found["rows"].items()}
    off = max(abs(total[name] / theirs[name] - 1) for name in theirs)
    ratio = total["AlchemyAO"] / total["SAO"]
    same = abs(ratio / (theirs["AlchemyAO"] / theirs["SAO"]) - 1) <= limit
    told = {"alchemy": total["AlchemyAO"], "sao": total["SAO"], "ratio": ratio, "off": off}
    return off <= limit and same, same, told


def guard_band(scale: Scale) -> Found:
    """Section 4: texels that a guard band adds, and the time of the z passes on them."""
    width = 1920
    height = 1200
    times = measured_before(scale, "SAO table 2")
    rows = {}
    for share in (0.05, 0.1):
        guard = round(share * width)
        texels = (width + 2 * guard) * (height + 2 * guard)
        rows[f"{share:.0%} of the width"] = {"guard": guard, "texels": texels, "more": texels / (width * height) - 1}
    z_passes = times["SAO, level 0"]["ms"] + times["SAO, levels"]["ms"]
    return {"rows": rows, "z": z_passes / times["SAO, total"]["ms"]}


def judge_guard_band(found: Found, limit: float, minor: float) -> Judged:
    more = found["rows"]["5% of the width"]["more"]
    told = {"more": more, "time": more * found["z"]}
    same = round(100 * more) == limit
    return same and told["time"] <= minor, same, told


def wider_band(_: Scale, found: Found) -> Found:
    """The guard band of table 3, 10 % of the width."""
    return changed(found, {"5% of the width": found["rows"]["10% of the width"]})


def unread(_: Scale) -> Found:
    """Section 4: texels of the guard band, by level, that no tap of a visible texel reads."""
    width = 1920
    height = 1200
    guard = 192
    rows = {}
    for level in range(6):
        reach = min(16 * 2**level, guard) if level < 5 else guard  # q' = 8: level m serves taps below 16 2^m texels
        band, read = ((width + 2 * g) * (height + 2 * g) - width * height for g in (guard, reach))
        rows[f"level {level}"] = {"texels": band / 4**level, "unread": 1 - read / band}
    return {"rows": rows}


def judge_unread(found: Found, limit: float) -> Judged:
    texels, share = (np.array([row[key] for row in found["rows"].values()]) for key in ("texels", "unread"))
    whole = float((texels * share).sum() / texels.sum())
    return abs(whole - 0.5) <= limit, whole > 0.5 - limit, {"share": whole}


def without_levels(_: Scale, found: Found) -> Found:
    """A guard band all of which is read at every level."""
    return changed(found, {name: {"unread": 0.0} for name in found["rows"]})


def small_radii(scale: Scale) -> Found:
    """Section 3.2, of the times of figure 5 and table 2: the smallest radius, 2560x1600."""
    times = measured_before(scale, "SAO figure 5")
    passes = measured_before(scale, "SAO table 2")
    texels = 2560 * 1600 / ((1920 + 380) * (1080 + 380))
    z_passes = texels * (passes["SAO, level 0"]["ms"] + passes["SAO, levels"]["ms"])
    sets = {"12 taps, no hierarchy": ("no hierarchy, 12 taps", 0.0), "SAO with its z passes": ("hierarchy", z_passes)}
    return {"rows": {name: {r: ms + more for r, ms in times[kind].items()} for name, (kind, more) in sets.items()}}


def judge_small_radii(found: Found) -> Judged:
    alchemy, own = (list(row.values()) for row in found["rows"].values())
    told = {"alchemy": alchemy[0], "sao": own[0], "alchemy_large": alchemy[-1], "sao_large": own[-1]}
    return alchemy[0] < own[0] and alchemy[-1] > own[-1], False, told


def largest_for_smallest(_: Scale, found: Found) -> Found:
    """The largest radius' times for all radii."""
    return {"rows": {name: dict.fromkeys(row, row["0.4"]) for name, row in found["rows"].items()}}


def figure_1(scale: Scale) -> Found:
    """Figure 1, of the times of figure 5 and table 2, by the texel: AlchemyAO at 1280x720, SAO at 1920x1080."""
    times = measured_before(scale, "SAO figure 5")
    passes = measured_before(scale, "SAO table 2")
    filtering = 1 / ((1920 + 380) * (1080 + 380))
    sampling = 1 / (2560 * 1600)
    sizes = {"AlchemyAO": (1280 * 720, "no hierarchy, 12 taps", "0.01", "Alchemy, bilateral"),
             "SAO": (1920 * 1080, "hierarchy", "0.1", "SAO, bilateral")}  # fmt: skip
    rows: dict[str, Any] = {}
    for name, (texels, kind, radius, filter_pass) in sizes.items():
        z_passes = passes["SAO, level 0"]["ms"] + passes["SAO, levels"]["ms"] if name == "SAO" else 0.0
        ms = texels * (sampling * times[kind][radius] + filtering * (passes[filter_pass]["ms"] + z_passes))
        rows[name] = {"texels": texels, "radius": float(radius), "ms": ms}
    return {"rows": rows}


def judge_figure_1(found: Found, limit: float) -> Judged:
    alchemy, own = found["rows"].values()
    ratio = own["ms"] / alchemy["ms"]
    more = own["texels"] / alchemy["texels"]
    told = {"ratio": ratio, "more": more, "alchemy": alchemy["ms"], "sao": own["ms"]}
    return ratio <= limit, ratio < more, told


def by_texels(_: Scale, found: Found) -> Found:
    """AlchemyAO under SAO's name, on as many texels."""
    alchemy, own = found["rows"].values()
    return changed(found, {"SAO": {"ms": alchemy["ms"] * own["texels"] / alchemy["texels"]}})


CLAIMS = {
    "SAO table 2, bytes": Claim(bytes_a_pixel, judge_bytes, taps_of_positions),
    "SAO section 3.2, small radii": Claim(small_radii, judge_small_radii, largest_for_smallest),
    "SAO figure 1": Claim(figure_1, judge_figure_1, by_texels),
    "SAO section 4, guard band": Claim(guard_band, judge_guard_band, wider_band),
    "SAO section 4, unread memory": Claim(unread, judge_unread, without_levels),
}
