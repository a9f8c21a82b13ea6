"""The number of threads that kernels run on."""

import numba
import pytest
from jobs import render

from lfssao.core.threads import kernel_threads


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
