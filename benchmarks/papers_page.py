"""The page of results, made from the measured numbers and from the papers' claims (papers_*.toml)."""

import inspect
import json
import re
from collections.abc import Iterable, Sequence
from typing import Any

import papers_lf
import papers_lf_mapping
import papers_lf_samples
import papers_sao
import papers_sao_counts
import papers_sao_depth
import papers_sao_times
import papers_vo
import papers_vo_samples
import papers_vo_volume
from papers_common import PAPERS, RESULTS, Claim

_ROOMS = (
    papers_lf, papers_lf_mapping, papers_lf_samples, papers_sao, papers_sao_counts, papers_sao_depth, papers_sao_times,
    papers_vo, papers_vo_samples, papers_vo_volume,
)  # fmt: skip
_MEASURED = {name: claim for room in _ROOMS for name, claim in room.CLAIMS.items()}
CLAIMS: dict[str, Claim] = {name: _MEASURED[name] for name, paper in PAPERS.items() if "why" not in paper}

_HEAD = """\
# Three papers, measured

`python benchmarks/results.py` measures all of this again and writes this page from its numbers,
[papers.json](results/papers.json). The claims and the papers' own numbers are in [papers_lf.toml](papers_lf.toml),
[papers_sao.toml](papers_sao.toml) and [papers_vo.toml](papers_vo.toml). A verdict follows from the measured numbers by
the rule in italics. LF is Doronin et al. 2017, SAO McGuire et al. 2012, VO Loos and Sloan 2010. Each rule has a
control, an input of which the claim is not true, chosen before it was measured: the rule must not find it reproduced.
Rules that did were mended: LF figures 10 to 13, VO figures 4, 5, 6 and 8, VO sections 4.1 and 5, and 4.5 on the random
texture. A claim that nothing here can measure has the reason in place of a verdict. Radii in per cent are of the
scene's diagonal. Times are processor time of one thread, the least of runs in turn, so that other work on the machine
slows the measurement and does not bend it; the median of all runs over the least says how much other work there was."""


def page(result: dict[str, Any], work_precision: str = "") -> str:
    """The page, from all that was measured and the text of the work-precision run."""
    told = {name: judged(name, result[name]["measured"]) for name in CLAIMS if name in result}
    controls = {name: judged(name, result[name]["control"]) for name in told}
    rows = [
        (f"[{name}]({anchor(name)})", _line(paper["says"]), told[name][1], f"**{told[name][0]}**",
         _controlled(name, controls))
        if name in told else (name, _line(paper["says"]), _line(paper["why"]), "no verdict", "-")
        for name, paper in PAPERS.items() if name in told or "why" in paper
    ]  # fmt: skip
    out = [_HEAD, "", _measured_where(result), "", "## Verdicts", ""]
    out += table(("", "the paper", "measured", "verdict", "control"), rows, "---")
    for name, (word, here) in told.items():
        out += ["", *_section(name, word, here, controls[name], result[name]["measured"]["rows"])]
    return re.sub(r"(?<=\d)%", " %", "\n".join(out)) + "\n" + work_precision


def judged(name: str, found: dict[str, Any]) -> tuple[str, str]:
    """A claim's verdict in words, and the measured in a sentence."""
    judge = CLAIMS[name].judge
    paper = PAPERS[name]
    limits = [key for key in inspect.signature(judge).parameters if key != "found"]
    whole, part, told = judge(found, **{key: paper[key] for key in limits})
    word = "reproduced" if whole else f"depends on {paper['depends']}" if part else "contradicted"
    return word, _line(paper["here"]).format(**told)


def _controlled(name: str, controls: dict[str, tuple[str, str]]) -> str:
    """A control, and whether the rule refuses it."""
    word = "**passed**" if controls[name][0] == "reproduced" else "refused"
    return f"{_line(PAPERS[name]['control'])}: {word}"


def table(head: Sequence[str], rows: Iterable[Sequence[str]], rule: str = "---:") -> list[str]:
    """A Markdown table; rule: how all columns but the first stand."""
    return ["| " + " | ".join(row) + " |" for row in (head, ["---", *[rule] * (len(head) - 1)], *rows)]


def anchor(title: str) -> str:
    """The place of a title, as GitHub links it."""
    return "#" + re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")


def _line(text: str) -> str:
    return " ".join(text.split())


def _measured_where(result: dict[str, Any]) -> str:
    """Machines and dates of the entries, and how many were measured small."""
    places = dict.fromkeys(f"{e['date']}, lfssao {e['lfssao']}, {e['processor']}" for e in result.values())
    small = sum(entry["quick"] for entry in result.values())
    seconds = sum(entry["seconds"] for entry in result.values())
    trial = f" **{small} of these are trials with small textures.**" if small else ""
    return f"Measured {'; '.join(places)}, in {seconds / 60:.0f} minutes of processor time.{trial}"


def _section(name: str, word: str, here: str, control: tuple[str, str], rows: dict[str, Any]) -> list[str]:
    paper = PAPERS[name]
    out = [f"## {name}", "", f"{_line(paper['says'])} Measured: {here}. **{word[0].upper()}{word[1:]}.**", ""]
    out += [_line(paper["setup"]), f"*{_line(paper['rule']).format(**paper)}*", _line(paper.get("note", ""))]
    out += [f"Control, {_line(paper['control'])}: {control[1]}; {control[0]}.", ""]
    picture = anchor(name)[1:] + ".png"
    if (RESULTS / picture).exists():
        out += [f"![{name}](results/{picture})", ""]
    columns = paper["columns"]
    theirs = paper.get("theirs", {})
    cells = [
        [row, *(format(found[key], form) if key in found else "-" for key, _, form in columns)]
        + ([f"{theirs[row]:g}"] if theirs else []) for row, found in rows.items()
    ]  # fmt: skip
    head = ["", *(title for _, title, _ in columns), *([paper["theirs_head"]] if theirs else [])]
    return out + table(head, cells)


def work_precision_text() -> str:
    """Most of the work-precision run's own page without its fronts, if there is a run beside the results."""
    path = RESULTS / "work-precision.json"
    if not path.exists():
        return ""
    from lfssao.bench.work_precision.page import as_text

    text = as_text(json.loads(path.read_text())).replace("](work-precision", "](results/work-precision")
    first, *errors = text.split("\n## Slopes")[0].split("\n![")
    told = "\n## ".join(first.split("\n## ")[:-1]).split("\n", 1)[1].replace("## ", "### ").strip()
    pictures = "\n".join(f"![{part.split(')')[0]})" for part in errors)
    links = "All of it: [page](results/work-precision.md), [numbers](results/work-precision.json)."
    return f"\n## Error against run time\n\n{told}\n\n{pictures}\n\n{links}\n"
