"""Errors: one base that the command line prints, and the classes that programs expect."""

from lfssao import InputError, LfssaoError, MissingPackageError


def test_errors_are_of_the_classes_that_programs_catch():
    assert issubclass(InputError, LfssaoError)
    assert issubclass(InputError, ValueError)
    assert issubclass(MissingPackageError, LfssaoError)
    assert issubclass(MissingPackageError, ImportError)
