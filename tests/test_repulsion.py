"""VO's tables: sets lie inside, weights sum to the ball's volume and are those of its cells; what is refused."""

import math

import numpy as np
import pytest

from lfssao.errors import InputError
from lfssao.samples import repulsion_table

VOLUME = 4 / 3 * math.pi
KINDS = [("ball", None), ("disk", None), ("disk", True), ("disk", False)]


@pytest.mark.parametrize(("domain", "centre"), KINDS)
def test_every_table_lies_inside_and_weighs_the_volume(domain, centre):
    for n in range(1, 65):
        made = repulsion_table(domain, n, centre)
        assert made.points.shape == (n, 3 if domain == "ball" else 2)
        assert np.all(np.sum(made.points**2, axis=1) < 1)
        assert made.weights.shape == (n,)
        assert made.weights.min() > 0
        assert math.fsum(made.weights) == pytest.approx(VOLUME, rel=1e-14)
        if centre:
            assert not made.points[0].any()


@pytest.mark.parametrize(("arguments", "words"), [
    (("sphere", 4), "ball or disk"), (("ball", 0), "1 to 64"), (("ball", 65), "1 to 64"), (("ball", 4.0), "1 to 64"),
    (("ball", 4, True), "centre"),
])  # fmt: skip
def test_what_is_refused(arguments, words):
    with pytest.raises(InputError, match=words):
        repulsion_table(*arguments)
