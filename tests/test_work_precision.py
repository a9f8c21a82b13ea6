"""Error against run time: references, slopes on scenes with known answers, the Pareto front, advice, plots, a run."""

import json
from dataclasses import replace

import numpy as np
import pytest

from lfssao.bench import plans, plots, work_precision
from lfssao.bench.advise import FORMAT, advice, pareto_front, points_of
from lfssao.bench.face_counts import LF_MILLISECONDS, spread_per_cent
from lfssao.bench.sampling_error import Reference, combine, rmse
from lfssao.bench.slopes import THEORY, fitted_slope
from lfssao.bench.times import in_turn
from lfssao.cli import main
from lfssao.errors import InputError
from lfssao.estimators.registry import ESTIMATORS
from lfssao.samples import sample_set

pytestmark = pytest.mark.usefixtures("one_thread")
SEEDS = 400


def point(ms, model, sampling=None, serves=None, **more):
    return {
        "estimator": "lf", "sampler": "latin", "samples": 8, "radii": 1, "blur": 0.0, "dtype": "float32", "ms": ms,
        "model": model, "sampling": sampling, "reference_error": None if sampling is None else 0.001,
        "reference_serves": serves, **more,
    }  # fmt: skip


def result(*points):
    machine = {"processor": "a processor", "threads": 2}
    setup = {"scene": "statue", "width": 32, "height": 24, "machine": machine}
    return {"work_precision": FORMAT, "setup": setup, "estimators": {"lf": {"points": points}}, "face_counts": None}


MADE_UP = result(
    point(1.0, 0.3, 0.2, True), point(2.0, 0.1, 0.1, True, samples=16), point(3.0, 0.1, 0.005, False, samples=32),
    point(4.0, 0.04, 0.02, True, samples=64), point(5.0, 0.2, 0.05, True, samples=1, radii=3, blur=1.0),
)  # fmt: skip


# Slopes


def half_planes(rng, points):
    """Each set's share of a half plane at random, less the exact one: a sum of two uniform numbers lies below c."""
    angle, c = rng.uniform(0, 2 * np.pi, SEEDS), rng.uniform(-0.4, 0.4, SEEDS)
    a, b = np.cos(angle), np.sin(angle)
    share = (a[:, None] * points[..., 0] + b[:, None] * points[..., 1] < c[:, None]).mean(axis=1)
    a, b = np.abs(a), np.abs(b)
    parts = [sign * np.maximum(c + s * a + t * b, 0) ** 2 for s, t, sign in
             ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1))]  # fmt: skip
    return share - sum(parts) / (8 * a * b)


def waves(rng, points):
    """Each set's mean of a smooth wave of random phase, less the exact one."""
    phase = rng.uniform(0, 2 * np.pi, SEEDS)
    mean = np.cos(1.5 * points[..., 0] + 2.0 * points[..., 1] + phase[:, None]).mean(axis=1)
    return mean - np.sin(1.5) / 1.5 * np.sin(2.0) / 2.0 * np.cos(phase)


@pytest.mark.parametrize("sampler", [
    "random", "jittered", "latin",
    pytest.param("poisson", marks=pytest.mark.xfail(
        strict=True, reason="exactly n points at a distance: -0.6 up to 2,304 of them, theory -0.5")),
])  # fmt: skip
def test_slopes_on_scenes_with_known_answers_are_those_of_theory(sampler):
    """The fit's standard error is near 0.01: 0.05 is five of them."""
    sizes = (64, 144, 256, 576, 1024)
    for integrand, expected in zip((half_planes, waves), THEORY[sampler], strict=True):
        rng = np.random.default_rng(7)
        errors = []
        for n in sizes:
            points = np.stack([sample_set("square", sampler, n, seed).points for seed in range(SEEDS)])
            errors.append(float(np.sqrt(np.mean(integrand(rng, points) ** 2))))
        assert fitted_slope(sizes, errors) == pytest.approx(expected, abs=0.05), integrand.__name__


def test_a_slope_is_the_exponent_and_needs_three_errors():
    assert fitted_slope([1, 10, 100, 1000], [5, 0.5, 0.05, 0.005]) == pytest.approx(-1)
    assert fitted_slope([1, 2, 4, 8], [1, 0, 0.5, 0]) is None


# References


@pytest.mark.parametrize("many", [2, 3])
def test_a_references_own_error_is_estimated_from_independent_ones(many):
    rng = np.random.default_rng(1)
    truth = rng.uniform(size=40_000)
    made = combine([truth + 0.01 * rng.standard_normal(truth.size) for _ in range(many)])
    assert rmse(made.texture, truth) == pytest.approx(0.01 / np.sqrt(many), rel=0.03)
    assert made.error == pytest.approx(rmse(made.texture, truth), rel=0.03)


def test_a_reference_serves_errors_ten_times_its_own():
    reference = Reference(np.zeros(1), 0.001)
    assert reference.serves(0.0101)
    assert not reference.serves(0.0099)


def test_no_sampler_is_compared_with_a_reference_of_its_own(monkeypatch):
    class Scene:
        def of_surface(self, texture):
            return texture

    monkeypatch.setattr(work_precision, "_finished", lambda layers, _blur: layers[0])
    many = {name: [np.full(3, float(k))] for k, name in enumerate(plans.REFERENCE_SAMPLERS)}
    means = {s: work_precision._reference(Scene(), many, s, 0.0).texture[0] for s in (*many, "latin")}
    assert means == {"sobol": 1.5, "jittered": 1.0, "r2": 0.5, "latin": 1.0}


# Sample sets


@pytest.mark.parametrize("name", [n for n in ESTIMATORS if plans.takes_samples(ESTIMATORS[n])])
def test_all_samplers_of_an_estimator_tend_to_the_integral_of_its_own_set(name):
    """Mean distance from the middle: 3/4 in the ball, 1/2 of taps, near 0.906 in LF's shell; of lines, which weigh as
    long as they are in the ball, 3 pi / 16."""
    estimator = ESTIMATORS[name]
    r = np.linspace(0.8, 1, 100_001)
    own = 0.5 if name == "alchemy" else 3 * np.pi / 16 if estimator.dimensions == 2 else 3 / 4
    expected = float((r**3).sum() / (r**2).sum()) if estimator.sampling else own
    samplers = plans.samplers_of(estimator, plans.FULL)
    assert len(samplers) >= 8
    for sampler in samplers:
        n = max(n for n in plans.counts_of(estimator, sampler, plans.FULL) if n <= 1024)
        points, weights = plans.samples_for(estimator, sampler, n, 3)
        assert points.shape == (n, estimator.dimensions)
        squares = (points**2).sum(axis=1)
        if name.startswith("vo-lines") and weights is None:
            weights = np.sqrt(1 - squares)
        mean = np.average(np.sqrt(squares), weights=weights)
        assert mean == pytest.approx(expected, abs=0.04), sampler


# Times, the front, advice


def test_times_are_of_warm_runs_in_turn():
    calls = []
    times = in_turn({"a": lambda: calls.append("a"), "b": lambda: calls.append("b")}, 3)
    assert "".join(calls) == "ab" * 4
    assert times["a"].low <= times["a"].median <= times["a"].high


def test_the_front_holds_what_nothing_beats():
    points = points_of(MADE_UP)
    assert [p["ms"] for p in pareto_front(points, "model")] == [1, 2, 4]
    assert [p["ms"] for p in pareto_front(points, "sampling")] == [1, 2, 4]  # 3 ms: its reference cannot tell


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


def test_spread():
    assert spread_per_cent([9.0, 10.0, 11.0]) == pytest.approx(20)
    assert spread_per_cent(list(LF_MILLISECONDS)) == pytest.approx(0.775, abs=0.001)


# The commands


def test_plots_are_drawn_from_the_json_only(tmp_path):
    figure = plots.draw(json.loads(json.dumps(MADE_UP)))
    for axes, error in zip(figure.axes, ("model", "sampling"), strict=True):
        lines = {line.get_label(): line for line in axes.get_lines()}
        assert list(lines["Pareto front"].get_xdata()) == [1, 2, 4]
        drawn = [y for line in axes.get_lines() if line.get_linestyle() == "None" for y in line.get_ydata()]
        assert sorted(drawn) == sorted(p[error] for p in points_of(MADE_UP))
    hollow = [line for line in figure.axes[1].get_lines() if line.get_markerfacecolor() == "none"]
    assert [list(line.get_xdata()) for line in hollow] == [[3.0]]
    plots.save_plots(MADE_UP, tmp_path)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["work-precision.png", "work-precision.svg"]
    assert "1 of 5 points are less than ten" in plots.as_text(MADE_UP)


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
    assert "no JSON" in refused(capsys, "advise", "--max-ms", "1", "--from", str(file))
    file.write_text("{}")
    assert "was not written by" in refused(capsys, "advise", "--max-ms", "1", "--from", str(file))
    assert "--max-error" in refused(capsys, "advise", "--max-error", "-1")
    assert "--max-error" in refused(capsys, "advise")


def test_a_tiny_run_is_interrupted_goes_on_and_gives_advice(capsys, tmp_path, monkeypatch):
    tiny = replace(plans.QUICK, width=16, height=12, counts=(1, 4, 16), samplers=("random",), reference_count=256,
                   repeats=1, frames=0)  # fmt: skip
    monkeypatch.setattr(plans, "QUICK", tiny)
    names = ("lf", "vo-lines", "multiresolution")
    monkeypatch.setattr(work_precision, "ESTIMATORS", {name: ESTIMATORS[name] for name in names})
    real, measured = work_precision.measure_estimator, []

    def interrupted(scene, estimator, *rest):
        measured.append(estimator.name)
        if measured.count("vo-lines") == 1 and estimator.name == "vo-lines":
            raise KeyboardInterrupt
        return real(scene, estimator, *rest)

    monkeypatch.setattr(work_precision, "measure_estimator", interrupted)
    file = tmp_path / "out" / "work-precision.json"
    command = ["bench", "work-precision", "statue", "--quick", "--threads", "1", "-o", str(file.parent)]
    assert main(command) == 130
    assert list(json.loads(file.read_text())["estimators"]) == ["lf"]
    assert main(command) == 0
    assert measured == ["lf", "vo-lines", "vo-lines", "multiresolution"]
    made = json.loads(file.read_text())
    assert sorted(p.name for p in file.parent.iterdir()) == [f"work-precision.{e}" for e in ("json", "png", "svg")]
    points = points_of(made)
    assert len(points) == 2 * (3 + 3 + 1)
    for p in points:
        assert p["ms"] > 0
        assert 0 <= p["model"] <= 1
        assert (p["sampling"] is None) == (p["estimator"] == "multiresolution")
    assert {"processor", "threads", "packages"} <= set(made["setup"]["machine"])
    capsys.readouterr()
    assert main(["bench", "advise", "--max-ms", "1e9", "--from", str(file)]) == 0
    assert capsys.readouterr().out.count(".\n") == 1
    assert "another scene" in refused(capsys, *command[1:2], "ammonite", *command[3:])
