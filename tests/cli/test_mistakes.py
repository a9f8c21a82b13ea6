"""Mistakes at the command line: each gets one sentence that names what mends it, and none is done without a word."""

import shlex

import numpy as np
import pytest
from jobs import render, sentence

from lfssao.cli.main import main


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder in which commands are given: a render, and files that are none of theirs."""
    place = tmp_path_factory.mktemp("mistakes")
    render(place / "ref", "statue", "--resolution", "64x48", "--modules", "9:11", "--radii", "5%")
    np.save(place / "d.npy", np.full((8, 8), 0.5, np.float32))
    np.save(place / "rgb.npy", np.zeros((8, 8, 3), np.float32))
    np.save(place / "p.npy", np.random.default_rng(1).random((20, 3)))
    for name, content in {"bad.toml": "kind = \n", "empty.obj": "", "t.txt": "hello", "my.py": "x = 1\n"}.items():
        (place / name).write_text(content)
    return place


MISTAKES = {
    "statue": "did you mean 'render statue'?",
    "ref": "did you mean 'render ref'?",
    "renderr": "did you mean 'render'?",
    "help renderr": "did you mean 'render'?",
    "--radii 1": "--radii: a command comes first",
    "render statu": "did you mean 'statue'?",
    "render statue armadillo": "unrecognized arguments: armadillo: nothing is left that takes them",
    "render statue --png yes": "unrecognized arguments: yes: nothing is left that takes them",
    "render statue --resume=yes": "--resume: it takes no value, and not 'yes'",
    "render --camera statue": "SCENE goes before --camera",
    "render statue --camera --eye 1 2 3": "'1' is not three numbers X,Y,Z, such as 3,2,5",
    "render statue --eye 1,2,3": "they need --camera",
    "render statue --stereo 0.065": "it needs --camera",
    "render statue --radius 5%": "did you mean '--radii'?",
    "render statue --modules 9,10": "such as 0:3",
    "render statue --modules 21": "are not a part of 0:21",
    "render statue --resolution 640": "such as 1024x768",
    "render statue --estimator saoo": "did you mean 'sao'?",
    "render statue --estimator hbao --samples 8": "--samples, --sampling, --seed: estimator hbao takes no samples",
    "render statue --parameter taps": "'taps' is not NAME=VALUE, such as sigma=2",
    "render statue --estimator sao --parameter tap=12": "it has intensity, beta, ",
    "render statue --like unity": "choose one of babylon-ssao2",
    "render statue --layers depth,merge": "did you mean 'merged'?",
    "render statue --display sample_b": "did you mean 'sample-b'?",
    "render statue --display bad.toml": "bad.toml: it is not a TOML file",
    "render statue --rotate blue": "choose one of none, hash",
    "render statue --quilt merged": "it needs --display of one",
    "render empty.obj": "empty.obj: the file is empty",
    "render t.txt": "files ending in '.txt' have no reader",
    "render ref": "ref: it is a folder, not a file",
    "plan statue --jsn": "did you mean '--json'?",
    "view nothing": "nothing: there is no such folder; 'lfssao render -o nothing' makes one",
    "view ref --layer ao_9": "choose one of shaded, color, ao_1",
    "view ref --eye-x 0.1 --orbit": "--eye-x does not go with --orbit",
    "view ref -o a.jpg": "does not end in .png",
    "compare ref": "are required: REFERENCE",
    "compare ref nothing": "nothing: there is no such file or folder",
    "compare ref ref --layers Merged": "did you mean 'merged'?",
    "compare ref ref --fail tiny": "--fail: 'tiny' is not a number",
    "compare ref ref --tolerance 0.1": "did you mean '--fail'?",
    "compare ref ref --fail -1": "-1.0 is not a number from 0",
    "compare ref ref --stored merged=unorm9": "formats are float, half, unorm8",
    "compare ref ref --map merged": "'merged' is not MINE=REFERENCE",
    "compare ref ref --exact --fail 1": "it goes without --fail",
    "compare ref ref --html nowhere/a.html": "there is no folder nowhere",
    "compare ref/module_009.exr ref": "compare like with like",
    "ao --depth d.npy --radii 1": "are required: --buffers",
    "ao --dept d.npy --radii 1": "did you mean '--depth'?",
    "ao --depth rgb.npy --buffers ref --radii 1": "expected a layer depth or just one of 1 channel",
    "ao --depth d.npy --buffers ref --radii 1": "choose one of module_009, module_010",
    "agree ref --layer depth": "such as ao_1, merged or blurred",
    "agree ref/module_009.exr": "two are needed to agree",
    "agree ref --mesh t.txt": "--mesh is of --truth",
    "kit ref": "the folder is not empty",
    "display sampel-a": "did you mean 'sample-a'?",
    "estimators my.py": "--template",
    "estimators --template add": "'sum', 'fold'",
    "samples mak latin": "did you mean 'make'?",
    "samples make lattin": "did you mean 'latin'?",
    "samples make latin --format gsl": "did you mean 'glsl'?",
    "samples check p.npy --promise unifrom": "did you mean 'uniform'?",
    "samples check missing.csv": "missing.csv: there is no such file",
    "samples plot latin -o a.jpg": "does not end in .png",
    "bench advise": "--max-error --max-ms is required",
    "bench stabilty": "did you mean 'stability'?",
}


@pytest.mark.parametrize("line", MISTAKES)
def test_a_mistake_gets_a_sentence_that_mends_it(folder, monkeypatch, capsys, line):
    monkeypatch.chdir(folder)
    before = sorted(folder.rglob("*"))
    assert main(shlex.split(line)) == (4 if line.startswith("compare") else 2)
    assert MISTAKES[line] in sentence(capsys)
    assert sorted(folder.rglob("*")) == before
