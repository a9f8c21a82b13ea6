"""LF's table 1: whether the time of SSAO depends on the number of faces."""

import time
from collections.abc import Callable
from typing import Any

from lfssao.display_file import find_display
from lfssao.raycast import RayCaster
from lfssao.rendering import Settings, default_radii, module_views, render_view
from lfssao.scene.builtin import builtin_scene

MODELS = ("statue", "ammonite", "armadillo")

# LF table 1, milliseconds of SSAO: the least and the greatest of its three models.
LF_MILLISECONDS = (6.43, 6.48)

_SSAO = ("ao", "merge", "blur", "shade")


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
    prepared = []
    for name in MODELS:
        tick(f"face counts: {name}")
        mesh = builtin_scene(name)
        view = module_views(mesh, find_display("virtual"))[0]
        caster, settings = RayCaster(mesh, view.cast_from_world, threads), Settings(default_radii(mesh))
        surface = (render_view(caster, view, settings).gbuffer.triangle >= 0).mean()
        prepared.append((mesh, view, caster, settings, float(surface)))
    without, ssao = [0.0] * len(MODELS), [0.0] * len(MODELS)
    for _ in range(frames):
        for k, (_, view, caster, settings, _) in enumerate(prepared):
            start = time.perf_counter()
            seconds = render_view(caster, view, settings).seconds
            whole = time.perf_counter() - start
            passes = sum(seconds[name] for name in _SSAO)
            ssao[k] += 1e3 * passes / frames
            without[k] += 1e3 * (whole - passes) / frames
    rows = [
        {"model": name, "faces": len(mesh.faces), "surface": surface, "without_ms": a, "ssao_ms": b, "with_ms": a + b}
        for name, (mesh, *_, surface), a, b in zip(MODELS, prepared, without, ssao, strict=True)
    ]
    return {
        "frames": frames, "rows": rows, "spread_per_cent": spread_per_cent(ssao),
        "lf_ms": list(LF_MILLISECONDS), "lf_spread_per_cent": spread_per_cent(list(LF_MILLISECONDS)),
    }  # fmt: skip
