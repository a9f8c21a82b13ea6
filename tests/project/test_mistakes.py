"""Mistakes in Python: each is an InputError of one sentence that names the argument, and none passes without one."""

import numpy as np
import pytest
from refusals import is_refused

import lfssao
from lfssao.testing import check_sampler, make_case, sample_sets, write_kit

MESH = lfssao.find_scene("statue")
DISPLAY = lfssao.find_display("sample-a").with_resolution(100, 60)
RENDERED = lfssao.render(MESH, DISPLAY, modules=[10])
TEXTURES = RENDERED[0]
BUFFERS = lfssao.Buffers.of(TEXTURES.gbuffer, TEXTURES.view)
ONE = np.ones((4, 4), np.float32)


def render(*display, **words):
    return lfssao.render(MESH, *(display or (DISPLAY,)), **words)


def compare(**words):
    np.save("a.npy", ONE)
    return lfssao.compare("a.npy", words.pop("reference", "a.npy"), **words)


MISTAKES = [
    (lambda: lfssao.render("statu"), "did you mean 'statue'"),
    (lambda: render("sample_b2"), "did you mean 'sample-b'"),
    (lambda: render(DISPLAY, [10]), "settings is of type list"),
    (lambda: render(modules=["10"]), r"modules \['10'\] are not a part of 0:21"),
    (lambda: render(modules=[]), r"modules \[\] are not a part"),
    (lambda: render(sample=8), "did you mean 'samples'"),
    (lambda: render(estimator="SAO"), "did you mean 'sao'"),
    (lambda: render(layers="ao"), "layers is of type str, expected a tuple or list"),
    (lambda: render(layers=["ao_1"]), "there is no layer 'ao_1': choose one of depth"),
    (lambda: render(estimator="sao", parameters={"tap": 3}), "has no parameter 'tap': it has intensity"),
    (lambda: render(parameters=[3]), "parameters is of type list, expected a Mapping"),
    (lambda: render(neighbours=30), "neighbours is 30: sample-a has 20 modules"),
    (lambda: render(normals=True), "choose one of geometric, smooth"),
    (lambda: render(rotation="hsh"), "did you mean 'hash'"),
    (lambda: render(blur=[1]), r"blur is \[1\], it must be a sigma"),
    (lambda: render(radii={"1%"}), "expected a list of numbers, or of per cent such as '1%'"),
    (lambda: RENDERED["module_010"], "the number of a view is 'module_010', it must be a whole number"),
    (lambda: RENDERED[1.5], "the number of a view is 1.5"),
    (lambda: lfssao.render((MESH.faces, MESH.vertices)), r"faces have shape .* expected \(F, 3\) integers"),
    (lambda: lfssao.render(MESH.vertices), "mesh is of type ndarray, expected a Mesh, a scene's name"),
    (lambda: lfssao.Mesh(MESH.vertices.T, MESH.faces), r"expected \(V, 3\)"),
    (lambda: lfssao.Settings([0.1], samples=8), r"samples is 8, expected offsets, such as make_samples\('latin', 8\)"),
    (lambda: lfssao.Settings(["1%"]), "radius is '1%'"),
    (lambda: lfssao.make_samples(8), "there is no sampling of the ball '8': choose one of"),
    (lambda: lfssao.make_samples("laten"), "did you mean 'latin'"),
    (lambda: lfssao.merge(TEXTURES.ao[0]), "layer 0 has shape"),
    (lambda: lfssao.merge(5), "layers is of type int, expected a Sequence or ndarray"),
    (lambda: lfssao.blur(ONE, "1"), "blur is '1'"),
    (lambda: lfssao.blur(ONE.astype(int), 1), "occlusion is of int64, expected an array of float32"),
    (lambda: lfssao.shade(ONE, ONE), "rgb has shape"),
    (lambda: lfssao.estimate("lf", TEXTURES, 0.1), "buffers is of type Textures, expected a Buffers"),
    (lambda: lfssao.estimate("sao", BUFFERS, "0.1"), "radius is '0.1'"),
    (lambda: lfssao.estimate("lf", BUFFERS, [0.1, 0.2]), r"radius is \[0.1, 0.2\]"),
    (lambda: lfssao.estimate("lf", BUFFERS, 0.1, tap=3), "estimator lf has no parameter 'tap'"),
    (lambda: compare(reference="b.npy"), "b.npy: there is no such file"),
    (lambda: lfssao.compare(ONE, ONE), "mine is of type ndarray, expected a str or Path"),
    (lambda: compare(layers="ao_1"), "layers is 'ao_1', it must be a list of texts"),
    (lambda: compare(fail="x"), "fail: 'x' is not a number from 0"),
    (lambda: compare(model="shade"), "did you mean 'shader'"),
    (lambda: compare().write_html("a.html"), "made without page=True"),
    (lambda: compare().write_json("nowhere/a.json"), "nowhere/a.json: it cannot be written"),
    (lambda: compare().save_picture("a.gif"), "a.gif: its name must end in one of .png"),
    (lambda: compare().write_junit(None), "path is of type NoneType, expected a str or Path"),
    (lambda: TEXTURES.save("a.jpg"), "does not end in .exr or .png"),
    (lambda: lfssao.read_exr("none.exr"), "none.exr: there is no such file"),
    (lambda: lfssao.write_exr("a.exr", [ONE]), "a part is of type ndarray, expected a Part"),
    (lambda: lfssao.find_display("looking-glass-go"), "it is a quilt of cameras' views"),
    (lambda: lfssao.Camera("fish", (0, 0, 1), (0, 0, 0), (0, 1, 0), 1, 0.1, 2), "choose one of perspective"),
    (lambda: lfssao.eye_page("nowhere"), "nowhere/manifest.json: there is no such file; 'lfssao render' writes it"),
    (lambda: lfssao.ray_cast_occlusion("statue", BUFFERS, 0.1), "occluders is of type str, expected a Occluders"),
    (lambda: lfssao.bent_normals("lf", BUFFERS, 0.1), "choose one of gtao, visibility-bitmask"),
    (lambda: lfssao.fit_roi("statue", DISPLAY), "world_box is 'statue'"),
    (lambda: lfssao.viz.draw_radii(TEXTURES, [0.1]), r"radii are \[0.1\], the textures were made with \[0.02"),
    (lambda: lfssao.viz.trace_texel((1000, 0), TEXTURES.view, TEXTURES.gbuffer, ONE, 1), "its column is 1000"),
    (lambda: make_case("fram"), "did you mean 'frame'"),
    (lambda: check_sampler(lambda n, seed: ONE, 8, 3), "the set of seed 0 has shape"),
    (lambda: sample_sets(domain="cube"), "there is no domain 'cube'"),
    (lambda: write_kit(5, []), "folder is of type int, expected a str or Path"),
]


@pytest.mark.parametrize(("call", "words"), MISTAKES, ids=[words for _, words in MISTAKES])
def test_a_mistake_is_refused_in_a_sentence(tmp_path, monkeypatch, call, words):
    monkeypatch.chdir(tmp_path)
    assert is_refused(call, words)


def test_a_view_that_is_not_there_ends_a_sequence():
    with pytest.raises(IndexError, match="there is no view 1 among the 1 that are rendered"):
        RENDERED[1]
    assert [textures.view.name for textures in RENDERED] == ["module_010"]
    assert RENDERED[-1].view.name == "module_010"
