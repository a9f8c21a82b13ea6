"""The numbers of the figures; that they are drawn is seen where the notebooks are run."""

import re
from base64 import b64decode

import numpy as np
import pytest

import lfssao
from lfssao.errors import InputError
from lfssao.rendering.passes import render_view
from lfssao.rendering.settings import Settings, diagonal
from lfssao.rendering.viewer import eye_view
from lfssao.rendering.views import module_views
from lfssao.verify.bounds.bounds import Bounds
from lfssao.viz import blurring, display, geometry, mapping, radii, samplers, texel, timing, truth, verdict
from lfssao.viz import interactive as sliders

WORLD = np.eye(3, 4)
DISPLAY = lfssao.find_display("sample-a").with_resolution(48, 32)


@pytest.fixture(scope="module")
def seen(statue):
    view = module_views(statue, DISPLAY)[10]
    return view, lfssao.RayCaster(statue, view.cast_from_world).gbuffer(view)


# The matrix that fits a mapping best


def test_a_pinhole_is_a_matrix():
    points = mapping.roi_lattice(DISPLAY)
    fit = mapping.best_matrix(eye_view(DISPLAY, WORLD, 0.3, 48).world_to_image, points)
    assert fit.distance.max() < 1e-9
    assert np.linalg.norm(fit.matrix) == pytest.approx(1)


def test_no_module_of_a_display_is_a_matrix():
    fits = mapping.matrix_fits(DISPLAY)
    assert len(fits) == 21
    assert min(fit.rmse for fit in fits) > 1


def test_no_matrix_nearby_fits_better():
    fit = mapping.matrix_fits(DISPLAY)[4]
    rows = np.hstack([fit.points, np.ones((len(fit.points), 1))])
    rng = np.random.default_rng(1)
    for size in (1e-2, 1e-3, 1e-4):
        for _ in range(20):
            image = rows @ (fit.matrix * (1 + size * rng.standard_normal((3, 4)))).T
            away = image[:, :2] / image[:, 2:] - fit.image
            assert np.sqrt((away**2).sum(axis=1).mean()) >= fit.rmse * (1 - 1e-9)


def test_five_points_are_too_few():
    with pytest.raises(InputError, match="at least 6 points, and 5 are"):
        mapping.best_matrix(DISPLAY.view(3, WORLD).world_to_image, mapping.roi_lattice(DISPLAY)[:5])


# One texel


def test_the_fraction_of_occluded_samples_is_what_algorithm_2_writes(seen, statue):
    view, gbuffer = seen
    samples = lfssao.make_samples("latin", 8)
    radius = 0.05 * diagonal(statue)
    ao = lfssao.algorithm2(gbuffer.depth, gbuffer.positions, view.world_to_image, samples, radius).texture
    rows, columns = np.nonzero(np.isfinite(gbuffer.depth))
    for i, j in list(zip(columns.tolist(), rows.tolist(), strict=True))[::23]:
        traced = texel.trace_texel((i, j), view, gbuffer, samples, radius)
        assert texel.occluded_fraction(traced) == ao[j, i]
    figure = texel.draw_texel((i, j), gbuffer.depth, traced)
    assert f"{ao[j, i]:.3g} of 8" in figure.get_suptitle()


# Errors of samplers


def test_the_error_of_the_reference_itself_is_none_and_random_falls_as_a_root(seen, statue):
    """Independent samples err by sqrt(p (1 - p) / n). The exponent of 16 seeds is off by 0.1 in one run of 20."""
    buffers = lfssao.Buffers.of(seen[1], seen[0])
    radius = 0.05 * diagonal(statue)
    itself = samplers.sampling_error(buffers, radius, ["sobol"], [64], (0,), reference=("sobol", 64))
    assert itself.rmse["sobol"] == [0]
    found = samplers.sampling_error(buffers, radius, ["random"], [4, 16, 64], range(16))
    assert found.slope("random") == pytest.approx(-0.5, abs=0.2)


# Radii, the truth, modules, verdicts


def test_the_first_of_the_largest_decides():
    layers = [np.array([[0.0, 0.5, 0.25]]), np.array([[0.0, 0.5, 0.75]])]
    assert radii.deciding_radius(layers).tolist() == [[-1, 0, 1]]


def test_deviation_by_hand():
    mine = np.array([[0.0, 1.0, 9.0]])
    exact = np.array([[0.5, 1.0, 0.0]])
    found = truth.deviation(mine, exact, np.array([[True, True, False]]))
    assert (found.bias, found.rmse) == (-0.25, pytest.approx(np.sqrt(0.125)))
    assert found.correlation == pytest.approx(1)
    assert np.isnan(truth.deviation(exact, exact, exact == 1.0).correlation)
    assert truth.half_space(np.array([0.25, 0.5, 0.75, 1.0])).tolist() == [0, 0, 0.5, 1]


def test_numbers_inside_bounds():
    right = np.zeros(5)
    mine = np.array([0.0, 0.1, 0.2, -0.1, np.nan])
    found = verdict.inside_bounds(mine, right, Bounds(np.full(5, -0.05), np.full(5, 0.1)))
    assert found.tolist() == [verdict.EQUAL, verdict.INSIDE, *[verdict.OUTSIDE] * 3]


# Blur, time


def test_a_blur_takes_noise_and_detail(seen, statue):
    view, gbuffer = seen
    buffers = lfssao.Buffers.of(gbuffer, view)
    radius = 0.05 * diagonal(statue)
    found = blurring.blur_error(buffers.turned("hash"), radius, [4], [0, 1.5], reference=("sobol", 64))
    exact, made = (
        render_view(
            lfssao.RayCaster(statue, view.cast_from_world),
            view,
            Settings((radius,), lfssao.make_samples(*table), 1.5, rotation=rotation),
        )
        for table, rotation in ((("sobol", 64), "none"), (("latin", 4), "hash"))
    )
    surface = gbuffer.triangle >= 0
    errors = [
        np.sqrt(np.mean((mine - exact.ao[0].astype(np.float64))[surface] ** 2))
        for mine in (made.ao[0], made.blurred, exact.blurred)
    ]
    assert [*found.rmse[4], *found.lost] == pytest.approx([*errors[:2], 0, errors[2]], rel=1e-12)
    assert found.best(4) == (0, 1.5)[int(np.argmin(errors[:2]))]


def test_the_first_run_is_not_timed(monkeypatch):
    clock = [0.0]
    lengths = iter([100.0, 3.0, 100.0, 4.0, 2.0])
    monkeypatch.setattr(timing, "perf_counter", lambda: clock[0])

    def run():
        clock[0] += next(lengths)

    assert [timing.least_seconds(run, times) for times in (1, 2)] == [3, 2]


def test_errors_over_time_are_those_of_the_estimators(seen, statue):
    buffers = lfssao.Buffers.of(seen[1], seen[0])
    radius = 0.05 * diagonal(statue)
    exact = np.zeros(buffers.depth.shape, np.float32)
    table = lfssao.make_samples("latin", 8)
    found = timing.error_by_time(buffers, radius, {"lf": {"8": {"points": table}}}, exact)["lf"]
    ao = lfssao.estimate("lf", buffers.turned("hash"), radius, table).texture[np.isfinite(buffers.depth)]
    assert found.rmse == pytest.approx([np.sqrt(np.mean((2 * np.maximum(0, ao.astype(np.float64) - 0.5)) ** 2))])
    assert found.milliseconds > 0
    assert timing.TimedError(["4", "8", "16"], np.ones(3), np.array([0.2, 0.109, 0.1])).enough() == 1


# Geometry


def test_the_numbers_of_a_geometry_by_hand():
    """Modules 0.2 m apart, 0.7 m behind the screen; an eye 1.4 m before it sees those with abs(x) <= 0.75 m."""
    given = lfssao.find_display("sample-a")
    changed = geometry.with_geometry(given, 1.4, 11, "linear")
    assert [module.x for module in changed.modules] == pytest.approx(np.arange(-1, 1.01, 0.2))
    found = geometry.geometry_of(changed, given)
    assert (found.seen, found.step) == (7, pytest.approx(0.4))
    # A point at y, z has v = 300 - 1000 (y D / (D + z)) by observers at the distance D.
    points = mapping.roi_lattice(given)
    shown = given.physical_to_image(20, points)[1] == 0
    _, y, z = points[shown & (changed.physical_to_image(10, points)[1] == 0)].T
    assert found.moved == pytest.approx(np.max(np.abs(1000 * y * (1.4 / (1.4 + z) - 2 / (2 + z)))))
    assert found.rmse == mapping.matrix_fits(changed)[-1].rmse
    same = geometry.geometry_of(geometry.with_geometry(given, 2.0, 21, "linear"), given)
    assert same.moved == 0


@pytest.mark.parametrize(("name", "words", "reason"), [
    ("virtual", (2.0, 21, "linear"), "in a row along x"),
    ("convex", (2.0, 21, "linear"), "in a row along x"),
    ("sample-a", (2.0, 1, "linear"), "modules"),
    ("sample-a", (-1.0, 21, "linear"), "in front of the screen"),
    ("sample-a", (2.0, 21, "round"), "diffuser"),
])  # fmt: skip
def test_geometries_that_mean_nothing_are_refused(name, words, reason):
    with pytest.raises(InputError, match=reason):
        geometry.with_geometry(lfssao.find_display(name), *words)


def test_metres_and_texels_are_square_in_figures():
    given = lfssao.find_display("sample-a")
    changed = geometry.with_geometry(given, 1.0, 6, "conical")
    figure, sentence = geometry.draw_geometry(changed, given)
    assert [axes.get_aspect() for axes in figure.axes] == [1, 1, 1]
    assert [axes.get_aspect() for axes in display.draw_display(given).axes] == [1, 1]
    assert "sees 4 of 6 modules, and passes from one to the next every 571 mm." in sentence


# Sliders


def test_sliders_show_what_their_values_say(statue):
    box = sliders.explore(statue, DISPLAY)
    columns, sentence, picture = box.children
    by_name = {control.description: control for column in columns.children for control in column.children}
    labels = [by_name[name].label for name in ("radius", "blur", "samples")]
    assert labels == ["5 % of the diagonal", "1 texels", "8"]
    before = picture.value
    by_name["module"].value, by_name["samples"].value, by_name["radius"].value = 3, 5, 10
    by_name["sampler"].value, by_name["seed"].value, by_name["blur"].value = "jittered", 2, 0.0
    by_name["rotation"].value = "tiles"
    view = module_views(statue, DISPLAY)[3]
    settings = Settings((0.1 * diagonal(statue),), lfssao.make_samples("jittered", 5, 2), 0.0, rotation="tiles")
    made = render_view(lfssao.RayCaster(statue, view.cast_from_world), view, settings)
    assert picture.value == made._repr_png_() != before
    shown = box._repr_mimebundle_()
    assert b64decode(shown["image/png"]) == picture.value
    assert shown["text/plain"].endswith(f"blur = 0\n{sentence.value}")
    exact = render_view(
        lfssao.RayCaster(statue, view.cast_from_world),
        view,
        Settings(settings.radii, lfssao.make_samples("sobol", 1024), 0.0, rotation="none"),
    )
    surface = made.gbuffer.triangle >= 0
    rmse = np.sqrt(np.mean((made.ao[0] - exact.ao[0].astype(np.float64))[surface] ** 2))
    assert sentence.value.startswith(f"RMSE {rmse:.3f} against 1024 samples of Sobol's sequence")
    assert 0 < float(re.search(r"the kernel took (\d+\.\d\d) ms\.", sentence.value)[1]) < 1000


def test_a_slider_says_why_it_shows_nothing(seen):
    view, gbuffer = seen
    table = lfssao.make_samples("latin", 4)
    box = sliders.sliders(
        lambda v=16: texel.draw_texel((24, v), gbuffer.depth, texel.trace_texel((24, v), view, gbuffer, table, 0.1)),
        v=range(32),
    )
    columns, sentence, picture = box.children
    before = picture.value
    columns.children[0].children[0].value = 0
    assert (sentence.value, picture.value) == ("texel (24, 0) shows no surface", before)
