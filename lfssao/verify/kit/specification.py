"""The kit's specification: one text, and one section for each estimator that has a file of its own."""

from functools import cache
from importlib.resources import files

from lfssao.ao.estimators.registry import ESTIMATORS
from lfssao.ao.post import blur_weights
from lfssao.samples.spiral import BEST_TURNS

_TURNS_A_LINE = 25


def is_specified(estimator: str) -> bool:
    """Whether the specification has a section on an estimator."""
    return files("lfssao.verify.kit").joinpath(f"estimator_{estimator}.md").is_file()


@cache
def specification() -> str:
    """The text of SPECIFICATION.md: the stages, then the estimators that are specified.

    They stand in the order of the registry, in which an estimator comes before those that are made of it.
    """
    names = [
        "SPECIFICATION.md",
        "ESTIMATORS.md",
        *(f"estimator_{name}.md" for name in ESTIMATORS if is_specified(name)),
    ]
    whole = "\n".join(files("lfssao.verify.kit").joinpath(name).read_text(encoding="utf-8") for name in names)
    weights = "\n".join(f"    {weight!s}" for weight in blur_weights(1.0))
    lines = [BEST_TURNS[k : k + _TURNS_A_LINE] for k in range(0, len(BEST_TURNS), _TURNS_A_LINE)]
    turns = "\n".join("    " + " ".join(map(str, line)) for line in lines)
    return whole.replace("<!-- weights -->", weights).replace("<!-- turns -->", turns)
