"""Changes of the blur: wide blurs are predicted as narrow ones are, in little memory."""

import tracemalloc

import numpy as np
import pytest

from lfssao.verify.diagnosis import post

HEIGHT = 40
WIDTH = 56


def blur(sigma, number, rng):
    """The problem of ``number`` texels of a random texture."""
    places = rng.choice(HEIGHT * WIDTH, number, replace=number > HEIGHT * WIDTH)
    rows, columns = np.divmod(places, WIDTH)
    nothing = np.zeros(number)
    merged = rng.random((HEIGHT, WIDTH)).astype(np.float32)
    plain = {"mine": nothing, "interval_width": nothing, "excess": nothing}
    return post.Blur(**plain, rows=rows, columns=columns, merged=merged, sigma=sigma)


@pytest.mark.parametrize("sigma", [0.7, 3.0])
def test_two_passes_over_the_texture_are_the_squares_of_texels(sigma, monkeypatch):
    problem = blur(sigma, 300, np.random.default_rng(1))
    changes = [change for change in problem.changes() if not change.first]
    assert len(changes) > 20
    for change in changes:
        made = change.apply(problem, (1.3,) * len(change.axes))
        monkeypatch.setattr(post, "_MOST_TAPS", 10**9)
        squares = made.interval()
        monkeypatch.setattr(post, "_MOST_TAPS", 0)
        np.testing.assert_allclose(made.interval(), squares, rtol=0, atol=1e-12, err_msg=change.kind)


def test_a_wide_blur_of_many_texels_takes_little_memory():
    """The squares of taps of 2,400 texels would take 7 GB."""
    problem = blur(100.0, 2400, np.random.default_rng(2))
    tracemalloc.start()
    low, high = problem.ends()
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 100e6
    assert 0 < low.min() <= high.max() < 1  # a mean of the texture's values
