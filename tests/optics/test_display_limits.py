"""Ends of the mapping of displays: growing radii, singular surfaces, points folded or outside."""

import math
from dataclasses import replace

import numpy as np
import pytest
from display_cases import ROI, ROUNDINGS, displays, round_trip_error, texels
from hypothesis import given, settings
from hypothesis import strategies as st

from lfssao import Display, InputError, Module
from lfssao.optics.lens import fold_radius

VALID, BEHIND_MODULE, BEHIND_OBSERVER, _, FOLDED, OUTSIDE = range(6)
FLAT = Display("flat", 1.0, 0.6, 0.1, -2.0, (Module(-0.8, 0.05, 0.7, 1000, 600, k1=0.02),), ROI)


@pytest.mark.parametrize("which", ["screen_curvature", "observer_curvature"])
@pytest.mark.parametrize("sign", [1, -1])
def test_growing_radii_lead_to_the_flat_display_at_the_rate_of_one_over_the_radius(which, sign):
    points = np.random.default_rng(33).uniform([-0.4, -0.25, -1.0], [0.4, 0.25, 0.4], (200, 3))
    u = np.array([0.5, 300, 999.5])
    v = np.array([0.5, 200, 599.5])

    def images_and_rays(display):
        return display.physical_to_image(0, points)[0], np.hstack(display.texel_ray(0, u, v))

    flat = images_and_rays(FLAT)
    errors = []
    for radius in (1e3, 1e6, 1e9, 1e12):
        curved = images_and_rays(replace(FLAT, **{which: sign / radius}))
        errors.append([np.abs(a - b).max() for a, b in zip(curved, flat, strict=True)])
    for found, floor in zip(np.transpose(errors), (1e-9, 1e-11), strict=True):
        assert found[:2] / found[1:3] == pytest.approx(1e3, rel=0.02)
        assert found[3] < floor


def answer_at(display, *point):
    image, answer = display.physical_to_image(0, point)
    assert np.isnan(image).all() == (int(answer) not in (VALID, OUTSIDE))
    return int(answer)


@given(display=displays(), x=st.floats(-0.4, 0.4), seed=st.integers(0, 2**32))
def test_rays_end_at_observers_and_lens_and_beyond_there_is_no_image(display, x, seed):
    """The conical diffuser's end where 1 + kappa = 0, z = -z_o h_m / h_e, if that is before the lens."""
    m = display.modules[0]
    y_o = display.observer_height
    z_o = display.observer_z
    arc = display.observer_curvature
    for z in (m.z, np.nextafter(m.z, 9), 2 * m.z, math.inf, math.nan):
        assert answer_at(display, m.x + x, 0.0, z) == BEHIND_MODULE
    assert arc != 0 or answer_at(display, x, 0.1, z_o) == BEHIND_OBSERVER
    origin, direction, span = display.texel_ray(0, *texels(m, seed))
    for start, step, (near, far) in zip(origin, direction, span, strict=True):
        if near < far:
            eye = start + near * step
            h_m = math.hypot(start[1] - m.y, m.z)
            h_e = math.hypot(start[1] - y_o, z_o)
            assert eye[1] == pytest.approx(y_o, abs=1e-12)
            assert arc * (eye[0] ** 2 + (near - z_o) ** 2) == pytest.approx(2 * (near - z_o), abs=1e-12)
            end = min(m.z, -z_o * h_m / h_e) if display.diffuser == "conical" else m.z
            assert far == pytest.approx(end, abs=1e-14)
            assert answer_at(display, *(start + (near - 1e-10) * step)) == BEHIND_OBSERVER
            assert answer_at(display, *(start + (far + 1e-10) * step)) == BEHIND_MODULE
            for z in (near + 1e-10, far - 1e-10):
                assert answer_at(display, *(start + z * step)) in (VALID, OUTSIDE)


TURNED = Display("turned", 1.0, 1.0, 0.0, -2.0, (Module(0.0, 0.0, 1.0, 100, 100, yaw=60.0, field_of_view=100.0),), ROI)


@pytest.mark.parametrize("diffuser", ["linear", "conical"])
def test_texels_that_look_away_from_the_screen_have_no_ray(diffuser):
    _, _, span = replace(TURNED, diffuser=diffuser).texel_ray(0, np.array([50.0, 70.0, 99.5]), 50.0)
    assert (span[:, 0] < span[:, 1]).tolist() == [True, True, False]


@pytest.mark.parametrize(("k1", "k2"), [
    (-0.03, 0.0), (0.0, -0.01), (-0.02, -0.003), (0.1, -0.02), (-0.0948, 0.0),  # the last just reaches the corner
])  # fmt: skip
def test_beyond_the_fold_there_is_no_image(k1, k2):
    m = Module(0.0, 0.0, 1.0, 100, 75, k1=k1, k2=k2)
    display = Display("folds", 2.0, 1.5, 0.0, -2.0, (m,), ROI)
    fold = math.sqrt(fold_radius(k1, k2))
    top = fold * (1 + k1 * fold**2 + k2 * fold**4)
    c = np.cos([0.0, 0.7, 2.0, 3.5])
    s = np.sin([0.0, 0.7, 2.0, 3.5])
    for share in (0.9, 1 - 1e-9, 1 + 1e-9, 2.0):
        _, answers = display.physical_to_image(0, share * fold * np.stack([c, s, 0 * s], axis=1))
        assert (answers == (OUTSIDE if share < 1 else FOLDED)).all()
        worst, there = round_trip_error(display, 0, 50 + 50 * share * top * c, 37.5 - 50 * share * top * s)
        assert (there == (share < 1)).all()
        assert worst < ROUNDINGS


@pytest.mark.parametrize(("k1", "r"), [(0.0, 1.8), (-0.1, 1.9), (0.05, 1.7)])
def test_a_distortion_must_grow_up_to_the_corner(k1, r):
    """With this k2 distorted radii grow up to r; the texture's corner is as far out as the largest, or a bit nearer."""
    k2 = -(1 + 3 * k1 * r**2) / (5 * r**4)
    radii = np.linspace(0.0, r, 1001)
    grown = radii * (1 + radii**2 * (k1 + radii**2 * k2))
    assert (np.diff(grown) > 0).all()
    height = 1000 * math.sqrt(grown[-1] ** 2 - 1)
    m = Module(0.0, 0.0, 1.0, 1000, round(height) - 2, k1=k1, k2=k2)
    display = Display("folds", 2.0, 1.5, 0.0, -2.0, (m,), ROI)
    with pytest.raises(InputError, match="k1: the distortion folds inside the texture"):
        replace(display, modules=(replace(m, height=round(height) + 2),))


@settings(max_examples=200)
@given(display=displays(), points=st.lists(st.tuples(*[st.floats()] * 3), min_size=1, max_size=6))
def test_any_numbers_get_an_answer(display, points):
    image, answers = display.physical_to_image(0, points)
    assert np.isnan(image[~np.isin(answers, (VALID, OUTSIDE))]).all()
    assert np.isfinite(np.array(points)[answers == VALID]).all()
    assert np.isfinite(image[answers == VALID]).all()


@pytest.mark.parametrize("axis", ["yaw", "pitch"])
@pytest.mark.parametrize("side", [1, -1])
def test_the_ray_of_a_modules_middle_must_reach_the_screen(axis, side):
    """Turned by 85 degrees it does; by 95 it leads away, though rays of other texels reach the screen."""
    module = Module(0.0, 0.05, 0.7, 40, 30, field_of_view=60.0)
    assert replace(FLAT, modules=(replace(module, **{axis: side * 85.0}),)).modules
    with pytest.raises(InputError, match="the ray of its middle does not reach screen and observers"):
        replace(FLAT, modules=(replace(module, **{axis: side * 95.0}),))
