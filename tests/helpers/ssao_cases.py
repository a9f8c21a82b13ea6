"""Textures, mappings and samples drawn by hypothesis for Algorithms 1 and 2, and bits compared."""

import numpy as np
import pytest
from bits import assert_same_bits
from hypothesis import strategies as st
from numba import njit

from lfssao import Camera, Display, Module, fit_roi
from lfssao.ao.kernels import ssao
from lfssao.ao.kernels.spans import next_span
from lfssao.optics.kernels.projection import CROSSED_SLITS, MATRIX, Projection

both = pytest.mark.parametrize("dtype", [np.float32, np.float64])


ROI = ((-0.4, -0.3, -0.25), (0.4, 0.3, 0.25))


WORLD_BOX = np.array([[-1.0, -2.0, -3.0], [4.0, 2.0, 1.0]])


def unwritten(depth):
    return np.full_like(depth, 9), np.full(depth.shape[0], -9, np.int64)


def run1(depth, offsets, back, m, turns=None):
    positions = np.full((*depth.shape, 3), 9, depth.dtype)
    ssao.unproject(depth, back, positions)
    return run2(depth, positions, offsets, MATRIX, m, turns)


def run2(depth, positions, offsets, kind, m, turns=None):
    """Result of Algorithm 2 for one of three radii, which have other offsets."""
    occlusion, outside = (np.stack([part] * 3) for part in unwritten(depth))
    radii = np.stack([np.roll(offsets, 1, axis=1), offsets, offsets[:, ::-1]])
    ssao.algorithm2(depth, positions, radii, Projection(kind, m), turns, occlusion, outside)
    return occlusion[1], outside[1]


def assert_same(actual, expected):
    assert_same_bits(actual[0], expected[0])
    assert actual[1].tolist() == expected[1].tolist()


def outside_of(result):
    """The reference's occlusion, and how many samples of each row are outside."""
    occlusion, answers = result
    return occlusion, answers[:, 1:].sum(axis=1)


sizes = st.one_of(
    st.tuples(st.integers(1, 10), st.integers(1, 8)),
    st.sampled_from([(1, 1), (1, 40), (19, 1), (1, 300), (2, 70), (17, 3)]),
)


def drawn_turns(draw, depth):
    """Cosines and sines of any angles, or other numbers, or None."""
    kind = draw(st.sampled_from(["none", "angles", "numbers"]))
    if kind == "none":
        return None
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    angles = rng.uniform(0, 2 * np.pi, depth.shape)
    numbers = rng.choice(LATTICE, (2, *depth.shape))
    return (np.stack([np.cos(angles), np.sin(angles)]) if kind == "angles" else numbers).astype(depth.dtype)


LATTICE = [-3.0, -2.0, -1.0, -0.5, -0.0, 0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0]


def wild_pool(dtype):
    limits = np.finfo(dtype)
    special = [0.0, -0.0, 1.0, -1.0, 0.5, np.inf, -np.inf, np.nan]
    special += [s * float(x) for s in (1, -1) for x in (limits.max, limits.tiny, limits.smallest_subnormal)]
    width = 32 if dtype == np.float32 else 64
    number = st.one_of(st.floats(width=width), st.floats(-8, 8, width=width), st.sampled_from(special))
    return st.lists(number, min_size=6, max_size=30)


@st.composite
def raw_cases(draw, dtype):
    """Any 16 numbers as the mapping, from a pool of small lattice numbers (ties, edges, singular planes) or of any."""
    lattice = draw(st.booleans())
    pool = np.array(LATTICE if lattice else draw(wild_pool(dtype)), dtype)
    finite = np.append(pool[np.isfinite(pool)], dtype(1))
    shape = draw(sizes)
    n = draw(st.sampled_from([8, 2, 1, 0]))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    kind = draw(st.sampled_from([CROSSED_SLITS, MATRIX]))
    m = rng.choice(finite, 16)
    if draw(st.booleans()):  # near the identity, so that samples land in the texture
        m[:12] = np.eye(3, 4, dtype=dtype).ravel()
        m[12:] = [4, -3, 1, 1] if kind == CROSSED_SLITS else [0, 0, 0, 1]
        m[rng.integers(0, 16)] = rng.choice(finite)
    depth = rng.choice(pool, shape)
    depth[np.isnan(depth)] = np.inf
    depth[rng.random(shape) < draw(st.sampled_from([0.0, 0.1, 0.3, 0.5, 1.0]))] = np.inf
    positions = rng.choice(pool, (*shape, 3))
    if draw(st.booleans()):
        positions[..., 0] = np.arange(shape[1]) + 0.5
        positions[..., 1] = np.arange(shape[0])[:, None] + 0.5
    offsets = rng.choice(finite, (n, 3)) * dtype(draw(st.sampled_from([0.0, 1.0])))
    back = rng.choice(finite, 16)
    return depth, positions, offsets, kind, m, back


@st.composite
def module_cases(draw, dtype):
    """A smooth surface behind one module of a drawn display, by DESIGN section 2's ray of a texel."""
    height, width = draw(sizes)
    m_x, m_y, y_o = draw(st.tuples(*[st.floats(-1, 1)] * 3))
    m_z = draw(st.floats(0.3, 2))
    z_o = draw(st.floats(-3, -0.5))
    display = Display("drawn", 1.0, 0.75, y_o, z_o, (Module(m_x, m_y, m_z, width, height),), ROI)
    world = fit_roi(WORLD_BOX, display.roi)
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    z = rng.uniform(0.8 * z_o, 0.8 * m_z) * np.ones((height, width)) + 0.02 * rng.standard_normal((height, width))
    s_x = (np.arange(width) + 0.5) / width - 0.5
    s_y = 0.75 * (0.5 - (np.arange(height)[:, None] + 0.5) / height)
    physical = np.stack([m_x + (s_x - m_x) * (m_z - z) / m_z, y_o + (s_y - y_o) * (z - z_o) / -z_o, z], axis=-1)
    positions = ((physical - world[:, 3]) / np.diag(world)).astype(dtype)
    depth = z.astype(dtype)
    depth[rng.random(depth.shape) < 0.1] = np.inf
    positions[np.isinf(depth)] = np.inf
    samples = rng.uniform(-1, 1, (draw(st.integers(1, 9)), 3))
    radius = draw(st.sampled_from([0.0, 1e-3, 0.3, 2.0, 30.0]))
    return depth, positions, display.view(0, world).world_to_image, samples, radius


@st.composite
def camera_cases(draw, dtype):
    height, width = draw(sizes)
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    eye = tuple(rng.uniform(2, 6, 3) * rng.choice([-1, 1], 3))
    kind = draw(st.sampled_from(["perspective", "orthographic"]))
    view = Camera(kind, eye, (0.0, 0.1, 0.2), (0.0, 1.0, 0.0), draw(st.floats(0.5, 4)), 1.0, 20.0).view(width, height)
    depth = (rng.uniform(0.1, 0.9) + 0.02 * rng.standard_normal((height, width))).astype(dtype)
    depth[rng.random(depth.shape) < 0.1] = np.inf
    samples = rng.uniform(-1, 1, (draw(st.integers(1, 9)), 3))
    return depth, view, samples, draw(st.sampled_from([0.0, 1e-3, 0.3, 2.0, 30.0]))


@njit
def all_spans(depth, at, end, most):
    found = []
    while at < end:
        start, n = next_span(depth, at, end, most)
        found.append((start, n))
        at = start + n
    return found


IDENTITY = np.eye(4).ravel()
