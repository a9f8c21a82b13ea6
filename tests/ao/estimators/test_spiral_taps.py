"""Filament's SAO and GTAO against evaluations of their own, texel by texel (``helpers/spiral_taps``)."""

import numpy as np
import pytest
import spiral_taps

from lfssao import Camera, RayCaster, builtin_scene, find_display, module_views
from lfssao.ao.estimators.registry import estimate, find_estimator, full_parameters
from lfssao.ao.formulas import cast_depth
from lfssao.ao.textures import Buffers
from lfssao.errors import InputError
from lfssao.samples.rotation import noise_turns

SIZE = 64, 48  # whole numbers of texels of the levels that are read


def corner():
    mesh = builtin_scene("corner")
    view = Camera.looking_at(mesh.bounds).view(*SIZE)
    made = Buffers.of(RayCaster(mesh, view.cast_from_world).gbuffer(view, normals="geometric"), view)
    depth, positions, normals = (x.astype(np.float64) for x in (made.depth, made.positions, made.normals))
    noise = np.random.default_rng(3).random((*SIZE[::-1], 2))
    return Buffers(view, depth, positions, normals, noise_turns(noise, *SIZE[::-1], np.dtype(np.float64)))


def frame_of(seen, beyond=np.inf):
    depth = cast_depth(seen)
    normals = seen.normals @ (seen.view.world_from_cast[:, :3] * [1, 1, -1])
    return spiral_taps.Frame(np.where(depth < np.inf, depth, beyond), normals, seen.view.lens[:4])


def chosen_texels(seen):
    """Rows from below and columns of texels that show a surface."""
    rows, columns = np.nonzero(seen.depth[::-1] < np.inf)
    chosen = np.random.default_rng(1).choice(len(rows), 60, replace=False)
    return list(zip(rows[chosen], columns[chosen], strict=True))


@pytest.mark.parametrize(("radius", "changed"), [
    (0.3, {}), (2.0, {"taps": 11, "turns": 6.0}), (0.6, {"horizon": 20.0, "bias": 0.01, "power": 0.5}),
    (3.0, {"max_level": 1, "intensity": 0.5}),
])  # fmt: skip
def test_filaments_sao_is_that_of_its_own_evaluation(radius, changed):
    seen = corner()
    options = full_parameters(find_estimator("filament-sao"), {"border": "clamp", **changed})
    made = estimate("filament-sao", seen, radius, **options).texture[::-1]
    frame = frame_of(seen)
    for row, column in chosen_texels(seen):
        right = spiral_taps.filament(frame, seen.turns[0, ::-1][row, column], radius, row, column, options)
        assert made[row, column] == pytest.approx(right, abs=1e-6), (row, column)
    assert made.max() > 0.1


@pytest.mark.parametrize(("radius", "changed"), [
    (0.3, {}), (3.0, {"max_level": 1}), (1.0, {"slices": 2, "steps": 5, "thickness": 0.1, "power": 1.5}),
    (0.6, {"intensity": 0.7, "background": "open"}),
])  # fmt: skip
def test_filaments_gtao_is_that_of_its_own_evaluation(radius, changed):
    given = {"border": "clamp", "background": "cleared", "cleared": 1e12, **changed}
    seen = corner()
    options = full_parameters(find_estimator("filament-gtao"), given)
    open_there = given["background"] == "open"
    made = estimate("filament-gtao", seen, radius, **options).texture[::-1]
    frame = frame_of(seen, np.inf if open_there else 1e12)
    for row, column in chosen_texels(seen):
        right = spiral_taps.filament_gtao(frame, seen.turns[:, ::-1][:, row, column], radius, row, column, options)
        assert made[row, column] == pytest.approx(right, abs=1e-6), (row, column)
    assert made.max() > 0.1


def test_filaments_gtao_reads_its_levels_without_a_filter():
    with pytest.raises(InputError, match="filament-gtao reads levels of depth"):
        estimate("filament-gtao", corner(), 0.3, filter="linear")


@pytest.mark.parametrize("name", ["filament-sao", "filament-gtao", "xegtao", "bevy-ssao"])
def test_shaders_that_divide_by_depth_are_refused_without_perspective(name):
    module = module_views(builtin_scene("corner"), find_display("sample-a").with_resolution(4, 3), range(4, 5))[0]
    orthographic = Camera("orthographic", (0, 0, 2), (0, 0, 0), (0, 1, 0), 1.0, 1.0, 3.0).view(4, 3)
    empty = np.zeros((3, 4), np.float32)
    for view in (module, orthographic):
        seen = Buffers(view, empty, np.zeros((3, 4, 3), np.float32), np.ones((3, 4, 3), np.float32), None)
        with pytest.raises(InputError, match=f"{name} measures texels of a perspective camera"):
            estimate(name, seen, 1.0)
