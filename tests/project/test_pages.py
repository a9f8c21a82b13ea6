"""The documentation's pages: what they show runs and is true, and what they name is there."""

import inspect
import re
import sys
from pathlib import Path

import pytest
from pages import blocks, run_page

import lfssao

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


@pytest.mark.parametrize("home", [lfssao, lfssao.samples, lfssao.testing, lfssao.viz], ids=lambda home: home.__name__)
def test_the_reference_lists_each_public_name_once(home):
    text = (DOCS / "reference" / f"{home.__name__.rpartition('.')[2]}.md").read_text(encoding="utf-8")
    listed = re.findall(r"^   ([A-Za-z]\w*)$", text, re.MULTILINE)
    assert sorted(listed) == sorted(name for name in home.__all__ if not inspect.ismodule(getattr(home, name)))


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_a_page_that_is_linked_to_is_there(page):
    """Those of estimators, commands and notebooks are made later; Sphinx finds what is missing of these."""
    links = re.findall(r"\]\(([^):#]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8"))
    kept = [link for link in links if MADE.isdisjoint(Path(link).parts)]
    assert [link for link in kept if not (page.parent / link).exists()] == []
