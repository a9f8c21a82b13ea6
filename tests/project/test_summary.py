"""Objects in one line and as tables, and the arrays that NumPy takes them for."""

from html.parser import HTMLParser

import numpy as np
import pytest
from refusals import is_refused

import lfssao
from lfssao.samples import sample_set
from lfssao.testing import make_case

DISPLAY = lfssao.find_display("sample-a").with_resolution(100, 60)
RENDERED = lfssao.render("statue", DISPLAY, modules=[10, 11])
TEXTURES = RENDERED[0]
BUFFERS = lfssao.Buffers.of(TEXTURES.gbuffer, TEXTURES.view)
PART = lfssao.Part("depth", ("Z",), np.ones((2, 3, 1), np.float32))
OCCLUSION = lfssao.Occlusion(np.float32([[0, 0.5]]), 3)
PHOTOGRAPH = lfssao.Photograph(np.zeros((2, 4, 3), np.float32), 5)
TRUTH = lfssao.GroundTruth(np.full((2, 3), 0.25), np.full((2, 3), 0.01), np.full((2, 3), 9))

LINES = [
    (RENDERED, "<Rendered: views 2, module_010 to module_011, texels 100x60, estimator lf, radii 0.025 0.0499 "),
    (TEXTURES, "<Textures: view module_010, texels 100x60 of float32, layers depth positions color ao merged "),
    (TEXTURES.gbuffer, "<GBuffer: texels 100x60 of float32, textures depth positions color, surface at "),
    (TEXTURES.settings, "<Settings: estimator lf, radii 0.025 0.0499 0.0874 0.15 0.25, samples 8, rotation hash, "),
    (BUFFERS, "<Buffers: view module_010, texels 100x60 of float32, textures depth positions, neighbours 0>"),
    (OCCLUSION, "<Occlusion: texels 2x1 of float32, mean 0.25, outside 3>"),
    (TRUTH, "<GroundTruth: texels 3x2 of float64, mean 0.25, largest error 0.01, rays 54>"),
    (PART, "<Part: name depth, channels Z, texels 3x2 of float32, guard 0, attributes 0>"),
    (PHOTOGRAPH, "<Photograph: pixels 4x2 of float32, dark 5>"),
    (lfssao.find_scene("statue"), "<Mesh: name statue, vertices 2,511, faces 5,010, colour yes, normals no, size "),
    (DISPLAY, "<Display: name sample-a, modules 21, screen 1 m wide>"),
    (make_case("merge_three"), "<Case: name merge_three, stage merge, title "),
    (sample_set("disk", "latin", 5, 2), "<SampleSet: method latin, domain disk, points 5, seed 2>"),
]


class Cells(HTMLParser):
    def __init__(self, page):
        super().__init__()
        self.found = {}
        self.feed(page)

    def handle_starttag(self, tag, attributes):
        self.tag = tag

    def handle_data(self, data):
        self.found.setdefault(self.tag, []).append(data)


@pytest.mark.parametrize(("thing", "line"), LINES, ids=[type(thing).__name__ for thing, _ in LINES])
def test_an_object_is_one_line_and_a_picture_or_a_table(thing, line):
    text = repr(thing)
    assert text.startswith(line)
    assert "\n" not in text
    assert len(text) < 400
    if hasattr(thing, "_repr_html_"):
        cells = Cells(thing._repr_html_()).found
        assert cells["caption"] == [type(thing).__name__]
        said = ", ".join(f"{name} {fact}" for name, fact in zip(cells["th"], cells["td"], strict=True))
        assert f"<{type(thing).__name__}: {said}>" == text


def test_a_table_holds_any_text():
    part = lfssao.Part("<b>&", ("Z",), np.ones((2, 3, 1), np.float32))
    assert Cells(part._repr_html_()).found["td"][0] == "<b>&"


@pytest.mark.parametrize(("thing", "array"), [
    (PART, PART.pixels), (OCCLUSION, OCCLUSION.texture), (PHOTOGRAPH, PHOTOGRAPH.image), (TRUTH, TRUTH.texture),
    (LINES[-1][0], LINES[-1][0].points),
], ids=lambda thing: type(thing).__name__)  # fmt: skip
def test_numpy_takes_an_object_for_its_array(thing, array):
    assert np.asarray(thing) is array or np.shares_memory(np.asarray(thing), array)
    assert np.array_equal(np.float64(1) * thing, array)
    assert np.asarray(thing, np.float16).dtype == np.float16
    assert len(thing) == len(array)


def test_occlusion_and_sample_sets_are_taken_where_arrays_are():
    ao = lfssao.estimate("lf", BUFFERS, 0.1, sample_set("ball", "latin", 8))
    same = lfssao.estimate("lf", BUFFERS, 0.1, sample_set("ball", "latin", 8).points)
    assert np.array_equal(ao, same)
    assert np.array_equal(lfssao.merge([ao, OCCLUSION.texture[:, :1] * np.ones((60, 100), np.float32)]), ao.texture)
    assert np.array_equal(lfssao.blur(ao, 1.0), lfssao.blur(ao.texture, 1.0))
    rgb = np.ones((60, 100, 3), np.float32)
    assert np.array_equal(lfssao.shade(rgb, ao), lfssao.shade(rgb, ao.texture))


def test_weights_are_not_lost_without_a_word():
    weighted = sample_set("ball", "repulsion", 8)
    assert is_refused(lambda: np.asarray(weighted), r"samples of repulsion have weights: hand over \.points")
    assert is_refused(lambda: lfssao.estimate("lf", BUFFERS, 0.1, weighted), "samples is <SampleSet: method repulsion")
