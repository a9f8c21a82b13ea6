"""The figures of occlusion on the surface: interiors and silhouettes apart, in text, JSON and page."""

import json

import numpy as np
import pytest
from compare_folders import changed, compare, poke, remade

from lfssao import read_exr
from lfssao.verify.compare.agreement import PARTS, agreements, surface_parts


@pytest.fixture
def scene():
    """A slanted plane with a box before it, both textures of occlusion; whether each texel is of a silhouette."""
    depth = (
        np.float32(0.2) + np.float32(0.01) * np.arange(30, dtype=np.float32)[:, None] + np.zeros((30, 40), np.float32)
    )
    depth[10:20, 10:20] -= np.float32(0.15)
    depth[:, 30:] = np.inf
    edges = np.zeros(depth.shape, bool)
    edges[9:21, 9:21], edges[11:19, 11:19] = True, False
    edges[9:21:11, 9:21:11] = False  # corners of the ring see no step along their row or column
    edges[:, 29] = True
    reference = np.random.default_rng(1).random(depth.shape, np.float32)
    mine = np.where(edges, 1 - reference, 2 * reference + np.float32(0.25))
    mine[0, :3] = reference[0, :3] + np.float32([5e-6, 2e-3, 6e-3])
    return mine, reference, depth, edges & np.isfinite(depth)


def test_figures_are_those_of_their_formulas_on_each_part(scene):
    mine, reference, depth, edges = scene
    found = agreements(mine, reference, surface_parts(depth, len(mine)))
    assert tuple(found) == PARTS
    for part, flags in (("interiors", np.isfinite(depth) & ~edges), ("silhouettes", edges)):
        figures = found[part]
        a = mine[flags].astype(float)
        b = reference[flags].astype(float)
        slope, offset = np.polyfit(b, a, 1)
        assert figures.texels == flags.sum()
        assert (figures.mean, figures.reference_mean) == pytest.approx((a.mean(), b.mean()))
        assert (figures.slope, figures.offset) == pytest.approx((slope, offset))
        assert figures.correlation == pytest.approx(np.corrcoef(a, b)[0, 1])
        assert (figures.within_1e5 * a.size, figures.within_code * a.size) == pytest.approx(
            ((np.abs(a - b) <= 1e-5).sum(), (np.abs(a - b) <= 1 / 255).sum())
        )
    assert "mine = -1 reference +1," in found["silhouettes"].words("silhouettes")


def test_a_guard_band_is_left_out_and_what_is_constant_has_no_regression(scene):
    mine, reference, depth, _ = scene
    whole = agreements(mine, reference, surface_parts(depth, 30))
    cropped = agreements(mine[3:-3, 3:-3], reference[3:-3, 3:-3], surface_parts(depth, 24))
    assert cropped["silhouettes"].texels == whole["silhouettes"].texels - 6
    (constant,) = agreements(mine, np.ones_like(mine), surface_parts(np.zeros_like(depth), 30)).values()
    assert (constant.slope, constant.offset, constant.correlation) == (None, None, None)
    assert "mine =" not in constant.words("interiors")
    assert agreements(mine, reference, surface_parts(np.full_like(depth, np.inf), 30)) == {}


def test_reports_show_them_where_occlusion_differs(tmp_path, reference, capsys):
    half = remade("ao_1", lambda pixels: np.float32(0.5) * pixels + np.float32(0.125))
    mine = changed(reference, tmp_path / "mine", "module_003", half)
    depth = read_exr(reference / "module_003.exr")["depth"].pixels
    assert compare(mine, reference, "--json", tmp_path / "a.json", "--html", tmp_path / "a.html") == 2
    results = {(r["module"], r["layer"]): r for r in json.loads((tmp_path / "a.json").read_text())["results"]}
    found = results["module_003", "ao_1"]["agreement"]
    assert list(found) == list(PARTS)
    assert sum(part["texels"] for part in found.values()) == np.isfinite(depth).sum()
    assert (found["interiors"]["slope"], found["interiors"]["offset"]) == pytest.approx((0.5, 0.125))
    assert results["module_004", "ao_1"]["agreement"] == results["module_003", "depth"]["agreement"] == {}
    line = "mine = 0.5 reference +0.125, "
    for text in (capsys.readouterr().out, (tmp_path / "a.html").read_text("utf-8")):
        assert [text.count(word) for word in (line, "interiors: ", "silhouettes: ")] == [2, 1, 1]


def test_one_texel_that_is_nan_leaves_the_figures(tmp_path, reference, capsys):
    compare(changed(reference, tmp_path / "mine", "module_003", poke("merged", (16, 24), np.nan)), reference)
    assert "correlation 1.0000" in capsys.readouterr().out
