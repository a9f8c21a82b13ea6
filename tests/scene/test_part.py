"""Parts of meshes."""

import numpy as np

from lfssao.scene.part import distinct


def test_distinct_rows():
    rows = np.random.default_rng(3).integers(-1, 3, (200, 3))
    places, numbers = distinct(rows)
    values, inverse = np.unique(rows, axis=0, return_inverse=True)
    assert np.array_equal(rows[places], values)
    assert np.array_equal(numbers, inverse.reshape(-1))
