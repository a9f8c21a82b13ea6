"""Run notebooks and save what they show: ``python tests/helpers/execute_notebooks.py notebooks/*.ipynb``.

One kernel runs all, in the running interpreter and an empty folder, and forgets between them. A line IN<tab>OUT of
standard input, for the tests, is a notebook and where it is saved; where it was is answered. A process of its own keeps
jupyter's event loops, sockets and warnings out of the tests.
"""

import os
import sys
import tempfile
from base64 import b64decode, b64encode
from copy import deepcopy
from io import BytesIO
from pathlib import Path

import nbformat
from jupyter_client.kernelspec import KernelSpecManager
from jupyter_client.manager import AsyncKernelManager
from nbclient import NotebookClient
from PIL import Image


def small(picture):
    """A PNG file, base64, with 256 colours at most: half of the size."""
    file = BytesIO()
    with Image.open(BytesIO(b64decode(picture))) as image:
        image.convert("RGB").quantize(256, dither=Image.Dither.NONE).save(file, "PNG", optimize=True)
    return b64encode(file.getvalue()).decode()


def execute(manager, source, target, folder):
    """Save a notebook with its outputs: pictures and text, without the widgets, which no page has without a kernel."""
    notebook = nbformat.read(source, as_version=4)
    metadata = deepcopy(notebook.metadata)
    notebook.cells.insert(0, nbformat.v4.new_code_cell("%reset -f\nimport shown_as_text as _"))
    options = {"timeout": 300, "record_timing": False, "store_widget_state": False}
    NotebookClient(notebook, km=manager, **options).execute(cwd=folder)
    del notebook.cells[0]
    notebook.metadata = metadata  # without the running Python's version
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    for number, cell in enumerate(code, 1):
        cell.execution_count = number
        for output in cell.outputs:
            data = output.get("data", {})
            data.pop("application/vnd.jupyter.widget-view+json", None)
            if "image/png" in data:
                data["image/png"] = small(data["image/png"])
            if output.output_type == "execute_result":
                output.execution_count = number
    nbformat.write(notebook, target)


def main():
    os.environ["PYTHONPATH"] = os.pathsep.join([str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")])
    # Without folders to search there is one kernel, the running interpreter's, registered or not.
    specs = KernelSpecManager(kernel_dirs=[])
    assert specs.get_kernel_spec("python3").argv[0] == sys.executable
    manager = AsyncKernelManager(kernel_name="python3", kernel_spec_manager=specs)
    with tempfile.TemporaryDirectory() as folder:
        lines = (line.rstrip("\n").split("\t") for line in sys.stdin)
        for source, target in [(path, path) for path in sys.argv[1:]] or lines:
            execute(manager, source, target, folder)
            print(target, flush=True)


if __name__ == "__main__":
    main()
