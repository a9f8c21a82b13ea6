"""Error against run time: references, slopes on scenes with known answers, the Pareto front, advice, plots, a run."""

import json
from collections import Counter
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from lfssao.ao.estimators.registry import ESTIMATORS
from lfssao.ao.post import blur
from lfssao.ao.ssao import algorithm2
from lfssao.bench.times import Times, balanced_orders, in_turn
from lfssao.bench.work_precision import page, plot, rotations, run
from lfssao.bench.work_precision import settings as grid
from lfssao.bench.work_precision.advise import FORMAT, advice, load_warning, points_of
from lfssao.bench.work_precision.references import Reference, combine_others, rmse
from lfssao.bench.work_precision.scene import BenchScene
from lfssao.bench.work_precision.setting_times import setting_times
from lfssao.bench.work_precision.slopes import THEORY, fitted_slope
from lfssao.cli.main import main
from lfssao.errors import InputError
from lfssao.samples import METHODS, make_samples, sample_set, texel_turns
from lfssao.scene.builtin import builtin_scene

pytestmark = pytest.mark.usefixtures("one_thread")
SEEDS = 400


def point(ms, model, sampling=None, serves=None, **more):
    setting = {"estimator": "lf", "sampler": "latin", "samples": 8, "radii": 1, "blur": 0.0, "dtype": "float32"}
    reference = {"reference_error": None if sampling is None else 0.001, "reference_serves": serves}
    return {**setting, "ms": ms, "time_of": "latin", "model": model, "sampling": sampling, **reference, **more}


def result(*points):
    machine = {"processor": "a processor", "threads": 2}
    setup = {"scene": "statue", "width": 32, "height": 24, "machine": machine}
    return {"work_precision": FORMAT, "setup": setup, "estimators": {"lf": {"points": points}}}


MADE_UP = result(
    point(1.0, 0.3, 0.2, True),
    point(2.0, 0.1, 0.1, True, samples=16),
    point(3.0, 0.1, 0.005, False, samples=32),
    point(4.0, 0.04, 0.02, True, samples=64),
    point(5.0, 0.2, 0.05, True, samples=1, radii=3, blur=1.0),
)


# Slopes


def exact_fraction(a, b, c):
    """The fraction of the square in a half plane: a sum of two uniform numbers lies below c."""
    a, b = np.abs(a), np.abs(b)
    parts = [s * t * np.maximum(c + s * a + t * b, 0) ** 2 for s in (1, -1) for t in (1, -1)]
    return sum(parts) / (8 * a * b)


def half_planes(rng, points):
    """The fraction of each set in a random half plane, less the exact one."""
    angle, c = rng.uniform(0, 2 * np.pi, SEEDS), rng.uniform(-0.4, 0.4, SEEDS)
    a, b = np.cos(angle), np.sin(angle)
    inside = (a[:, None] * points[..., 0] + b[:, None] * points[..., 1] < c[:, None]).mean(axis=1)
    return inside - exact_fraction(a, b, c)


def waves(rng, points):
    """Each set's mean of a smooth wave of random phase, less the exact one."""
    phase = rng.uniform(0, 2 * np.pi, SEEDS)
    mean = np.cos(1.5 * points[..., 0] + 2.0 * points[..., 1] + phase[:, None]).mean(axis=1)
    return mean - np.sin(1.5) / 1.5 * np.sin(2.0) / 2.0 * np.cos(phase)


SIZES = (64, 144, 256, 576, 1024)


def sets_of(sampler, sizes=SIZES):
    """Points of all seeds, (seeds, n, 2), for each size."""
    return [np.stack([sample_set("square", sampler, n, seed).points for seed in range(SEEDS)]) for n in sizes]


def errors_of(sets):
    """RMSE of both integrands at each size."""
    errors = []
    for integrand in (half_planes, waves):
        rng = np.random.default_rng(7)
        errors.append([float(np.sqrt(np.mean(integrand(rng, points) ** 2))) for points in sets])
    return errors


@pytest.mark.parametrize("sampler", ["random", "jittered", "latin", "sobol"])
def test_slopes_on_scenes_with_known_answers_are_those_of_theory(sampler):
    """The fit's standard error is near 0.01: 0.05 is five of them. Nets have a logarithm in their law."""
    sizes, (edge, smooth) = (64, 128, 256, 512, 1024) if sampler == "sobol" else SIZES, THEORY[sampler]
    if sampler == "sobol":
        smooth = fitted_slope(sizes, [np.sqrt(np.log(n)) * n**smooth for n in sizes])[0]
    for errors, expected in zip(errors_of(sets_of(sampler, sizes)), (edge, smooth), strict=True):
        assert fitted_slope(sizes, errors)[0] == pytest.approx(expected, abs=0.05)


@pytest.mark.slow
def test_poisson_disks_have_the_slope_before_the_limit_that_the_page_states():
    for errors in errors_of(sets_of("poisson")):
        assert -0.75 < fitted_slope(SIZES, errors)[0] < -0.55 < THEORY["poisson"][0]


def test_a_slope_is_the_exponent_and_needs_three_errors():
    slope, error = fitted_slope([1, 10, 100, 1000], [5, 0.5, 0.05, 0.005])
    assert slope == pytest.approx(-1)
    assert error == pytest.approx(0, abs=1e-9)
    assert fitted_slope([1, 2, 4, 8], [1, 0, 0.5, 0]) is None


def test_the_standard_error_of_a_slope_is_what_it_scatters_by():
    rng = np.random.default_rng(2)
    n = [2**k for k in range(12)]
    fits = np.array([fitted_slope(n, np.exp(0.1 * rng.standard_normal(12)) / n) for _ in range(400)])
    assert fits[:, 0].std() == pytest.approx(np.sqrt(np.mean(fits[:, 1] ** 2)), rel=0.1)


# References


@pytest.mark.parametrize("many", [2, 3])
def test_a_references_own_error_is_estimated_from_independent_ones(many):
    rng = np.random.default_rng(1)
    truth = rng.uniform(size=40_000)
    made = combine_others({str(k): truth + 0.01 * rng.standard_normal(truth.size) for k in range(many)}, "another")
    assert rmse(made.texture, truth) == pytest.approx(0.01 / np.sqrt(many), rel=0.03)
    assert made.error == pytest.approx(rmse(made.texture, truth), rel=0.03)


def test_a_reference_serves_errors_ten_times_its_own():
    reference = Reference(np.zeros(1), 0.001)
    assert reference.serves(0.0101)
    assert not reference.serves(0.0099)


def test_no_sampler_is_compared_with_a_reference_of_its_own():
    many = {name: np.full(3, float(k)) for k, name in enumerate(grid.FULL.reference_samplers)}
    means = {sampler: combine_others(many, sampler).texture[0] for sampler in (*many, "latin")}
    assert means == {"sobol": 1.5, "halton": 1.0, "fibonacci": 0.5, "latin": 1.0}


@pytest.mark.parametrize("sizes", [grid.FULL, grid.QUICK])
def test_every_sampler_has_two_references_of_many_samples_by_others(sizes):
    for estimator in ESTIMATORS.values():
        if grid.takes_samples(estimator):
            for sampler in grid.samplers_of(estimator, sizes):
                assert len(set(sizes.reference_samplers) - {sampler}) >= 2
    for name in ESTIMATORS:
        assert sizes.references_of(name) >= 65_536 * (1 + 7 * (4096 in sizes.counts and name.startswith("vo-points")))
        assert sizes.references_of(name).bit_count() == 1
    assert set(grid.TWICE) <= set(ESTIMATORS)
    assert sizes.repeats >= 20


# Sample sets


@pytest.mark.parametrize("name", [n for n in ESTIMATORS if grid.takes_samples(ESTIMATORS[n])])
def test_all_samplers_of_an_estimator_tend_to_the_integral_of_its_own_set(name):
    """Mean distance from the middle: 3/4 in the ball, 1/2 of taps, near 0.906 in LF's shell; of lines, which weigh as
    long as they are in the ball, 3 pi / 16."""
    estimator = ESTIMATORS[name]
    r = np.linspace(0.8, 1, 100_001)
    own = 0.5 if name == "alchemy" else 3 * np.pi / 16 if estimator.dimensions == 2 else 3 / 4
    expected = float((r**3).sum() / (r**2).sum()) if estimator.sampling else own
    samplers = grid.samplers_of(estimator, grid.FULL)
    assert len(samplers) >= 8
    for sampler in samplers:
        n = max(n for n in grid.counts_of(estimator, sampler, grid.FULL) if n <= 1024)
        points, weights = grid.samples_for(estimator, sampler, n, 3)
        assert points.shape == (n, estimator.dimensions)
        squares = (points**2).sum(axis=1)
        if name.startswith("vo-lines") and weights is None:
            weights = np.sqrt(1 - squares)
        mean = np.average(np.sqrt(squares), weights=weights)
        assert mean == pytest.approx(expected, abs=0.04), sampler


@pytest.mark.parametrize("name", [n for n in ESTIMATORS if grid.takes_samples(ESTIMATORS[n])])
def test_samplers_are_left_out_where_their_points_alone_are_not_even(name):
    """The spiral's are taps, repulsion's are even with their weights, which VO reads. LF's are those of its shell."""
    estimator = ESTIMATORS[name]
    methods = METHODS["ball" if estimator.dimensions == 3 else "disk"]
    even = set(methods) - {"spiral", "repulsion"}
    even |= {"spiral"} & set(methods) if name == "alchemy" else set()
    even |= {"repulsion"} & set(methods) if name.startswith("vo-") else set()
    assert set(grid.samplers_of(estimator, grid.FULL)) == even
    assert set(grid.samplers_of(estimator, grid.QUICK)) == even & {"random", "latin", "poisson"}
    for sampler in even:
        most = methods[sampler].most
        wide = replace(grid.FULL, counts=(1, (most or 9) - 1, most or 9, (most or 9) + 1))
        assert tuple(grid.counts_of(estimator, sampler, wide)) == wide.counts[: 3 if most else 4]
        points, weights = grid.samples_for(estimator, sampler, 16, 3)
        assert (weights is not None and len(set(weights)) > 1) == (sampler == "repulsion")
        if name == "lf":
            assert np.array_equal(points, make_samples(sampler, 16, 3))
    assert list(grid.counts_of(estimator, grid.TIMED_FOR_ALL, grid.FULL)) == list(grid.FULL.counts)
    first, second, again = (grid.samples_for(estimator, "random", 5, seed)[0] for seed in (1, 2, 1))
    assert np.array_equal(first, again)
    assert not (first == second).any()


@pytest.mark.parametrize("name", [n for n in ESTIMATORS if not grid.takes_samples(ESTIMATORS[n])])
def test_numbers_of_taps_are_those_of_the_estimators_own_parameters(name):
    estimator = ESTIMATORS[name]
    default, *others = grid.own_counts_of(estimator, grid.FULL)
    assert default == (None, {})
    counted = {"taps", "directions", "steps"} & set(estimator.parameters)
    assert bool(others) == bool(counted)
    for n, parameters in others:
        assert counted <= set(parameters) <= set(estimator.parameters)
        assert n == np.prod([parameters[key] for key in counted])
        assert parameters.get("turns", 0) == 0  # as many as make the taps even
    assert grid.own_counts_of(estimator, grid.QUICK) == [default]


def test_each_radius_is_measured_once():
    assert replace(grid.FULL, radii=((0.02,), (0.1, 0.02, 0.005))).each_radius == (0.005, 0.02, 0.1)


# Samples that turn


FACTS = {"radii": 1, "rotation": "ign", "samples": 8, "blur": 1.0, "reference_error": 0.015}
ROWS = [{"view": "a", "sampling": 0.3, **FACTS}, {"view": "b", "sampling": 0.4, **FACTS}]


def test_errors_of_turned_samples_are_algorithm_2s_and_only_they_are_blurred_away(monkeypatch):
    """Turning leaves a texel's own error as it is; neighbours that turn alike keep it when they are blurred."""
    sizes = replace(grid.QUICK, width=96, height=72, seeds=1)
    monkeypatch.setattr(rotations, "SCENES", ("statue",))
    monkeypatch.setattr(rotations, "RADII", ((0.05,),))
    rows = list(rotations.rotation_errors(sizes, 1, lambda _: None))
    errors = {tuple(row[key] for key in ("view", "rotation", "samples", "blur")): row["sampling"] for row in rows}
    assert len(set(errors.values())) == len(rows) == 2 * 5 * 3 * 3
    for (view, rotation, n, sigma), error in errors.items():
        ratio = error / errors[view, "none", n, sigma]
        assert rotation == "none" or (0.8 < ratio < 1.25 if sigma == 0 else ratio < 1 - 0.15 * sigma), (view, rotation)

    scene = BenchScene(builtin_scene("statue"), sizes, 1, "picoarray")
    textures = scene.buffers["float32"]

    def blurred(sampler, n, seed, turns=None):
        arguments = textures.depth, textures.positions, textures.view.world_to_image, make_samples(sampler, n, seed)
        return blur(algorithm2(*arguments, 0.05 * scene.unit, turns).texture, 2.0).astype(float)

    turns = texel_turns("tiles", 72, 96, 0, np.dtype(np.float32))
    away = blurred("latin", 8, 0, turns) - (blurred("sobol", 4096, 2**32) + blurred("halton", 4096, 2**32)) / 2
    expected = np.sqrt(np.mean(away[np.isfinite(textures.depth)] ** 2))
    assert errors["statue on picoarray", "tiles", 8, 2.0] == pytest.approx(expected, rel=1e-6)


# Times, the front, advice


def test_times_are_of_warm_runs_in_turn():
    calls = []
    times = in_turn({"a": lambda: calls.append("a"), "b": lambda: calls.append("b")}, 3)
    assert "".join(calls) == "ab" + "ab" + "ba" + "ab"
    assert times["a"].low <= times["a"].median <= times["a"].high
    assert Times.of(np.array([1.0, 2.0, 3.0, 4.0, 5.0]), 9.0) == Times(3.0, 2.0, 4.0, 9.0)


@pytest.mark.parametrize("n", range(1, 8))
def test_in_turns_each_follows_each_other_one_equally_often(n):
    orders = balanced_orders(n)
    assert all(sorted(order) == list(range(n)) for order in orders)
    following = Counter(pair for order in orders for pair in pairwise(order))
    assert set(following) == {(a, b) for a in range(n) for b in range(n) if a != b}
    assert len(set(following.values())) <= 1


def test_a_settings_time_is_the_sum_of_its_passes_in_each_turn(monkeypatch):
    """Each pass is made to take a time of its own by the clock."""
    sizes = replace(grid.FULL, width=16, height=12, repeats=3)
    scene = BenchScene(builtin_scene("statue"), sizes, 1)

    def clocked(passes, repeats):
        ao = {key: (7.0, np.arange(repeats) + 100.0 * key[-1]) for key in passes if key[0] == "ao"}
        return {key: (7.0, np.full(repeats, {"merge": 10.0, "blur": 1.0}.get(key[0]))) for key in passes} | ao

    monkeypatch.setattr("lfssao.bench.work_precision.setting_times.turns", clocked)
    made = setting_times(scene, ESTIMATORS["lf"], sizes, {"a": ((None, None), {})})
    assert len(made["a"]) == 2 * 2 * 2
    assert made["a"]["float32", (0.02,), 1.0].median == pytest.approx(2 + 1 + 11)
    assert made["a"]["float64", (0.01, 0.02, 0.035), 0.0].median == pytest.approx(6.5 + 3 + 11)
    assert made["a"]["float32", (0.02,), 1.0].first == 21


@pytest.mark.parametrize(
    ("limit", "sentence"),
    [
        ({"max_error": 0.15}, "Take lf, 16 samples by latin, 1 radius, no blur, float32: 2 ms, model error 0.1 "),
        ({"max_ms": 3.5}, "Take lf, 16 samples by latin, 1 radius, no blur, float32: 2 ms, model error 0.1 "),
        ({"max_error": 0.01}, "No measured setting has a model error of at most 0.01 "),
        ({"max_ms": 0.5}, "No measured setting takes at most 0.5 ms "),
    ],
)
def test_advice_is_one_sentence(limit, sentence):
    said = advice(MADE_UP, "model", **limit)
    assert said.startswith(sentence)
    assert "in 32x24 on statue" in said


@pytest.mark.parametrize("limits", [{}, {"max_error": 0.1, "max_ms": 1.0}])
def test_advice_needs_one_limit(limits):
    with pytest.raises(InputError, match="either"):
        advice(MADE_UP, "model", **limits)


@pytest.mark.parametrize(("load", "said"), [(2.4, ""), (2.6, "The machine was loaded, up to 2.6: ")])
def test_a_busy_machine_is_said(load, said):
    """Two threads of the bench's own are no load."""
    busy = {"points": [], "load_average": load}
    setup = {**MADE_UP["setup"], "machine": {"threads": 2, "processor": "one"}}
    result = {**MADE_UP, "setup": setup, "estimators": {**MADE_UP["estimators"], "busy": busy}}
    assert load_warning(result).startswith(said)
    assert bool(load_warning(result)) == bool(said)
    assert (said or "compiled.\n") in page.as_text(result)


# The commands


def test_plots_are_drawn_from_the_json_only(tmp_path):
    figure = plot.draw(json.loads(json.dumps(MADE_UP)))
    for axes, error in zip(figure.axes, ("model", "sampling"), strict=True):
        lines = {line.get_label(): line for line in axes.get_lines()}
        # Nothing beats what is on the front; of the errors of sampling one, at 3 ms, is too small for its reference.
        assert list(lines["Pareto front"].get_xdata()) == [1, 2, 4]
        drawn = [y for line in axes.get_lines() if line.get_linestyle() == "None" for y in line.get_ydata()]
        assert sorted(drawn) == sorted(p[error] for p in points_of(MADE_UP))
    hollow = [line for line in figure.axes[1].get_lines() if line.get_markerfacecolor() == "none"]
    assert [list(line.get_xdata()) for line in hollow] == [[3.0]]
    plot.save_plots(MADE_UP, tmp_path)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["work-precision.png", "work-precision.svg"]


def test_the_page_says_what_to_take_and_names_the_points_that_references_do_not_serve():
    text = page.as_text(json.loads(json.dumps(MADE_UP)))
    assert text.count("Error of at most 0.12: Take lf, 16 samples by latin") == 1
    assert "At most 3 ms: Take lf, 16 samples by latin" in text
    assert "- lf, 32 samples by latin, 1 radius, no blur, float32: 0.005, reference 0.001" in text
    assert "4 of 5" in text


def test_the_page_has_errors_of_turned_samples_of_all_views_and_of_each():
    """sqrt((0.3^2 + 0.4^2) / 2) is 0.3536; no reference is further off than a twentieth, 0.015 of 0.3."""
    text = page.as_text({**MADE_UP, "rotations": ROWS})
    cells = [line.split() for line in text.splitlines() if " 1, ign" in line]
    assert [line[-2] for line in cells] == ["0.354", "0.300", "0.400"]
    assert "at most 0.05 of these" in text


def refused(capsys, *words):
    assert main(["bench", *words]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    return said.err


def test_advise_refuses_in_one_sentence(capsys, tmp_path):
    file = tmp_path / "a.json"
    assert "cannot be read" in refused(capsys, "advise", "--max-ms", "1", "--from", str(file))
    file.write_text("{")
    assert "not a JSON file" in refused(capsys, "advise", "--max-ms", "1", "--from", str(file))
    file.write_text("{}")
    assert "was not written by" in refused(capsys, "advise", "--max-ms", "1", "--from", str(file))
    assert "--max-error" in refused(capsys, "advise", "--max-error", "-1")
    assert "--max-error" in refused(capsys, "advise")


@pytest.mark.slow
def test_a_tiny_run_is_interrupted_goes_on_and_gives_advice(capsys, tmp_path, monkeypatch):
    few = {"counts": (1, 4, 16), "samplers": ("random",), "reference_count": 256, "repeats": 1, "own_counts": True}
    tiny = replace(grid.QUICK, width=16, height=12, **few)
    monkeypatch.setattr("lfssao.cli.bench_work_precision.QUICK", tiny)
    names = ("lf", "vo-lines", "sao")
    monkeypatch.setattr(run, "ESTIMATORS", {name: ESTIMATORS[name] for name in names})
    real, measured = run.measure_estimator, []

    def interrupted(scene, estimator, *rest):
        measured.append(estimator.name)
        if measured.count("vo-lines") == 1 and estimator.name == "vo-lines":
            raise KeyboardInterrupt
        return real(scene, estimator, *rest)

    monkeypatch.setattr(run, "measure_estimator", interrupted)
    monkeypatch.setattr(run, "rotation_errors", lambda *_: measured.append("rotations") or ROWS)
    file = tmp_path / "out" / "work-precision.json"
    command = ["bench", "work-precision", "statue", "--quick", "--threads", "1", "-o", str(file.parent)]
    assert main(command) == 130
    assert list(json.loads(file.read_text())["estimators"]) == ["lf"]
    assert main(command) == 0
    assert measured == ["rotations", "lf", "vo-lines", "vo-lines", "sao"]
    made = json.loads(file.read_text())
    assert made["rotations"] == ROWS
    assert sorted(p.name for p in file.parent.iterdir()) == [
        f"work-precision.{e}" for e in ("json", "md", "png", "svg")
    ]
    points = points_of(made)
    assert len(points) == 2 * (3 + 3 + 6)
    assert [p["samples"] for p in points[-12::2]] == [None, 1, 4, 16, 64, 256]
    for p in points:
        assert p["ms"] > 0
        assert 0 <= p["model"] <= 1
        assert (p["sampling"] is None) == (p["estimator"] == "sao")
        assert p["time_of"] == p["sampler"]
    assert {"processor", "threads", "packages"} <= set(made["setup"]["machine"])
    capsys.readouterr()
    assert main(["bench", "advise", "--max-ms", "1e9", "--from", str(file)]) == 0
    assert capsys.readouterr().out.count(".\n") == 1
    assert "another scene" in refused(capsys, *command[1:2], "ammonite", *command[3:])
