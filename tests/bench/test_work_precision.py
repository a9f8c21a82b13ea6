"""Error against run time: figures, references, slopes with known answers, least times, the front, advice, a run."""

import json
from collections import Counter
from dataclasses import replace
from functools import partial
from itertools import count, pairwise, repeat

import numpy as np
import pytest
from jobs import sentence
from skimage.metrics import structural_similarity
from turns import Times, balanced_orders, in_turn

from lfssao.ao.estimators.registry import ESTIMATORS, estimate, of_one_view
from lfssao.ao.ground_truth import Occluders, ray_cast_occlusion
from lfssao.ao.post import blur
from lfssao.bench.work_precision import page, plot, run
from lfssao.bench.work_precision import settings as grid
from lfssao.bench.work_precision.advise import ERRORS, FORMAT, advice, points_of
from lfssao.bench.work_precision.figures import combine_others, figures, null_lines, pooled, rms
from lfssao.bench.work_precision.run import least_times
from lfssao.bench.work_precision.scene import BenchScene
from lfssao.bench.work_precision.slopes import THEORY, fitted_slope
from lfssao.cli.main import main
from lfssao.samples import METHODS, make_samples, sample_set
from lfssao.scene.builtin import builtin_scene

SEEDS = 400


def point(ms, rmse, gain_free, sampling=None, reference=None, **more):
    """A setting of ``lf``; its own errors are twice those of visibility."""
    setting = {"estimator": "lf", "sampler": "latin", "samples": 8, "radii": [0.02], "blur": 0.0}
    errors = {"visibility": [rmse, 0, gain_free, 0.5, 0.5], "own": [2 * rmse, 0, 2 * gain_free, 0.5, 0.5]}
    times = {"ms": ms, "spread": 0.01, "wall_ms": ms / 2}
    return {**setting, **times, **errors, "sampling": sampling, "reference": reference, **more}


def result(*points):
    setup = {
        "scenes": [{"name": "statue"}], "commit": None, "machine": {"processor": "a processor", "threads": 2},
        "grid": {"width": 32, "height": 24, "radii": [[0.02]], "blurs": [0.0], "seeds": 2},
    }  # fmt: skip
    null = {"none": 0.6, "constant": 0.25, "truth": 0.01}
    nulls = {"cosine constant": [null], "uniform shell": [{**null, "constant": 0.15}]}
    estimators = {"lf": {"integrand": ["uniform", "shell"], "points": points}}
    return {"work_precision": FORMAT, "setup": setup, "nulls": nulls, "estimators": estimators}


MADE_UP = result(
    point(1.0, 0.3, 0.24, 0.2, 0.001),
    point(2.0, 0.1, 0.09, 0.1, 0.001, samples=16),
    point(3.0, 0.1, 0.09, 0.005, 0.001, samples=32),
    point(4.0, 0.04, 0.03, 0.02, 0.001, samples=64),
    point(5.0, 0.2, 0.1, 0.05, 0.001, samples=1),
)


# Slopes


def half_planes(rng, points):
    """The fraction of each set to the left of a random line that crosses the square's middle, less the exact one."""
    slope = rng.uniform(0.3, 0.7, SEEDS)
    c = rng.uniform(-0.3, 0.3, SEEDS)
    left = points[..., 0] < c[:, None] + slope[:, None] * points[..., 1]
    return left.mean(axis=1) - (1 + c) / 2


def waves(rng, points):
    """Each set's mean of a smooth wave of random phase, less the exact one."""
    phase = rng.uniform(0, 2 * np.pi, SEEDS)
    mean = np.cos(1.5 * points[..., 0] + 2.0 * points[..., 1] + phase[:, None]).mean(axis=1)
    return mean - np.sin(1.5) / 1.5 * np.sin(2.0) / 2.0 * np.cos(phase)


@pytest.mark.parametrize(
    "sampler", ["random", "jittered", "latin", "sobol", pytest.param("poisson", marks=pytest.mark.slow)]
)
def test_slopes_on_scenes_with_known_answers_are_those_that_the_page_states(sampler):
    """The fit's standard error is near 0.01: 0.05 is five of them. Nets have a logarithm in their law."""
    sizes, (edge, smooth) = (64, 144, 256, 576, 1024), THEORY[sampler]
    if sampler == "sobol":
        sizes = 64, 128, 256, 512, 1024
        smooth = fitted_slope(sizes, [np.sqrt(np.log(n)) * n**smooth for n in sizes])[0]
    if sampler == "poisson":
        edge = smooth = -0.65  # before the limit
    sets = [np.stack([sample_set("square", sampler, n, seed).points for seed in range(SEEDS)]) for n in sizes]
    for integrand, expected in ((half_planes, edge), (waves, smooth)):
        rng = np.random.default_rng(7)
        errors = [rms(integrand(rng, points)) for points in sets]
        assert fitted_slope(sizes, errors)[0] == pytest.approx(expected, abs=0.1 if sampler == "poisson" else 0.05)


def test_a_slope_is_the_exponent_and_needs_three_errors():
    slope, error = fitted_slope([1, 10, 100, 1000], [5, 0.5, 0.05, 0.005])
    assert slope == pytest.approx(-1)
    assert error == pytest.approx(0, abs=1e-9)
    assert fitted_slope([1, 2, 4, 8], [1, 0, 0.5, 0]) is None


# References


@pytest.mark.parametrize("many", [2, 3])
def test_a_references_own_error_is_estimated_from_independent_ones(many):
    rng = np.random.default_rng(1)
    truth = rng.uniform(size=40_000)
    made = combine_others({str(k): truth + 0.01 * rng.standard_normal(truth.size) for k in range(many)}, "another")
    assert rms(made[0] - truth) == pytest.approx(0.01 / np.sqrt(many), rel=0.03)
    assert made[1] == pytest.approx(rms(made[0] - truth), rel=0.03)


def test_no_sampler_is_compared_with_a_reference_of_its_own():
    many = {name: np.full(3, float(k)) for k, name in enumerate(grid.FULL.reference_samplers)}
    means = {sampler: combine_others(many, sampler)[0][0] for sampler in (*many, "latin")}
    assert means == {"sobol": 1.5, "halton": 1.0, "fibonacci": 0.5, "latin": 1.0}


@pytest.mark.parametrize("sizes", [grid.FULL, grid.QUICK])
def test_every_sampler_has_two_references_of_many_samples_by_others(sizes):
    for estimator in ESTIMATORS.values():
        if grid.takes_samples(estimator):
            for sampler in grid.samplers_of(estimator, sizes):
                assert len(set(sizes.reference_samplers) - {sampler}) >= 2
    assert sizes.reference_count.bit_count() == 1
    assert sizes.reference_count >= 64 * max(sizes.counts)


# Sample sets


@pytest.mark.parametrize("name", [n for n in ESTIMATORS if grid.takes_samples(ESTIMATORS[n])])
def test_samplers_of_an_estimator_are_those_that_tend_to_the_integral_of_its_own_set(name):
    """The spiral's points are taps, repulsion's are even with their weights, which VO reads.

    Mean distance from the middle: 3/4 in the ball, 1/2 of taps, near 0.906 in LF's shell; of lines, which weigh as long
    as they are in the ball, 3 pi / 16.
    """
    estimator = ESTIMATORS[name]
    sizes = grid.FULL
    r = np.linspace(0.8, 1, 100_001)
    methods = METHODS["ball" if estimator.dimensions == 3 else "disk"]
    left_out = {"spiral": name != "alchemy", "repulsion": not name.startswith("vo-")}
    even = {sampler for sampler in methods if not left_out.get(sampler)}
    own = 0.5 if name == "alchemy" else 3 * np.pi / 16 if estimator.dimensions == 2 else 3 / 4
    expected = float((r**3).sum() / (r**2).sum()) if estimator.sampling else own
    assert set(grid.samplers_of(estimator, sizes)) == even
    assert set(grid.samplers_of(estimator, grid.QUICK)) == even & {"random", "latin", "poisson"}
    for sampler in even:
        most = methods[sampler].most
        wide = replace(sizes, counts=(1, (most or 9) - 1, most or 9, (most or 9) + 1))
        assert tuple(grid.counts_of(estimator, sampler, wide)) == wide.counts[: 3 if most else 4]
        n = max(grid.counts_of(estimator, sampler, sizes))
        points, weights = grid.samples_for(estimator, sampler, n, 3)
        assert points.shape == (n, estimator.dimensions)
        assert (weights is not None and len(set(weights)) > 1) == (sampler == "repulsion")
        if name == "lf":
            assert np.array_equal(points, make_samples(sampler, n, 3))
        squares = (points**2).sum(axis=1)
        if name.startswith("vo-lines") and weights is None:
            weights = np.sqrt(1 - squares)
        mean = np.average(np.sqrt(squares), weights=weights)
        assert mean == pytest.approx(expected, abs=0.04), sampler
    first, second, again = (grid.samples_for(estimator, "random", 5, seed)[0] for seed in (1, 2, 1))
    assert np.array_equal(first, again)
    assert not (first == second).any()


@pytest.mark.parametrize("name", [n for n in ESTIMATORS if not grid.takes_samples(ESTIMATORS[n])])
def test_numbers_of_taps_are_those_of_the_estimators_own_parameters(name):
    estimator = ESTIMATORS[name]
    others = {n: parameters for (_, n), (_, parameters) in grid.inputs_of(estimator, grid.FULL, 0).items()}
    assert others.pop(None) == {}
    counted = {"taps", "directions", "slices", "steps"} & set(estimator.parameters)
    assert bool(others) == bool(counted)
    for n, parameters in others.items():
        assert counted <= set(parameters) <= set(estimator.parameters)
        assert n == np.prod([parameters[key] for key in counted]) * (2 if "slices" in counted else 1)  # sides
        assert parameters.get("turns", 0) == 0  # as many as make the taps even
    assert grid.inputs_of(estimator, grid.QUICK, 0) == {(None, None): ((None, None), {})}


def test_each_radius_is_measured_once():
    assert replace(grid.FULL, radii=((0.02,), (0.1, 0.02, 0.005))).each_radius == (0.005, 0.02, 0.1)


# Figures


def test_figures_are_those_of_their_definitions():
    rng = np.random.default_rng(3)
    truth = rng.uniform(size=(24, 32))
    surface = rng.random((24, 32)) < 0.7
    truth[~surface] = 0
    off = np.where(surface, 0.5 * truth + 0.1, 0)
    noise = np.where(surface, rng.uniform(size=truth.shape), 0)
    error = off[surface] - truth[surface]
    similar = structural_similarity(1 - off, 1 - truth, data_range=1, full=True)[1][surface].mean()
    expected = [np.sqrt(np.mean(error**2)), error.mean(), 0, 1, similar]
    assert figures(off, truth, surface) == pytest.approx(expected, rel=1e-12, abs=1e-7)
    _, _, gain_free, correlation, similar = figures(noise, truth, surface)
    _, residual, *_ = np.polyfit(noise[surface], truth[surface], 1, full=True)
    assert gain_free == pytest.approx(np.sqrt(residual[0] / surface.sum()))
    assert correlation == pytest.approx(np.corrcoef(noise[surface], truth[surface])[0, 1])
    assert similar < 0.5
    constant = figures(np.where(surface, 0.3, 0), truth, surface, seen=False)
    assert constant[2:4] == pytest.approx([truth[surface].std(), 0])
    assert np.isnan(constant[4])


def test_figures_of_scenes_are_root_mean_squares_of_errors_and_means_of_others():
    found = pooled([[3.0, 1.0, 0.0, 0.2, np.nan], [4.0, -3.0, 2.0, 0.4, 0.5]])
    assert found == pytest.approx([np.sqrt(12.5), -1.0, np.sqrt(2), 0.3, 0.5])


def test_null_lines_are_of_no_work_and_of_the_truth():
    truths = [(np.array([0.0, 0.4]), np.full(2, 0.01)), (np.full(3, 0.2), np.full(3, 0.01))]
    expected = {"none": np.sqrt((0.08 + 0.04) / 2), "constant": np.sqrt(0.04 / 2), "truth": 0.01}
    assert null_lines(truths) == pytest.approx(expected)


INTEGRANDS = {"hemisphere": ("uniform", "shell"), "vo-lines": ("uniform", "cubic"), "sao": ("cosine", "linear")}


@pytest.mark.parametrize("name", INTEGRANDS)
def test_errors_of_a_run_are_against_visibility_and_the_estimators_own_integrand(name):
    """By hand from the textures of the view; whole balls would be doubled, as only ``vo-lines`` is one."""
    sizes = replace(
        grid.QUICK, width=48, height=36, counts=(4,), samplers=("latin",), seeds=2, reference_count=64, most=3
    )
    scene = BenchScene(builtin_scene("corner"), sizes, 1)
    estimator = ESTIMATORS[name]
    points = run.summary(estimator, [run.times_of(scene, estimator, 1)], [run.errors_of(scene, estimator)])["points"]
    made = next(p for p in points if p["blur"] == 1.0)
    buffers = scene.buffers
    radius = 0.02 * scene.unit
    occluders = Occluders(scene.mesh)
    errors = []
    for seed in range(2):
        points, weights = (None, None) if name == "sao" else grid.samples_for(estimator, "latin", 4, seed)
        ours = blur(estimate(name, buffers.turned(estimator.rotation, seed), radius, points, weights).texture, 1.0)
        errors.append(np.where(name == "vo-lines", 2 * np.maximum(0, ours.astype(float) - 0.5), ours)[scene.surface])
    for truth, integrand in (("visibility", ("cosine", "constant")), ("own", INTEGRANDS[name])):
        exact = ray_cast_occlusion(occluders, buffers, radius, *integrand, tolerance=0.01, rounds=(8, 64)).texture
        differences = np.array([each - exact[scene.surface] for each in errors])
        assert made[truth][:2] == pytest.approx([rms(differences), differences.mean()], rel=1e-3, abs=1e-4)


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


def test_least_times_run_until_three_agree_and_leave_slow_moments_out():
    """A run takes a second, and as long as its slow moments last."""
    now = [0.0]
    calls = Counter()
    slow = {"steady": repeat(0), "disturbed": iter([0, 50, 60, 70, 0, 80, 0, 0]), "never": count()}

    def work(name):
        calls[name] += 1
        now[0] += 1.0 + next(slow[name])

    found = least_times({name: partial(work, name) for name in slow}, spread=0.03, most=20, clock=lambda: now[0])
    assert found == {"steady": (1000, 0), "disturbed": (1000, 0), "never": (2000, 1.0)}
    assert calls == {"steady": 1 + 3, "disturbed": 1 + 7, "never": 1 + 20}


def test_a_settings_time_is_the_sum_of_its_passes(monkeypatch):
    """Each pass is made to take a time of its own, and twice that on all threads."""
    sizes = replace(grid.FULL, width=16, height=12, counts=(4,), samplers=("latin",))
    scene = BenchScene(builtin_scene("statue"), sizes, 1)
    clocks = iter((1.0, 2.0))

    def clocked(passes, spread, most, clock):
        factor = next(clocks)
        own = {"ao": lambda key: 100 * key[-1], "merge": lambda key: 10.0, "blur": lambda key: 1.0}
        return {key: (factor * own[key[0]](key), 0.02) for key in passes}

    monkeypatch.setattr(run, "least_times", clocked)
    made = run.times_of(scene, ESTIMATORS["lf"], 1)
    assert len(made) == 3 * 2
    assert made[("latin", 4), (0.02,), 1.0] == pytest.approx((2 + 11, 0.02, 26))
    assert made[("latin", 4), (0.02, 0.08), 0.0] == pytest.approx((10 + 11, 0.02, 42))


@pytest.mark.parametrize(
    ("limit", "sentence"),
    [
        ({"max_error": 0.15}, "Take lf, 16 samples by latin, no blur: 2 ms, visibility error 0.1, 60 % below"),
        ({"max_ms": 3.5}, "Take lf, 16 samples by latin, no blur: 2 ms, visibility error 0.1, 60 % below"),
        ({"max_error": 0.01}, "No measured setting has a visibility error of at most 0.01: the least is that of lf"),
        ({"max_ms": 1.5}, "No measured setting that is better than a constant takes at most 1.5 ms: the fastest is lf"),
        ({"max_ms": 9.0, "error": "own"}, "Take lf, 64 samples by latin, no blur: 4 ms, own error 0.08, 47 % below"),
        ({"max_ms": 3.5, "error": "sampling"}, "Take lf, 16 samples by latin, no blur: 2 ms, sampling error 0.1 (R"),
    ],
)  # fmt: skip
def test_advice_is_one_sentence_and_never_worse_than_the_best_constant(limit, sentence):
    said = advice(MADE_UP, **limit)
    assert said.startswith(sentence)
    assert said.endswith("(R 2 %, statue).")


def test_no_advice_where_nothing_beats_the_best_constant():
    poor = result(point(1.0, 0.25, 0.2), point(2.0, 0.6, 0.2))
    assert advice(poor, max_ms=9.0).startswith("No measured setting has a visibility error below that of the best")
    assert "No setting is better than the best constant." in page.as_text(poor)


# The commands


def test_plots_are_drawn_from_the_json_only(tmp_path):
    read = json.loads(json.dumps(MADE_UP))
    figure = plot.draw(read, "visibility")
    family, *_, everything = figure.axes
    (line,) = [line for line in family.get_lines() if len(line.get_xdata()) == 5]
    assert sorted(line.get_ydata()) == [0.04, 0.1, 0.1, 0.2, 0.3]
    (front,) = [line for line in everything.get_lines() if line.get_color() == "tab:red"]
    assert list(front.get_xdata()) == [2, 4]
    levels = {line.get_ydata()[0] for line in family.get_lines() if len(line.get_xdata()) == 2}
    assert levels == {0.6, 0.25, 0.01}
    # One sampling error, at 3 ms, is too small for its reference.
    drawn = [list(line.get_xdata()) for line in plot.draw(read, "sampling").axes[0].get_lines()]
    assert drawn == [[1, 2, 4, 5]]
    plot.save_plots(MADE_UP, tmp_path)
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(f"work-precision-{error}.png" for error in ERRORS)


def test_families_of_the_plots_are_all_estimators():
    assert sorted(name for names in plot.FAMILIES.values() for name in names) == sorted(of_one_view())


def refused(capsys, *words):
    assert main(["bench", *words]) == 2
    return sentence(capsys)


def test_advise_refuses_in_one_sentence(capsys, tmp_path):
    file = tmp_path / "a.json"
    assert "no such file" in refused(capsys, "advise", "--max-ms", "1", "--from", str(file))
    file.write_text("{")
    assert "not a JSON file" in refused(capsys, "advise", "--max-ms", "1", "--from", str(file))
    file.write_text("{}")
    assert "was not written by" in refused(capsys, "advise", "--max-ms", "1", "--from", str(file))
    file.write_text(json.dumps(MADE_UP))
    assert "are R 2 %" in refused(capsys, "advise", "--max-ms", "1", "--from", str(file), "--radii", "0.5")
    assert "visibility" in refused(capsys, "advise", "--max-ms", "1", "--error", "rmse")
    assert "--max-error" in refused(capsys, "advise", "--max-error", "-1")
    assert "--max-error" in refused(capsys, "advise")
    assert "--max-error" in refused(capsys, "advise", "--max-ms", "1", "--max-error", "1")


def test_advise_takes_its_figures_from_the_folder_else_from_those_committed(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("lfssao.cli.bench_advise.COMMITTED", tmp_path / "committed.json")
    assert "lfssao bench work-precision --quick" in refused(capsys, "advise", "--max-ms", "9")
    (tmp_path / "committed.json").write_text(json.dumps(MADE_UP))
    assert main(["bench", "advise", "--max-ms", "9", "--radii", "2%"]) == 0
    said = capsys.readouterr().out
    assert said.startswith("Take lf, 64 samples")
    assert "committed.json" in said
    assert "lfssao bench work-precision" in said
    (tmp_path / "work-precision").mkdir()
    (tmp_path / "work-precision" / "work-precision.json").write_text(json.dumps(result(point(1.0, 0.2, 0.1))))
    assert main(["bench", "advise", "--max-ms", "9"]) == 0
    assert capsys.readouterr().out.startswith("Take lf, 8 samples")


@pytest.mark.slow
def test_a_tiny_run_is_interrupted_goes_on_and_gives_advice(capsys, tmp_path, monkeypatch):
    few = {"counts": (1, 4, 16), "samplers": ("random",), "reference_count": 256, "most": 3, "own_counts": True}
    tiny = replace(grid.QUICK, width=24, height=18, **few)
    monkeypatch.setattr("lfssao.cli.bench_work_precision.QUICK", tiny)
    names = ("lf", "vo-lines", "sao")
    monkeypatch.setattr(run, "of_one_view", lambda: {name: ESTIMATORS[name] for name in names})
    real = run.errors_of
    measured = []

    def interrupted(scene, estimator):
        measured.append(estimator.name)
        if measured.count("vo-lines") == 1 and estimator.name == "vo-lines":
            raise KeyboardInterrupt
        return real(scene, estimator)

    monkeypatch.setattr(run, "errors_of", interrupted)
    file = tmp_path / "out" / "work-precision.json"
    command = ["bench", "work-precision", "statue", "corner", "--quick", "--threads", "1", "-o", str(file.parent)]
    assert main(command) == 130
    assert list(json.loads(file.read_text())["estimators"]) == ["lf"]
    assert main(command) == 0
    assert measured == ["lf", "lf", "vo-lines", "vo-lines", "vo-lines", "sao", "sao"]
    made = json.loads(file.read_text())
    pictures = {f"work-precision-{error}.png" for error in ERRORS}
    assert {p.name for p in file.parent.iterdir()} <= pictures | {"work-precision.json", "work-precision.md"}
    points = points_of(made, "visibility")
    assert len(points) == 2 * (3 + 3 + 6)
    assert [p["samples"] for p in points[-12::2]] == [None, 1, 4, 16, 64, 256]
    for p in points:
        assert p["ms"] > 0
        assert p["wall_ms"] > 0
        assert 0 <= p["visibility"][2] <= p["visibility"][0] <= 1
        assert (p["sampling"] is None) == (p["estimator"] == "sao")
    assert {"processor", "threads", "packages"} <= set(made["setup"]["machine"])
    capsys.readouterr()
    assert main(["bench", "advise", "--max-ms", "1e9", "--from", str(file)]) == 0
    assert capsys.readouterr().out.count(".\n") == 1
    other = [command[1], "ammonite", *command[4:]]
    assert "other scenes" in refused(capsys, *other)
