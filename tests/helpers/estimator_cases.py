"""Textures for estimators and their reference: analytic surfaces in all kinds of view, with holes and wild numbers."""

import analytic_scenes as scenes
import numba
import numpy as np
from bits import assert_same_bits
from hypothesis import strategies as st
from reference.kit import solve

from lfssao import Buffers
from lfssao.ao.estimators.registry import ESTIMATORS
from lfssao.ao.estimators.sao.texel_rays import texel_rays
from lfssao.core.threads import kernel_threads
from lfssao.optics.view import KINDS
from lfssao.verify.kit.views import view_numbers

WILD = [0.0, -0.0, 0.5, -1.0, 2.0, 1e-30, -1e-30, 1e6, -1e30, 1e38]


@st.composite
def buffers(draw, dtype):
    """Buffers of few texels: some without a surface, some with a normal of 0, some with wild numbers."""
    width, height = draw(st.sampled_from([(1, 1), (1, 7), (9, 1), (30, 3)]) | st.tuples(*[st.integers(2, 9)] * 2))
    sight = scenes.SIGHTS[draw(st.sampled_from(list(scenes.SIGHTS)))](width, height)
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    hole = rng.random((height, width)) < draw(st.sampled_from([0.0, 0.1, 0.5, 1.0]))
    seen = scenes.buffers(draw(st.sampled_from(list(scenes.SURFACES))), sight, dtype, hole)
    if draw(st.booleans()):
        return seen
    depth = seen.depth.copy()
    positions = seen.positions.copy()
    normals = seen.normals.copy()
    there = ~np.isinf(depth)
    if draw(st.booleans()):  # normals from everywhere, away from the viewer too
        turned = rng.standard_normal(normals.shape)
        normals[there] = (turned / np.linalg.norm(turned, axis=-1, keepdims=True))[there]
        return Buffers(seen.view, depth, positions, normals)
    for texture in (depth, positions, normals):
        wild = there & (rng.random((height, width)) < 0.2)
        texture[wild] = rng.choice(np.array(WILD, dtype), texture[wild].shape)
    normals[there & (rng.random((height, width)) < 0.2)] = 0
    return Buffers(seen.view, depth, positions, normals)


radii = st.sampled_from([0.0, 1e-3, 0.05, 0.2, 2.0, 1e3])


@st.composite
def offsets(draw, dimensions):
    """Points of the ball or disk, the middle among them now and then."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    points = rng.uniform(-1, 1, (draw(st.integers(1, 9)), dimensions)) / np.sqrt(dimensions)
    points[rng.random(len(points)) < 0.1] = 0
    return points


def sunflower(n):
    """Points that fill the disk evenly, as a limit wants them."""
    k = np.arange(n)
    r = np.sqrt((k + 0.5) / n)
    turn = k * np.pi * (3 - np.sqrt(5))
    return np.stack([r * np.cos(turn), r * np.sin(turn)], -1)


def filled_ball(n):
    """Points that fill the ball, each with its opposite."""
    rng = np.random.default_rng(4)
    d = rng.standard_normal((n, 3))
    d *= rng.random((n, 1)) ** (1 / 3) / np.linalg.norm(d, axis=1, keepdims=True)
    return np.concatenate([d, -d])


def with_one_thread_and_two(make):
    """Both results of a function."""
    for threads in (1, min(2, numba.config.NUMBA_NUM_THREADS)):
        with kernel_threads(threads):
            yield make()


def texel_table(view, dtype):
    """Lines of a view's texels, (H, W, 4); None where the view's numbers say them all."""
    lines = texel_rays(view, np.dtype(dtype))
    return None if lines.table is None else lines.table.T.reshape(view.height, view.width, 4)


def assert_equals_reference(name, seen, radius, result, points=None, weights=None, **options):
    """Occlusion and the number of samples outside, by the specification; options have the estimator's defaults."""
    view = seen.view
    mapping = seen.view.world_to_image
    parameters = {
        "estimator": name, "radius": radius, "options": {**ESTIMATORS[name].parameters, **options},
        "mapping": {"kind": KINDS[mapping.kind], "numbers": mapping.numbers.tolist()},
        "viewer_distance": view.viewer_distance().tolist(), "view": view_numbers(view),
    }  # fmt: skip
    inputs = {
        "depth": seen.depth, "positions": seen.positions, "normals": seen.normals, "directions": seen.directions,
        "points": points, "weights": weights, "turns": seen.turns, "lines": texel_table(view, seen.depth.dtype),
    }  # fmt: skip
    made = solve("estimator", parameters, {key: value for key, value in inputs.items() if value is not None})
    assert_same_bits(result.texture, made["occlusion"])
    assert result.outside == made["outside"].item()
