"""The views of a display's modules: which there are, and the scene's box in the region of interest."""

import numpy as np
import pytest

from lfssao import InputError, builtin_scene, find_display, module_views
from lfssao.ao.estimators.neighbours import nearest_modules
from lfssao.optics.display import fit_roi
from lfssao.rendering.views import neighbour_views

MESH, DISPLAY = builtin_scene("statue"), find_display("sample-a").with_resolution(32, 24)


def test_views_of_all_modules_or_a_range():
    views = module_views(MESH, DISPLAY)
    assert [view.name for view in views] == [f"module_{k:03d}" for k in range(21)]
    some = module_views(MESH, DISPLAY, range(3, 5), 2)
    assert [(view.name, view.width, view.height) for view in some] == [("module_003", 36, 28), ("module_004", 36, 28)]
    for modules in (range(20, 22), range(-1, 1), range(3, 3)):
        with pytest.raises(InputError, match="are not a part of 0:21, the modules of sample-a"):
            module_views(MESH, DISPLAY, modules)


def test_the_box_that_is_given_is_fitted_in_place_of_the_meshs():
    box = 3 * MESH.bounds
    for given, bounds in (({}, MESH.bounds), ({"bounds": box}, box)):
        (view,) = module_views(MESH, DISPLAY, range(1), **given)
        fitted = DISPLAY.view(0, fit_roi(bounds, DISPLAY.roi))
        np.testing.assert_array_equal(view.world_to_image(bounds), fitted.world_to_image(bounds))


def test_views_of_the_nearest_modules():
    asked = neighbour_views(MESH, DISPLAY, 3, range(9, 11))
    wanted = [[f"module_{k:03d}" for k in nearest_modules(DISPLAY, index, 3)] for index in (9, 10)]
    assert [[view.name for view in views] for views in asked] == wanted
    assert neighbour_views(MESH, DISPLAY, 0, range(2)) == [(), ()]
