"""Settings of every test run."""

import gc
import os
import shutil
import signal

import numba
import pytest
from hypothesis import HealthCheck, settings

import lfssao

# The same examples on every machine and in every run; no deadline, as the first call of a kernel compiles it.
settings.register_profile(
    "lfssao", derandomize=True, deadline=None, max_examples=60, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("lfssao")

# A shell's background jobs ignore interrupts, and so would all that they start: what is tested is that they do not.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# Kernels on one thread: the workers share the cores already. Tests of threads set their number themselves.
numba.set_num_threads(1)

# The compiler makes millions of objects: to look for garbage as often as by default takes a twentieth of the run.
gc.set_threshold(100_000, 50, 50)


def pytest_xdist_auto_num_workers():
    """One process more than cores: some tests wait for a browser, for killed jobs, or for a clock."""
    return (os.cpu_count() or 1) + 1


def pytest_collection_modifyitems(items):
    """Tests that compile for minutes come first, so that no process is left alone with them at the end."""
    items.sort(key=lambda item: {"generic_cpu", "kit"}.isdisjoint(item.fixturenames))


@pytest.fixture
def generic_cpu():
    """The environment that tells a process to compile for a CPU without extensions."""
    return {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": "", "NUMBA_NUM_THREADS": "2"}


@pytest.fixture(scope="session")
def statue():
    return lfssao.builtin_scene("statue")


@pytest.fixture(scope="module")
def context():
    from glsl_renderer import open_context, without_opengl  # late: few tests need OpenGL

    try:
        made = open_context()
    except Exception as error:  # moderngl raises whatever the driver's loader said
        without_opengl(error)
    yield made
    made.release()


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    """A Chromium without a window; as with OpenGL a CI that skipped its tests would prove nothing."""
    from selenium import webdriver  # late: few tests need it

    program, driver = (shutil.which(name) for name in ("chromium", "chromedriver"))
    if program is None or driver is None:
        (pytest.fail if os.environ.get("CI") else pytest.skip)("there is no chromium with its chromedriver")
    options = webdriver.ChromeOptions()
    options.binary_location = program
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    for flag in ("headless", "no-sandbox", "disable-gpu", "enable-unsafe-swiftshader", "disable-quic", "no-first-run",
                 "disable-component-update",
                 "disable-background-networking", "disable-sync", "window-size=1400,1000",
                 f"user-data-dir={tmp_path_factory.mktemp('profile')}"):  # fmt: skip
        options.add_argument(f"--{flag}")
    made = webdriver.Chrome(options=options, service=webdriver.ChromeService(driver))
    yield made
    made.quit()
