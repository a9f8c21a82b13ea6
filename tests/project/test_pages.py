"""The documentation's pages: what they show runs and is true, and what they name is there."""

import sys
from pathlib import Path

import pytest
from pages import blocks, run_page

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
MADE = {"_build", "made", "notebooks", "generated"}
PAGES = [page for page in sorted(DOCS.rglob("*.md")) if MADE.isdisjoint(page.relative_to(DOCS).parts)]
SHOWN = [page for page in PAGES if blocks(page.read_text(encoding="utf-8"))]


def name_of(page):
    return str(page.relative_to(DOCS))


def test_each_role_has_a_tutorial():
    assert {"tutorials/renderer.md", "tutorials/sampler.md", "tutorials/jupyter.md"} <= set(map(name_of, SHOWN))


@pytest.mark.parametrize("page", SHOWN, ids=name_of)
def test_commands_and_python_run_as_they_stand(page, tmp_path, monkeypatch):
    """All in turn in one folder, with what is printed below them."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    before = set(sys.modules)
    run_page(page.read_text(encoding="utf-8"))
    for name in set(sys.modules) - before:
        if str(tmp_path) in str(getattr(sys.modules[name], "__file__", "")):
            del sys.modules[name]
