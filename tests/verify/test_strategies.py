"""lfssao.testing's strategies: what they draw is valid, within what was asked, and covers what it should."""

import numpy as np
import pytest
from hypothesis import Phase, find, given, settings
from hypothesis import strategies as st
from jobs import python
from refusals import is_refused

from lfssao import estimate
from lfssao.testing import cameras, displays, gbuffers, radii, sample_sets

EYE = np.eye(3, 4)


@settings(max_examples=40)
@given(display=displays(modules=3, texels=20))
def test_displays_have_rays_and_mappings(display):
    assert 1 <= len(display.modules) <= 3
    for index, module in enumerate(display.modules):
        assert max(module.width, module.height) <= 20
        view = display.view(index, EYE)
        assert view.screen_to_world is None
        _, _, span = display.texel_ray(index, module.width / 2, module.height / 2)
        assert np.all(np.isfinite(span))


@settings(max_examples=40)
@given(camera=cameras())
def test_cameras_see_what_they_look_at(camera):
    u, v, z = camera.view(32, 24).world_to_image(np.array(camera.target))
    assert (u, v) == pytest.approx((16, 12), abs=1e-6)
    assert 0 < z < 1


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@settings(max_examples=12)
@given(data=st.data())
def test_gbuffers_can_be_estimated_from(dtype, data):
    buffers = data.draw(gbuffers(dtype=dtype, most=9))
    assert buffers.depth.dtype == dtype
    empty = np.isinf(buffers.depth)
    assert np.array_equal(empty, np.isinf(buffers.positions).all(axis=-1))
    assert not buffers.normals[empty].any()
    occlusion = estimate(
        "lf", buffers, data.draw(radii(most=10.0)), data.draw(sample_sets(domain="ball", most=8)).points
    )
    assert np.all((occlusion.texture >= 0) & (occlusion.texture <= 1))
    assert not occlusion.texture[empty].any()


@given(r=radii(least=0.1, most=5.0, zero=False))
def test_radii_stay_in_their_range(r):
    assert 0.1 <= r <= 5


def drawn(strategy, condition=lambda value: True):
    """A value that fulfils a condition, not made as simple as possible: that would take long."""
    return find(strategy, condition, settings=settings(phases=[Phase.generate], max_examples=500, database=None))


def test_the_extremes_can_be_drawn():
    for wanted in (0.0, 1e-30, 1e30):
        assert drawn(radii(), lambda r, wanted=wanted: r == wanted) == wanted
    for screen, sign in (("convex", 1), ("concave", -1), ("flat", 0)):
        assert np.sign(drawn(displays(screens=(screen,))).screen_curvature) == sign
    assert drawn(displays(screens=("conical",))).diffuser == "conical"
    assert drawn(sample_sets(methods=("poisson",))).method == "poisson"
    assert drawn(gbuffers(normals=False), lambda b: np.isinf(b.depth).any()).normals is None


# The least and the largest of the numbers that are drawn; the strategies' docstrings say the most important ones.
ENDS = {
    "away": (2, 10), "target": (-1, 1), "rise": (-0.9, 0.9), "tilt": (-0.2, 0.2), "extent": (0.1, 1.5),
    "near": (0.01, 0.5), "far": (1.5, 10), "width": (0.5, 1.6), "height": (0.3, 1), "observers": (-4, -1.5),
    "level": (-0.3, 0.3), "radius": (1.5, 5), "arc": (0, 0.5), "count": (1, 3), "x": (-0.1, 0.1), "y": (-0.2, 0.2),
    "z": (0.6, 1.5), "texels": (1, 64), "roll": (-5, 5), "field of view": (20, 90),
}  # fmt: skip


def camera_numbers(camera):
    away = np.subtract(camera.eye, camera.target)
    length = np.linalg.norm(away)
    yield from (("away", length), ("rise", away[1] / length), ("extent", camera.extent / length))
    yield from (("near", camera.near / length), ("far", camera.far / length))
    yield from (("target", x) for x in camera.target)
    yield from (("tilt", camera.up[k]) for k in (0, 2))


def display_numbers(display):
    yield from (("width", display.screen_width), ("height", display.screen_height), ("count", len(display.modules)))
    yield from (("observers", display.observer_z), ("level", display.observer_height))
    yield "arc", -display.observer_curvature * display.observer_z
    if display.screen_curvature:
        yield "radius", 1 / abs(display.screen_curvature) / display.screen_width
    for k, module in enumerate(display.modules):
        yield "x", module.x + 0.3 - 0.3 * (2 * k + 1) / len(display.modules)  # their even places
        yield from (("y", module.y), ("z", module.z), ("texels", module.width), ("texels", module.height))
        if module.field_of_view is not None:
            yield from (("roll", module.roll), ("field of view", module.field_of_view))


def test_numbers_come_near_the_ends_of_their_ranges_and_no_farther():
    found = {}

    @settings(max_examples=400, phases=[Phase.generate])
    @given(camera=cameras(), display=displays(screens=("flat", "convex", "concave")))
    def collect(camera, display):
        for name, number in (*camera_numbers(camera), *display_numbers(display)):
            low, high = found.get(name, (number, number))
            found[name] = min(low, number), max(high, number)

    collect()
    assert found.keys() == ENDS.keys()
    for name, (low, high) in ENDS.items():
        least, most = found[name]
        room, tiny = 0.25 * (high - low), 1e-9 * (high - low)  # draws depend on what else the process has loaded
        assert low - tiny <= least <= low + room, name
        assert high - room <= most <= high + tiny, name


@pytest.mark.parametrize(("call", "words"), [
    (lambda: radii(least=2, most=1), "least and most are 2 and 1"),
    (lambda: radii(most=0), "least and most are 0.0 and 0"),
    (lambda: radii(least="1"), "least and most are '1'"),
    (lambda: sample_sets(domain="bal"), "did you mean 'ball'"),
    (lambda: sample_sets(methods=("latn",)), "did you mean 'latin'"),
    (lambda: sample_sets(domain="ball", methods=("spiral",)), "there is no methods 'spiral'"),
    (lambda: sample_sets(methods="latin"), "methods is 'latin', it must be a list"),
    (lambda: sample_sets(least=0), "least is 0"),
    (lambda: sample_sets(least=5, most=4), "most is 4"),
    (lambda: cameras(projections=()), r"projections is \(\), it must be a list"),
    (lambda: cameras(projections=("fisheye",)), "'fisheye'"),
    (lambda: cameras(distance=0), "distance is 0"),
    (lambda: displays(screens=("round",)), "'round'"),
    (lambda: displays(modules=0), "modules is 0"),
    (lambda: displays(texels=1.5), "texels is 1.5"),
    (lambda: gbuffers(dtype=int), "dtype is <class 'int'>"),
    (lambda: gbuffers(most=0), "most is 0"),
    (lambda: gbuffers(normals="yes"), "normals is of type str"),
    (lambda: gbuffers(views=cameras), "views is of type function"),
])  # fmt: skip
def test_strategies_refuse_what_means_nothing_where_they_are_made(call, words):
    assert is_refused(call, words)


def test_methods_choose_the_domains_that_have_them():
    assert drawn(sample_sets(methods=("spiral",))).domain == "disk"


def test_hypothesis_is_imported_only_with_a_strategy():
    script = """import sys
from lfssao.testing import check_promise
check_promise("inside", [[0.0, 0.5]], "square")
assert "hypothesis" not in sys.modules
from lfssao.testing import displays
assert "hypothesis" in sys.modules"""
    python("-c", script)
