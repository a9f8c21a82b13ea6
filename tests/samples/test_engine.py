"""The square's methods as engines of scipy.stats.qmc: the same points, the same calls, the same warning."""

import numpy as np
import pytest
from scipy.stats import qmc

from lfssao.errors import InputError
from lfssao.samples import METHODS, Sampler, square_points


@pytest.mark.parametrize("name", [name for name, method in METHODS["square"].items() if method.prefix])
def test_an_engine_goes_on_leaves_out_and_begins_again(name):
    want = (square_points(name, 32, 5) + 1) / 2
    engine = Sampler(name, seed=5)
    assert isinstance(engine, qmc.QMCEngine)
    np.testing.assert_array_equal(engine.random(8), want[:8])
    np.testing.assert_array_equal(engine.random(8), want[8:16])
    np.testing.assert_array_equal(engine.fast_forward(8).random(8), want[24:])
    np.testing.assert_array_equal(engine.reset().random(4), want[:4])


def test_other_methods_give_one_set():
    engine = Sampler("latin", 5)
    assert engine.random(8).min() >= 0
    with pytest.raises(InputError, match="reset"):
        engine.random(8)
    assert engine.reset().random(8).max() < 1
    with pytest.raises(InputError, match="did you mean 'latin'"):
        Sampler("latn")


def test_sobol_warns_as_scipys_does():
    for engine in (qmc.Sobol(2), Sampler("sobol")):
        with pytest.warns(UserWarning, match="balance"):
            engine.random(12)
    Sampler("sobol").random(16)
