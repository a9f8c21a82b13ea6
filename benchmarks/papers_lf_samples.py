"""The LF paper's section 6, measured and judged."""

from functools import partial

import numpy as np
from cpu_times import least
from papers_common import Found, Judged, Scale
from papers_lf import model

import lfssao
from lfssao.viz.samplers import draw_sampling_error, sampling_error


def few_samples(scale: Scale) -> Found:
    """Section 6."""
    mesh = lfssao.builtin_scene("ammonite")
    view = lfssao.module_views(mesh, lfssao.find_display("sample-a").with_resolution(*scale.size(200, 120)), [10])[0]
    buffers = lfssao.Buffers.of(lfssao.RayCaster(mesh, view.cast_from_world).gbuffer(view), view)
    radius, counts = lfssao.default_radii(mesh)[3], [4, 8, 16, 32, 64]
    found = sampling_error(
        buffers, radius, ("random", "jittered", "latin", "poisson"), counts, reference=("sobol", 1024)
    )
    scale.save("lf-section-6", draw_sampling_error(found))
    m = model(mesh, scale.size(1024, 768))
    arrays = m.gbuffer.depth, m.gbuffer.positions, m.view.world_to_image
    sets = {str(n): lfssao.make_samples("latin", n) for n in counts}
    times = least({n: partial(lfssao.algorithm2, *arrays, s, radius) for n, s in sets.items()}, scale.repeats(20))
    rows = {f"RMSE, {name}": dict(zip(sets, errors.tolist(), strict=True)) for name, errors in found.rmse.items()}
    return {"rows": rows | {"ms": {n: row["ms"] for n, row in times.items()}}}


def judge_few_samples(found: Found, limit: float) -> Judged:
    ms = found["rows"]["ms"]
    n, t = np.array([int(each) for each in ms]), np.array(list(ms.values()))
    bend = float(np.abs(np.polyval(np.polyfit(n, t, 1, w=1 / t), n) / t - 1).max())
    random, *placed = (row["8"] for name, row in found["rows"].items() if name != "ms")
    holds = max(placed) < random, bend <= limit
    return all(holds), any(holds), {"random": random, "low": min(placed), "high": max(placed), "bend": bend}


CLAIMS = {
    "LF section 6": (few_samples, judge_few_samples),
}
