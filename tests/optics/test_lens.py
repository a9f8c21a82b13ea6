"""Module optics: homographies and where radial distortion folds, against computations of another kind."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from reference.textbook import rotation as turned_about

from lfssao.errors import InputError
from lfssao.optics import lens as optics

unit = st.floats(-1, 1)
homographies = st.builds(
    lambda h, scale: tuple((np.array([*h, 1.0]) * ([scale] * 6 + [1.0] * 3)).tolist()),
    st.lists(unit, min_size=8, max_size=8), st.sampled_from([1.0, 1e3]),
)  # fmt: skip


def matrix(h):
    return np.array(h).reshape(3, 3)


def apply(h, x, y):
    a, b, c = matrix(h) @ [x, y, 1.0]
    return np.array([a / c, b / c])


@given(homographies, st.integers(0, 500), unit, unit)
def test_a_guard_band_moves_texels_by_its_width(h, guard, x, y):
    assume(abs(matrix(h)[2] @ [x, y, 1]) > 0.05)
    np.testing.assert_allclose(apply(optics.with_guard(h, guard), x, y), apply(h, x, y) + guard, rtol=1e-11, atol=1e-9)
    assert optics.with_guard(h, 0) == h


@given(homographies)
def test_inverse_undoes_a_homography(h):
    assume(np.linalg.cond(matrix(h)) < 1e6)
    inverse = matrix(optics.invert(h))
    np.testing.assert_allclose(inverse @ matrix(h), np.eye(3), rtol=0, atol=1e-8)
    np.testing.assert_allclose(inverse, np.linalg.inv(matrix(h)), rtol=1e-7, atol=1e-9 * np.abs(inverse).max())
    np.testing.assert_allclose(optics.invert(optics.invert(h)), h, rtol=1e-7, atol=1e-9 * max(map(abs, h)))


@pytest.mark.parametrize("scale", [1e-100, 1.0, 1e100])
def test_singularity_does_not_depend_on_the_scale(scale):
    h = np.array([1000.0, 3, 512, 2, -900, 384, 0.1, 0.05, 1])
    optics.invert(tuple((scale * h).tolist()))
    for singular in ([1, 2, 3, 2, 4, 6, 0, 0, 1], [1, 0, 0, 0, 1, 0, 1, 1, 0], [0.0] * 9, [0.1, 0.2, 0.3] * 3):
        with pytest.raises(InputError, match="singular"):
            optics.invert(tuple((scale * np.array(singular)).tolist()))


@pytest.mark.parametrize("entry", range(9))
def test_an_infinite_or_undefined_homography_is_singular(entry):
    for value in (math.nan, math.inf):
        h = [1000.0, 3, 512, 2, -900, 384, 0.1, 0.05, 1]
        h[entry] = value
        with pytest.raises(InputError, match="singular"):
            optics.invert(tuple(h))


def test_a_field_of_view_whose_focal_length_overflows_is_refused_in_silence():
    with pytest.raises(InputError, match="singular"):
        optics.invert(optics.projector_homography((0.0, 0.0, 1.0), (0.0, 0.0, 0.0), 1e-306, (40, 30)))


angles = st.floats(-70, 70)


@given(
    st.tuples(unit, unit, st.floats(0.2, 2)), st.tuples(angles, angles, st.floats(-180, 180)), st.floats(1, 170), unit,
    unit,
)  # fmt: skip
def test_projector_homography_is_that_of_rotation_matrices(lens, turn, field_of_view, x, y):
    """Yaw to +x, pitch up and roll, in that order, each about the projector's own axes; it looked along -z."""
    width = 640
    height = 480
    yaw, pitch, roll = turn
    # In physical space, X right, Y up, Z away, seen along -z: yaw to +x turns about y from -z to +x, and so on.
    rotation = turned_about(1, -yaw) @ turned_about(0, pitch) @ turned_about(2, roll)
    right, up, back = rotation.T @ (np.array([x, y, 0.0]) - lens)
    forward = -back
    assume(abs(forward) > 0.05)
    focal = 0.5 * width / math.tan(math.radians(field_of_view / 2))
    want = 0.5 * width + focal * right / forward, 0.5 * height - focal * up / forward
    h = optics.projector_homography(lens, turn, field_of_view, (width, height))
    np.testing.assert_allclose(apply(h, x, y), want, rtol=1e-10, atol=1e-9)
    assert (matrix(h)[2] @ [x, y, 1] > 0) == (forward > 0)


@given(st.one_of(st.just(0.0), st.floats(-2, 2)), st.one_of(st.just(0.0), st.floats(-2, 2)))
def test_fold_radius_is_the_first_zero_of_the_slope(k1, k2):
    found = optics.fold_radius(k1, k2)
    assert found > 0

    def slope(r2):
        return 1 + r2 * (3 * k1 + r2 * (5 * k2))

    until = np.linspace(0, min(found, 100.0) * (1 - 1e-9), 20_001)
    assert (slope(until) > 0).all()
    if found < math.inf:
        size = 1 + 3 * abs(k1) * found + 5 * abs(k2) * found * found
        assert abs(slope(found)) <= 1e-14 * size
    else:
        far = 10.0 ** np.linspace(-3, 12, 3001)
        assert (slope(far) > 0).all()
