"""lfssao samples: tables read back to the same bits, promises are judged, pictures are drawn, bad input is refused."""

import json
import re
from io import BytesIO
from types import SimpleNamespace

import numpy as np
import pytest
from bits import bits
from jobs import sentence
from matplotlib.image import imread

from lfssao.cli.main import main
from lfssao.errors import InputError
from lfssao.samples import METHODS, make_samples, sample_set
from lfssao.samples.formats import FORMATS, read_points, to_glsl
from lfssao.testing import PROMISES
from lfssao.viz.samples import draw_samples


@pytest.mark.parametrize("form", ["csv", "json", "npy"])
@pytest.mark.parametrize(("domain", "name", "words", "options"), [
    *((domain, "sobol", [], {}) for domain in METHODS), ("disk", "repulsion", ["--no-centre"], {"centre": False}),
])  # fmt: skip
def test_tables_read_back_to_the_same_bits(tmp_path, capsys, form, domain, name, words, options):
    path = tmp_path / f"table.{form}"
    want = sample_set(domain, name, 13, 5, **options)
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
    good = directions * np.cbrt(rng.random((5000, 1)))
    bad = directions * rng.random((5000, 1))
    np.savetxt(tmp_path / "good.csv", good, "%.9g", ",")
    np.savetxt(tmp_path / "bad.txt", bad, header="as np.savetxt writes them")
    assert main(["samples", "check", str(tmp_path / "good.csv"), "--promise", "uniform-ball"]) == 0
    out = capsys.readouterr().out
    assert "BROKEN" not in out
    assert out.count(": holds at n = 5000: ") == len(out.splitlines()) == 7
    assert main(["samples", "check", str(tmp_path / "bad.txt")]) == 1
    assert any("BROKEN" in line and "r^3" in line for line in capsys.readouterr().out.splitlines())
    np.save(tmp_path / "square.npy", sample_set("square", "latin", 40).points.astype(np.float32))
    promises = ["--promise", "latin", "--promise", "inside-square", "--promise", "net"]
    assert main(["samples", "check", str(tmp_path / "square.npy"), *promises]) == 1
    verdicts = {line.split(" ")[0] for line in capsys.readouterr().out.splitlines() if "BROKEN" in line}
    assert verdicts == {"net"}
    np.save(tmp_path / "disk.npy", sample_set("disk", "random", 400).points)
    assert main(["samples", "check", str(tmp_path / "disk.npy"), "--promise", "uniform-disk"]) == 0
    assert "holds" in capsys.readouterr().out


def test_files_of_a_pattern_are_pooled_and_one_of_them_cannot_tell(tmp_path, capsys):
    for seed in range(40):
        np.savetxt(tmp_path / f"mine_{seed:02}.csv", sample_set("ball", "latin", 8, seed).points, delimiter=";")
    assert main(["samples", "check", str(tmp_path / "mine_*.csv"), "--alarm", "0.01"]) == 0
    out = capsys.readouterr().out
    assert "repeated sets of 40 (limits are those of independent points, safe for more even sets): 0" in out
    assert out.count("p = ") == out.count(" at n = 320: ") == 7
    assert main(["samples", "check", str(tmp_path / "mine_05.csv")]) == 0
    out = capsys.readouterr().out
    assert out.count("p = ") == out.count(": cannot tell at n = 8: ") == 6
    assert "larger --alarm" in out
    np.savetxt(tmp_path / "mine_07.csv", np.full((2, 3), 0.1))
    assert main(["samples", "check", str(tmp_path / "mine_*.csv"), "--promise", "distinct"]) == 1
    assert "set 7: 1, at most 0: BROKEN" in (out := capsys.readouterr().out)
    assert "mine_07.csv" in out


def test_an_array_of_sets_in_a_file_and_files_together_are_pooled(tmp_path, capsys):
    sets = np.stack([sample_set("ball", "latin", 8, seed).points for seed in range(40)])
    np.save(tmp_path / "a.npy", sets[:30])
    (tmp_path / "b.json").write_text(json.dumps(sets[30:].tolist()))
    assert main(["samples", "check", *(str(tmp_path / name) for name in ("a.npy", "b.json")), "--alarm", "0.01"]) == 0
    assert capsys.readouterr().out.count(" at n = 320: ") == 7
    sets[3, 2] = sets[3, 1]
    np.save(tmp_path / "a.npy", sets[:30])
    assert main(["samples", "check", str(tmp_path / "a.npy"), "--promise", "distinct"]) == 1
    assert "a.npy, set 3)" in capsys.readouterr().out
    with pytest.raises(InputError, match="it holds 30 sets of points, expected one"):
        read_points(tmp_path / "a.npy")


@pytest.mark.parametrize("form", [form for form in FORMATS if form != "glsl-function"])  # which holds no points
def test_standard_input_is_read_in_the_format_that_it_has(monkeypatch, capsys, form):
    data = FORMATS[form](sample_set("square", "latin", 16, 1))
    monkeypatch.setattr("sys.stdin", SimpleNamespace(buffer=BytesIO(data)))
    assert main(["samples", "check", "-", "--promise", "latin", "--range", "-1,1"]) == 0
    assert "latin (square)" in capsys.readouterr().out
    monkeypatch.setattr("sys.stdin", SimpleNamespace(buffer=BytesIO(data[: len(data) // 2] + b"x")))
    assert main(["samples", "check", "-"]) == 2
    assert sentence(capsys).startswith(f"standard input, read as .{form}: ")


def test_points_from_0_to_1_in_space_get_a_hint(tmp_path, capsys):
    np.save(tmp_path / "unit.npy", np.random.default_rng(1).random((500, 3)))
    assert main(["samples", "check", str(tmp_path / "unit.npy")]) == 1
    assert capsys.readouterr().err.count("--range 0,1, if they fill that") == 1


def test_points_of_the_unit_square_are_recognised_and_said_to_be(tmp_path, capsys):
    np.save(tmp_path / "unit.npy", np.random.default_rng(1).random((2000, 2)))
    assert main(["samples", "check", str(tmp_path / "unit.npy")]) == 0
    assert capsys.readouterr().err.count("taken for the whole square") == 1
    assert main(["samples", "check", str(tmp_path / "unit.npy"), "--range", "-1,1"]) == 1
    assert main(["samples", "check", str(tmp_path / "unit.npy"), "--range", "0,1"]) == 0
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(("domain", "names"), [
    ("square", ["xi_1", "xi_2"]), ("disk", ["r", "phi"]), ("sphere", ["z", "phi"]), ("ball", ["z", "phi", "r"])
])  # fmt: skip
def test_pictures_show_a_histogram_of_each_coordinate_over_its_band(domain, names):
    """1000 points, 30 bins and 2 sigma: under 10 of 90 bins lie outside, and all of an upper half ball's."""
    figure = draw_samples([sample_set(domain, "random", 500, seed) for seed in (1, 2)])
    by_title = {axes.get_title(): axes for axes in figure.axes if axes.get_title()}
    shown = [f"share by {name} (2 sigma)" for name in names]
    rest = ["periodogram (independent: 1)", "its radial mean (2 sigma)", "pair correlation (independent: 1)"]
    assert list(by_title) == ["points", *shown, *rest]
    for title in shown:
        band, fair, share = (patch.get_data() for patch in by_title[title].patches)
        assert fair.values.sum() == pytest.approx(1)
        assert share.values.sum() == pytest.approx(1)
        assert np.sum((share.values > band.values) | (share.values < band.baseline)) < 5


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
    (["make", "latn"], "did you mean 'latin'"),
    (["make", "latin", "--format", "gsl"], "did you mean 'glsl'"),
    (["make", "latin", "--format", "npy"], "-o"),
    (["make", "latin", "-n", "0"], "not from 1"),
    (["make", "latin", "-n", "nan"], "not a whole number"),
    (["make", "latin", "--r-min", "nan"], "not a radius"),
    (["make", "latin", "--domain", "disk", "--r-min", "0.5"], "only the ball has a shell"),
    (["make", "latin", "--turns", "3"], "no option"),
    (["plot", "latin", "-o", "a.gif"], "does not end in"),
    (["plot", "latin", "-o", "nowhere/a.png"], "no folder"),
    (["check", "nothing.csv"], "no such file"),
    (["check", "nothing.gif"], "format of points"),
    (["check", "nothing_*.csv"], "no such file"),
    (["check", "a.csv", "--alarm", "1"], "not a probability"),
    (["check", "a.csv", "--range", "1"], "'1' is not LOW,HIGH"),
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
    ("a.json", b'{"points": [[1, 2]], "domain": "sqare"}', "did you mean 'square'"),
    ("a.npy", b"PK\3\4", "it cannot be read as an NPY file"),
])  # fmt: skip
def test_malformed_files_get_one_sentence(tmp_path, capsys, name, content, message):
    (tmp_path / name).write_bytes(content)
    assert main(["samples", "check", str(tmp_path / name)]) == 2
    assert message in sentence(capsys)


def test_files_of_different_domains_are_refused(tmp_path, capsys):
    (tmp_path / "a.csv").write_text("0.1,0.2\n")
    (tmp_path / "b.csv").write_text("0.1,0.2,0.3\n")
    assert main(["samples", "check", str(tmp_path / "[ab].csv"), "--range", "-1,1"]) == 2
    assert "b.csv: points of the square have shape (1, 3)" in sentence(capsys)


def test_sobol_sets_of_no_power_of_two_are_warned_of(capsys):
    assert main(["samples", "make", "sobol", "-n", "12"]) == 0
    assert "12 points of sobol are not" in capsys.readouterr().err
