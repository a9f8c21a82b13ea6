"""For other projects: checks of renderers and of sample sets, cases of the kit, and hypothesis strategies.

The names below are imported when they are first used; hypothesis only when a strategy is called.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lfssao.samples.properties import PROMISES, Finding, Promise, check_promise
    from lfssao.verify.kit.cases import make_case
    from lfssao.verify.kit.folder import write_kit
    from lfssao.verify.testing.conformance import assert_conforms
    from lfssao.verify.testing.strategies import cameras, displays, gbuffers, radii, sample_sets

_MODULE_OF = {
    "PROMISES": "samples.properties",
    "Finding": "samples.properties",
    "Promise": "samples.properties",
    "assert_conforms": "verify.testing.conformance",
    "cameras": "verify.testing.strategies",
    "check_promise": "samples.properties",
    "displays": "verify.testing.strategies",
    "gbuffers": "verify.testing.strategies",
    "make_case": "verify.kit.cases",
    "radii": "verify.testing.strategies",
    "sample_sets": "verify.testing.strategies",
    "write_kit": "verify.kit.folder",
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
    "make_case",
    "radii",
    "sample_sets",
    "write_kit",
]


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'lfssao.testing' has no attribute '{name}'")
    return getattr(import_module(f"lfssao.{_MODULE_OF[name]}"), name)


def __dir__() -> list[str]:
    return __all__
