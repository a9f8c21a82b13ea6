"""Every notebook shows what running it gives, says it in a few pictures and numbers, and its sliders move."""

import ast
import json
import os
import re
import shutil
import subprocess
import sys
from base64 import b64decode
from contextlib import contextmanager
from pathlib import Path

import pytest
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.wait import WebDriverWait

import lfssao

FOLDER = Path(__file__).resolve().parents[2] / "notebooks"
HELPERS = FOLDER.parent / "tests" / "helpers"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
SLIDERS = {"02": "u v samples", "03": "method n", "04": "smallest radii", "05": "estimator radius", "06": "K"}
PNG = b"\x89PNG\r\n\x1a\n"

by_notebook = pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)


def cells(path, kind):
    notebook = json.loads(path.read_text(encoding="utf-8"))
    return [{**cell, "source": "".join(cell["source"])} for cell in notebook["cells"] if cell["cell_type"] == kind]


def title(path):
    return cells(path, "markdown")[0]["source"].splitlines()[0]


def without_pictures(path):
    """The whole file, each picture only as one: what is in it is said by the text beside it."""
    notebook = json.loads(path.read_text(encoding="utf-8"))
    for cell in notebook["cells"]:
        for output in cell.get("outputs", []):
            if "image/png" in output.get("data", {}):
                output["data"]["image/png"] = b64decode(output["data"]["image/png"]).startswith(PNG)
    return notebook


@contextmanager
def started(folder, *command, **options):
    """A process of the running interpreter that keeps its settings in a folder; what it says goes to a file there."""
    homes = {name: str(folder) for name in ("IPYTHONDIR", "JUPYTER_RUNTIME_DIR", "JUPYTER_CONFIG_DIR",
                                            "JUPYTER_DATA_DIR", "JUPYTERLAB_WORKSPACES_DIR", "TMPDIR")}  # fmt: skip
    search = os.pathsep.join([str(Path(lfssao.__file__).parents[1]), os.environ.get("PYTHONPATH", "")])
    with (folder / "said.txt").open("w") as said:
        env = {**os.environ, **homes, "PYTHONPATH": search}
        with subprocess.Popen([sys.executable, *command], env=env, stderr=said, text=True, **options) as process:
            try:
                yield process
            finally:
                process.terminate()


@pytest.fixture(scope="module")
def executed(tmp_path_factory):
    """A function that runs a notebook, all on one kernel, and returns the path of what was made."""
    folder = tmp_path_factory.mktemp("notebooks")

    def execute(path):
        target = folder / path.name
        print(path, target, sep="\t", file=process.stdin, flush=True)
        assert process.stdout.readline().strip() == str(target), (folder / "said.txt").read_text()
        return target

    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with started(folder, str(HELPERS / "execute_notebooks.py"), **pipes) as process:
        yield execute
        process.communicate()


def test_there_are_seven():
    assert [path.stem[:3] for path in NOTEBOOKS] == [f"{k:02d}_" for k in range(1, 8)]


@pytest.mark.slow
@by_notebook
def test_a_notebook_holds_what_running_it_gives(path, executed):
    """The same text, figures with the same axes, titles and labels, and values of sliders."""
    assert without_pictures(executed(path)) == without_pictures(path), f"run {HELPERS / 'execute_notebooks.py'}"


@by_notebook
def test_a_notebook_shows_small_pictures_sliders_and_numbers(path):
    outputs = [output for cell in cells(path, "code") for output in cell["outputs"]]
    assert {output.get("name", "data") for output in outputs} == {"stdout", "data"}  # no errors, no warnings
    shown = [output["data"] for output in outputs if "data" in output]
    pictures = [b64decode(data["image/png"]) for data in shown if "image/png" in data]
    assert pictures
    assert max(map(len, pictures)) < 150_000
    assert path.stat().st_size < 1_000_000
    moved = [text for data in shown for text in data["text/plain"] if text.startswith("sliders: ")]
    assert set(SLIDERS.get(path.stem[:2], "").split()) <= set(re.findall(r"(\w+) = ", " ".join(moved)))
    said = "".join("".join(output["text"]) for output in cells(path, "code")[-1]["outputs"])
    assert re.search(r"\d", said), "the last cell says, in numbers, what was found"


@by_notebook
def test_a_notebook_defines_nothing_and_imports_public_names(path):
    source = "\n".join(cell["source"] for cell in cells(path, "code")).replace("%matplotlib inline", "")
    nodes = list(ast.walk(ast.parse(source)))
    definitions = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef
    assert [node.name for node in nodes if isinstance(node, definitions)] == []
    names = {node.module if isinstance(node, ast.ImportFrom) else alias.name for node in nodes
             if isinstance(node, ast.Import | ast.ImportFrom) for alias in node.names}  # fmt: skip
    own = {name for name in names if name.split(".")[0] == "lfssao"}
    assert own <= {"lfssao", "lfssao.samples", "lfssao.testing", "lfssao.viz"}


@by_notebook
def test_a_notebook_asks_one_question_and_is_listed_by_it(path):
    number, _, question = title(path).removeprefix("# ").partition(". ")
    assert number == str(int(path.stem[:2]))
    assert question.endswith("?")
    assert f"| [{path.name}]({path.name}) | {question} |" in (FOLDER / "README.md").read_text(encoding="utf-8")


IDLE = "return window.jupyterapp?.shell.currentWidget?.sessionContext?.session?.kernel?.status === 'idle'"
PICTURE = """
const [image, done] = arguments;
fetch(image.src).then((answer) => answer.arrayBuffer()).then((bytes) => done(Array.from(new Uint8Array(bytes))));
"""


@pytest.mark.slow
def test_a_slider_in_a_browser_changes_the_picture(browser, tmp_path):
    """The second notebook in JupyterLab, run as a user runs it; a sample more, and one less again."""
    path = shutil.copy(NOTEBOOKS[1], tmp_path)
    lab = ["-m", "jupyterlab", "--no-browser", "--allow-root", "--expose-app-in-browser", f"--notebook-dir={tmp_path}"]
    with started(tmp_path, *lab):
        wait = WebDriverWait(browser, 60)
        (described,) = wait.until(lambda _: list(tmp_path.glob("jpserver-*.json")))
        server = wait.until(lambda _: json.loads(described.read_text() or "null"))
        browser.get(f"{server['url']}lab/tree/{Path(path).name}?token={server['token']}")
        wait.until(lambda _: browser.execute_script(IDLE))
        browser.execute_script("jupyterapp.commands.execute('notebook:run-all-cells')")
        wait.until(lambda _: browser.find_elements("css selector", ".noUi-handle"))
        labels = browser.find_elements("css selector", ".widget-hslider .widget-label")
        (slider,) = (label for label in labels if label.text == "samples")
        handle = slider.find_element("xpath", "..").find_element("css selector", ".noUi-handle")
        (image,) = browser.find_elements("css selector", "img.widget-image")
        seen = [browser.execute_async_script(PICTURE, image)]
        for key in (Keys.ARROW_RIGHT, Keys.ARROW_LEFT):
            handle.send_keys(key)
            wait.until(lambda _: browser.execute_async_script(PICTURE, image) != seen[-1])
            seen.append(browser.execute_async_script(PICTURE, image))
    assert bytes(seen[1]).startswith(PNG)
    assert seen[0] == seen[2]
