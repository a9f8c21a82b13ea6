"""For other projects: checks of renderers and of sample sets as plain functions, and hypothesis strategies.

The names below are imported when they are first used; hypothesis only when a strategy is called.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lfssao.testing.conformance import assert_conforms
    from lfssao.testing.promises import PROMISES, Finding, Promise, check_promise
    from lfssao.testing.strategies import cameras, displays, gbuffers, radii, sample_sets

_MODULE_OF = {
    "PROMISES": "promises",
    "Finding": "promises",
    "Promise": "promises",
    "assert_conforms": "conformance",
    "cameras": "strategies",
    "check_promise": "promises",
    "displays": "strategies",
    "gbuffers": "strategies",
    "radii": "strategies",
    "sample_sets": "strategies",
}

__all__ = [
    "PROMISES",
    "Finding",
    "Promise",
    "assert_conforms",
    "cameras",
    "check_promise",
    "displays",
    "gbuffers",
    "radii",
    "sample_sets",
]


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'lfssao.testing' has no attribute '{name}'")
    return getattr(import_module(f"lfssao.testing.{_MODULE_OF[name]}"), name)


def __dir__() -> list[str]:
    return __all__
