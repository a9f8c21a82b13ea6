"""For the tests of other projects; the names below are imported when they are first used."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lfssao.testing.conformance import assert_conforms

_MODULE_OF = {
    "assert_conforms": "conformance",
}

__all__ = ["assert_conforms"]


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'lfssao.testing' has no attribute '{name}'")
    return getattr(import_module(f"lfssao.testing.{_MODULE_OF[name]}"), name)


def __dir__() -> list[str]:
    return __all__
