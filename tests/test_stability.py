"""Stiff and extreme cases: every row of the table, and that the table would notice."""

import json
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lfssao.bench import curved, measure, probes, stability
from lfssao.bench.running_error import Arithmetic, Tracked
from lfssao.bench.sequences import curves
from lfssao.bench.stability import BROKEN, CASES, DEGRADED, REFUSED, WITHIN, Case, Refusal
from lfssao.cli import main

pytestmark = pytest.mark.usefixtures("one_thread")
MAPPED = [case for case in CASES if isinstance(case, Case)]
number = st.floats(-1e6, 1e6, width=32)
normal = st.one_of(st.just(0.0), number.filter(lambda x: abs(x) > 1e-6))


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_every_row_is_what_it_states(case):
    rows = list(case.rows())
    assert rows
    assert [(row.input, row.path, row.reason) for row in rows if row.verdict == BROKEN] == []
    if isinstance(case, Refusal):
        assert {row.verdict for row in rows} == {REFUSED}
        return
    for path in measure.PATHS:  # what is said to degrade does, and nothing else
        verdicts = {row.verdict for row in rows if row.path == path}
        assert verdicts <= {WITHIN, DEGRADED}
        assert (DEGRADED in verdicts) == (path in case.degraded)


# The error analysis


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@given(st.sampled_from(["add", "subtract", "multiply", "divide"]), normal, normal)
def test_bounds_hold_for_two_operations(dtype, operation, a, b):
    """(a / 3 op b / 7): operands that are rounded themselves."""
    work = Arithmetic.of(dtype)
    tracked = [work.divide(Tracked(Fraction(x)), Tracked(Fraction(y))) for x, y in ((a, 3), (b, 7))]
    plain = [dtype(x) / dtype(y) for x, y in ((a, 3), (b, 7))]
    result = getattr(work, operation)(*tracked)
    with np.errstate(all="ignore"):
        value = getattr(np, operation)(*plain)
    if np.isfinite(result.error):
        assert abs(Fraction(float(value)) - result.value) <= Fraction(result.error)
    else:
        assert operation == "divide"
        assert b == 0


def test_what_is_exact_has_no_error():
    work = Arithmetic.of(np.float32)
    one, third = Tracked(Fraction(1)), work.rounded(Tracked(Fraction(1, 3)))
    assert third.error == pytest.approx(2.0**-24 / 3)
    assert work.subtract(one, Tracked(Fraction(1, 2**24))).error == 0  # 24 digits
    assert work.subtract(one, Tracked(Fraction(1, 2**25))).error == pytest.approx(2.0**-24)
    assert work.multiply(Tracked(Fraction(2) ** 100), Tracked(Fraction(2) ** 100)).error == np.inf
    assert one.surely(one) is False
    assert third.surely(Tracked(Fraction(1, 3))) is None


# Both formulas


def test_near_a_slit_ours_keeps_its_digits_and_the_straightforward_formula_does_not():
    """m_z - z is exact: three roundings. 1 - z / m_z has the error of a quotient near 1, half an ulp, over 2^-k."""
    for name, points in curves().items():
        digits = 24 if "32" in name else 53
        assert len(points) >= digits - 1, name
        for k, ours, straightforward in points:
            assert ours <= 4, (name, k)
            assert straightforward <= 2 ** (k + 3), (name, k)
        assert max(straightforward for k, _, straightforward in points if k <= digits - 3) > 2 ** (digits - 6), name


# The table notices


def test_a_formula_that_loses_digits_breaks_a_row(monkeypatch):
    case = stability.near_lens(18)
    assert measure.measure(case, "float32").exceeded == 0

    def lossy(a, b, c, z_module, z_observer, u_0, v_0):
        one = type(z_module)(1)
        return u_0 + a / z_module / (one - c / z_module), v_0 + b / (z_observer - c)

    lossy.py_func = lossy
    monkeypatch.setattr(measure.mapping, "project_crossed_slits", lossy)
    assert measure.measure(case, "float32").exceeded > 0


def test_a_wrong_decision_breaks_a_row(monkeypatch):
    real = measure.passes.algorithm2
    for case in MAPPED:
        if case.name in ("ordinary", "texel edges"):
            _, stiff = next(case.inputs())

            def wrong(*inputs):
                found = real(*inputs)
                found.texture[3, 3] = 1 - found.texture[3, 3]
                return found

            monkeypatch.setattr(measure.passes, "algorithm2", wrong)
            assert measure.measure(stiff, "float64").exceeded == 1
            monkeypatch.setattr(measure.passes, "algorithm2", real)
            assert measure.measure(stiff, "float64").exceeded == 0


# The command


def test_the_command_prints_the_table_and_writes_the_files(tmp_path, capsys, monkeypatch):
    kept = tuple(case for case in CASES if case.name in ("ordinary", "offset") or isinstance(case, Refusal))
    monkeypatch.setattr(stability, "CASES", kept)
    table, picture = tmp_path / "a.json", tmp_path / "a.png"
    assert main(["bench", "stability", "--json", str(table), "--plot", str(picture)]) == 0
    lines = capsys.readouterr().out.splitlines()
    rows = json.loads(table.read_text())["rows"]
    assert len(lines) == 1 + len(rows)
    assert picture.read_bytes().startswith(b"\x89PNG")
    broken = Refusal("x", "x", "x", lambda: None, "")
    monkeypatch.setattr(stability, "CASES", (broken,))
    assert main(["bench", "stability"]) == 1
    assert "it was served" in capsys.readouterr().out


def test_a_picture_of_another_kind_is_refused(capsys):
    assert main(["bench", "stability", "--plot", "a.txt"]) == 2
    assert "must end in one of" in capsys.readouterr().err


def test_a_curved_display_a_billionth_of_a_texel_off_breaks_a_row(monkeypatch):
    real = curved.land

    def off(kind, m, points, image):
        real(kind, m, points, image)
        image[0, 0] += 1e-9

    assert curved.picoarray(0.5, "float64").exceeded == 0
    monkeypatch.setattr(curved, "land", off)
    assert curved.picoarray(0.5, "float64").exceeded == 2  # the first point of each of two modules


def test_a_blur_that_loses_a_hundred_thousandth_breaks_a_row(monkeypatch):
    real = probes.passes.blur

    def short(texture, sigma):
        return real(texture, sigma) - texture.dtype.type(1e-5) * texture

    assert probes.blurred(1.0, "float32").exceeded == 0
    monkeypatch.setattr(probes.passes, "blur", short)
    assert probes.blurred(1.0, "float32").exceeded > 0
