"""Error of estimators against their time, by their settings, and the setting beyond which more time brings little."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from time import perf_counter
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from lfssao.ao.estimators.registry import estimate, find_estimator
from lfssao.ao.textures import Buffers
from lfssao.viz.panels import mark_decades
from lfssao.viz.truth import Texture, deviation, half_space


@dataclass(frozen=True, eq=False)
class TimedError:
    """Error and time of one estimator, by its settings."""

    labels: list[str]  # of the settings
    milliseconds: NDArray[np.float64]  # (c,) float64: least time of the estimator, compiled
    rmse: NDArray[np.float64]  # (c,) float64: root mean square of occlusion less the truth, over the surface texels

    def enough(self, within: float = 0.1) -> int:
        """Return the number of the first setting whose error exceeds the least by no more than that share of it."""
        return int(np.argmax(self.rmse <= (1 + within) * self.rmse.min()))


def least_seconds(run: Callable[[], object], times: int = 2) -> float:
    """Return the least time of some runs, s, after one that is not timed, which compiles or loads the kernels."""
    run()
    seconds = []
    for _ in range(times):
        start = perf_counter()
        run()
        seconds.append(perf_counter() - start)
    return min(seconds)


def error_by_time(
    buffers: Buffers, radius: float, settings: Mapping[str, Mapping[str, Mapping[str, Any]]], truth: Texture
) -> dict[str, TimedError]:
    """Return error and time of estimators against a truth, (H, W), occlusion of the half space.

    Settings are, by the estimator's name and a label, keywords of ``lfssao.estimate``. Samples turn as they do in a
    render by default. Occlusion of the whole ball becomes that of the half space (``half_space``). InputError as
    ``estimate`` and ``deviation``.
    """
    surface = np.isfinite(buffers.depth)
    found = {}
    for name, by_label in settings.items():
        estimator = find_estimator(name)
        turned = buffers if estimator.rotation == "none" else buffers.turned(estimator.rotation)
        milliseconds = []
        rmse = []
        for words in by_label.values():
            texture = estimate(name, turned, radius, **words).texture
            rmse.append(deviation(half_space(texture) if estimator.whole_ball else texture, truth, surface).rmse)
            run = partial(estimate, name, turned, radius, **words)
            milliseconds.append(1000 * least_seconds(run, 9))
        found[name] = TimedError(list(by_label), np.array(milliseconds), np.array(rmse))
    return found


def draw_error_by_time(found: Mapping[str, TimedError], reference: str = "rays") -> Figure:
    """Return a figure of errors over times on logarithmic axes: a line an estimator, a ring where time is enough."""
    figure = Figure(figsize=(7.5, 4.5), layout="constrained")
    axes = figure.add_subplot(xscale="log", yscale="log", xlabel="time of the kernel, ms", ylabel="RMSE of ao")
    for (name, each), marker in zip(found.items(), "osD^vP*X" * len(found), strict=False):
        (line,) = axes.plot(each.milliseconds, each.rmse, marker=marker, markersize=5, label=name)
        for label, x, y in zip(each.labels, each.milliseconds, each.rmse, strict=True):
            axes.annotate(label, (x, y), (3, 4), textcoords="offset points", fontsize="x-small", color=line.get_color())
        k = each.enough()
        axes.plot(each.milliseconds[k], each.rmse[k], "o", markersize=13, fillstyle="none", color=line.get_color())
    axes.plot([], [], "o", markersize=10, fillstyle="none", color="gray", label="within 10 % of its least error")
    mark_decades(axes, "xy")
    axes.grid(alpha=0.3)
    axes.set_title(f"against {reference}", fontsize="medium")
    axes.legend(fontsize="small")
    return figure
