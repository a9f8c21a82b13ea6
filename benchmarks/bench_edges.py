"""Errors of straight edges, in texels, by the edge's length: ``python benchmarks/bench_edges.py [DISPLAY]``.

A GPU pipeline transforms a triangle's vertices and joins them by straight lines; in a module's image the edge is a
curve. Each edge's end points and 257 points along it are mapped exactly (``Display.physical_to_image``); its error is
the largest distance of the curve from the chord. Edges lie around places on a grid in the region of interest, at
several slants to the screen (0: at constant z, where the curve is straight on a flat display) and eight directions in
the plane of the screen; those that leave the mapping's domain are left out. Writes JSON, and a plot from the JSON.
"""

import argparse
import json
from itertools import pairwise
from pathlib import Path

import numpy as np

from lfssao import find_display
from lfssao.rendering.manifest import describe_machine

LENGTHS = tuple(float(f"{length:.4g}") for length in np.geomspace(1e-3, 1.0, 13))
SLANTS = (0, 10, 30, 60, 90)  # degrees
POINTS = 257
RESULTS = Path(__file__).parent / "results"


def chord_errors(display, index, starts, ends, points=POINTS):
    """Largest distance, texels, of each edge's image from its chord; NaN where a point of it has no image.

    starts, ends: (n, 3) physical coordinates, metres.
    """
    t = np.linspace(0.0, 1.0, points)[:, None, None]
    image, answers = display.physical_to_image(index, (1 - t) * starts + t * ends)
    curve = image[..., :2]
    chord = curve[-1] - curve[0]
    length = np.hypot(chord[:, 0], chord[:, 1])
    beside = curve - curve[0]
    across = np.abs(chord[:, 0] * beside[..., 1] - chord[:, 1] * beside[..., 0])
    # An edge seen end on has no direction: then the distance is that from its start.
    distance = np.where(length > 0, across / np.where(length > 0, length, 1), np.hypot(beside[..., 0], beside[..., 1]))
    return np.where(np.isin(answers, (0, 5)).all(axis=0), distance.max(axis=0), np.nan)


def edges(display, length, slant):
    """End points of edges of one length and slant, all over the region of interest."""
    low, high = np.array(display.roi)
    steps = [np.linspace(a, b, n) for a, b, n in zip(low, high, (7, 5, 5), strict=True)]
    middles = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 1, 3)
    azimuth = np.arange(8) * np.pi / 8
    tilt = np.deg2rad(slant)
    flat = np.cos(tilt) if slant < 90 else 0.0
    way = np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), np.full(8, np.sin(tilt))], axis=-1)
    # Both ways in z for each direction.
    half = 0.5 * length * np.concatenate([way, way * (1, 1, -1)])
    return (middles - half).reshape(-1, 3), (middles + half).reshape(-1, 3)


def slope(lengths, errors):
    return float(np.polyfit(np.log(lengths), np.log(errors), 1)[0])


def curve_of(display, index, slant):
    rows = []
    for length in LENGTHS:
        errors = chord_errors(display, index, *edges(display, length, slant))
        kept = errors[np.isfinite(errors)]
        if len(kept) > len(errors) / 2:
            middle = float(np.median(kept))
            most = float(kept.max())
            rows.append({"length": length, "median": middle, "worst": most, "edges": len(kept)})
    return rows


def length_for(rows, error):
    """Edge length at which the worst error reaches so many texels, by a power law between the rows; None beyond."""
    for a, b in pairwise(rows):
        if 0 < a["worst"] < error <= b["worst"]:
            share = np.log(error / a["worst"]) / np.log(b["worst"] / a["worst"])
            return float(a["length"] * (b["length"] / a["length"]) ** share)
    return None


def plot(result, path):
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, len(result["modules"]), figsize=(13, 5), sharey=True)
    for axis, module in zip(axes, result["modules"], strict=True):
        for slant, curve in module["slants"].items():
            rows = [r for r in curve["rows"] if r["worst"] > 1e-9]
            if rows:
                x = [r["length"] for r in rows]
                line = axis.loglog(x, [r["worst"] for r in rows], "-", label=f"{slant} degrees, worst")
                axis.loglog(x, [r["median"] for r in rows], ":", color=line[0].get_color(), label="  median")
        axis.axhline(0.5, color="black", linewidth=0.8)
        axis.set(title=f"{result['display']}, module {module['index']} at x = {module['x']:g} m", xlabel="edge, metres")
        axis.grid(visible=True, which="both", alpha=0.3)
    axes[0].set(ylabel="chord against true curve, texels (line: half a texel)", ylim=(1e-5, None))
    axes[0].legend()
    figure.tight_layout()
    figure.savefig(path, dpi=120)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("display", nargs="?", default="sample-a")
    parser.add_argument("--json", type=Path, default=RESULTS / "edges.json")
    options = parser.parse_args()
    display = find_display(options.display)
    modules = []
    for index in (len(display.modules) // 2, len(display.modules) - 1):
        slants = {}
        print(f"{display.name}, module {index} at x = {display.modules[index].x:g} m")
        for slant in SLANTS:
            rows = curve_of(display, index, slant)
            short = [r for r in rows if r["length"] <= 0.05]
            curved = rows[0]["worst"] > 1e-9
            found = slope([r["length"] for r in short], [r["worst"] for r in short]) if curved else None
            limit = length_for(rows, 0.5)
            slants[slant] = {"slope": found, "half_texel_at": limit, "rows": rows}
            at = {r["length"]: float(f"{r['worst']:.3g}") for r in rows[::2]}
            print(
                f"  slant {slant:2d}: slope {found and round(found, 3)}, half a texel at {limit and round(limit, 4)} m"
            )
            print("   ", at)
        modules.append({"index": index, "x": display.modules[index].x, "slants": slants})
    options.json.parent.mkdir(exist_ok=True)
    result = {"machine": describe_machine(1), "display": display.name, "modules": modules}
    options.json.write_text(json.dumps(result, indent=1))
    plot(json.loads(options.json.read_text()), options.json.with_suffix(".png"))


if __name__ == "__main__":
    main()
