"""Memory: what the passes take is what is foretold, and more than there is is refused."""

import os
import platform
import tracemalloc
from dataclasses import replace
from pathlib import Path

import pytest
from jobs import python

from lfssao import RayCaster, Settings, builtin_scene, find_display, module_views
from lfssao.ao.estimators.registry import find_estimator
from lfssao.core.memory import available_memory
from lfssao.errors import InputError
from lfssao.rendering.passes import render_view
from lfssao.rendering.run import check_memory, needed_memory


def test_memory_is_checked_against_what_is_there(monkeypatch):
    assert available_memory() > 10_000_000
    monkeypatch.setattr("lfssao.core.memory.available_memory", lambda: 10**9)
    check_memory(2000, 2000, 5, 4)  # 0.5 GB
    with pytest.raises(InputError, match=r"resolution 4000x4000.* 2\.0 GB of memory, 1\.0 GB are available"):
        check_memory(4000, 4000, 5, 4)
    check_memory(2000, 3400, 5, 4)  # 0.9 GB
    with pytest.raises(InputError, match=r"resolution 2000x3400.* 1\.1 GB of memory, 1\.0 GB are available"):
        check_memory(2000, 3400, 5, 96)
    with pytest.raises(InputError, match=r"resolution 2000x3400.* 1\.3 GB of memory, 1\.0 GB are available"):
        check_memory(2000, 3400, 5, 4, bent=True)
    monkeypatch.setattr("lfssao.core.memory.available_memory", lambda: None)
    check_memory(2**16, 2**15 - 1, 5, 4)
    with pytest.raises(InputError, match="at most 2147483647 texels"):
        check_memory(2**16, 2**15, 5, 4)


@pytest.mark.slow
def test_memory_is_what_the_passes_take():
    """The memory of sao where the texels' lines are a table, which needs more than all that comes after it."""
    mesh = builtin_scene()
    display = find_display("convex")
    settings = Settings((0.1, 0.2), estimator="sao", normals="geometric")

    def rendering(width, height):
        module = replace(display.modules[0], width=width, height=height)
        (view,) = module_views(mesh, replace(display, modules=(module,)))
        caster = RayCaster(mesh, view.cast_from_world)
        caster.gbuffer(view)  # Embree's tree is built by the first one
        return lambda: render_view(caster, view, settings)

    def peak(width, height):
        render = rendering(width, height)
        tracemalloc.start()
        try:
            render()
            return tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()

    rendering(20, 10)()  # what is made once; to trace the compiler's memory takes four times as long as to compile
    texels = 240 * 180 - 80 * 60
    needed = needed_memory(texels, 2, find_estimator("sao").texel_bytes)
    assert needed == 144 * texels
    assert 0.97 * needed < peak(240, 180) - peak(80, 60) < 1.03 * needed


def test_what_is_freed_is_kept_for_what_is_taken_next():
    """In a process of its own, whose arrays would each be new pages of the system; glibc alone can keep them."""
    code = """
import resource, numpy as np
from lfssao.core.memory import keep_freed_memory
def new_pages():
    begin = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(20):
        np.ones(300_000)
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - begin
before = new_pages()
keep_freed_memory()
new_pages()
print(before, new_pages())
"""
    before, after = map(int, python("-c", code).stdout.split())
    assert after < before / 10 or platform.libc_ver()[0] != "glibc"


def test_memory_without_proc(monkeypatch):
    def missing(*_, **__):
        raise FileNotFoundError

    monkeypatch.setattr(Path, "read_text", missing)
    assert available_memory() == os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
