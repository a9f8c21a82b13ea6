"""Sample sets: the method, count and seed that they name make them again."""

import numpy as np
from bits import bits
from hypothesis import given, settings

from lfssao.samples import METHODS, sample_set
from lfssao.testing import PROMISES, sample_sets


@settings(max_examples=30)
@given(made=sample_sets(most=40))
def test_drawn_sets_are_what_they_say(made):
    again = sample_set(made.domain, made.method, len(made.points), made.seed)
    np.testing.assert_array_equal(bits(again.points), bits(made.points))
    assert set(made.promises) <= set(PROMISES)


def test_weights_are_volumes_of_the_ball():
    """The weights of point repulsion share out the unit ball's 4/3 pi; no other method has any."""
    for domain, methods in METHODS.items():
        for name in methods:
            made = sample_set(domain, name, 8)
            assert (made.weights is not None) == (name == "repulsion")
            if made.weights is not None:
                np.testing.assert_allclose(made.weights.sum(), 4 / 3 * np.pi, rtol=1e-12)
