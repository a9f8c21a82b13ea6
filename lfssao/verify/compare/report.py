"""A report: text for a terminal, a table for a notebook, numbers for programs, JUnit XML for a CI."""

import html
import json
import math
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import cached_property
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

from lfssao.errors import InputError, check_type
from lfssao.files.whole import write_text
from lfssao.verify.compare.layers import stage_order
from lfssao.verify.compare.picture import Panels, save_panels
from lfssao.verify.compare.power import WEAK, Power
from lfssao.verify.compare.result import Result, Tolerance
from lfssao.verify.verdict import FAILED, SAME, WARNING, Verdict

if TYPE_CHECKING:
    from lfssao.verify.compare.causes import Cause
    from lfssao.verify.compare.page.textures import Textures

# 2: max_ulp may be null, results count texels beyond the tolerance. 3: a worst texel's reference is stored in mine's
# format, and ``before`` is the reference itself; results have ``power``, and 'inside, weakly' is a verdict.
FORMAT = 3
_MOST_LINES = 20
_MOST_NAMES = 6
_WORDS = {0: "conforms", 1: "passes, with warnings", 2: "FAILED", 3: "NOT COMPARABLE", 4: "FILE ERROR"}
# Columns of the table: numbers of verdicts, then figures.
_COLUMN = {
    Verdict.EQUAL_BITS: "equal bits",
    Verdict.EQUAL_VALUES: "inside",
    Verdict.INSIDE: "inside",
    Verdict.INSIDE_WEAKLY: "weakly",
    Verdict.WITHIN: "tolerated",
    Verdict.OUTSIDE: "outside",
    Verdict.DIFFERENT: "outside",
}
_COUNTS = ("equal bits", "inside", "weakly", "tolerated", "outside", "other")
_FIGURES = ("texels off", "max ulp", "mean", "RMSE", "PSNR", "SSIM")


@dataclass(frozen=True, eq=False)
class Report:
    """The outcome of a comparison; true if MINE conforms (exit code 0), so that a test may assert it.

    Attributes
    ----------
    mine, reference : str
        The folders or files.
    model : str or None
        The error model of the intervals; None if no interval is known.
    exact : bool
        Whether only equal bits pass.
    tolerance : Tolerance
        Limits of differences that pass outside the interval, with a warning.
    kit : bool
        Whether the modules are cases of a kit.
    estimator : str or None
        The reference's estimator if no intervals of its occlusion are known.
    modules : int
        Number of requested modules.
    results : tuple of Result
        One for each texture, module by module, in the order of the stages; a single one for an unreadable module.
    notes : tuple of str
        Warnings, for example on textures of the other renderer that were not compared.
    panels : Panels or None
        The panels of the difference picture.
    textures : Textures or None
        The textures of the page; None without a page.
    facts : tuple of (str, str)
        Names and texts for the page: date, version, settings of the reference, digests of files.

    Examples
    --------
    >>> lfssao.compare("mine.npy", "mine.npy").exit_code
    0
    """

    mine: str
    reference: str
    model: str | None
    exact: bool
    tolerance: Tolerance
    kit: bool
    estimator: str | None
    modules: int
    results: tuple[Result, ...]
    notes: tuple[str, ...] = ()
    panels: Panels | None = None
    textures: "Textures | None" = None
    facts: tuple[tuple[str, str], ...] = ()

    @property
    def exit_code(self) -> int:
        """0 same, 1 warnings only, 2 failed, 3 sizes, channels or types differ, 4 file error."""
        worst = max((self.code(result) for result in self.results), default=SAME)
        return WARNING if worst == SAME and self.notes else worst

    def __bool__(self) -> bool:
        return self.exit_code == SAME

    @cached_property
    def causes(self) -> "tuple[Cause, ...]":
        """The changes of the reference that explain wrong textures, each for all stages and modules."""
        if all(result.diagnosis is None for result in self.results):
            return ()
        from lfssao.verify.compare.causes import causes_of  # late: only diagnoses have causes

        return causes_of(self.results)

    @property
    def outcome(self) -> str:
        """The exit code and its meaning, in words."""
        return f"{_WORDS[self.exit_code]} (exit code {self.exit_code})"

    def code(self, result: Result) -> int:
        """The exit code of one result."""
        if self.exact and result.verdict is not Verdict.EQUAL_BITS:
            return max(FAILED, result.verdict.code)
        return result.verdict.code

    @property
    def first_difference(self) -> Result | None:
        """The first result without equal bits; a missing texture only if all such textures are missing."""
        return min((r for r in self.results if r.verdict is not Verdict.EQUAL_BITS), key=_is_missing, default=None)

    @property
    def first_failure(self) -> Result | None:
        """The first failing result, the earliest stage of the first such module; a missing one only if all are."""
        return min((r for r in self.results if self.code(r) > WARNING), key=_is_missing, default=None)

    def __str__(self) -> str:
        return "\n".join(self._lines())

    def _lines(self) -> Iterator[str]:
        known = "no interval is known" if self.model is None else f"intervals of the error model '{self.model}'"
        modules = _count(self.modules, "case" if self.kit else "module")
        yield f"{self.mine} against {self.reference}: {modules}, {known}{self.tolerance}"
        if self.estimator is not None:
            yield f"ao_1, ... of estimator {self.estimator} must have equal values: no intervals of it are known"
        formats = {(stage_order(r.layer), f"{r.layer}: {r.stored}") for r in self.results if r.stored}
        for _, words in sorted(formats):
            yield f"{words}; its interval is wider by that, and later stages are judged on what is read of it"
        yield ""
        yield from _table(self.summary())
        failing = [r for r in self.results if self.code(r) > WARNING and not _is_missing(r)]
        explained = {place for cause in self.causes for place in cause.places}
        for result in failing[:_MOST_LINES]:
            yield f"{result.place}: {result.sentence}"
            yield from (f"  {agreement.words(part)}" for part, agreement in result.agreement.items())
            if result.diagnosis is not None and result.place not in explained:
                yield f"  {result.diagnosis.words(result.module)}"
        if len(failing) > _MOST_LINES:
            yield f"... and {len(failing) - _MOST_LINES} more"
        shown = max((r for r in self.results if r.worst), key=self.code, default=None)
        if shown is not None and (self.code(shown) > SAME or self.exit_code <= WARNING):
            yield f"worst texels (column, row) of {shown.place}:"
            yield from (f"  {texel}" for texel in shown.blamed)
        yield from self._missing_lines()
        yield from self._power_lines()
        within = [f"{r.place}: {r.sentence}" for r in self.results if r.verdict is Verdict.WITHIN]
        warnings = [*self.weak_stages(), *within, *self.notes]
        yield from (f"warning: {warning}" for warning in warnings[:_MOST_LINES])
        if len(warnings) > _MOST_LINES:
            yield f"... and {len(warnings) - _MOST_LINES} more warnings"
        first = self.first_difference
        if first is not None:
            yield f"first that differs: {first.place} ({first.verdict.title})"
        yield from (f"diagnosis: {self._cause_sentence(cause)}" for cause in self.causes)
        yield self.outcome

    def _cause_sentence(self, cause: "Cause") -> str:
        """A cause in a sentence; for a single texture its diagnosis, which tells the share of decided texels."""
        alone = [r for r in self.results if len(cause.places) == 1 and r.place in cause.places]
        return next((r.diagnosis.words(r.module) for r in alone if r.diagnosis is not None), cause.words)

    def _power_lines(self) -> Iterator[str]:
        """Yield a line for each stage that is inside: the module with the least power."""
        for _, results in self._stages():
            inside = [result for result in results if result.power is not None]
            weakest = min(inside, key=_weakness, default=None)
            if weakest is not None:
                count = f" (the weakest of {len(inside)})" if len(inside) > 1 else ""
                yield f"{weakest.place}: {weakest.verdict.short}; {weakest.power}{count}"

    def weak_stages(self) -> Iterator[str]:
        """Yield a warning on each stage that is inside its interval weakly in some modules."""
        for name, results in self._stages():
            weak = [result.module for result in results if result.verdict is Verdict.INSIDE_WEAKLY]
            if weak:
                names = ", ".join([*weak[:_MOST_NAMES], *["..."] * (len(weak) > _MOST_NAMES)])
                count = _count(len(weak), "case" if self.kit else "module")
                yield f"{name} of {count} is inside, weakly: AO x {WEAK:g} would be inside as well ({names})"

    def _stages(self) -> list[tuple[str, list[Result]]]:
        """Layers and their results, in the order of the stages."""
        stages: dict[str, list[Result]] = {}
        for result in self.results:
            stages.setdefault(result.layer, []).append(result)
        return sorted(stages.items(), key=lambda stage: stage_order(stage[0]))

    def _missing_lines(self) -> Iterator[str]:
        """Yield a line on missing modules or cases, one on missing layers, and one on the first reason."""
        missing = [r for r in self.results if _is_missing(r)]
        words, unit = ("not tried", "case") if self.kit else ("not given", "module")
        modules = [r.module for r in missing if self.kit or not r.layer]
        if modules:
            names = ", ".join([*modules[:_MOST_NAMES], *["..."] * (len(modules) > _MOST_NAMES)])
            given = [r.module for r in self.results if self.kit and r.module not in modules]
            yield f"{words}: {len(modules)} of {_count(self.modules, unit)} ({names}){_option_hint('cases', given)}"
        layers = Counter(r.layer for r in missing if r.module not in modules)
        if layers:
            layers_of_count = {
                number: ", ".join(layer for layer in layers if layers[layer] == number) for number in layers.values()
            }
            layer_lines = (
                f"{names} ({_count(number, 'module')}{' each' * (', ' in names)})"
                for number, names in layers_of_count.items()
            )
            given = [r.layer for r in self.results if r.layer and r.layer not in layers]
            yield f"not given: {', '.join(layer_lines)}{_option_hint('layers', given)}"
        yield from (f"  {r.place}: {r.detail}" for r in missing[:1])

    def summary(self) -> list[list[str]]:
        """One row for each stage, below a header: counts and texels over the modules, the worst module's figures."""
        rows = [["stage", *_COUNTS, *_FIGURES]]
        rows += [_row(name or "(whole module)", results) for name, results in self._stages()]
        weak = any(result.verdict is Verdict.INSIDE_WEAKLY for result in self.results)
        is_unused = {"weakly": not weak, "tolerated": not self.tolerance}
        columns = [k for k, head in enumerate(rows[0]) if not is_unused.get(head, False)]
        return [[row[k] for k in columns] for row in rows]

    def as_dict(self) -> dict[str, Any]:
        """The whole report for JSON: infinite and undefined numbers are strings or null."""
        first = self.first_difference
        failure = self.first_failure
        return {
            "format": FORMAT,
            "mine": self.mine,
            "reference": self.reference,
            "model": self.model,
            "exact": self.exact,
            "fail": self.tolerance.fail,
            "fail_percent": self.tolerance.percent,
            "exit_code": self.exit_code,
            "first_difference": first and {"module": first.module, "layer": first.layer},
            "first_failure": failure and {"module": failure.module, "layer": failure.layer},
            "notes": list(self.notes),
            "causes": [_json_numbers(asdict(cause)) for cause in self.causes],
            "results": [
                _json_numbers({**asdict(r), "verdict": r.verdict.title, "exit_code": self.code(r)})
                for r in self.results
            ],
        }

    def as_json(self) -> str:
        """``as_dict`` as JSON."""
        return json.dumps(self.as_dict(), indent=1, allow_nan=False)

    def write_json(self, path: str | Path) -> None:
        """Write ``as_json`` to a file; InputError if it cannot be written."""
        write_text(_path(path), f"{self.as_json()}\n")

    def write_junit(self, path: str | Path) -> None:
        """Write JUnit XML, a suite for each module, a case for each stage; InputError if it cannot be written."""
        text = ElementTree.tostring(self._junit(), encoding="unicode", xml_declaration=False)
        write_text(_path(path), f'<?xml version="1.0" encoding="utf-8"?>\n{text}\n')

    def _junit(self) -> ElementTree.Element:
        top = ElementTree.Element("testsuites", name="lfssao compare")
        for module, group in groupby(self.results, lambda result: result.module):
            results = list(group)
            codes = [self.code(result) for result in results]
            failures = sum(c == FAILED for c in codes)
            errors = sum(c > FAILED for c in codes)
            counts = {"tests": str(len(results)), "failures": str(failures), "errors": str(errors)}
            suite = ElementTree.SubElement(top, "testsuite", {"name": _xml_text(module), **counts})
            for result, code in zip(results, codes, strict=True):
                names = {"classname": _xml_text(module), "name": _xml_text(result.layer or "file")}
                case = ElementTree.SubElement(suite, "testcase", names)
                if code == WARNING:
                    ElementTree.SubElement(case, "system-out").text = _xml_text(result.sentence)
                elif code != SAME:
                    kind = "failure" if code == FAILED else "error"
                    wrong = ElementTree.SubElement(case, kind, message=_xml_text(result.sentence))
                    wrong.text = _xml_text("\n".join(str(texel) for texel in result.blamed))
        return top

    def save_picture(self, path: str | Path) -> None:
        """Draw the first failing module, else the first that differs, else the first: both sides, difference, verdict.

        InputError if nothing was compared or the file cannot be written.
        """
        save_panels(self.panels, _path(path))

    def write_html(self, path: str | Path) -> None:
        """Write one HTML file with a viewer of all textures; InputError without textures or if it cannot be written."""
        from lfssao.verify.compare.page.page import page_text  # late: only a page needs its templates

        if self.textures is None:
            raise InputError(f"{path}: the comparison was made without page=True, it kept no textures")
        write_text(_path(path), page_text(self, self.textures))

    def _repr_html_(self) -> str:
        head, *rows = ([html.escape(cell) for cell in row] for row in self.summary())
        cells = "".join(f"<th>{cell}</th>" for cell in head)
        body = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows)
        failure = self.first_failure or self.first_difference
        first = [] if failure is None or _is_missing(failure) else [f"{failure.place}: {failure.sentence}"]
        more = "".join(f"; {line.strip()}" for line in (*first, *self._missing_lines(), *self.weak_stages()))
        title = f"<b>{_WORDS[self.exit_code]}</b>{html.escape(str(self.tolerance) + more)}"
        return f"<p>{title}</p><table><thead><tr>{cells}</tr></thead><tbody>{body}</tbody></table>"


def _path(path: str | Path) -> Path:
    check_type("path", path, str | Path)
    return Path(path)


def _weakness(result: Result) -> tuple[float, float]:
    """A key that sorts results that are inside, those with the largest undetected error first."""
    power = result.power or Power(0.0)
    return (power.factor or 0.0), -power.width


def _is_missing(result: Result) -> bool:
    return result.verdict is Verdict.MISSING


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'s' * (number != 1)}"


def _option_hint(option: str, names: list[str]) -> str:
    return f"; compare what is there by --{option} {','.join(dict.fromkeys(names))}" if names else ""


def _row(name: str, results: list[Result]) -> list[str]:
    numbers = Counter(_COLUMN.get(r.verdict, "other") for r in results)
    counts = [name, *(str(numbers[column]) for column in _COUNTS)]
    measured = [r.metrics for r in results if r.metrics is not None]
    if not measured:
        return counts + [""] * len(_FIGURES)
    off = sum(m.differing for m in measured)
    ulps = [m.max_ulp for m in measured if m.max_ulp is not None]
    ulp = str(max(ulps)) if len(ulps) == len(measured) else "-"
    mean = max(m.mean_error for m in measured)
    rmse = max(m.rmse for m in measured)
    psnr = min((m.psnr for m in measured if m.psnr is not None), default=math.inf)
    ssim = min((m.ssim for m in measured if m.ssim is not None), default=math.nan)
    return [*counts, str(off), ulp, f"{mean:.3g}", f"{rmse:.3g}", f"{psnr:.1f}", f"{ssim:.6f}"]


def _table(rows: list[list[str]]) -> Iterator[str]:
    """Rows as lines of columns of equal width."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    for row in rows:
        cells = [row[0].ljust(widths[0]), *(cell.rjust(w) for cell, w in zip(row[1:], widths[1:], strict=True))]
        yield "  ".join(cells).rstrip()
    yield ""


def _json_numbers(value: Any) -> Any:
    """The value with strings in place of numbers that JSON lacks."""
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    if isinstance(value, dict):
        return {key: _json_numbers(item) for key, item in value.items()}
    return [_json_numbers(item) for item in value] if isinstance(value, list | tuple) else value


def _xml_text(text: str) -> str:
    """The text without characters that XML cannot hold; names in files may have them."""
    return re.sub("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]", "?", text)
