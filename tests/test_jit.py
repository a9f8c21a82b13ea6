"""The requests that kernels make of the compiler."""

import itertools

import llvmlite.binding
import numpy as np
import pytest
from numba import types

from lfssao.kernels import ball, extremes, jit, linked, philox


def double(values, out):
    for i in range(values.shape[0]):
        out[i] = values[i] + values[i]


def double_wide(values, out):
    jit.wide_vectors()
    for i in range(values.shape[0]):
        out[i] = values[i] + values[i]


def compiled(function):
    """LLVM's code, machine code and the result of 0 .. 99."""
    result, ready = np.empty(100, np.float32), jit.numba.njit(function)
    ready(np.arange(100, dtype=np.float32), result)
    (llvm,), (machine,) = ready.inspect_llvm().values(), ready.inspect_asm().values()
    return llvm, machine, result


def test_wide_vectors_are_as_wide_as_the_processor_has_them():
    request = '"prefer-vector-width"="512"'
    plain, _, expected = compiled(double)
    llvm, machine, result = compiled(double_wide)
    assert request not in plain
    assert request in llvm
    assert ("zmm" in machine) == bool(llvmlite.binding.get_host_cpu_features().get("avx512f"))
    np.testing.assert_array_equal(result, expected)
    np.testing.assert_array_equal(result, 2 * np.arange(100))


def test_literal_numbers_do_not_compile_a_callee_again():
    kinds = [types.literal(number) for number in range(6)]
    _, _, arguments, _ = philox.philox4x32.get_call_template(kinds, {})  # as in a call from another kernel
    assert arguments == (types.int64,) * 6
    signatures = philox.philox4x32.linked().signatures
    assert arguments in signatures
    assert not any(isinstance(kind, types.Literal) for signature in signatures for kind in signature)


def test_processes_that_compile_for_different_types_at_the_same_time_write_different_files(monkeypatch):
    written = []
    for key in ("float32", "float64", "float32"):
        index = jit.kernel(ball.algorithm3.py_func)._cache._cache_file
        monkeypatch.setattr(index, "_load_index", dict)  # the others have not written yet
        monkeypatch.setattr(index, "_save_index", lambda overloads: None)
        monkeypatch.setattr(index, "_save_data", lambda name, data: written.append(name))
        index.save(key, None)
    assert written[0] == written[2] != written[1]


def test_calls_from_kernels_use_code_that_unpacks_no_arguments_from_python():
    arguments = (types.float64, types.float64)
    template = ball.algorithm3.get_call_template(arguments, {})[0]
    assert [case.args for case in template.cases] == [arguments]
    assert ball.algorithm3.get_overload(arguments) is ball.algorithm3.linked().overloads[arguments].entry_point
    assert ball.algorithm3(0.0, 0.5) == (0, 1, 0)  # as called from Python
    key, linked_key = (
        kernel._cache._index_key(arguments, kernel.targetctx.codegen())
        for kernel in (ball.algorithm3, ball.algorithm3.linked())
    )
    assert key[:-1] == linked_key[:-1]
    assert key != linked_key


def linked_only(function):
    flags = {"pipeline_class": linked.Linked, "no_cfunc_wrapper": True, "no_cpython_wrapper": True}
    return linked.for_kernels(jit.numba.njit(function, **flags))


def test_linked_functions_of_the_same_types_are_told_apart():
    doubled, squared = linked_only(lambda a: a + a), linked_only(lambda a: a * a)
    assert jit.numba.njit(lambda a: squared(a) - doubled(a))(3.0) == 3.0


def test_no_machine_code_is_made_of_what_only_kernels_call():
    made = []
    for dispatcher in (jit.numba.njit(lambda a: a + a), linked_only(lambda a: a + a)):
        assert jit.numba.njit(lambda a, callee=dispatcher: callee(a) * a)(3.0) == 18.0
        (result,) = dispatcher.overloads.values()
        made.append(result.library.codegen._engine.is_symbol_defined(result.fndesc.llvm_func_name))
    assert made == [True, False]


def test_what_only_kernels_call_can_be_linked_from_disk():
    arguments, kernels = (types.float32, types.float32), [jit.kernel(ball.algorithm3.py_func) for _ in range(2)]
    for callee in kernels:
        caller = jit.numba.njit(lambda a, b, callee=callee: callee(a, b))
        assert caller(np.float32(0), np.float32(0.5)) == (0, 1, 0)
    assert kernels[1].linked().stats.cache_hits == {arguments: 1}


@jit.numba.njit
def extremes_of_two(a, b):
    return extremes.largest(a, b), extremes.smallest(a, b)


@jit.numba.njit
def extremes_of_three(a, b, c):
    return extremes.largest(a, b, c), extremes.smallest(a, b, c)


@pytest.mark.parametrize(
    "kinds", [(float, float), (float, float, float), (int, float), (np.int32, int), (np.uint64, np.uint64)]
)
def test_max_and_min_of_kernels_are_pythons(kinds):
    """With NaN first, last and between, and of mixed types."""
    assert (ball.max, ball.min) == (extremes.largest, extremes.smallest)
    kernel = extremes_of_two if len(kinds) == 2 else extremes_of_three
    values = {float: [1.5, np.nan, -2.0, 0.0, -0.0]}
    for numbers in itertools.product(*(values.get(kind, [kind(3), kind(0), kind(7)]) for kind in kinds)):
        got, want = np.array(kernel(*numbers), float), np.array([max(numbers), min(numbers)], float)
        np.testing.assert_array_equal(got.view(np.int64), want.view(np.int64))
    assert not kernel.py_func(*numbers)[0] < want[0]
