"""Names that a package imports late."""

import pytest

import lfssao
from lfssao.core.late_names import late_names
from lfssao.optics.display import Display


def test_names_are_those_of_their_modules_or_modules_themselves():
    get, names = late_names("x", {"optics.display": ("Display",), "ao": ("reference",)})
    assert get("Display") is Display
    assert get("reference").__name__ == "lfssao.ao.reference"
    assert names() == ["Display", "reference"]
    with pytest.raises(AttributeError, match="module 'x' has no attribute 'Displai'"):
        get("Displai")


def test_unknown_names_of_the_package_are_unknown():
    with pytest.raises(AttributeError, match="module 'lfssao' has no attribute 'renderr'"):
        lfssao.renderr  # noqa: B018
