"""Pictures of objects in a notebook: the right values in the right places."""

from io import BytesIO
from types import SimpleNamespace

import numpy as np
import pytest
from IPython.core.formatters import DisplayFormatter
from jobs import python
from PIL import Image

from lfssao import GBuffer, Occlusion, Photograph, RayCaster, Settings, find_display, render_view
from lfssao.files import pictures
from lfssao.rendering.settings import diagonal
from lfssao.rendering.views import module_views
from lfssao.samples import sample_set
from lfssao.viz import notebook

DISPLAY = find_display("sample-a").with_resolution(40, 24)


def shown(thing):
    """The picture of an object, (H, W, 3) uint8."""
    return np.asarray(Image.open(BytesIO(thing._repr_png_())).convert("RGB"))


@pytest.fixture(scope="module")
def textures(statue):
    view = module_views(statue, DISPLAY)[10]
    settings = Settings((0.05 * diagonal(statue),), normals="geometric")
    return render_view(RayCaster(statue, view.cast_from_world), view, settings)


def test_occlusion_is_shown_as_visibility():
    ao = np.array([[0.0, 0.2], [1.0, 0.5]], np.float32)
    picture = shown(Occlusion(ao, 0))
    assert picture.shape == (360, 360, 3)
    assert picture[::359, ::359, 1].tolist() == [[255, 204], [0, 128]]


def test_textures_are_shown_without_visibility_and_with(textures):
    picture = shown(textures)
    left, middle, right = (picture[:, k : k + 320].astype(int) for k in (0, 332, 664))
    occluded = np.kron(textures.blurred, np.ones((8, 8))) > 0.3
    assert occluded.sum() > 1000
    assert (right <= left).all()
    assert (right[occluded] < left[occluded]).any(axis=1).mean() > 0.99
    visibility = np.kron(1 - textures.blurred, np.ones((8, 8)))
    assert visibility.min() > 0.0031308  # beyond the straight part of sRGB's curve
    assert np.abs(middle[..., 0] - 255 * (1.055 * visibility ** (1 / 2.4) - 0.055)).max() <= 0.51


def test_a_gbuffer_shows_depth_normals_and_colour(textures):
    gbuffer = textures.gbuffer
    parts = gbuffer.pictures()
    seen = gbuffer.triangle >= 0
    assert len(parts) == 3
    assert (parts[0][~seen] == 255).all()
    assert (parts[1][~seen] == 255).all()
    depth = gbuffer.depth[seen]
    assert parts[0][seen][np.argmin(depth)].tolist() == [235] * 3
    assert parts[0][seen][np.argmax(depth)].tolist() == [40] * 3
    assert (parts[1][seen][:, 0] > 127).tolist() == (gbuffer.normals[seen][:, 0] > -0.5 / 255).tolist()
    assert shown(gbuffer).shape == (216, 3 * 368 - 8, 3)
    assert len(GBuffer(gbuffer.depth, gbuffer.positions, None, gbuffer.triangle).pictures()) == 1


def test_a_view_of_nothing_is_white():
    nothing = np.full((2, 3), np.inf, np.float32)
    assert (pictures.depth_codes(nothing) == 255).all()


@pytest.mark.parametrize("channels", [1, 3])
def test_a_photograph_shows_light(channels):
    image = np.zeros((2, 4, channels), np.float32)
    image[0, 0], image[1, 3] = 1.0, 0.2158605  # sRGB code 128 (IEC 61966-2-1)
    picture = shown(Photograph(image, 0))
    assert picture.shape == (2, 4, 3)
    assert picture[..., 0].tolist() == [[255, 0, 0, 0], [0, 0, 0, 128]]


@pytest.mark.parametrize("thing", [DISPLAY, sample_set("square", "jittered", 16)], ids=["display", "samples"])
def test_a_notebook_shows_displays_and_sample_sets_as_figures(thing, monkeypatch):
    shell = SimpleNamespace(display_formatter=DisplayFormatter())
    monkeypatch.setattr(notebook, "get_ipython", lambda: shell)
    notebook.show_figures()
    made, _ = shell.display_formatter.format(thing)
    picture = np.asarray(Image.open(BytesIO(made["image/png"])).convert("RGB"))
    assert min(picture.shape[:2]) > 300
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 20


def test_figures_are_shown_in_notebooks_alone():
    """``import lfssao`` in a notebook registers them; elsewhere it imports neither IPython nor matplotlib."""
    ask = "print([t for t in formatter.deferred_printers if t[0].startswith('lfssao')])"
    script = f"""from IPython.core.interactiveshell import InteractiveShell
formatter = InteractiveShell.instance().display_formatter.formatters['image/png']
import lfssao
{ask}"""
    found = python("-c", script).stdout
    assert found == "[('lfssao.optics.display', 'Display'), ('lfssao.samples.sets', 'SampleSet')]\n"
    plain = "import sys, lfssao; print({'IPython', 'matplotlib'} & set(sys.modules))"
    assert python("-c", plain).stdout == "set()\n"
