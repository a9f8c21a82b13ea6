"""How a wrong renderer sees a scene: what cannot be is refused, whatever came first."""

from dataclasses import replace

import numpy as np
import pytest

import lfssao
from lfssao.errors import InputError
from lfssao.verify.diagnosis.views import sight_of


@pytest.fixture
def sight():
    display = lfssao.find_display("sample-a").with_resolution(48, 36)
    return sight_of(display.view(6, np.eye(3, 4)), display, 6)


def test_a_pinhole_has_no_distortion_whichever_comes_first(sight):
    with pytest.raises(InputError, match="a pinhole has aligned texels and no distortion"):
        replace(sight.with_module(k1=0.01), pinhole=True)
    with pytest.raises(InputError, match="a pinhole has aligned texels and no distortion"):
        replace(sight, pinhole=True).with_module(k1=0.01)


def test_a_pinhole_looks_through_the_lens_in_both_axes(sight):
    lens = np.array([sight.module.x, sight.module.y, sight.module.z])
    lines = replace(sight, pinhole=True).lines(np.arange(5), np.arange(5))
    for start, end in zip(lines[:, :3], lines[:, 3:6], strict=True):
        away = np.cross(end - start, lens - start) / np.linalg.norm(end - start)
        assert np.linalg.norm(away) < 1e-9
