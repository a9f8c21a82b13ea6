"""Errors: one base that the command line prints, and the classes that programs expect."""

import pytest

from lfssao import InputError, LfssaoError, MissingPackageError, make_samples


def test_errors_are_of_the_classes_that_programs_catch():
    assert issubclass(InputError, LfssaoError)
    assert issubclass(InputError, ValueError)
    assert issubclass(MissingPackageError, LfssaoError)
    assert issubclass(MissingPackageError, ImportError)


def test_an_unknown_name_is_answered_with_the_nearest():
    with pytest.raises(InputError, match=r"did you mean 'latin'"):
        make_samples("latn", 8)
