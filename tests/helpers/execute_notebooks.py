"""Run a notebook by the interpreter that runs this: ``python execute_notebooks.py IN.ipynb OUT.ipynb FOLDER``.

A process of its own keeps jupyter's event loops, sockets and warnings out of the tests.
"""

import sys

import nbformat
from jupyter_client.kernelspec import KernelSpecManager
from jupyter_client.manager import AsyncKernelManager
from nbclient import NotebookClient


def main(source, target, folder):
    # Without folders to search there is one kernel, the running interpreter's, registered or not.
    specs = KernelSpecManager(kernel_dirs=[])
    assert specs.get_kernel_spec("python3").argv[0] == sys.executable
    notebook = nbformat.read(source, as_version=4)
    manager = AsyncKernelManager(kernel_name="python3", kernel_spec_manager=specs)
    client = NotebookClient(notebook, km=manager, timeout=300, resources={"metadata": {"path": folder}})
    client.execute(cwd=folder)
    nbformat.write(notebook, target)


if __name__ == "__main__":
    main(*sys.argv[1:])
