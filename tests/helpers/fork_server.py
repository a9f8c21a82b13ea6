"""Runs commands of lfssao in forked children of one warm process: ``python fork_server.py``.

A line of JSON on standard input is the words of a command; the child's process number is answered on a line.
"""

import json
import os
import sys

import numba

import lfssao.cli.render  # noqa: F401 (main imports it late)
from lfssao.cli.main import main
from lfssao.optics.display_file import find_display
from lfssao.rendering.passes import render
from lfssao.rendering.settings import Settings
from lfssao.scene.builtin import builtin_scene


def warm_up():
    """Load the kernels; write nothing, as threads of OpenImageIO do not survive a fork."""
    numba.set_num_threads(1)
    display = find_display("sample-a").with_resolution(64, 48)
    render(builtin_scene("ammonite"), display, Settings((0.05, 0.1)), range(3, 4))[0]


def serve():
    for line in sys.stdin:
        child = os.fork()
        if child == 0:
            os.dup2(os.open(os.devnull, os.O_RDWR), 1)
            os.dup2(1, 2)
            os._exit(main(json.loads(line)))
        print(child, flush=True)
        os.waitpid(child, 0)
        print("over", flush=True)


if __name__ == "__main__":
    warm_up()
    print("ready", flush=True)
    serve()
