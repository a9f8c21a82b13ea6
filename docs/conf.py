"""Settings of Sphinx: ``sphinx-build -W --keep-going docs docs/_build/html`` makes the pages."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import pages

import lfssao

project = "lfssao"
author = "The lfssao developers"
version = release = lfssao.__version__
html_title = f"lfssao {release}"
html_show_copyright = False

extensions = ["sphinx.ext.autosummary", "sphinx.ext.mathjax", "numpydoc", "myst_nb", "sphinx_design"]
exclude_patterns = ["_build"]
templates_path = ["_templates"]

# Texts of other folders are included, and their headings are linked to.
myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 3

# Notebooks hold what running them gives.
nb_execution_mode = "off"

# A page a public name; docstrings tell types and units.
autodoc_typehints = "none"
autodoc_default_options = {"members": True}
autodoc_member_order = "bysource"
numpydoc_show_class_members = False

html_theme = "pydata_sphinx_theme"
html_static_path = ["_static"]
html_css_files = ["lfssao.css"]
html_theme_options = {
    "show_toc_level": 2,
    "header_links_before_dropdown": 5,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["sphinx-version"],
    "footer_end": ["theme-version"],
}
html_show_sourcelink = False
# Pages without pages below them have the room of the left bar.
html_sidebars = {
    name: []
    for name in (
        *("index", "displays", "files", "kit", "kit_estimators", "own_estimator", "results", "work_precision"),
        *("limits", "benchmarks", "mutants", "contributing", "changes", "made/commands", "made/shaders"),
    )
}


def skip_member(app, kind, name, member, skip, options):
    """Skip a field of a named tuple: its class describes it."""
    return skip or str(getattr(member, "__doc__", "")).startswith("Alias for field number")


def setup(app):
    """Make pages of the registry, the commands and the notebooks first; lead links of included texts to their pages."""
    pages.write_all()
    app.connect("include-read", pages.lead_links)
    app.connect("autodoc-skip-member", skip_member)
