"""How a wrong renderer sees a scene: what cannot be is refused, whatever came first."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import lfssao
from lfssao.errors import InputError
from lfssao.verify.diagnosis.views import sight_of, view_changes


def seen_by(name, module):
    display = lfssao.find_display(name).with_resolution(48, 36)
    return sight_of(display.view(module, np.eye(3, 4)), display, module)


@pytest.fixture
def sight():
    return seen_by("sample-a", 6)


def test_a_pinhole_has_no_distortion_whichever_comes_first(sight):
    with pytest.raises(InputError, match="a pinhole has aligned texels and no distortion"):
        replace(sight.with_module(k1=0.01), pinhole=True)
    with pytest.raises(InputError, match="a pinhole has aligned texels and no distortion"):
        replace(sight, pinhole=True).with_module(k1=0.01)


@pytest.mark.parametrize(("name", "module"), [("sample-a", 6), ("sample-a-conical", 6), ("convex", 20)])
def test_a_pinhole_looks_through_the_lens_in_both_axes(name, module):
    """Whatever the diffuser and the screen are."""
    own = seen_by(name, module).with_module(k1=0.0)
    (change,) = [each for each in view_changes(own, None, {}) if each.kind == "a pinhole in both axes"]
    made = change.apply(SimpleNamespace(sight=own, with_sight=lambda sight: sight), ())
    lens = np.array([own.module.x, own.module.y, own.module.z])
    for start, end in made.lines(np.arange(5), np.arange(5))[:, :6].reshape(5, 2, 3):
        away = np.cross(end - start, lens - start) / np.linalg.norm(end - start)
        assert np.linalg.norm(away) < 1e-9
