"""For other projects: checks of renderers and of sample sets, cases of the kit, and hypothesis strategies.

The names below are imported when they are first used; only the strategies import hypothesis.
"""

from typing import TYPE_CHECKING

from lfssao.core.late_names import late_names

if TYPE_CHECKING:
    from lfssao.samples.properties import PROMISES, Finding, Promise, assert_promise, check_promise, check_sampler
    from lfssao.verify.kit.cases import make_case
    from lfssao.verify.kit.folder import write_kit
    from lfssao.verify.testing.conformance import assert_conforms
    from lfssao.verify.testing.strategies import cameras, displays, gbuffers, radii, sample_sets

__getattr__, __dir__ = late_names(
    __name__,
    {
        "samples.properties": ("PROMISES", "Finding", "Promise", "assert_promise", "check_promise", "check_sampler"),
        "verify.kit.cases": ("make_case",),
        "verify.kit.folder": ("write_kit",),
        "verify.testing.conformance": ("assert_conforms",),
        "verify.testing.strategies": ("cameras", "displays", "gbuffers", "radii", "sample_sets"),
    },
)

__all__ = [
    "PROMISES", "Finding", "Promise", "assert_conforms", "assert_promise", "cameras", "check_promise", "check_sampler",
    "displays", "gbuffers", "make_case", "radii", "sample_sets", "write_kit",
]  # fmt: skip
