"""SHA-256 of several arrays at once, against hashlib's of each."""

import hashlib

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from lfssao import digests as digests_module
from lfssao.digests import digest, digests, hash_together


def sha256(text):
    return hashlib.sha256(text.tobytes()).hexdigest()


def text_of(size, seed):
    """Bytes that begin anywhere in memory."""
    return np.random.default_rng(seed).integers(0, 256, size + 1, np.uint8)[1:]


# Sizes at which the padding begins a block of its own, and does not.
SIZES = st.sampled_from([0, 1, 55, 56, 63, 64, 119, 120, 128]) | st.integers(0, 5000)


@given(sizes=st.lists(SIZES, max_size=40), seed=st.integers(0, 2**32), order=st.randoms(use_true_random=False))
@example(sizes=[], seed=0, order=None)
@example(sizes=[64 * k for k in range(16)], seed=1, order=None)
def test_lanes_hash_what_hashlib_hashes(sizes, seed, order):
    texts = [text_of(size, seed + k) for k, size in enumerate(sizes)]
    lanes = [[] for _ in range(16)]
    for k in range(len(texts)):
        lanes[k % 16 if order is None else order.randrange(16)].append(k)
    assert hash_together(texts, lanes) == [sha256(text) for text in texts]


def test_a_size_in_bits_beyond_32_bits():
    """Of half a gigabyte on, the size takes both words at the end."""
    text = np.zeros(2**29 + 5, np.uint8)
    text[::4099] = 7
    assert hash_together([text], [[0], *([] for _ in range(15))]) == [sha256(text)]


@pytest.fixture
def together(monkeypatch):
    """How many texts each call hashed together, on a processor that has wide vectors."""
    calls = []
    monkeypatch.setattr(digests_module, "_wide_vectors", lambda: True)

    def hash_and_note(texts, lanes):
        calls.append((len(texts), sorted(k for lane in lanes for k in lane)))
        return hash_together(texts, lanes)

    monkeypatch.setattr(digests_module, "hash_together", hash_and_note)
    return calls


def textures(views):
    """Textures of the sizes of so many views' of five radii."""
    random = np.random.default_rng(3)
    shapes = [(24, 32, channels) for channels in (3, 1, 3, 1, 1, 1, 1, 1, 1, 1)]
    return [random.random(shape, np.float32) for _ in range(views) for shape in shapes]


def test_textures_of_several_views_are_hashed_together(together):
    arrays = textures(3)
    assert digests(arrays) == [sha256(array) for array in arrays]
    assert together == [(30, list(range(30)))]


@pytest.mark.parametrize(
    "arrays", [[], textures(1), textures(3)[:1], [*textures(3), np.zeros(10**6)], [np.zeros(0)] * 32]
)
def test_lanes_that_would_have_nothing_to_do_are_not_used(together, arrays):
    assert digests(arrays) == [sha256(array) for array in arrays]
    assert together == []


def test_processors_without_wide_vectors_hash_one_after_the_other(together, monkeypatch):
    monkeypatch.setattr(digests_module, "_wide_vectors", lambda: False)
    arrays = textures(3)
    assert digests(arrays) == [sha256(array) for array in arrays]
    assert together == []


def test_arrays_are_hashed_row_by_row_and_little_endian(together):
    arrays = [array[:, ::-1].transpose(1, 0, 2) for array in textures(3)]
    arrays[0] = arrays[0].astype(">f4")
    expected = [sha256(np.ascontiguousarray(array, "<f4")) for array in arrays]
    assert digests(arrays) == expected == [digest(array) for array in arrays]
    assert together


def test_the_longest_texts_come_first_and_each_goes_where_least_is_to_do():
    lanes = digests_module._lanes([10, 30, *[11] * 16, 1])
    assert lanes[0] == [1]
    assert [len(lane) for lane in lanes[1:]] == [2, 2, 2, *[1] * 12]
    assert [lanes[1][1], lanes[2][1], lanes[3][1]] == [17, 0, 18]
    assert sorted(k for lane in lanes for k in lane) == list(range(19))
