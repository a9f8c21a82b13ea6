"""The number of threads that kernels run on, and items that a thread makes ahead."""

import threading

import numba
import pytest
from jobs import render

from lfssao.core.threads import ahead, kernel_threads


def test_the_number_of_threads_is_set_for_a_block_alone():
    def fail():
        assert numba.get_num_threads() == numba.config.NUMBA_NUM_THREADS
        raise KeyError

    before = numba.get_num_threads()
    with pytest.raises(KeyError), kernel_threads(numba.config.NUMBA_NUM_THREADS):
        fail()
    assert numba.get_num_threads() == before


def test_a_job_leaves_it_as_it_was(tmp_path):
    with kernel_threads(1):
        render(tmp_path / "out", "ammonite", "--camera", "--resolution", "8x6")
        assert numba.get_num_threads() == 1


def test_items_are_made_before_they_are_asked_for_and_what_one_raises_is_raised():
    made = []
    second = threading.Event()

    def items():
        for n in (1, 2):
            made.append(n)
            if n == 2:
                second.set()
            yield n
        raise KeyError

    given = ahead(items())
    assert next(given) == 1
    assert second.wait(10)
    assert made == [1, 2]
    assert next(given) == 2
    with pytest.raises(KeyError):
        next(given)
