"""Calls with arguments that mean nothing."""

import pytest

from lfssao import InputError


def is_refused(call, words):
    """Whether a call raises an InputError of one line with such words."""
    with pytest.raises(InputError, match=words) as caught:
        call()
    return "\n" not in str(caught.value)
