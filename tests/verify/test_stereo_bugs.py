"""Two eyes of ``render --stereo``, one of them drawn with the other's matrix: the cause has the other eye's name."""

from dataclasses import replace

import numpy as np
import pytest
from jobs import manifest_of, render

import lfssao
from lfssao.ao.textures import Buffers
from lfssao.rendering.manifest import view_of

OTHER = {"left": "right", "right": "left"}
JOB = ["--camera", "--stereo", "0.3", "--resolution", "80x60", "--radii", "8%", "--rotate", "none"]
LAYERS = "--layers", "depth,positions,ao"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return render(tmp_path_factory.mktemp("stereo") / "out", "statue", *JOB, *LAYERS, "--estimator", "point")


def occlusion(folder, eye, matrix):
    """AO of an eye's textures, its samples mapped by the matrix of an eye."""
    manifest = manifest_of(folder)
    parts = lfssao.read_exr(folder / f"{eye}.exr")
    views = {entry["name"]: view_of(entry["name"], entry["view"]) for entry in manifest["views"]}
    view = replace(views[eye], world_to_image=views[matrix].world_to_image)
    buffers = Buffers(view, np.ascontiguousarray(parts["depth"].pixels[..., 0]), parts["positions"].pixels)
    settings = manifest["settings"]
    return lfssao.estimate("point", buffers, settings["radii"][0], np.array(settings["samples"])).texture


@pytest.mark.parametrize("wrong", ["left", "right", None])
def test_one_eyes_matrix_for_both_is_named(folder, tmp_path, wrong):
    for eye, other in OTHER.items():
        np.save(tmp_path / f"{eye}_ao_1.npy", occlusion(folder, eye, other if eye == wrong else eye))
    report = lfssao.compare(tmp_path, folder, layers=("ao_1",))
    assert report.exit_code == (0 if wrong is None else 2)
    found = {result.module: result.diagnosis for result in report.results if result.diagnosis is not None}
    assert list(found) == ([] if wrong is None else [wrong])
    for eye, diagnosis in found.items():
        assert diagnosis.fits
        assert diagnosis.candidates[0].kind == f"the mapping of {OTHER[eye]}"
