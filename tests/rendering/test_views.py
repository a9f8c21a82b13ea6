"""The views of a display's modules: which there are."""

import pytest

from lfssao import InputError, find_display, module_views


def test_views_of_all_modules_or_a_range(statue):
    display = find_display("sample-a").with_resolution(32, 24)
    views = module_views(statue, display)
    assert [view.name for view in views] == [f"module_{k:03d}" for k in range(21)]
    some = module_views(statue, display, range(3, 5), 2)
    assert [(view.name, view.width, view.height) for view in some] == [("module_003", 36, 28), ("module_004", 36, 28)]
    for modules in (range(20, 22), range(-1, 1), range(3, 3)):
        with pytest.raises(InputError, match="are not a part of 0:21, the modules of sample-a"):
            module_views(statue, display, modules)
