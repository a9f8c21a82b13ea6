"""The decorator of kernels: where compiled code is kept, what it depends on, and Python's meaning of max and min."""

import errno
import hashlib
import itertools
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

import numba
import numpy as np
import pytest
from jobs import python

import lfssao
from lfssao.ao.kernels import post
from lfssao.core import jit
from lfssao.errors import InputWarning
from lfssao.optics.kernels.projection import Slits
from lfssao.samples.kernels import ball

PACKAGE = Path(lfssao.__file__).parent

# Calls a kernel of ball.py, which calls sincospi of elementary.py.
SCRIPT = """import json, numba
from lfssao.samples.kernels import ball
stats = (ball.algorithm3(0.0, 1.0)[0], ball.algorithm3.stats)
print(json.dumps([stats[0], sum(stats[1].cache_hits.values()), stats[1].cache_path, numba.config.CACHE_DIR]))"""


def first_call(env):
    """Result of a kernel in a new process, its hits in the cache, its cache folder, and numba's own afterwards."""
    return json.loads(python("-P", "-c", SCRIPT, **{"NUMBA_CACHE_DIR": "", **env}).stdout)


@pytest.fixture
def package(tmp_path):
    """A copy of the package, without compiled code, and the environment that imports it."""
    ignored = shutil.ignore_patterns("__pycache__")
    copy = shutil.copytree(PACKAGE, tmp_path / "copy" / "lfssao", ignore=ignored)
    return copy, {"PYTHONPATH": str(copy.parent), "HOME": str(tmp_path / "home"), "PYTHONDONTWRITEBYTECODE": "1"}


def test_the_cache_folder_is_named_by_all_kernel_sources():
    """A file with kernels or formulas that were not among these would run as it was before."""
    digest = hashlib.sha256()
    for path in jit.compiled_sources():
        digest.update(path.name.encode() + b"\0" + path.read_bytes())
    compiled_here = re.compile(r"^@(formula|kernel)\b|^    def (term|step|place)\(self, view", re.MULTILINE)
    known = {*jit.compiled_sources(), PACKAGE / "ao" / "formulas.py"}  # whose classes are protocols
    for path in PACKAGE.rglob("*.py"):
        assert path in known or not compiled_here.search(path.read_text()), path
    assert jit.source_digest() == digest.hexdigest()
    for compiled in (ball.algorithm3, post.blur_horizontal.compiled):
        assert f"kernels-{digest.hexdigest()[:16]}" in Path(compiled.stats.cache_path).parts


def test_code_that_checks_its_indices_is_kept_apart(monkeypatch, tmp_path):
    """NUMBA_BOUNDSCHECK=1 is no part of numba's own key, and would run the code without checks from the disk."""
    folder = jit._cache_folder.__wrapped__
    usual = folder(str(tmp_path))
    monkeypatch.setattr(numba.config, "BOUNDSCHECK", 1)
    assert folder(str(tmp_path)) == f"{usual}-checked"


def test_a_change_of_a_callee_is_not_hidden_by_the_cache(package, tmp_path):
    """The file that defines algorithm3 does not change, nor does numba's folder for it."""
    copy, env = package
    cache = tmp_path / "cache"
    env["NUMBA_CACHE_DIR"] = str(cache)
    result, hits, folder, restored = first_call(env)
    assert (result, hits, restored) == (-1, 0, str(cache))
    assert Path(folder).is_relative_to(cache)
    assert first_call(env) == [-1, 1, folder, str(cache)]
    callee = copy / "core" / "elementary.py"
    source = callee.read_text()
    assert source.count("-cosine if") == 1
    callee.write_text(source.replace("-cosine if", "-7.0 if"))
    result, hits, other, _ = first_call(env)
    assert (result, hits) == (-7, 0)
    assert other != folder
    callee.write_text(source)
    assert first_call(env) == [-1, 1, folder, str(cache)]


def test_code_is_kept_beside_the_sources_else_in_the_users_cache_folder_else_nowhere(package, tmp_path):
    copy, env = package
    beside = copy / "core" / "__pycache__"
    home = tmp_path / "home"
    assert Path(first_call(env)[2]).is_relative_to(beside)
    shutil.rmtree(beside)
    beside.write_text("a file, in which nobody can make a folder")
    assert Path(first_call(env)[2]).is_relative_to(home)
    assert first_call(env)[:2] == [-1, 1]
    shutil.rmtree(home)
    home.write_text("a file")
    assert first_call(env) == [-1, 0, None, ""]


def test_processes_that_compile_at_the_same_time_agree(package, tmp_path):
    _, env = package
    env["NUMBA_CACHE_DIR"] = str(tmp_path / "cache")
    command = [sys.executable, "-P", "-c", SCRIPT]
    running = [subprocess.Popen(command, env=os.environ | env, stdout=subprocess.PIPE, text=True) for _ in range(2)]
    assert [json.loads(process.communicate()[0])[0] for process in running] == [-1, -1]
    assert first_call(env)[:2] == [-1, 1]


def twice(number):
    return number + number


DAMAGES = {
    "empty": lambda path, data: path.write_bytes(b""),
    "cut": lambda path, data: path.write_bytes(data[: len(data) // 2]),
    "first bit": lambda path, data: path.write_bytes(bytes([data[0] ^ 1]) + data[1:]),
    "middle bit": lambda path, data: path.write_bytes(
        data[: len(data) // 2] + bytes([data[len(data) // 2] ^ 16]) + data[len(data) // 2 + 1 :]
    ),
    "last bit": lambda path, data: path.write_bytes(data[:-1] + bytes([data[-1] ^ 128])),
    "longer": lambda path, data: path.write_bytes(data + b"\0"),
    "pipe": lambda path, data: (path.unlink(), os.mkfifo(path)),
}


@pytest.mark.parametrize("ending", [".nbi", ".nbc"])
def test_compiled_code_that_is_damaged_is_noticed_and_made_anew(tmp_path, monkeypatch, ending):
    monkeypatch.setattr(jit, "_cache_folder", lambda _: str(tmp_path))

    def hits():
        made = jit.kernel(twice)
        assert made(3) == 6
        return sum(made.stats.cache_hits.values())

    assert (hits(), hits()) == (0, 1)
    (path,) = tmp_path.rglob(f"*{ending}")
    for name, damage in DAMAGES.items():
        damage(path, path.read_bytes())
        with pytest.warns(InputWarning, match="compiled code in it was damaged and is compiled anew"):
            assert hits() == 0, name
        assert hits() == 1, name
    path.unlink()
    assert (hits(), hits()) == (0, 1)
    path.unlink()
    path.mkdir()
    assert (hits(), hits()) == (0, 0)


def test_code_that_another_process_writes_in_between_is_not_damaged(tmp_path, monkeypatch):
    """The file appears behind the first question about it."""
    path = tmp_path / "kernels" / "code.nbc"
    path.parent.mkdir()
    exists = Path.exists
    is_file = Path.is_file

    def appears_after(asked):
        def ask(self):
            answer = asked(self)
            if self == path and not exists(self):
                self.write_bytes(b"code" + hashlib.sha256(b"code").digest())
            return answer

        return ask

    monkeypatch.setattr(Path, "exists", appears_after(exists))
    monkeypatch.setattr(Path, "is_file", appears_after(is_file))
    assert jit._is_whole(path)
    assert path.read_bytes().startswith(b"code")


def test_code_that_cannot_be_written_is_compiled_anew(tmp_path, monkeypatch):
    """As on a full disk."""
    monkeypatch.setattr(jit, "_cache_folder", lambda _: str(tmp_path))

    def full(*_given):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(jit._Files, "_open_for_write", full)
    assert jit.kernel(twice)(3) == 6
    assert list(tmp_path.rglob("*.nb?")) == []


class Foreign(NamedTuple):
    """A tuple that other processes cannot import."""

    number: int
    within: Any = None


def number_of(given):
    return given.number


def first_of(given):
    return given[0]


def test_code_for_tuples_of_others_is_not_kept(tmp_path, monkeypatch):
    """Their types stand in the index of a kernel's code, which no process could read that does not know them."""
    monkeypatch.setattr(jit, "_cache_folder", lambda _: str(tmp_path))
    made = jit.kernel(number_of)
    first = jit.kernel(first_of)
    assert made(Foreign(3)) == made(Foreign(3, 5.0)) == 3
    assert first(Slits(1, 2, 3, Foreign(4))) == first((1, Foreign(2))) == 1
    assert not list(tmp_path.rglob("*.nbi"))
    assert first(Slits(1, 2, 3, 4)) == 1
    assert list(tmp_path.rglob("*.nbi"))


@numba.njit
def extremes_of_two(a, b):
    return max(a, b), min(a, b)


@numba.njit
def extremes_of_three(a, b, c):
    return max(a, b, c), min(a, b, c)


@pytest.mark.parametrize(
    "kinds", [(float, float), (float, float, float), (int, float), (np.int32, int), (np.uint64, np.uint64)]
)
def test_max_and_min_of_kernels_are_pythons(kinds):
    """With NaN first, last and between, and of mixed types."""
    kernel = extremes_of_two if len(kinds) == 2 else extremes_of_three
    values = {float: [1.5, np.nan, -2.0, 0.0, -0.0]}
    for numbers in itertools.product(*(values.get(kind, [kind(3), kind(0), kind(7)]) for kind in kinds)):
        got = np.array(kernel(*numbers), float)
        want = np.array([max(numbers), min(numbers)], float)
        np.testing.assert_array_equal(got.view(np.int64), want.view(np.int64))
