"""The kit's specification: the stages, and the estimators, of which each has a file of its own."""

from functools import cache
from importlib.resources import files

from lfssao.ao.estimators.registry import of_one_view
from lfssao.ao.post import blur_weights
from lfssao.samples.spiral import BEST_TURNS

_TURNS_A_LINE = 25


@cache
def specification() -> dict[str, str]:
    """The texts by the names of their files: SPECIFICATION.md, the stages, and ESTIMATORS.md.

    Estimators stand in the order of the registry, in which one comes before those that are made of it.
    """
    parts = ["ESTIMATORS.md", *(f"estimator_{name}.md" for name in of_one_view() if name != "lf")]
    weights = "\n".join(f"    {weight!s}" for weight in blur_weights(1.0))
    lines = [BEST_TURNS[k : k + _TURNS_A_LINE] for k in range(0, len(BEST_TURNS), _TURNS_A_LINE)]
    turns = "\n".join("    " + " ".join(map(str, line)) for line in lines)
    return {
        "SPECIFICATION.md": _text("SPECIFICATION.md").replace("<!-- weights -->", weights),
        "ESTIMATORS.md": "\n".join(map(_text, parts)).replace("<!-- turns -->", turns),
    }


def _text(name: str) -> str:
    return files("lfssao.verify.kit").joinpath(name).read_text(encoding="utf-8")
