"""LF Algorithms 1 and 2: against the reference bit for bit."""

import numpy as np
import pytest
import ssao_cases as cases
from bits import assert_same_bits
from hypothesis import given, settings
from hypothesis import strategies as st
from reference import passes as reference

from lfssao import WorldToImage
from lfssao.ao import ssao
from lfssao.errors import InputError
from lfssao.optics.view import KINDS


@cases.both
@settings(max_examples=300)
@given(data=st.data())
def test_both_algorithms_equal_the_reference_for_any_numbers(dtype, data):
    depth, positions, offsets, kind, m, back = data.draw(cases.raw_cases(dtype))
    turns = cases.drawn_turns(data.draw, depth)
    second = reference.algorithm2(depth, positions, offsets, KINDS[kind], m, turns)
    cases.assert_same(cases.run2(depth, positions, offsets, kind, m, turns), cases.outside_of(second))
    first = reference.algorithm1(depth, offsets, back, m, turns)
    cases.assert_same(cases.run1(depth, offsets, back, m, turns), cases.outside_of(first))


@settings(max_examples=60)
@given(
    st.integers(0, 2**32), st.integers(1, 1300), st.integers(0, 40), st.sampled_from([32, 256, 2048]),
    st.sampled_from([0.0, 1e-3, 0.01, 0.3, 1.0]),
)  # fmt: skip
def test_spans_hold_all_that_sees_a_surface_and_little_else(seed, width, first, most, share):
    rng = np.random.default_rng(seed)
    seen = rng.random(first + width) < share
    seen[first + rng.integers(width) : first + rng.integers(width + 1)] |= rng.random() < 0.5
    depth = np.where(seen, np.float32(-1), np.float32(np.inf))
    at = first
    for start, n in cases.all_spans(depth, first, first + width, most):
        assert not seen[at:start].any()
        assert n <= most
        assert n or start == first + width
        assert all(seen[k : min(k + 32, start + n)].any() for k in range(start, start + n, 32))
        at = start + n
    assert not seen[at : first + width].any()


@cases.both
@given(data=st.data())
def test_pass_algorithm2_equals_the_reference_on_modules(dtype, data):
    depth, positions, mapping, samples, radius = data.draw(cases.module_cases(dtype))
    turns = cases.drawn_turns(data.draw, depth)
    actual = ssao.algorithm2(depth, positions, mapping, samples, radius, turns)
    kind = KINDS[mapping.kind]
    numbers = mapping.numbers.astype(dtype)
    offsets = (radius * samples).astype(dtype)
    texture, outside = cases.outside_of(reference.algorithm2(depth, positions, offsets, kind, numbers, turns))
    assert_same_bits(actual.texture, texture)
    assert actual.outside == outside.sum()


@cases.both
@given(data=st.data())
def test_pass_algorithm1_equals_the_reference_on_cameras(dtype, data):
    depth, view, samples, radius = data.draw(cases.camera_cases(dtype))
    forth = view.world_to_image.numbers.reshape(4, 4)
    turns = cases.drawn_turns(data.draw, depth)
    actual = ssao.algorithm1(depth, view.screen_to_world, forth, samples, radius, turns)
    back = view.screen_to_world.ravel().astype(dtype)
    offsets = (radius * samples).astype(dtype)
    forth = forth.ravel().astype(dtype)
    texture, outside = cases.outside_of(reference.algorithm1(depth, offsets, back, forth, turns))
    assert_same_bits(actual.texture, texture)
    assert actual.outside == outside.sum()


def test_algorithm2_does_not_mind_how_arrays_lie_in_memory():
    rng = np.random.default_rng(3)
    depth = rng.random((6, 9))
    positions = rng.random((6, 9, 3)) * [9, 6, 1]
    samples = rng.uniform(-1, 1, (5, 3))
    mapping = WorldToImage(cases.MATRIX, cases.IDENTITY)
    want = ssao.algorithm2(depth, positions, mapping, samples, 1.0)
    strided = np.repeat(depth, 2, axis=1)[:, ::2], np.repeat(positions, 2, axis=0)[::2]
    got = ssao.algorithm2(*strided, mapping, samples[::-1][::-1], 1.0)
    assert_same_bits(got.texture, want.texture)
    assert got.outside == want.outside > 0


def test_algorithm_passes_refuse_what_does_not_fit():
    depth = np.zeros((2, 3))
    positions = np.zeros((2, 3, 3))
    samples = np.zeros((1, 3))
    mapping = WorldToImage(cases.MATRIX, cases.IDENTITY)
    bad = [
        (depth.astype(int), positions, samples, 1.0),
        (depth[0], positions, samples, 1.0),
        (depth[:0], positions[:0], samples, 1.0),
        (depth, positions[:1], samples, 1.0),
        (depth, positions.astype(np.float32), samples, 1.0),
        (depth, positions, samples[:0], 1.0),
        (depth, positions, samples[:, :2], 1.0),
        (depth, positions, samples + np.nan, 1.0),
        *((depth, positions, samples, radius) for radius in (-1.0, np.nan, np.inf)),
    ]
    for d, p, s, r in bad:
        with pytest.raises(InputError):
            ssao.algorithm2(d, p, mapping, s, r)
    for back, forth in [(np.eye(3), np.eye(4)), (np.eye(4), np.eye(4).ravel())]:
        with pytest.raises(InputError):
            ssao.algorithm1(depth, back, forth, samples, 1.0)
