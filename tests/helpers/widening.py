"""Where a compiled kernel widens float32 to float64 without saying so, as numba does for float32 times an integer.

Such a step computes in more precision than the textures have, and nobody who reads the formula sees it. What is
meant says ``np.float64(x)``. Only kernels that this process compiled are looked at, not those it found compiled.
"""

import importlib
import pkgutil

from numba.core import ir, types

import lfssao.kernels


def widened():
    """What ``widened_in`` finds in all kernels."""
    modules = [
        importlib.import_module(m.name) for m in pkgutil.iter_modules(lfssao.kernels.__path__, "lfssao.kernels.")
    ]
    kernels = {value for module in modules for value in vars(module).values() if hasattr(value, "overloads")}
    return sorted({line for kernel in kernels for line in widened_in(kernel)})


def widened_in(function):
    """Lines like 'circle_crossing, line 52: a = ...' of a compiled function."""
    for compiled in function.overloads.values():
        if isinstance(compiled.type_annotation, str):  # of code that was read from a file
            continue
        known = dict(compiled.type_annotation.typemap)
        for step in assignments(compiled.type_annotation.blocks):
            if known.get(step.target.name) == types.float64 and not _is_meant(step.value, known):
                yield f"{function.__name__}, line {step.loc.line}: {step}"


def assignments(blocks):
    """Every assignment in blocks of numba's code, those of parallel loops' bodies among them."""
    for block in blocks.values():
        yield from block.find_insts(ir.Assign)
        for loop in block.body:
            yield from assignments(getattr(loop, "loop_body", {}))


def _is_meant(value, known):
    """Whether no operand is a float32; or a conversion asks for it, or a kernel, which is looked at itself."""
    called = known.get(value.func.name) if isinstance(value, ir.Expr) and value.op == "call" else None
    if isinstance(called, (types.NumberClass, types.Dispatcher)):
        return True
    operands = [value] if isinstance(value, ir.Var) else value.list_vars() if isinstance(value, ir.Expr) else []
    return not any(known.get(operand.name) == types.float32 for operand in operands)
