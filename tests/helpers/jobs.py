"""Commands of lfssao in this process, and the manifests of their folders."""

import json

from lfssao.cli.main import main


def render(folder, *words, code=0):
    """Render into a folder; the folder."""
    assert main(["render", *words, "-o", str(folder)]) == code
    return folder


def manifest_of(folder):
    return json.loads((folder / "manifest.json").read_text("utf-8"))


def digests_of(folder):
    return [{name: t["sha256"] for name, t in v["textures"].items()} for v in manifest_of(folder)["views"]]


def sentence(capsys):
    """The one sentence that a refused command says, and nothing else."""
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert captured.err.startswith("lfssao: ")
    return captured.err.removeprefix("lfssao: ").rstrip("\n")
