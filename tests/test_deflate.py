"""Deflate of packed lines: zlib reads it, and the bytes are the twin's."""

import hashlib
import zlib

import deflate_twin
import exr_twin
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lfssao.exr import read_exr, write_exr
from lfssao.exr_file import Part
from lfssao.kernels.adler32 import adler32
from lfssao.kernels.deflate import SLACK, deflate
from lfssao.kernels.repeats import LEAST, LONGEST, find_repeats

NOTHING = np.empty(0, np.uint32)  # to be read next


def deflated(data, far):
    """The stream; nothing behind the room that is promised was written."""
    packed = np.frombuffer(data, np.uint8)
    size = 2 * packed.size + SLACK
    out = np.full(size + 64, 0xA5, np.uint8)
    count = deflate(packed, far, np.empty((packed.size // 4 + 2, 2), np.int32), NOTHING, out)
    assert (out[size:] == 0xA5).all()
    return out[:count].tobytes()


def check(data, far):
    found = deflated(data, far)
    assert zlib.decompress(found) == data
    assert found == deflate_twin.stream(data, far)
    return found


def noise(size, seed=1):
    return np.random.default_rng(seed).integers(0, 256, size, np.uint8).tobytes()


def lines_of(kind, width, height=16, seed=1):
    """Packed lines of texels that are what textures hold, by the twin alone."""
    rng = np.random.default_rng(seed)
    texels = np.full((height, width, 1), np.float32(np.inf if kind == "depth" else 0))
    inside = texels[height // 4 :, width // 4 : width - width // 5]
    if kind == "steps":
        inside[...] = np.sort(rng.integers(0, 9, inside.shape), axis=1) / np.float32(8)
    elif kind != "flat":
        inside[...] = rng.random(inside.shape, np.float32)
    return exr_twin.before_deflate(exr_twin.lines_as_stored(texels.view(np.uint32).tolist(), [0], 0, height))


# What a chunk may be made of: each piece is a kind, a number of bytes, and a seed.
PIECES = st.tuples(st.sampled_from(["run", "pair", "noise", "steps", "again"]), st.integers(1, 700), st.integers(0, 9))


def composed(pieces, far):
    data = b""
    for kind, size, seed in pieces:
        if kind == "run":
            data += bytes([seed * 28]) * size
        elif kind == "pair":
            data += (bytes([128 + seed, 128 - seed]) * size)[:size]
        elif kind == "noise":
            data += noise(size, seed)
        elif kind == "steps":
            data += np.repeat(np.random.default_rng(seed).integers(0, 4, size), 3)[:size].astype(np.uint8).tobytes()
        else:  # the line before
            for _ in range(size):
                data += data[-far : len(data) - far + 1] or b"\1"
    return data


def test_adler32_of_more_than_64_bits_of_sums():
    data = np.full(300_000_001, 255, np.uint8)
    assert adler32(data) == zlib.adler32(data)


@given(pieces=st.lists(PIECES, min_size=1, max_size=6), far=st.sampled_from([2, 4, 6, 14, 62, 64, 66, 130, 514, 2048]))
def test_what_textures_are_made_of(pieces, far):
    check(composed(pieces, far), far)


@given(data=st.binary(min_size=1, max_size=300), far=st.integers(1, 40))
def test_any_bytes(data, far):
    check(data, 2 * far)


@pytest.mark.parametrize("kind", ["flat", "depth", "steps", "noise"])
@pytest.mark.parametrize(("width", "height"), [(1, 1), (1, 16), (2, 3), (37, 16), (150, 16), (151, 5)])
def test_lines_of_textures(kind, width, height):
    check(lines_of(kind, width, height), 2 * width)


@pytest.mark.parametrize("length", [*range(2, 12), *range(255, 264), 514, 515, 516, 517, 519, 520, 774, 777, 2000])
def test_repeats_of_any_length(length):
    for far in (2, 200):
        data = noise(300) + noise(200, 2)
        data += (data[-2:] * length)[:length] if far == 2 else (data[-200:] * length)[:length]
        check(data + noise(150, 3), far)


@pytest.mark.parametrize("far", [2, 4, 6, 8, 32, 510, 1024, 16386, 24578, 32766, 32768, 32770, 40000])
def test_distances(far):
    """Farther ones than deflate can say are not used."""
    data = noise(far, 1)
    found = check(data + data[:600] + noise(100, 2), far)
    assert (len(found) < far + 400) == (6 < far <= 32768) or far < 600


@pytest.mark.parametrize("size", [65535, 65536, 140_000])
def test_noise_is_stored_in_as_many_blocks_as_it_takes(size):
    data = bytes(200) + noise(size) + bytes(400)
    found = check(data, 1000)
    assert len(found) < size + 100


@pytest.mark.parametrize("run", [62, 63, 64, 65])
def test_where_literals_are_stored(run):
    """Runs of so many literals between repeats: the twin says what is done with each."""
    data = b"".join(noise(run, seed) + noise(run, seed)[-2:] * 30 for seed in range(60))
    check(data, 100_000)
    check(noise(1500) + data, 100_000)


@pytest.mark.parametrize("far", range(118, 190, 2))
def test_the_first_line_that_a_window_can_repeat(far):
    check(noise(far) * 3, far)


def test_the_bytes_are_the_same_on_every_machine():
    chunks = [lines_of(kind, 150) for kind in ("flat", "depth", "steps", "noise")]
    for write in (deflated, deflate_twin.stream):
        found = b"".join(write(chunk, 300) for chunk in chunks)
        assert hashlib.sha256(found).hexdigest() == "08d224a8215c7859a4dc91eb016b5a6fabef863c6542513b9884b235ad2bdabc"


@pytest.mark.parametrize("size", [1, 63, 1023, 1024, 1025, 5000, 70_000])
def test_adler32(size):
    for data in (noise(size), b"\xff" * size, bytes(size)):
        assert adler32(np.frombuffer(data, np.uint8)) == zlib.adler32(data)


@given(pieces=st.lists(PIECES, min_size=1, max_size=6), far=st.sampled_from([4, 62, 64, 130, 514]))
def test_repeats_are_repeats(pieces, far):
    data = composed(pieces, far)
    packed = np.frombuffer(data, np.uint8)
    found = np.empty((packed.size // LEAST + 2, 2), np.int32)
    place = 0
    for literals, length in found[: find_repeats(packed, far, found, NOTHING)].tolist():
        place += literals
        distance, length = (far if length < 0 else 2), abs(length)  # noqa: PLW2901
        assert length == 0 or length % LONGEST == 0 or length % LONGEST >= LEAST
        for _ in range(length):
            assert data[place] == data[place - distance]
            place += 1
    assert place == len(data)


def test_lines_that_deflate_makes_no_shorter_are_kept_as_they_are(tmp_path):
    """Readers know such a chunk by its size: one that is deflated to that very size would not be read."""
    sizes = []
    for equal in range(16):
        for seed in range(3):
            pixels = np.random.default_rng(seed).random((1, 21, 1), np.float32)
            pixels[0, :equal] = 0
            stored = exr_twin.lines_as_stored(pixels.view(np.uint32).tolist(), [0], 0, 1)
            sizes.append(len(deflate_twin.stream(exr_twin.before_deflate(stored), 42)))
            write_exr(tmp_path / "a.exr", [Part("a", ("Z",), pixels)])
            np.testing.assert_array_equal(read_exr(tmp_path / "a.exr")["a"].pixels, pixels)
    assert min(sizes) < pixels.nbytes < max(sizes)
    assert pixels.nbytes in sizes
