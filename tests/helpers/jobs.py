"""Commands of lfssao in this process and others, and the manifests of their folders."""

import functools
import json
import operator
import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

import lfssao
from lfssao.cli.main import main

NEEDS_EMBREE = pytest.mark.skipif(find_spec("embreex") is None, reason="Embree has no wheel here")
HELPERS = Path(__file__).parent
# A process of its own finds the package, the reference and the helpers here.
PATH = os.pathsep.join(
    [*map(str, (Path(lfssao.__file__).parents[1], HELPERS.parent, HELPERS)), os.environ.get("PYTHONPATH", "")]
)


def python(*command, code=0, **variables):
    """A process of Python that has ended with a code, and what it printed; variables are added to its environment."""
    env = {**os.environ, "PYTHONPATH": PATH, **variables}
    done = subprocess.run([sys.executable, *command], env=env, capture_output=True, text=True, check=False)
    assert done.returncode == code, done.stderr
    return done


def render(folder, *words, code=0):
    """Render into a folder; the folder."""
    assert main(["render", *words, "-o", str(folder)]) == code
    return folder


def manifest_of(folder):
    return json.loads((folder / "manifest.json").read_text("utf-8"))


def edit(folder, *keys, value):
    """Put another value at a place in the manifest."""
    manifest = manifest_of(folder)
    functools.reduce(operator.getitem, keys[:-1], manifest)[keys[-1]] = value
    (folder / "manifest.json").write_text(json.dumps(manifest))


def digests_of(folder):
    return [{name: t["sha256"] for name, t in v["textures"].items()} for v in manifest_of(folder)["views"]]


def sentence(capsys):
    """The one sentence that a refused command says, and nothing else."""
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert captured.err.startswith("lfssao: ")
    return captured.err.removeprefix("lfssao: ").rstrip("\n")
