"""The picture of the estimators' benchmark."""

from pathlib import Path
from typing import Any


def plot(result: dict[str, Any], path: Path) -> None:
    """Times of the estimators and of C on all scenes, and ratios of every row."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, 2, figsize=(15, 13))
    marks = dict(zip(result["tables"], ("o", "s", "."), strict=True))
    names = list(result["tables"]["relief"])[::-1]
    for scene, table in result["tables"].items():
        rows = [table[name] for name in names]
        ours = [row["ms_per_megapixel"][1] for row in rows]
        axes[0].plot(ours, names, marks[scene], label=f"lfssao, {scene}")
        axes[0].plot(
            [row["c_ms_per_megapixel"][1] for row in rows], names, marks[scene], mfc="none", label=f"C, {scene}"
        )
        low, middle, high = zip(*(row["c_ratio"] for row in rows), strict=True)
        spread = [[b - a for a, b in zip(low, middle, strict=True)], [c - b for b, c in zip(middle, high, strict=True)]]
        axes[1].errorbar(middle, names, xerr=spread, fmt=marks[scene], label=scene)
    for x, style in ((1, "-"), (3, "--")):
        axes[1].axvline(x, color="grey", linestyle=style)
    axes[1].tick_params(labelleft=False)
    axes[0].set(xlabel="ms / Mpixel", xscale="log")
    axes[1].set(xlabel="time of plain C over lfssao's", xscale="log")
    for axis in axes:
        axis.grid(visible=True, which="both", alpha=0.3)
        axis.legend()
    figure.tight_layout()
    figure.savefig(path, dpi=100)
