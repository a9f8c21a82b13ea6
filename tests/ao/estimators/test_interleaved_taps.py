"""Godot 4's SSAO against an evaluation of its own, texel by texel (``helpers/interleaved_taps``)."""

import interleaved_taps
import numpy as np
import pytest

from lfssao import Camera, RayCaster, builtin_scene
from lfssao.ao.estimators.registry import estimate, find_estimator, full_parameters
from lfssao.ao.formulas import cast_depth
from lfssao.ao.textures import Buffers
from lfssao.errors import InputError


def corner(width=40, height=30, **changed):
    mesh = builtin_scene("corner")
    view = Camera.looking_at(mesh.bounds, **changed).view(width, height)
    made = Buffers.of(RayCaster(mesh, view.cast_from_world).gbuffer(view, normals="geometric"), view)
    return Buffers(view, *(x.astype(np.float64) for x in (made.depth, made.positions, made.normals)))


@pytest.mark.parametrize(("radius", "changed"), [
    (0.5, {}), (2.0, {"power": 1.0, "horizon": 0.2}), (9.0, {"intensity": 9.0}),
    (1.0, {"fade_from": 1.0, "fade_to": 20.0}),
])  # fmt: skip
def test_godots_ssao_is_that_of_its_own_evaluation(radius, changed):
    seen = corner()
    options = full_parameters(find_estimator("godot-4"), changed)
    made = estimate("godot-4", seen, radius, **options).texture
    axes = seen.view.world_from_cast[:, :3]
    depth = cast_depth(seen)
    rows, columns = np.nonzero(depth < np.inf)
    chosen = np.random.default_rng(2).choice(len(rows), 60, replace=False)
    for row, column in zip(rows[chosen], columns[chosen], strict=True):
        right = interleaved_taps.godot(depth, seen.normals @ axes, seen.view.lens[:4], radius, row, column, options)
        assert made[row, column] == pytest.approx(right, abs=1e-6), (row, column)
    assert made.max() > 0.05


def test_godots_obscurance_may_end_at_once():
    assert not estimate("godot-4", corner(), 0.5, fade_from=1.0, fade_to=1.0).texture.any()


@pytest.mark.parametrize(("changed", "words"), [
    ({"projection": "orthographic"}, "measures texels of a perspective camera"),
    ({"width": 39}, "has passes of a half, and the texture has 39 x 30 texels"),
])  # fmt: skip
def test_godots_ssao_is_refused_without_halves_and_perspective(changed, words):
    with pytest.raises(InputError, match=words):
        estimate("godot-4", corner(**changed), 0.5)
