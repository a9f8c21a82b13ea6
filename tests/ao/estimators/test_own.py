"""Estimators of one's own: templates run, and each mistake is told by its file and line."""

from importlib.resources import files

import numpy as np
import pytest

import lfssao
from lfssao.ao.estimators.own import few_texels
from lfssao.ao.estimators.registry import ESTIMATORS

START = {name: (files("lfssao.ao.estimators.templates") / f"{name}.py").read_text() for name in ("sum", "fold")}


@pytest.fixture(autouse=True)
def known(monkeypatch):
    monkeypatch.setattr(ESTIMATORS, "data", dict(ESTIMATORS.data))


def written(folder, text):
    (folder / "mine.py").write_text(text)
    return folder / "mine.py"


def test_the_start_of_a_sum_counts_hidden_points(tmp_path):
    """As ``point`` does, but for z along the view in place of a camera's image z."""
    made = lfssao.read_estimator(written(tmp_path, START["sum"]))
    buffers = few_texels()
    points = np.random.default_rng(0).uniform(-0.5, 0.5, (9, 3))
    found = lfssao.estimate(made, buffers, 0.4, points)
    assert np.array_equal(found.texture, lfssao.estimate("point", buffers, 0.4, points).texture)
    assert found.texture.any()
    assert np.array_equal(lfssao.estimate("mine", buffers, 0.4, points).texture, found.texture)
    assert lfssao.estimate(made, buffers, 0.4, points, bias=10.0).texture.sum() == 0


def test_another_text_with_the_same_fields_makes_other_numbers(tmp_path):
    """numba takes classes of one name with equal fields as one, and would run the formulas that it has."""
    buffers = few_texels()
    points = np.array([[0.0, 0.0, -0.5], [0.0, 0.0, 0.5]])
    made = []
    for half in (1, 0.5):
        own = lfssao.read_estimator(written(tmp_path, START["sum"].replace("number(1, z)", f"number({half}, z)")))
        made.append(lfssao.estimate(own, buffers, 0.4, points).texture)
    assert made[0].any()
    assert np.array_equal(made[1], 0.5 * made[0])


def test_the_start_of_a_fold_sees_a_wall_before_a_texel(tmp_path):
    buffers = few_texels()
    found = lfssao.estimate(lfssao.read_estimator(written(tmp_path, START["fold"])), buffers, 1.0).texture
    near = np.argmax(buffers.view.cast_z(buffers.depth[0]) > buffers.view.cast_z(buffers.depth[0]).min())
    assert found[:, near].min() > 0.05  # the first column behind the nearer wall's edge
    assert not found[:, :near].any()


MISTAKES = [
    ("view.surface(seen)", "view.surfac(seen)", ", line 44: nothing here has 'surfac'"),
    ("def term(", "def trem(", ": class Mine has no 'term', which formulas need"),
    ("bias: Any\n", "bias: Any\n    part: Any = 0\n", ": class Mine has a field 'part', which is a word"),
    ("return Mine(np", "return Mine(npp", ", line 58: NameError: name 'npp' is not defined"),
    ("ENTRIES = (", "ENTRY = (", ": it has no ENTRIES"),
    ('summed("mine"', 'summed("sao"', ": an estimator of lfssao has the name 'sao'"),
    ("class Mine(NamedTuple):", "class Mine(NamedTuple)", ", line 23: "),
    ("from lfssao.samples import", "from lfssao.sample import", ", line 13: ModuleNotFoundError: "),
    ("limits=(0.0, 10.0), power=1)", "limits=(0.0, 10.0), power=1.0.0)", ", line 20: "),
    ("number(1, z), 0)", "'hidden', 0)", "it cannot be compiled"),
]


@pytest.mark.parametrize(("before", "after", "words"), MISTAKES)
def test_a_mistake_is_told_by_its_line(tmp_path, before, after, words):
    assert START["sum"].count(before) == 1
    path = written(tmp_path, START["sum"].replace(before, after))
    with pytest.raises(lfssao.InputError) as caught:
        lfssao.read_estimator(path)
    assert str(caught.value).startswith(str(path))
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)
    assert "mine" not in ESTIMATORS


def test_bent_normals_need_an_axis(tmp_path):
    path = written(tmp_path, START["fold"].replace("normals=True)", "normals=True, bent=True)"))
    with pytest.raises(lfssao.InputError) as caught:
        lfssao.read_estimator(path)
    assert str(caught.value) == f"{path}: estimator mine: its formulas have no field 'axis' for bent normals"
