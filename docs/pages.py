"""Pages that are made of the package: its estimators, published shaders, commands and notebooks."""

import base64
import json
import os
import re
import shutil
from contextlib import redirect_stdout, suppress
from io import StringIO
from pathlib import Path

from lfssao.ao.estimators.published import published_names, published_text
from lfssao.ao.estimators.registry import ESTIMATORS
from lfssao.cli.main import COMMANDS, main
from lfssao.verify.bounds.registry import has_bounds

DOCS = Path(__file__).resolve().parent
ROOT = DOCS.parent
KIT = ROOT / "lfssao" / "verify" / "kit"
MADE = DOCS / "made"
NOTEBOOKS = DOCS / "notebooks"
COLUMNS = "100"  # of a command's help

# Pages that show a text of another folder.
SHOWN = {
    "benchmarks/README.md": "benchmarks.md",
    "benchmarks/RESULTS.md": "results.md",
    "benchmarks/results/mutants.md": "mutants.md",
    "benchmarks/results/work-precision.md": "work_precision.md",
    "benchmarks/README.md#how-to-write-an-estimator": "own_estimator.md",
}


def lead_links(app, path, docname, text):
    """Lead relative links of an included text to the page that shows the file, or to the file itself.

    Parts of the kit's specification have headings of the third level, their pages one of the first: they rise by one.
    """
    source = (DOCS / path).resolve()
    page = (DOCS / docname).parent
    if source.is_relative_to(DOCS):
        return

    def led(match):
        target, anchor = match[1], match[2] or ""
        name = os.path.relpath(source.parent / target, ROOT)
        for known, shown in ((name + anchor, ""), (name, anchor)):
            if known in SHOWN:
                return f"]({os.path.relpath(DOCS / SHOWN[known], page)}{shown})"
        return f"]({os.path.relpath(ROOT / name, page)}{anchor})"

    text[0] = re.sub(r"\]\(([^):#]+)(#[^)]*)?\)", led, text[0])
    if source.parent == KIT and source.name.lower().startswith("estimator"):
        text[0] = re.sub("^###", "##", text[0], flags=re.MULTILINE)


def write_all():
    """Write all pages anew."""
    for folder in (MADE, NOTEBOOKS):
        shutil.rmtree(folder, ignore_errors=True)
    (MADE / "estimators").mkdir(parents=True)
    for estimator in ESTIMATORS.values():
        (MADE / "estimators" / f"{estimator.name}.md").write_text(estimator_page(estimator), encoding="utf-8")
    (MADE / "estimators.txt").write_text(estimator_table(), encoding="utf-8")
    (MADE / "shaders.md").write_text(shaders_page(), encoding="utf-8")
    (MADE / "commands.md").write_text(commands_page(), encoding="utf-8")
    copy_notebooks()


def estimator_table():
    """One row an estimator, and the table of contents of their pages."""
    lines = ["| name | what it computes | source |", "|---|---|---|"]
    for each in ESTIMATORS.values():
        lines.append(f"| [{each.name}](made/estimators/{each.name}.md) | {each.title} | {each.source} |")
    pages = (f"made/estimators/{name}" for name in ESTIMATORS)
    return "\n".join([*lines, "", "```{toctree}", ":hidden:", "", *pages, "```", ""])


def estimator_page(estimator):
    """Formula, limits and options of an estimator, then its part of the kit's specification."""
    title = estimator.title[0].upper() + estimator.title[1:]
    lines = [f"# `{estimator.name}`", "", f"{title} ({estimator.source}).", ""]
    lines += ["```{code-block} text", ":class: formula", "", estimator.formula, "```", ""]
    lines += [*(f"- {fact}" for fact in facts(estimator)), ""]
    lines += ["## Options", "", *options(estimator), ""]
    part = KIT / f"estimator_{estimator.name}.md"
    if part.exists():
        lines += [f"```{{include}} {os.path.relpath(part, MADE / 'estimators')}", "```", ""]
    return "\n".join(lines)


def facts(estimator):
    """Sentences on an estimator: the occlusion it estimates, what it reads, how its samples turn, its intervals."""
    weighting, falloff = estimator.integrand
    rays = f"occlusion by rays of weighting `{weighting}` and falloff `{falloff}`"
    if estimator.converges:
        yield f"It estimates, up to strength, {rays}, as of {{func}}`lfssao.ray_cast_occlusion`."
    else:
        yield f"It tends to no occlusion by rays; near is {rays}, as of {{func}}`lfssao.ray_cast_occlusion`."
    if estimator.whole_ball:
        yield "Its samples fill the whole ball, and a plane hides half: the half space has 2 max(0, ao - 1/2)."
    reads = ["depth and positions", *["normals"] * estimator.normals]
    reads += ["depth textures of other modules"] * estimator.neighbours
    yield f"It reads {', '.join(reads)}."
    if estimator.samples is not None:
        points = "one point" if estimator.count == 1 else f"{estimator.count} points"
        yield f"Its own set has {points} of {estimator.dimensions} numbers."
    if estimator.turns:
        yield f"Its samples turn from texel to texel by `{estimator.rotation}`, unless `--rotate` says otherwise."
    else:
        yield "Its samples do not turn by `--rotate`."
    if estimator.bent:
        yield "It has bent normals: `--layers bent`, {func}`lfssao.bent_normals`."
    if estimator.name != "lf" and not has_bounds(estimator.name):
        yield "No acceptance intervals are known: `lfssao compare` asks for equal values."


def options(estimator):
    """A table of an estimator's options, or a sentence where it has none."""
    meanings, choices, limits = (estimator.said(fact) for fact in ("meaning", "choices", "limits"))
    if not estimator.parameters:
        return ["It has no options of its own."]
    rows = ["| option | default | values | meaning |", "|---|---|---|---|"]
    for name, default in estimator.parameters.items():
        values = ", ".join(f"`{choice}`" for choice in choices.get(name, ()))
        if name in limits:
            values = "{:.16g} to {:.16g}".format(*limits[name])
        rows.append(f"| `{name}` | `{default}` | {values} | {meanings.get(name, '')} |")
    return rows


def shaders_page():
    """The choices of each published shader, as its file says them."""
    lines = ["# Published shaders", "", "`--like NAME` of `render` and `ao` takes these choices.", ""]
    for name in published_names():
        lines += [f"## `{name}`", "", "```toml", published_text(name).rstrip(), "```", ""]
    return "\n".join(lines)


def commands_page():
    """The help of every command, as it is printed."""
    lines = ["# Commands", "", "As `lfssao help COMMAND` prints it.", ""]
    for command in commands():
        lines += [f"(command-{'-'.join(command)})=", "", f"## `lfssao {' '.join(command)}`", ""]
        lines += ["```text", printed("help", *command).rstrip(), "```", ""]
    return "\n".join(lines)


def commands():
    """The words of each command; of those with commands of their own these too."""
    texts = sorted(path.stem for path in (ROOT / "lfssao" / "cli" / "help").glob("*_*.txt"))
    for command in COMMANDS:
        yield [command]
        for text in texts:
            group, _, own = text.partition("_")
            if group == command:
                yield [command, own.replace("_", "-")]


def printed(*words):
    """Return the output of an lfssao command at a fixed width; help ends its process."""
    os.environ["COLUMNS"] = COLUMNS
    with redirect_stdout(StringIO()) as text, suppress(SystemExit):
        main(words)
    return text.getvalue()


def copy_notebooks():
    """The notebooks, the first picture of each, and the cards that lead to them."""
    NOTEBOOKS.mkdir()
    cards = [":::::{grid} 1 2 2 3", ":gutter: 3", ":class-container: gallery", ""]
    for path in sorted((ROOT / "notebooks").glob("*.ipynb")):
        shutil.copy(path, NOTEBOOKS)
        cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
        title = "".join(cells[0]["source"]).splitlines()[0].removeprefix("# ")
        (NOTEBOOKS / f"{path.stem}.png").write_bytes(base64.b64decode(picture(cells)))
        cards += [f"::::{{grid-item-card}} {title}", f":img-top: notebooks/{path.stem}.png",
                  f":link: notebooks/{path.stem}", ":link-type: doc", "::::", ""]  # fmt: skip
    (MADE / "gallery.txt").write_text("\n".join([*cards, ":::::", ""]), encoding="utf-8")


def picture(cells):
    """The first picture of a notebook's outputs, in base64."""
    outputs = [output for cell in cells for output in cell.get("outputs", ())]
    return next(output["data"]["image/png"] for output in outputs if "image/png" in output.get("data", {}))
