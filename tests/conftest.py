"""Settings of every test run."""

import numba
import pytest
from hypothesis import HealthCheck, settings

# The same examples on every machine and in every run; no deadline, as the first call of a kernel compiles it.
settings.register_profile(
    "lfssao", derandomize=True, deadline=None, max_examples=60, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("lfssao")


@pytest.fixture(scope="module")
def one_thread():
    """Kernels on one thread: on small textures waiting for another takes longer than the work."""
    before = numba.get_num_threads()
    numba.set_num_threads(1)
    yield
    numba.set_num_threads(before)
