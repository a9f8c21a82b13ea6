"""lfssao samples: tables read back to the same bits, promises are judged, pictures are drawn, bad input is refused."""

import json
import re

import numpy as np
import pytest
from bits import bits
from jobs import sentence
from matplotlib.image import imread

from lfssao.cli.main import main
from lfssao.samples import METHODS, make_samples, sample_set
from lfssao.samples.formats import read_points, to_glsl
from lfssao.samples.plot import draw_samples
from lfssao.testing import PROMISES


@pytest.mark.parametrize("form", ["csv", "json", "npy"])
@pytest.mark.parametrize(
    ("domain", "name", "words", "options"),
    [*((domain, "sobol", [], {}) for domain in METHODS), ("disk", "repulsion", ["--no-centre"], {"centre": False})],
)
def test_tables_read_back_to_the_same_bits(tmp_path, capsys, form, domain, name, words, options):
    path, want = tmp_path / f"table.{form}", sample_set(domain, name, 13, 5, **options)
    words = [*words, "--domain", domain, "-n", "13", "--seed", "5", "--format", form, "-o", str(path)]
    assert main(["samples", "make", name, *words]) == 0
    assert capsys.readouterr().out == f"{path}\n"
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
    if want.weights is not None and form == "npy":  # a column of their own
        np.testing.assert_array_equal(np.load(path), np.column_stack([want.points, want.weights]))
    else:
        points, weights, named = read_points(path)
        np.testing.assert_array_equal(bits(points), bits(want.points))
        assert (weights is None and want.weights is None) or (bits(weights) == bits(want.weights)).all()
        assert named == (domain if form == "json" else None)


def test_standard_output_and_the_shell(capsys):
    assert main(["samples", "make", "latin", "-n", "8", "--r-min", "0.8"]) == 0
    first, *rows = capsys.readouterr().out.splitlines()
    assert first == "x,y,z"
    np.testing.assert_array_equal([[float(c) for c in row.split(",")] for row in rows], make_samples("latin", 8))
    assert main(["samples", "make", "spiral", "-n", "9", "--turns", "7", "--format", "json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert (facts["domain"], facts["method"], facts["weights"]) == ("disk", "spiral", None)
    np.testing.assert_array_equal(facts["points"], sample_set("disk", "spiral", 9, turns=7).points)


def test_glsl_arrays_hold_the_numbers_rounded_to_float32():
    made = sample_set("ball", "repulsion", 7)
    text = to_glsl(made).decode()
    assert "const int SAMPLE_COUNT = 7;" in text
    samples, weights = text.split("const float WEIGHTS[7] = float[7](")
    rows = re.findall(r"vec3\((-?[0-9.e+-]+), (-?[0-9.e+-]+), (-?[0-9.e+-]+)\)", samples.split("vec3[7](")[1])
    np.testing.assert_array_equal(np.array(rows, np.float32), made.points.astype(np.float32))
    words = re.findall(r"-?[0-9]+\.[0-9]+e[+-][0-9]+", weights)
    np.testing.assert_array_equal(np.array(words, np.float32), made.weights.astype(np.float32))
    assert "WEIGHTS" not in to_glsl(sample_set("disk", "latin", 3)).decode()
    assert "vec2[3](" in to_glsl(sample_set("disk", "latin", 3)).decode()


def test_without_a_name_methods_and_promises_are_listed(capsys):
    assert main(["samples", "make"]) == 0
    text = capsys.readouterr().out
    assert all(f"  {name}: " in text for methods in METHODS.values() for name in methods)
    assert main(["samples", "check"]) == 0
    assert [line.split(":")[0] for line in capsys.readouterr().out.splitlines()] == list(PROMISES)


def test_somebody_elses_points_are_judged(tmp_path, capsys):
    rng = np.random.default_rng(3)
    directions = rng.normal(size=(5000, 3))
    directions /= np.sqrt(np.sum(directions**2, axis=1, keepdims=True))
    good, bad = directions * np.cbrt(rng.random((5000, 1))), directions * rng.random((5000, 1))
    for name, points in (("good", good), ("bad", bad)):
        np.savetxt(tmp_path / f"{name}.csv", points, "%.9g", ",")
    assert main(["samples", "check", str(tmp_path / "good.csv"), "--promise", "uniform-ball"]) == 0
    out = capsys.readouterr().out
    assert "BROKEN" not in out
    assert out.count("holds") == 5
    assert main(["samples", "check", str(tmp_path / "bad.csv"), "--promise", "uniform-ball"]) == 1
    broken = [line for line in capsys.readouterr().out.splitlines() if "BROKEN" in line]
    assert any("r^3" in line for line in broken)
    assert main(["samples", "check", str(tmp_path / "bad.csv")]) == 1
    capsys.readouterr()
    np.save(tmp_path / "square.npy", sample_set("square", "latin", 40).points.astype(np.float32))
    promises = ["--promise", "latin", "--promise", "inside-square", "--promise", "net"]
    assert main(["samples", "check", str(tmp_path / "square.npy"), *promises]) == 1
    verdicts = {line.split(" ")[0] for line in capsys.readouterr().out.splitlines() if "BROKEN" in line}
    assert verdicts == {"net"}
    np.save(tmp_path / "disk.npy", sample_set("disk", "random", 400).points)
    assert main(["samples", "check", str(tmp_path / "disk.npy"), "--promise", "uniform-disk"]) == 0
    capsys.readouterr()


@pytest.mark.parametrize("domain", ["square", "disk", "ball"])
def test_the_line_over_the_radii_is_a_density(domain):
    axes = draw_samples(sample_set(domain, "random", 5000)).axes[1]
    at, density = axes.lines[0].get_data()
    assert np.trapezoid(density, at) == pytest.approx(1, abs=0.01)
    heights = [bar.get_height() for bar in axes.patches]
    middles = [bar.get_x() + bar.get_width() / 2 for bar in axes.patches]
    np.testing.assert_allclose(heights, np.interp(middles, at, density), atol=0.7)  # 5 sigma


@pytest.mark.parametrize("domain", METHODS)
def test_pictures_show_four_panels(domain):
    figure = draw_samples(sample_set(domain, "r2", 50))
    titles = [axes.get_title() for axes in figure.axes if axes.get_title()]
    assert [title.split(" (")[0] for title in titles] == [
        "points", "distances from the centre", "periodogram", "pair correlation"
    ]  # fmt: skip


def test_a_picture_is_written(tmp_path, capsys):
    target = tmp_path / "drawn.png"
    assert main(["samples", "plot", "poisson", "-n", "100", "-o", str(target)]) == 0
    assert capsys.readouterr().out == f"{target}\n"
    assert imread(target).std() > 0.05
    points = tmp_path / "mine.csv"
    points.write_text("0.5,0.5\n-0.5,0.25\n")
    assert main(["samples", "plot", str(points), "-o", str(tmp_path / "mine.svg")]) == 0
    assert (tmp_path / "mine.svg").stat().st_size > 1000


@pytest.mark.parametrize(("words", "message"), [
    (["make", "latn"], "nearest is 'latin'"),
    (["make", "latin", "--format", "gsl"], "nearest is 'glsl'"),
    (["make", "latin", "--format", "npy"], "-o"),
    (["make", "latin", "-n", "0"], "not from 1"),
    (["make", "latin", "-n", "nan"], "not a whole number"),
    (["make", "latin", "--r-min", "nan"], "not a radius"),
    (["make", "latin", "--domain", "disk", "--r-min", "0.5"], "only the ball has a shell"),
    (["make", "latin", "--turns", "3"], "no option"),
    (["plot", "latin", "-o", "a.gif"], "does not end in"),
    (["plot", "latin", "-o", "nowhere/a.png"], "no folder"),
    (["check", "nothing.csv"], "cannot be read"),
    (["check", "nothing.txt"], "format of points"),
])  # fmt: skip
def test_bad_options_get_one_sentence(words, message, capsys):
    assert main(["samples", *words]) == 2
    assert message in sentence(capsys)


@pytest.mark.parametrize(("name", "content", "message"), [
    ("a.csv", b"", "expected (n, 2) or (n, 3)"),
    ("a.csv", b"x,y,z\n", "at least 1"),
    ("a.csv", b"1,2\n3\n", "columns changed from 2 to 1"),
    ("a.csv", b"1,2\n3,four\n", "could not convert string 'four'"),
    ("a.csv", b"1,2\n3,inf\n", "not finite"),
    ("a.csv", b"1,2,3,4\n", "shape (1, 4)"),
    ("a.csv", b"\xff\xfe,2\n", "utf-8"),
    ("a.json", b"{", "not a JSON file"),
    ("a.json", b"{}", "no 'points'"),
    ("a.json", b'{"points": [[1, 2], [3]]}', "not a table of numbers"),
    ("a.json", b'{"points": [[1, 2]], "domain": "sqare"}', "nearest is 'square'"),
    ("a.npy", b"no", "not a .npy file"),
])  # fmt: skip
def test_malformed_files_get_one_sentence(tmp_path, capsys, name, content, message):
    (tmp_path / name).write_bytes(content)
    assert main(["samples", "check", str(tmp_path / name)]) == 2
    assert message in sentence(capsys)
