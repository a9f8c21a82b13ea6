"""Freed memory is used again: without telling the C library so, every texture's pages are cleared by the system."""

import platform
import subprocess
import sys

import pytest

ARRAYS = """
import resource
import numpy as np
from lfssao.memory import keep_freed_memory

def faults():
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt

def textures():
    return [np.ones(750_000, np.float32) for _ in range(10)]

{first}
textures()
before = faults()
for _ in range(5):
    textures()
print(faults() - before)
"""
PAGES = 5 * 10 * 3_000_000 // 65_536  # of the largest usual size, so at least that many


def page_faults(first):
    done = subprocess.run(
        [sys.executable, "-c", ARRAYS.format(first=first)], capture_output=True, text=True, check=True
    )
    return int(done.stdout.split()[-1])


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="only glibc can be told to keep freed memory")
def test_freed_memory_is_used_again():
    assert page_faults("keep_freed_memory()") < PAGES / 20
    assert page_faults("from lfssao.cli import main; main(['display'])") < PAGES / 20
    assert page_faults("") > PAGES  # else the function has nothing to do


def test_a_c_library_that_keeps_nothing_is_left_alone(monkeypatch):
    import ctypes

    from lfssao.memory import keep_freed_memory

    def refuse(_name):
        raise TypeError("LoadLibrary() argument 1 must be str, not None")  # Windows

    for library in (refuse, lambda _name: object()):  # no mallopt: macOS, musl
        monkeypatch.setattr(ctypes, "CDLL", library)
        assert keep_freed_memory() is None
