"""XeGTAO and Bevy's bitmask against evaluations of their own, texel by texel (``helpers/noise_slices``)."""

import noise_slices
import numpy as np
import pytest

from lfssao import Camera, RayCaster, builtin_scene
from lfssao.ao.estimators.registry import estimate, find_estimator, full_parameters
from lfssao.ao.formulas import cast_depth
from lfssao.ao.textures import Buffers
from lfssao.samples.rotation import noise_turns

R = 0.3
NOISE = noise_slices.hilbert_noise()


def corner():
    """Textures of the corner in float64 with XeGTAO's noise."""
    mesh = builtin_scene("corner")
    view = Camera.looking_at(mesh.bounds).view(40, 30)
    made = Buffers.of(RayCaster(mesh, view.cast_from_world).gbuffer(view, normals="geometric"), view)
    depth, positions, normals = (x.astype(np.float64) for x in (made.depth, made.positions, made.normals))
    turns = noise_turns(NOISE.astype(np.float64), 30, 40, np.dtype(np.float64))
    return Buffers(view, depth, positions, normals, turns)


def frame_of(seen):
    axes = seen.view.world_from_cast[:, :3]
    return noise_slices.Frame(cast_depth(seen), seen.normals @ axes, seen.view.lens[:4])


@pytest.mark.parametrize("changed", [
    {}, {"slices": 2, "steps": 2}, {"root": "exact", "snap": False}, {"thin": 0.7, "falloff": 0.3, "longer": 0.0},
    {"squared": False, "power": 1.0, "multiplier": 0.7, "nearer": 0.99, "nearest": 0.0},
])  # fmt: skip
def test_xegtao_is_that_of_its_own_evaluation(changed):
    seen = corner()
    options = full_parameters(find_estimator("xegtao"), {"border": "clamp", **changed})
    made = estimate("xegtao", seen, R, **options).texture
    frame = frame_of(seen)
    rows, columns = np.nonzero(seen.depth < np.inf)
    chosen = np.random.default_rng(0).choice(len(rows), 60, replace=False)
    for row, column in zip(rows[chosen], columns[chosen], strict=True):
        right = noise_slices.xegtao(frame, seen.turns[:, row, column], R, row, column, options)
        assert made[row, column] == pytest.approx(min(max(right, 0.0), 1.0), abs=1e-6), (row, column)


@pytest.mark.parametrize("changed", [
    {}, {"slices": 2, "steps": 5, "thickness": 0.1}, {"unit": True, "square": True, "nearer": 0.01},
])  # fmt: skip
def test_bevys_bitmask_is_that_of_its_own_evaluation(changed):
    cleared = {"border": "clamp", "filter": "linear", "background": "cleared", "cleared": 1e12}
    seen = corner()
    options = full_parameters(find_estimator("bevy-ssao"), {**cleared, **changed})
    made = estimate("bevy-ssao", seen, R, **options).texture
    frame = frame_of(seen)
    rows, columns = np.nonzero(seen.depth < np.inf)
    chosen = np.random.default_rng(1).choice(len(rows), 60, replace=False)
    near = seen.view.lens[4]
    for row, column in zip(rows[chosen], columns[chosen], strict=True):
        right = noise_slices.bevy(frame, seen.turns[:, row, column], R, row, column, near, options)
        assert made[row, column] == pytest.approx(right, abs=1e-6), (row, column)
