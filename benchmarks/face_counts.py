"""LF's table 1: whether the time of SSAO depends on the number of faces.

A shader runs at every texel; ours leaves texels without a surface out. So the models are measured twice: each as large
as it is shown by default, and all so far away that they cover as much of the picture as the one that covers least.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from lfssao.display_file import find_display
from lfssao.raycast import RayCaster
from lfssao.rendering import Settings, default_radii, module_views, render_view
from lfssao.scene.builtin import builtin_scene
from lfssao.scene.mesh import Mesh
from lfssao.view import View

MODELS = ("statue", "ammonite", "armadillo")
FACE_COUNT_STEPS = len(MODELS)

# LF table 1, milliseconds of each model without and with SSAO; their difference is SSAO's.
LF_MILLISECONDS = {"statue": (0.79, 7.25), "ammonite": (1.62, 8.05), "armadillo": (2.48, 8.96)}

_SSAO = ("ao", "merge", "blur", "shade")


@dataclass(frozen=True, eq=False)
class _Case:
    """A model in one view; cover: the share of texels with a surface."""

    mesh: Mesh
    view: View
    caster: RayCaster
    settings: Settings
    cover: float


def spread_per_cent(values: list[float]) -> float:
    """Greatest less least, of their mean."""
    return 100 * (max(values) - min(values)) * len(values) / sum(values)


def measure_face_counts(frames: int, threads: int, tick: Callable[[str], None]) -> dict[str, Any]:
    """Mean milliseconds of a frame with and without SSAO, 1024x768, the models in turn.

    Parameters
    ----------
    frames : int
        Frames of each model, after one that may compile.
    threads : int
        Threads of the ray caster.
    tick : callable
        Called with each model's name.
    """
    shown = []
    for name in MODELS:
        tick(f"face counts: {name}")
        shown.append(_case(builtin_scene(name), 1.0, threads))
    least = min(case.cover for case in shown)
    away = [_covering(case, least, threads) for case in shown]
    theirs = [after - before for before, after in LF_MILLISECONDS.values()]
    return {
        "frames": frames,
        "as_shown": _measured(shown, frames),
        "equal_cover": _measured(away, frames),
        "lf_ms": {name: list(pair) for name, pair in LF_MILLISECONDS.items()},
        "lf_spread_per_cent": spread_per_cent(theirs),
    }


def _case(mesh: Mesh, scale: float, threads: int) -> _Case:
    """A model with a box around it, so many times as large as its own, fitted into the display."""
    middle = mesh.bounds.mean(axis=0)
    view = module_views(mesh, find_display("virtual"), bounds=middle + scale * (mesh.bounds - middle))[0]
    caster, settings = RayCaster(mesh, view.cast_from_world, threads), Settings(default_radii(mesh))
    triangle = render_view(caster, view, settings).gbuffer.triangle
    return _Case(mesh, view, caster, settings, float(np.mean(triangle >= 0)))


def _covering(case: _Case, cover: float, threads: int) -> _Case:
    """The same model, its box enlarged until it covers that share, within one in a hundred of it."""
    scale, now = 1.0, case
    for _ in range(8):
        if abs(now.cover / cover - 1) <= 0.01:
            break
        scale *= (now.cover / cover) ** 0.5
        now = _case(case.mesh, scale, threads)
    return now


def _measured(cases: list[_Case], frames: int) -> dict[str, Any]:
    without, ssao = np.empty((len(cases), frames)), np.empty((len(cases), frames))
    for frame in range(frames):
        for k, case in enumerate(cases):
            start = time.perf_counter()
            seconds = render_view(case.caster, case.view, case.settings).seconds
            whole = time.perf_counter() - start
            ssao[k, frame] = 1e3 * sum(seconds[name] for name in _SSAO)
            without[k, frame] = 1e3 * whole - ssao[k, frame]
    texels = cases[0].view.width * cases[0].view.height
    rows: list[dict[str, Any]] = []
    for name, case, a, b in zip(MODELS, cases, without, ssao, strict=True):
        mean = float(b.mean())
        rows.append({
            "model": name, "faces": len(case.mesh.faces), "cover": case.cover, "without_ms": float(a.mean()),
            "ssao_ms": mean, "with_ms": float(a.mean()) + mean, "ssao_median_ms": float(np.median(b)),
            "ns_per_covered_texel": 1e6 * mean / (case.cover * texels),
        })  # fmt: skip
    spread = {
        f"{key}_spread_per_cent": spread_per_cent([row[key] for row in rows])
        for key in ("ssao_ms", "ssao_median_ms", "ns_per_covered_texel")
    }
    return {"rows": rows, **spread}
