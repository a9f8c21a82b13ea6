"""Compiled kernels as LLVM's intermediate code, in which arithmetic that is not as written is seen."""

import re
import sys

from numba.core.dispatcher import Dispatcher

from lfssao.core.jit import RowKernel

# Functions from outside that a kernel may call: Python's and numba's own, at its door; of LLVM those that move numbers,
# compare them, or round as IEEE says. C's square root becomes an instruction, and is rounded as IEEE says anywhere.
_ALLOWED = re.compile(
    r"_?Py\w+|NRT_\w+|numba_\w+|sqrtf?"
    r"|llvm\.(sqrt|fabs|floor|ceil|trunc|rint|copysign|abs|[su]min|[su]max|ct(lz|tz|pop)|masked\.\w+|mem(set|cpy|move)"
    r"|lifetime\.\w+|assume|expect|is\.fpclass|bitreverse|bswap|vector\.reduce\.(and|or|xor|add|[su]min|[su]max)"
    r"|\w+\.with\.overflow|x86\.atomic\.\w+"
    r"|experimental\.noalias\.scope\.decl)(\.[\w.]+)?"
)
# Flags that let a compiler reorder or fuse arithmetic, and the remainder, which libm computes.
_LOOSE = re.compile(
    r"\b(?:f(?:add|sub|mul|div|neg|cmp)|call|select|phi) (?:fast|contract|reassoc|afn|arcp|nnan|ninf|nsz)\b|\bfrem\b"
)


def faults(code):
    """Calls into libm and loose arithmetic of a module in LLVM's words."""
    called = re.findall(r"^declare [^@]*@\"?([\w.$]+)", code, re.MULTILINE)
    return {name for name in called if not _ALLOWED.fullmatch(name)} | set(_LOOSE.findall(code))


def compiled_kernels():
    """Name and code of each signature of each kernel of lfssao that this process compiled; not of one that it read."""
    seen = {}
    for name, module in list(sys.modules.items()):
        if name.partition(".")[0] == "lfssao":
            for each in vars(module).values():
                kernel = each.compiled if isinstance(each, RowKernel) else each
                if isinstance(kernel, Dispatcher) and not kernel.stats.cache_hits:
                    seen[f"{kernel.py_func.__module__}.{kernel.__name__}"] = kernel
    return [(f"{name}{signature}", code) for name, kernel in sorted(seen.items())
            for signature, code in kernel.inspect_llvm().items()]  # fmt: skip
