"""The requests that kernels make of the compiler."""

import llvmlite.binding
import numpy as np

from lfssao.kernels import jit


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
