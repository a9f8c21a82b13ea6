"""What ``max`` and ``min`` of several numbers are in kernels: numba itself compiles a function for each use of them."""

import builtins
import operator
from typing import Any

from numba import extending, types
from numba.core.typing import signature
from numba.core.typing.templates import AbstractTemplate, infer_global
from numba.cpython.builtins import do_minmax


def largest(*numbers: Any) -> Any:
    """Python's ``max``: a later number only where it is greater, so that NaN stays where it comes first."""
    return builtins.max(*numbers)


def smallest(*numbers: Any) -> Any:
    """Python's ``min``, likewise."""
    return builtins.min(*numbers)


class _OfNumbers(AbstractTemplate):  # type: ignore[misc]
    """The one type that all arguments have in common."""

    def generic(self, arguments: Any, _named: Any) -> Any:
        kinds = tuple(map(types.unliteral, arguments))
        common = self.context.unify_types(*kinds)
        return signature(common, *kinds) if isinstance(common, types.Number) else None


def _translate(function: Any, before: Any) -> None:
    """Let calls of a function become numba's own lines for max or min, in place."""
    infer_global(function)(type(function.__name__, (_OfNumbers,), {"key": function}))

    @extending.lower_builtin(function, types.VarArg(types.Number))
    def find(context: Any, builder: Any, of: Any, arguments: Any) -> Any:
        return do_minmax(context, builder, of.args, arguments, before)


_translate(largest, operator.gt)
_translate(smallest, operator.lt)
