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
SLIDERS = {
    "01": "distance modules diffuser",
    "02": "u v samples",
    "03": "method n blur",
    "04": "smallest radii",
    "05": "estimator radius",
    "06": "K",
}
PNG = b"\x89PNG\r\n\x1a\n"

by_notebook = pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)


def cells(path, kind):
    notebook = json.loads(path.read_text(encoding="utf-8"))
    return [{**cell, "source": "".join(cell["source"])} for cell in notebook["cells"] if cell["cell_type"] == kind]


def title(path):
    return cells(path, "markdown")[0]["source"].splitlines()[0]


def without_pictures(path):
    """The whole file, each picture only as one, as the text beside it says what it shows, and no time of a kernel."""
    notebook = json.loads(re.sub(r"\b[\d.]+ ms\b", "0 ms", path.read_text(encoding="utf-8")))
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
def test_a_notebook_shows_square_texels_and_ends_with_a_sentence(path):
    """Textures have the shape of the screen; figures of texels or metres are never stretched, by their words."""
    source = "\n".join(cell["source"] for cell in cells(path, "code"))
    sizes = re.findall(r"with_resolution\((\d+), (\d+)\)", source)
    for name in re.findall(r'find_display\("(.*?)"\)', source):
        display = lfssao.find_display(name)
        shapes = {int(width) / int(height) for width, height in sizes}
        assert shapes <= {display.screen_width / display.screen_height}
    assert "stretched" not in path.read_text(encoding="utf-8")
    last = json.loads(path.read_text(encoding="utf-8"))["cells"][-1]
    assert last["cell_type"] == "markdown"
    assert re.fullmatch(r"[A-Z`][^.?!#]{40,}\.", "".join(last["source"]))


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


RUN = """
const done = arguments[0];
(async () => {
  await jupyterapp.commands.execute('notebook:clear-all-cell-outputs');
  await jupyterapp.commands.execute('notebook:run-all-cells');
  const cells = Array.from(jupyterapp.shell.currentWidget.content.model.cells, (cell) => cell.toJSON());
  done(cells.filter((cell) => cell.cell_type === 'code'));
})();
"""
# The last slider of this name, and the sentence above its picture, by notebook
MOVED = {
    "01": ("modules", r"An eye in the middle sees \d+ of \d+ modules, .* misses by \d+ texels\."),
    "02": ("samples", ""),
    "04": ("samples", r"RMSE 0\.\d{3} against 1024 samples .*; the kernel took \d+\.\d\d ms\."),
}


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """A running JupyterLab, in whose folder the notebooks are, and a function that returns a notebook's address."""
    folder = tmp_path_factory.mktemp("lab")
    command = ["--no-browser", "--allow-root", "--expose-app-in-browser", f"--notebook-dir={folder}"]
    for path in NOTEBOOKS:
        shutil.copy(path, folder)
    with started(folder, "-m", "jupyterlab", *command):
        wait = WebDriverWait(None, 60)
        (described,) = wait.until(lambda _: list(folder.glob("jpserver-*.json")))
        server = wait.until(lambda _: json.loads(described.read_text() or "null"))
        # A workspace each: another one's would open the notebooks before, too.
        yield lambda path: f"{server['url']}lab/workspaces/{path.stem}/tree/{path.name}?token={server['token']}"


@pytest.mark.slow
@pytest.mark.parametrize("path", [path for path in NOTEBOOKS if path.stem[:2] in MOVED], ids=lambda path: path.stem)
def test_a_notebook_runs_in_a_browser_and_its_sliders_change_the_picture(path, lab, browser):
    """All cells, run in JupyterLab as a user runs them; then a slider a step up, and down again."""
    name, sentence = MOVED[path.stem[:2]]
    wait = WebDriverWait(browser, 60)
    browser.get(lab(path))
    wait.until(lambda _: browser.execute_script(IDLE))
    browser.set_script_timeout(300)
    code = browser.execute_async_script(RUN)
    assert [cell["execution_count"] for cell in code] == list(range(1, len(cells(path, "code")) + 1))
    assert all(cell["outputs"] for cell in code)
    outputs = [output for cell in code for output in cell["outputs"]]
    assert {output["output_type"] for output in outputs}.isdisjoint({"error"})
    views = sum("application/vnd.jupyter.widget-view+json" in output.get("data", {}) for output in outputs)
    wait.until(lambda _: len(browser.find_elements("css selector", "img.widget-image[src]")) == views)
    row = f"//div[contains(@class, 'widget-hslider')][*[text() = '{name}']]//div[contains(@class, 'noUi-handle')]"
    handle = wait.until(lambda _: browser.find_elements("xpath", row))[-1]
    image = browser.find_elements("css selector", "img.widget-image")[-1]
    words = image.find_element("xpath", "preceding-sibling::*[1]")
    seen = [(browser.execute_async_script(PICTURE, image), words.text)]
    for key in (Keys.ARROW_RIGHT, Keys.ARROW_LEFT):
        handle.send_keys(key)
        wait.until(lambda _: browser.execute_async_script(PICTURE, image) != seen[-1][0])
        seen.append((browser.execute_async_script(PICTURE, image), words.text))
    assert bytes(seen[1][0]).startswith(PNG)
    assert seen[0][0] == seen[2][0]
    assert all(re.fullmatch(sentence, text) for _, text in seen)
    assert not sentence or seen[0][1] != seen[1][1]
