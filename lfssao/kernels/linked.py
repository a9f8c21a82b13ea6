"""Functions that only kernels call: LLVM's code of them, of which each kernel makes its own machine code.

numba makes machine code of every function that it compiles, and optimises it, whoever calls it. Of functions that
end in kernels this is thrown away: an eighth of the time that it takes to compile what a render needs.
"""

from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler


class _Linked(JITCodeLibrary):  # type: ignore[misc]
    """Optimised code, not made into machine code."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True

    def serialize_using_object_code(self) -> Any:
        return self.serialize_using_bitcode()


class _Raw(_Linked):
    """Code as it was written: a loop that threads share has one kernel, and is optimised there."""

    def _optimize_final_module(self) -> None:
        pass


class Unaliased(Compiler):  # type: ignore[misc]
    """Compiles a function none of whose arrays shares memory with another that is written: its loops become vectors."""

    def __init__(self, typing: Any, target: Any, library: Any, arguments: Any, returns: Any, flags: Any, names: Any):
        flags.noalias = True
        super().__init__(typing, target, library, arguments, returns, flags, names)


class Linked(Compiler):  # type: ignore[misc]
    """Compiles a function that kernels call, and nobody else."""

    library: type[_Linked] = _Linked

    def __init__(self, typing: Any, target: Any, _library: Any, arguments: Any, returns: Any, flags: Any, names: Any):
        flags.no_compile = True
        super().__init__(typing, target, self.library(target.codegen(), "linked"), arguments, returns, flags, names)

    def _compile_core(self) -> Any:
        made = super()._compile_core()
        made = made._replace(entry_point=made.fndesc)  # what numba knows it by in place of a function to call
        self.state.targetctx.insert_user_function(made.entry_point, made.fndesc, [made.library])
        return made


class Loop(Linked, Unaliased):
    """Compiles a loop that threads share."""

    library = _Raw


def for_kernels(dispatcher: Any) -> Any:
    """The dispatcher of a function compiled by ``Linked``: it keeps none among what Python may call."""
    dispatcher._insert = lambda *_: None
    return dispatcher
