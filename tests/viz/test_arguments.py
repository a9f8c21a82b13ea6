"""Arguments of figures' numbers that mean nothing: each is refused in a sentence that names it."""

import numpy as np
import pytest
from refusals import is_refused

import lfssao
from lfssao import viz

DISPLAY = lfssao.find_display("virtual").with_resolution(8, 6)
TEXTURES = lfssao.render("corner", DISPLAY, lfssao.Settings((0.5,), layers=("depth", "positions")))[0]
OCCLUSION = np.full((2, 3), 0.5, np.float32)
SURFACE = np.ones((2, 3), bool)
HOLED = np.ma.array(OCCLUSION, mask=np.eye(2, 3))


def traced(texel, samples=((0.0, 0.0, 0.5),), radius=0.5):
    return viz.trace_texel(texel, TEXTURES.view, TEXTURES.gbuffer, samples, radius)


WRONG = [
    *((lambda bad=bad: traced(bad), "texel") for bad in (
        (-1, 0), (8, 0), (0, 6), (0.5, 0), ("0", 0), 3, None, (1, 2, 3),
    )),
    *((lambda bad=bad: traced((4, 3), bad), "samples") for bad in (
        "many", np.ones((1, 2)), np.ma.array(np.ones((1, 3)), mask=[[0, 0, 1]]),
    )),
    *((lambda bad=bad: traced((4, 3), radius=bad), "radius is") for bad in (np.nan, -1, "0.5", None)),
    (lambda: viz.occluded_fraction([]), "there are no samples"),
    *((lambda bad=bad: viz.deciding_radius(bad), "layer") for bad in (
        [HOLED], [np.nan * OCCLUSION], [OCCLUSION, [1]], 5,
    )),
    *((lambda bad=bad: viz.deviation(bad, OCCLUSION, SURFACE), "occlusion") for bad in (
        HOLED, np.nan * OCCLUSION, None, OCCLUSION[:1],
    )),
    *((lambda bad=bad: viz.deviation(OCCLUSION, bad, SURFACE), "truth") for bad in (HOLED, np.nan * OCCLUSION, "rays")),
    (lambda: viz.deviation(OCCLUSION, OCCLUSION, ~SURFACE), "a texel with a surface"),
]  # fmt: skip


@pytest.mark.parametrize(("call", "words"), WRONG, ids=[words for _, words in WRONG])
def test_what_means_nothing_is_refused(call, words):
    assert is_refused(call, words)
