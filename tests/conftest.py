"""Settings of every test run."""

from hypothesis import HealthCheck, settings

# The same examples on every machine and in every run; no deadline, as the first call of a kernel compiles it.
settings.register_profile(
    "lfssao", derandomize=True, deadline=None, max_examples=60, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("lfssao")
