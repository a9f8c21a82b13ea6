"""Which C function does what which kernel does, and how its arguments come from the kernel's."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from stages import Baseline

from lfssao.ao.kernels import ssao
from lfssao.ao.kernels.spans import CHUNK
from lfssao.optics.kernels.projection import MATRIX

ESTIMATORS = "lfssao.ao.estimators."
KERNELS = ESTIMATORS + "kernels."
FILTERS = ("rotated", "arithmetic", "harmonic", "min", "max")


def _transformed(offsets: Any, projection: Any) -> Any:
    """The offsets after the mapping's linear part, (n, 4)."""
    return np.ascontiguousarray(ssao.transform_offsets(offsets, projection, None)[:, 2])


def _size(a: Any) -> list[int]:
    return [a.shape[1], a.shape[0]]


def _seen(view: Any, radius: Any, occlusion: Any) -> list[Any]:
    """A view of formulas as ``_scene`` has it, and its rightward direction; the second axis is not read."""
    textures = [view.depth, view.positions, view.directions, view.normals]
    return [*_size(occlusion), *textures, view.rows, view.lens, view.axes, radius]


def _mapping(view: Any) -> Any:
    """The numbers of a module's mapping: rows u, v and z, and the lens."""
    return np.concatenate([view.rows[:8], view.rows[12:], view.lens])


def _points(a: Sequence[Any]) -> list[Any]:
    view, ball, occlusion, _ = a
    samples = [ball.mirrors, len(ball.points), ball.points, ball.weights, int(ball.tangent)]
    return [*_seen(view, ball.radius, occlusion), *samples, ball.thick, occlusion]


def _lines(a: Sequence[Any]) -> list[Any]:
    view, disk, occlusion, _ = a
    samples = [disk.mirrors, len(disk.points), disk.points, disk.half, disk.weights, int(disk.tangent)]
    return [*_seen(view, disk.radius, occlusion), *samples, disk.thickness, occlusion]


def _fan(a: Sequence[Any]) -> list[Any]:
    """The arguments that horizons and slices share: scene, reflections, and steps along directions."""
    view, fan, occlusion, _ = a
    mirrors = np.ascontiguousarray(np.tile(fan.mirrors, CHUNK // fan.mirrors.shape[2]))
    return [*_seen(view, fan.radius, occlusion), mirrors, len(fan.points), fan.points, fan.steps]


def _fraction(a: Sequence[Any]) -> list[Any]:
    view, ball, occlusion, _ = a
    offsets = ball.points
    numbers = _mapping(view)
    x, y, z = numbers[:12].reshape(3, 4)[:, :3].T
    moved = np.zeros((len(offsets), 4), offsets.dtype)
    moved[:, :3] = (offsets[:, :1] * x + offsets[:, 1:2] * y) + offsets[:, 2:] * z
    textures = (view.depth, view.positions, view.normals)
    half = int(ball.half is not None)
    return [*_size(occlusion), len(offsets), *textures, offsets, moved, numbers, half, occlusion]


def _alchemy(a: Sequence[Any]) -> list[Any]:
    view, taps, occlusion, _ = a
    textures = view.depth, view.positions, view.normals, view.directions
    scalars = taps.radius, taps.beta, taps.epsilon, taps.scale
    given = [*textures, taps.points, view.turns, _mapping(view), taps.away, *scalars, occlusion]
    return [*_size(occlusion), len(taps.points), *given]


def _oriented(a: Sequence[Any]) -> list[Any]:
    view, ball, occlusion, _ = a
    textures = view.depth, view.positions, view.normals
    given = [*textures, ball.points, view.turns, view.axes, _mapping(view), ball.radius, ball.reach, ball.bias]
    return [*_size(occlusion), len(ball.points), *given, occlusion]


def _sampling(a: Sequence[Any]) -> list[Any]:
    view, sao, sums, _ = a
    scalars = [sao.reach_u, sao.reach_v, sao.inverse, sao.cubed, sao.bias, sao.depth_bias, sao.origin, sao.epsilon]
    return [
        *_size(sums), view.depth, *view.levels, len(view.levels.first), view.positions, view.normals,
        view.turns, sao.points, len(sao.points), view.rays.numbers, view.rays.world, np.array(scalars, np.float32),
        sao.log_q, sums,
    ]  # fmt: skip


def _area(a: Sequence[Any]) -> list[Any]:
    view, disk, occlusion, _ = a
    samples = [disk.mirrors, len(disk.points), disk.points, disk.half, disk.weights, disk.finer]
    pyramid = [*view.moments_of, len(view.moments_of.pitches)]
    return [*_seen(view, disk.radius, occlusion), *samples, *pyramid, disk.half_width, disk.thickness, occlusion]


BASELINES = (
    Baseline("lfssao.ao.ssao.ssao.unproject", "LF Algorithm 1, lines 1 to 3", "unproject",
             lambda a: [*_size(a[0]), *a], (2,)),
    Baseline("lfssao.ao.ssao.ssao.algorithm2", "LF Algorithms 1 and 2", "algorithm2",
             lambda a: [*_size(a[0]), len(a[2][0]), a[0], a[1], _transformed(a[2][0], a[3]), a[3].numbers,
                        int(a[3].kind == MATRIX), a[5]], (5,)),
    Baseline("lfssao.ao.post.post_kernels.blur_horizontal", "Gaussian blur, rows", "blur_horizontal",
             lambda a: [*_size(a[0]), a[0], a[1], len(a[1]), a[2]], (2,)),
    Baseline("lfssao.ao.post.post_kernels.blur_vertical", "Gaussian blur, columns", "blur_vertical",
             lambda a: [*_size(a[0]), a[0], a[1], len(a[1]), a[2]], (2,)),
    Baseline("lfssao.ao.formulas.sum_samples", "Alchemy, taps", "alchemy", _alchemy, (2,), "Alchemy"),
    Baseline("lfssao.ao.formulas.sum_samples", "oriented hemisphere", "oriented", _oriented, (2,), "Hemisphere"),
    Baseline("lfssao.ao.textures.write_directions", "viewing directions", "directions",
             lambda a: [*_size(a[2]), *a[0], *a[1:]], (2,)),
    Baseline(ESTIMATORS + "sao.texel_rays.linear_depth", "linear z", "linear_depth",
             lambda a: [*_size(a[0]), a[0], *a[2:]], (5,)),
    Baseline(ESTIMATORS + "sao.estimator.rebuild_positions", "positions from z", "positions",
             lambda a: [*_size(a[1]), a[0].depth, a[0].rays.numbers, a[0].rays.world, a[1]], (1,)),
    Baseline(ESTIMATORS + "sao.estimator.face_normals", "face normals", "face_normals",
             lambda a: [*_size(a[1]), a[0].depth, a[0].positions, a[0].rays.numbers, a[0].rays.world, a[1]], (1,)),
    Baseline(ESTIMATORS + "sao.estimator.sum_samples", "SAO taps", "sampling", _sampling, (2,), "Sao"),
    Baseline(ESTIMATORS + "sao.estimator.average_quads", "2x2 average", "quads", lambda a: [*_size(a[0]), *a], (3,)),
    Baseline(ESTIMATORS + "sao.estimator.passes.through_bytes", "packing", "through_bytes",
             lambda a: [*_size(a[0]), *a], (2, 3)),
    Baseline(ESTIMATORS + "sao.estimator.bilateral", "bilateral", "bilateral",
             lambda a: [*_size(a[0]), *a[:3], a[4], int(a[3][0] == 0), a[5]], (5,)),
    Baseline(ESTIMATORS + "sao.estimator.passes.occlusion_of", "occlusion of A", "occlusion_of",
             lambda a: [*_size(a[0]), a[0], a[1], a[3]], (3,)),
    Baseline(ESTIMATORS + "vo.volume.sum_samples", "VO points", "vo_points", _points, (2,), "Points"),
    Baseline(ESTIMATORS + "vo.volume.sum_samples", "VO lines", "vo_lines", _lines, (2,), "Lines"),
    Baseline(ESTIMATORS + "vo.volume.sum_samples", "VO area", "vo_area", _area, (2,), "Areas"),
    Baseline("lfssao.ao.moments.kernels.write_half", "pyramid of moments", "moments_half",
             lambda a: [a[2], a[3], a[0], a[1], a[4], float(a[5]), float(a[6])], (0,)),
    Baseline("lfssao.ao.formulas.fold_steps", "horizons", "hbao", lambda a: [*_fan(a), a[2]], (2,), "Horizons"),
    Baseline("lfssao.ao.formulas.fold_steps", "slices", "gtao", lambda a: [*_fan(a), a[1].first, a[2]], (2,), "Arcs"),
    Baseline("lfssao.ao.formulas.sum_samples", "points with options", "share_behind", _fraction, (2,), "Points"),
    Baseline(KERNELS + "multiresolution.first_level", "multiresolution, halve", "first_level",
             lambda a: [*_size(a[0]), *a], (1,)),
    Baseline(KERNELS + "multiresolution.halve", "multiresolution, halve", "halve",
             lambda a: [*_size(a[1]), *a], (2,)),
    Baseline(KERNELS + "multiresolution.level_occlusion", "multiresolution, levels", "level_occlusion",
             lambda a: [*_size(a[0]), *a[:4], *a[5:7]], (6,)),
    Baseline(KERNELS + "multiresolution.refine", "multiresolution, upsample", "refine",
             lambda a: [*_size(a[0]), *a], (7, 8)),
    Baseline(ESTIMATORS + "sao.hierarchy.z_pyramid.next_level", "z hierarchy", "next_level",
             lambda a: [*_size(a[0]), a[0], int(a[1]), a[2], a[3]], (3,)),
)  # fmt: skip
