"""Rules of verdicts on the papers' claims: each refuses its control, and none does when it is weakened."""

import ast
import inspect
import json
import textwrap

import numpy as np
import papers_page
import pytest
import results
from papers_common import PAPERS, RESULTS, moved, renamed

MEASURED = json.loads((RESULTS / "papers.json").read_text())
PAGE = results.PAGE.read_text()


def verdict(judge, name, state):
    """Verdict of a rule on what was measured, or on its control."""
    limits = {key: PAPERS[name][key] for key in inspect.signature(judge).parameters if key != "found"}
    whole, part, _ = judge(MEASURED[name][state], **limits)
    return "reproduced" if whole else "depends" if part else "contradicted"


def comparisons(judge):
    return sum(isinstance(node, ast.Compare) for node in ast.walk(ast.parse(textwrap.dedent(inspect.getsource(judge)))))


def weakened(judge, chosen):
    """The rule with some of its comparisons, by their places in it, always true."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(judge)))
    place = iter(range(10**6))

    class Weaken(ast.NodeTransformer):
        def visit_Compare(self, node):
            return ast.copy_location(ast.Constant(True), node) if next(place) in chosen else node

    space = dict(vars(inspect.getmodule(judge)))
    exec(compile(ast.fix_missing_locations(Weaken().visit(tree)), "<weakened>", "exec"), space)
    return space[judge.__name__]


def test_all_controls_are_refused():
    verdicts = {name: verdict(claim.judge, name, "control") for name, claim in papers_page.CLAIMS.items()}
    assert [name for name, word in verdicts.items() if word == "reproduced"] == []
    assert PAGE.count(": refused |") == len(verdicts)


@pytest.mark.parametrize("name", papers_page.CLAIMS)
def test_a_rule_without_its_comparisons_passes_its_control(name):
    judge = papers_page.CLAIMS[name].judge
    assert verdict(weakened(judge, ()), name, "control") == verdict(judge, name, "control")
    assert verdict(weakened(judge, range(comparisons(judge))), name, "control") == "reproduced"


def test_damaged_inputs_have_the_values_of_other_places():
    texture = np.arange(12.0).reshape(3, 4)
    seen = np.tile([True, True, False, True], (3, 1))
    out = moved(texture, seen)
    assert sorted(out[seen]) == sorted(texture[seen])
    assert (out != texture)[seen].all()
    assert (out == texture)[~seen].all()
    assert renamed({"rows": {"a": 1, "b": 2, "c": 3}}) == {"rows": {"a": 2, "b": 3, "c": 1}}
