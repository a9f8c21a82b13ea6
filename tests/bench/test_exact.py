"""Exact values of stability: those of the textbook, inside the intervals, and of every estimator in the registry."""

import sys
from dataclasses import replace

import numpy as np
import planted_estimator
import pytest
from reference import kit, textbook

from lfssao.ao.estimators.registry import ESTIMATORS, find_estimator
from lfssao.ao.estimators.sao.texel_rays import texel_rays
from lfssao.ao.textures import Buffers
from lfssao.bench.stability import conditions, occlusions
from lfssao.bench.stability.inputs import UNCHANGED, display, general_view
from lfssao.bench.stability.measure import Exact, Stiff
from lfssao.bench.stability.occlusions import LEVELS, SAMPLED, compute
from lfssao.bench.stability.table import DEGRADED, WITHIN, Case
from lfssao.bench.stability.tracked import Arithmetic
from lfssao.optics.camera import PROJECTIONS
from lfssao.optics.display_file import find_display
from lfssao.optics.kernels.projection import DISPLAY
from lfssao.verify.bounds.points import point_bounds
from lfssao.verify.kit.views import described, view_numbers

FORMULAS = tuple(name for name in ESTIMATORS if find_estimator(name).reads_texels)
FILTERED = tuple(name for name in ESTIMATORS if find_estimator(name).filtered)
EXACT = (*FORMULAS, *FILTERED, *SAMPLED, LEVELS)
PASSES = {"quad_edge": 0.0, "gauss": 0.0}  # behind SAO's sampling pass there are none
# Parameters in tests of exact occlusion: words that the defaults do not name, taps that turn by the hash alone.
OPTIONS = {"sao": PASSES, "sao-equation-1": {
    **PASSES, "landing": "nearest", "angle_sum": "float32", "log_q": 0, "mip": "harmonic",
}}  # fmt: skip
HASHED = ("sao-equation-1",)


def exact_image(view, point):
    """U, v and z of a point; None outside the domain."""
    case = Stiff(view, np.array(point).reshape(1, 1, 3), np.zeros(3), np.zeros((1, 1), np.float32))
    (u, v, in_domain), z = Exact(case, Arithmetic()).image((0, 0))
    return [float(number.value) for number in (u, v, z)] if in_domain else None


@pytest.mark.parametrize("kind", ["convex", "picoarray", "linear", "conical"])
def test_exact_images_are_those_of_the_textbook(kind):
    """With and without distortion of the lens, of points between observers and lens; outside there is no image."""
    given = replace(display(), diffuser=kind) if kind in ("linear", "conical") else find_display(kind)
    distorted = replace(given, modules=(replace(given.modules[0], k1=-0.05, k2=0.01),))
    for view in (general_view(distorted, 0), *([given.view(0, UNCHANGED)] if kind == "linear" else [])):
        shown_by = distorted if view.world_to_image.kind == DISPLAY else given
        d, (low, high) = shown_by.module_numbers(0), np.array(given.roi)
        points = np.random.default_rng(3).uniform(low, high, (20, 3))
        exact = [exact_image(view, point) for point in points]
        seen = [(image, point) for image, point in zip(exact, points, strict=True) if image is not None]
        assert len(seen) >= 10
        for image, point in seen:
            right = textbook.image(d[:3], d[3:5], tuple(d[5:7]), d[7] != 0, d[8:17], d[17:22], point)
            assert image[:2] == pytest.approx(right, abs=1e-9)
        for beyond in (given.modules[0].z + 0.1, given.observer_z - 0.1):
            assert exact_image(view, (0.0, 0.0, beyond)) is None


SMALL = (12, 9)
SAMPLES = 6


def buffers_of(kind, dtype, turning, **how):
    made = conditions.buffers_of(kind, size=SMALL, **how)
    arrays = (each.astype(dtype) for each in (made.depth, made.positions, made.normals))
    buffers = Buffers(made.view, *arrays)
    return buffers.turned("hash") if turning else buffers


def exact_occlusion(name, buffers, radius, step=7):
    """Exact occlusion of some texels that show a surface, by number; of SAO without the passes behind its sampling."""
    made = compute(name, buffers, radius, SAMPLES, find_estimator(name).options(**OPTIONS.get(name, {})))
    exact = {texel: made.exact(texel) for texel in np.flatnonzero(np.isfinite(buffers.depth))[::step].tolist()}
    return {texel: 1 - a for texel, a in exact.items()} if name in SAMPLED else exact


@pytest.mark.parametrize("kind", conditions.VIEWS)
@pytest.mark.parametrize("name", EXACT)
def test_exact_occlusion_is_that_of_the_textbook(name, kind):
    """In float64 by an independent reader of the specification; samples turn from texel to texel."""
    estimator = find_estimator(name)
    buffers = buffers_of(kind, np.float64, estimator.turns and name not in HASHED)
    radius = 5 * conditions.texel_size(buffers)
    points, weights = estimator.default_samples(SAMPLES)
    given = {"points": points, "weights": weights, "turns": buffers.turns, "directions": buffers.directions}
    if (table := texel_rays(buffers.view, np.dtype(np.float64)).table) is not None:
        given["lines"] = table.T.reshape(*buffers.depth.shape, 4)
    inputs = {name: array for name, array in given.items() if array is not None}
    inputs |= {name: getattr(buffers, name) for name in ("depth", "positions", "normals")}
    parameters = {
        "estimator": name,
        "radius": radius,
        "options": {**estimator.parameters, **OPTIONS.get(name, {})},
        "mapping": described(buffers.view.world_to_image),
        "viewer_distance": buffers.view.viewer_distance().tolist(),
        "view": view_numbers(buffers.view),
    }
    right = kit.solve("estimator", parameters, inputs)["occlusion"].ravel()
    exact = exact_occlusion(name, buffers, radius)
    unknown = [texel for texel, made in exact.items() if made.error == np.inf]
    if name in SAMPLED:  # texels without a length: the next one has no ray
        assert all(kind == "curved" and buffers.depth.flat[texel + 1] == np.inf for texel in unknown)
    assert len(unknown) <= (0.2 * len(exact) if name in (*FILTERED, *SAMPLED) else 0)  # M2 - M1^2 cancels
    for texel in exact.keys() - unknown:
        least = 1e-9 if name in FILTERED else 1e-12
        assert float(exact[texel].value) == pytest.approx(right[texel], abs=least)
    assert any(made.value > 0.01 for made in exact.values())


@pytest.mark.parametrize("kind", conditions.VIEWS)
@pytest.mark.parametrize("name", EXACT)
def test_exact_occlusion_lies_inside_the_intervals(name, kind):
    estimator = find_estimator(name)
    for surface, texels in (("hills", 3.0), ("hills", 2.0**-8), ("planes an ulp apart", 2.0)):
        buffers = buffers_of(kind, np.float32, estimator.turns and name not in HASHED, surface=surface)
        radius = float(np.float32(texels * conditions.texel_size(buffers)))
        samples = estimator.default_samples(SAMPLES)
        options = {**estimator.parameters, **OPTIONS.get(name, {})}
        bounds = point_bounds(name, buffers, radius, *samples, options)
        if bounds is None:
            assert (name in FILTERED, kind in PROJECTIONS) == (True, True)
            continue
        for texel, made in exact_occlusion(name, buffers, radius, step=17).items():
            low, high = (np.nextafter(end.flat[texel], np.float32(way), dtype=np.float32)
                         for end, way in ((bounds.lower, -np.inf), (bounds.upper, np.inf)))  # fmt: skip
            assert float(low) <= made.value <= float(high)


def test_a_new_estimator_gets_rows_by_its_row_in_the_registry(monkeypatch):
    monkeypatch.setitem(sys.modules, "lfssao.ao.estimators.planted", planted_estimator)
    monkeypatch.setitem(ESTIMATORS.data, "crytek-sphere", "planted")
    monkeypatch.setattr("lfssao.core.jit._Cache.save_overload", lambda *_: None)  # other processes know no such type
    inputs = [(text, run) for name, text, run in occlusions.occlusions() if "float32" in name and "2^2" in text]
    rows = list(Case("", "", inputs, {"": (np.inf, "")}, ("crytek-sphere",)).rows())
    assert {row.verdict for row in rows} <= {WITHIN, DEGRADED}
    assert len(rows) == 2 * len(conditions.VIEWS)
    assert max(row.measured.error for row in rows) > 0
