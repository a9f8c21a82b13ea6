"""Loops over rows in several threads: each row once, in numba's own threads, and no rows lost to copies."""

from contextlib import contextmanager

import numba
import numpy as np
import pytest
from numba import get_thread_id, prange
from numba.core.errors import TypingError

from lfssao.kernels import jit, linked, threads
from lfssao.kernels.threads import interleaved


@contextmanager
def threads_set_to(count):
    before = numba.get_num_threads()
    numba.set_num_threads(min(count, numba.config.NUMBA_NUM_THREADS))
    yield numba.get_num_threads()
    numba.set_num_threads(before)


@pytest.fixture(params=[1, 2])
def several(request):
    with threads_set_to(request.param) as count:
        yield count


def halves(texture, first, second, least=0):
    """The second loop reads what other threads wrote in the first."""
    height, width = texture.shape
    values, sums = texture.reshape(-1), first.reshape(-1)
    one = texture.dtype.type(1)
    for j in prange(height):
        for i in range(width):
            sums[j * width + i] = values[j * width + i] + one
    last = height - 1
    for k in prange(second.shape[0]):
        total = first.dtype.type(least)
        for i in range(width):
            total += sums[(last - k) * width + i]
        second[k] = total


def interpreted(function):
    """With loops that are left to Python."""
    shared = threads.with_shared_loops(
        function, lambda loop: lambda low, high, step, _, *rest: loop(low, high, step, 1, *rest), lambda head: head
    )
    function.__globals__["borrowed"] = lambda value: value
    return shared


def compiled(function):
    """Compiled as kernels are, but not kept on disk."""
    flags = {"nogil": True, "pipeline_class": linked.Loop, "no_cpython_wrapper": True}
    return threads.with_shared_loops(
        function, lambda loop: linked.for_kernels(numba.njit(loop, **flags)), numba.njit
    )  # fmt: skip


def compiled_apart(function):
    """Its loops can be called from Python."""
    return threads.with_shared_loops(
        function, lambda loop: numba.njit(loop, nogil=True, pipeline_class=linked.Unaliased), numba.njit
    )


@pytest.mark.parametrize("version", [interpreted, compiled, compiled_apart])
def test_loops_in_threads_do_what_the_function_does(version):
    texture = np.arange(35, dtype=np.float32).reshape(7, 5)
    expected = np.zeros((7, 5), np.float32), np.zeros(7, np.float32)
    halves(texture, *expected, least=3)
    shared = version(halves)
    assert shared.py_func is halves
    assert shared.__doc__ == halves.__doc__
    assert len(shared.loops) == 2
    for count in (1, 2):
        made = np.zeros((7, 5), np.float32), np.zeros(7, np.float32)
        with threads_set_to(count):
            shared(texture, *made, least=3)
            np.testing.assert_array_equal(made[0], expected[0])
            np.testing.assert_array_equal(made[1], expected[1])
            shared(texture, *made)  # the default
            np.testing.assert_array_equal(made[1], expected[1] - 3)


def scratches(height, width, seen):
    for j in prange(height):
        kept = np.empty(width)
        own = np.empty(width + j)
        seen.append((kept, own))


def test_scratch_arrays_that_suit_every_row_are_made_once(one_thread):
    seen = []
    interpreted(scratches)(3, 4, seen)
    assert [kept.shape for kept, _ in seen] == [(4,)] * 3
    assert [own.shape for _, own in seen] == [(4,), (5,), (6,)]
    assert len({id(kept) for kept, _ in seen}) == 1


def visits(n, often, by):
    for k in prange(n):
        often[k] += 1
        by[k] = get_thread_id()


@pytest.fixture(scope="module")
def visit():
    return compiled(visits)


@pytest.fixture(scope="module")
def dealing():
    return compiled(visits_in_turns)


@pytest.mark.parametrize("n", [0, 1, 2, 3, 10, 1001])
def test_each_number_is_in_one_share_of_one_thread(several, n, visit):
    often, by = np.zeros(n + 1, np.int64), np.full(n + 1, -1)
    visit(n, often, by)
    assert often.tolist() == [1] * n + [0]
    found = by[:n].tolist()
    assert len(set(found)) == min(several, n)
    turns = [k for k in range(1, n) if found[k] != found[k - 1]]  # shares are contiguous, and equal but for one
    assert turns == [n * k // several for k in range(1, several) if several <= n]


def visits_in_turns(n, often, by):
    for k in interleaved(n):
        often[k] += 1
        by[k] = get_thread_id()


@pytest.mark.parametrize("n", [0, 1, 2, 3, 10, 1001])
def test_numbers_are_dealt_to_threads_in_turns(several, n, dealing):
    often, by = np.zeros(n + 1, np.int64), np.full(n + 1, -1)
    dealing(n, often, by)
    assert often.tolist() == [1] * n + [0]
    hands = by[: min(n, several)].tolist()
    assert len(set(hands)) == min(n, several)
    assert by[:n].tolist() == (hands * n)[:n]


def test_some_other_first_number(several):
    """Bounds need not begin at 0: what the second loop of a share that is divided again would see."""
    (loop,) = compiled_apart(visits).loops
    often, by = np.zeros(20, np.int64), np.zeros(20, np.int64)
    loop(3, 17, 1, several, by, often)
    assert often.tolist() == [0] * 3 + [1] * 14 + [0] * 3


def test_what_is_no_view_is_refused_rather_than_copied():
    texture, sums = np.zeros((4, 4), np.float32), np.zeros((4, 8), np.float32)
    with pytest.raises(TypingError, match="contiguous"):
        compiled(halves)(texture, sums[:, :4], np.zeros(4, np.float32))


def test_a_function_without_a_loop_to_share_is_refused():
    def nothing(values):
        for i in range(len(values)):
            values[i] = 0

    with pytest.raises(AssertionError, match="nothing has no loop"):
        threads.with_shared_loops(nothing, lambda loop: loop, lambda head: head)


def test_loops_count_no_references_and_know_that_arrays_do_not_overlap():
    loop, _ = compiled_apart(halves).loops
    numbers = np.arange(4, dtype=np.float32)
    loop(0, 1, 1, 1, numbers.dtype.type(1), numbers.copy(), numbers, 4)
    (llvm,) = loop.inspect_llvm().values()
    (head,) = [line for line in llvm.splitlines() if line.startswith("define") and "_halves_loop_0" in line][:1]
    assert head.count("noalias") > 2  # besides the result's and the exception's
    assert "vector.body" in llvm
    body = llvm[llvm.index(head) :]
    assert "NRT_incref" not in body[: body.index("\n}")]


def with_scratch(texture, sums):
    height, width = texture.shape
    for j in prange(height):
        doubled = np.empty(width, texture.dtype)
        for i in range(width):
            doubled[i] = texture[j, i] + texture[j, i]
        for i in range(width):
            sums[j, i] += doubled[i] * texture[j, i]


def test_launching_threads_leaves_loops_their_vectors():
    """Were the arrays' pointers stored in the loop's own function, LLVM could not tell scratch arrays from them."""
    shared = compiled(with_scratch)
    texture = np.ones((3, 40), np.float32)
    shared(texture, np.zeros((3, 40), np.float32))
    (llvm,) = shared.head.inspect_llvm().values()
    assert "vector.body" in llvm
    assert "vector.memcheck" not in llvm


def counts_seven(often):
    for k in prange(7):
        often[k] += 1


def test_a_bound_that_is_a_literal_number_is_not_compiled_in(several, monkeypatch):
    """numba takes it for a type of its own: each thread's share would end there."""
    real = numba.njit

    def kept_nowhere(*arguments, cache=False, **flags):
        return real(*arguments, **flags)

    monkeypatch.setattr(numba, "njit", kept_nowhere)
    for name in ("_key_by_sources", "_key_by_options", "_name_by_signature"):
        monkeypatch.setattr(jit, name, lambda *_: None)
    often = np.zeros(7, np.int64)
    jit.kernel(parallel=True)(counts_seven)(often)
    assert often.tolist() == [1] * 7
