"""Settings: default radii, what is refused, and which layers are kept and computed."""

import numpy as np
import pytest

from lfssao import InputError, Settings, default_radii
from lfssao.rendering.settings import ASKED
from lfssao.rendering.settings import LAYERS as ALL

LAYERS = tuple(name for name in ALL if name not in ASKED)


def test_layers_that_are_kept_and_normals_that_they_need():
    assert Settings((0.1,)).kept == tuple(name for name in LAYERS if name != "normals")
    assert Settings((0.1,), normals="smooth").kept == LAYERS
    assert Settings((0.1,), estimator="hbao").kept == LAYERS
    assert Settings((0.1,), estimator="sao", parameters={"normals": "buffer"}).kept == LAYERS
    assert "normals" not in Settings((0.1,), estimator="sao").kept
    assert ASKED == ("bent",)
    asked = Settings((0.1,), layers=("shaded", "normals", "shaded"))
    assert asked.kept == ("normals", "shaded")
    assert asked.normals == "geometric"


def test_default_radii_are_fractions_of_the_diagonal(statue):
    diagonal = np.linalg.norm(statue.bounds[1] - statue.bounds[0])
    assert default_radii(statue) == pytest.approx([f * diagonal for f in (0.01, 0.02, 0.035, 0.06, 0.1)])


@pytest.mark.parametrize(("wrong", "words"), [
    ({"radii": ()}, "radii: at least one"),
    ({"radii": (0.1, -1.0)}, "radius"),
    ({"blur": float("nan")}, "sigma"),
    ({"color_filter": "cubic"}, "color_filter: there is no choice 'cubic': choose one of bilinear, nearest"),
    ({"normals": "up"}, "normals: there is no choice 'up': choose one of geometric, smooth"),
    ({"caster": "vulkan"}, "caster: there is no choice 'vulkan': choose one of exact, embree"),
    ({"estimator": "best"}, "no estimator 'best'"),
    ({"parameters": {"x": 1}}, "estimator lf has no parameter 'x'"),
    ({"samples": np.zeros((4, 2))}, r"samples have shape \(4, 2\)"),
    ({"neighbours": -1}, "neighbours is -1, it must be a whole number of at least 0"),
    ({"neighbours": 1, "estimator": "sao"}, "neighbours are for estimator lf, not for sao"),
    ({"estimator": "lf-neighbours"}, "estimator lf-neighbours asks other modules: neighbours must be at least 1"),
    ({"units": "feet"}, "units: there is no choice 'feet': choose one of radii, world"),
    ({"estimator": "sao", "parameters": {"angle_sum": "float32"}}, "angle_sum is float32, which is of the rotation"),
    ({"layers": ()}, "layers: at least one"),
    ({"layers": ("ao_1",)}, "layers: there is no layer 'ao_1'"),
    ({"layers": ("depth", "best")}, "layers: there is no layer 'best'"),
])  # fmt: skip
def test_what_settings_refuse(wrong, words):
    with pytest.raises(InputError, match=words):
        Settings(**{"radii": (0.1,), **wrong})
