"""The page of a report: one HTML file with its pictures, styles and script, which asks no network for anything."""

from base64 import b64encode
from hashlib import sha256
from importlib.resources import files
from typing import Any
from urllib.parse import quote

import numpy as np
from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

from lfssao.verify.compare.layers import stage_order
from lfssao.verify.compare.page.textures import RAMPS, Textures, code_png
from lfssao.verify.compare.result import Result
from lfssao.verify.diagnosis.change import purpose
from lfssao.verify.verdict import SAME, WARNING, Verdict

_MOST_ROWS = 12  # modules that have a row of words each; more modules are signs in rows of their layers
_SIGNS = {"equal": "=", "inside": "\N{ALMOST EQUAL TO}", "weak": "?", "wrong": "\N{MULTIPLICATION X}"}


def page_text(report: Any, textures: Textures) -> str:
    """Return the whole file of a ``Report``, which itself writes pages, and of the textures that it has kept."""
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    environment.filters["purpose"] = purpose
    endings = "html.j2", "css", "js"
    template, style, script = (Markup((files(__package__) / f"page.{e}").read_text("utf-8")) for e in endings)
    results = [_shown(result, report.code(result), textures) for result in report.results]
    cells: dict[str, dict[str, Any]] = {}
    start = _common([result.module for result in report.results])
    for shown in results:
        shown["short"] = shown["result"].module[start:]
        cells.setdefault(shown["result"].module, {})[shown["result"].layer] = shown
    first = report.first_failure or report.first_difference or next(iter(report.results), None)
    text = environment.from_string(template).render(
        report=report,
        style=style,
        script=script,
        policy=f"default-src 'none'; img-src data:; style-src {_hash(style)}; script-src {_hash(script)}",
        layers=sorted({result.layer for result in report.results}, key=stage_order),
        cells=cells,
        most_rows=_MOST_ROWS,
        kinds={shown["kind"] for shown in results},
        results=results,
        warnings=[*report.weak_stages(), *report.notes],
        first=next((shown for shown in results if shown["result"] is first), None),
        ramps={words: code_png(np.array([codes], np.uint8)) for words, codes in RAMPS.items()},
        small=len(textures.small),
        left_out=len(textures.left_out),
    )
    return text.encode("utf-8", "backslashreplace").decode("utf-8")  # names of files may hold half a character


def _shown(result: Result, code: int, textures: Textures) -> dict[str, Any]:
    equal = result.verdict in (Verdict.EQUAL_BITS, Verdict.EQUAL_VALUES)
    weak = code == WARNING and result.verdict is Verdict.INSIDE_WEAKLY
    kind = "weak" if weak else "wrong" if code != SAME else "equal" if equal else "inside"
    return {
        "result": result,
        "kind": kind,
        "sign": _SIGNS[kind],
        "words": result.verdict.short,
        "link": "/".join(quote(name, safe="", errors="backslashreplace") for name in (result.module, result.layer)),
        "textures": textures.kept.get((result.module, result.layer)),
        "samples": {
            (t.column, t.row): textures.samples.get((result.module, result.layer, t.column, t.row))
            for t in result.worst
        },
    }


def _common(names: list[str]) -> int:
    """Number of characters with which all names begin."""
    ends = (min(names), max(names)) if names else ("", "")
    return next((k for k, (one, other) in enumerate(zip(*ends, strict=False)) if one != other), 0)


def _hash(source: str) -> str:
    """The source that lets a browser run a script or use a style by its Content-Security-Policy, and no other."""
    return f"'sha256-{b64encode(sha256(source.encode()).digest()).decode()}'"
