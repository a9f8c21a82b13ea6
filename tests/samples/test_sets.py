"""Sample sets: the method, count and seed that they name make them again."""

import numpy as np
from bits import bits
from hypothesis import given, settings

from lfssao.samples import sample_set
from lfssao.testing import PROMISES, sample_sets


@settings(max_examples=30)
@given(made=sample_sets(most=40))
def test_drawn_sets_are_what_they_say(made):
    again = sample_set(made.domain, made.method, len(made.points), made.seed)
    np.testing.assert_array_equal(bits(again.points), bits(made.points))
    assert set(made.promises) <= set(PROMISES)
