"""Every notebook runs from top to bottom in the running interpreter, without a warning, and shows figures."""

import ast
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import lfssao

FOLDER = Path(__file__).resolve().parents[2] / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))

by_notebook = pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)


def cells(path, kind):
    notebook = json.loads(path.read_text(encoding="utf-8"))
    return [{**cell, "source": "".join(cell["source"])} for cell in notebook["cells"] if cell["cell_type"] == kind]


def title(path):
    return cells(path, "markdown")[0]["source"].splitlines()[0]


def executed(path, folder):
    """The code cells of a notebook after a run in an empty folder."""
    homes = {name: str(folder) for name in ("IPYTHONDIR", "JUPYTER_RUNTIME_DIR", "JUPYTER_CONFIG_DIR", "TMPDIR")}
    search = os.pathsep.join([str(Path(lfssao.__file__).parents[1]), os.environ.get("PYTHONPATH", "")])
    helper, target = FOLDER.parent / "tests" / "helpers" / "execute_notebooks.py", folder / "executed.ipynb"
    command = [sys.executable, *map(str, (helper, path, target, folder))]
    env = {**os.environ, **homes, "PYTHONPATH": search}
    done = subprocess.run(command, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return cells(target, "code")


def test_there_are_seven():
    assert [path.stem[:3] for path in NOTEBOOKS] == [f"{k:02d}_" for k in range(1, 8)]


@pytest.mark.slow
@by_notebook
def test_a_notebook_runs_and_shows_figures(path, tmp_path):
    code = executed(path, tmp_path)
    outputs = [output for cell in code for output in cell["outputs"]]
    assert ["".join(output["text"]) for output in outputs if output.get("name") == "stderr"] == []
    assert [output for output in outputs if output["output_type"] == "error"] == []
    shown = [output["data"] for output in outputs if "data" in output]
    assert any("image/png" in data for data in shown)
    # A figure that no formatter knows would be shown as its text.
    assert [data for data in shown if list(data) == ["text/plain"]] == []
    said = "".join("".join(output["text"]) for output in code[-1]["outputs"])
    assert re.search(r"\d", said), "the last cell says, in numbers, what was found"


@by_notebook
def test_a_notebook_is_committed_without_outputs_defines_nothing_and_imports_public_names(path):
    code = cells(path, "code")
    assert all((cell["outputs"], cell["execution_count"]) == ([], None) for cell in code)
    nodes = list(ast.walk(ast.parse("\n".join(cell["source"] for cell in code).replace("%matplotlib inline", ""))))
    definitions = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef
    assert [node.name for node in nodes if isinstance(node, definitions)] == []
    names = {node.module if isinstance(node, ast.ImportFrom) else alias.name for node in nodes
             if isinstance(node, ast.Import | ast.ImportFrom) for alias in node.names}  # fmt: skip
    own = {name for name in names if name.split(".")[0] == "lfssao" and not name.startswith("lfssao.viz")}
    assert own <= {"lfssao", "lfssao.samples", "lfssao.testing"}


@by_notebook
def test_a_notebook_asks_one_question_and_is_listed_by_it(path):
    number, _, question = title(path).removeprefix("# ").partition(". ")
    assert number == str(int(path.stem[:2]))
    assert question.endswith("?")
    assert f"| [{path.name}]({path.name}) | {question} |" in (FOLDER / "README.md").read_text(encoding="utf-8")
