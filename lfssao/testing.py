"""For other projects: checks of renderers and of sample sets, cases of the kit, and hypothesis strategies."""

from typing import TYPE_CHECKING, Any

from lfssao.samples.assertions import assert_promise, assert_sampler, check_sampler
from lfssao.samples.properties import PROMISES, Finding, Findings, Promise, check_promise
from lfssao.verify.kit.cases import make_case
from lfssao.verify.kit.folder import write_kit
from lfssao.verify.testing.conformance import assert_conforms

if TYPE_CHECKING:
    from lfssao.verify.testing.strategies import cameras, displays, gbuffers, radii, sample_sets

__all__ = [
    "PROMISES", "Finding", "Findings", "Promise", "assert_conforms", "assert_promise", "assert_sampler", "cameras",
    "check_promise", "check_sampler", "displays", "gbuffers", "make_case", "radii", "sample_sets", "write_kit",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    from lfssao.verify.testing import strategies  # late: hypothesis is no dependency

    return getattr(strategies, name)
