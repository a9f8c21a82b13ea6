"""NPY files of numbers are read; what else has that ending is refused, however much it claims to hold."""

import io
import tracemalloc

import numpy as np
import pytest

from lfssao.errors import InputError
from lfssao.files.npy import read_npy

PLAIN = np.arange(12.0).reshape(3, 4)


def saved(array, save=np.save, **more):
    stream = io.BytesIO()
    save(stream, array, **more)
    return stream.getvalue()


def claiming(shape):
    """PLAIN's numbers below a header of another shape."""
    header = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}}}".encode()
    return b"\x93NUMPY\1\0" + len(header).to_bytes(2, "little") + header + PLAIN.tobytes()


@pytest.mark.parametrize("array", [PLAIN, PLAIN.T, PLAIN.astype(">f4"), np.int8([[1]]), np.zeros((0, 3)), PLAIN[0, 0]])
def test_numbers_are_read(tmp_path, array):
    np.save(tmp_path / "a.npy", array)
    read = read_npy(tmp_path / "a.npy")
    assert read.dtype == array.dtype.newbyteorder("=")
    assert np.array_equal(read, array)


@pytest.mark.parametrize(("content", "reason"), [
    (saved(PLAIN, np.savez), "the magic string is not correct"),
    (saved(np.array([object()]), allow_pickle=True), "it holds object (1,), expected numbers"),
    (saved(PLAIN.astype(np.longdouble)), "it holds float128 (3, 4), expected numbers"),
    (saved(PLAIN)[:-1], "it is damaged (shape (3, 4) needs 96 bytes, has 95)"),
    (claiming("(3, 4000000000)"), "needs 96000000000 bytes, has 96"),
    (claiming("(-3, -4)"), "it holds float64 (-3, -4), expected numbers"),
    (claiming("3"), "it cannot be read as an NPY file"),
    (claiming("(" * 15), "it cannot be read as an NPY file"),
    (b"\x93NUMPY\2\0\xff\xff\xff\xff" + bytes(100), "expected 4294967295 bytes"),
])  # fmt: skip
def test_what_is_no_file_of_numbers_is_refused_before_it_takes_memory(tmp_path, content, reason):
    path = tmp_path / "a.npy"
    path.write_bytes(content)
    tracemalloc.start()
    with pytest.raises(InputError) as caught:
        read_npy(path)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert str(caught.value).startswith(f"{path}: ")
    assert reason in str(caught.value)
    assert most < 1_000_000
