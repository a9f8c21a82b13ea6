"""Stiff and extreme cases: every row of the table, and that the table would notice."""

import json
import operator
from dataclasses import replace
from fractions import Fraction
from types import SimpleNamespace

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lfssao.ao.estimators.kernels.multiresolution import obscured
from lfssao.ao.estimators.registry import ESTIMATORS, estimate, find_estimator, of_one_view
from lfssao.ao.moments import moment_pyramid
from lfssao.ao.post import blur
from lfssao.ao.ssao import algorithm2
from lfssao.bench.stability import conditions, levels, measure, occlusions, scalar_cases
from lfssao.bench.stability.cases import CASES
from lfssao.bench.stability.conditions import FEW
from lfssao.bench.stability.exact import Formulas
from lfssao.bench.stability.inputs import along_rays, near, scene
from lfssao.bench.stability.measure import PATHS, Measured
from lfssao.bench.stability.occlusions import LEVELS, OCCLUSIONS, SAMPLED, SAMPLING
from lfssao.bench.stability.table import BROKEN, DEGRADED, NOT_EXACT, REFUSED, WITHIN, Case, NotExact, Refusal
from lfssao.bench.stability.tracked import Arithmetic, Doubt, in_doubt
from lfssao.cli.main import main
from lfssao.core.numbers import larger, power, select, smaller, smoothstep
from lfssao.optics.display_file import find_display
from lfssao.optics.kernels.projection import land

FORMULAS = tuple(name for name in ESTIMATORS if find_estimator(name).reads_texels)
FILTERED = tuple(name for name in ESTIMATORS if find_estimator(name).filtered)
EXACT = (*FORMULAS, *FILTERED, *SAMPLED, LEVELS)
WHOLE = (*FORMULAS, *FILTERED, LEVELS)
HAVE = {"epsilon": ("alchemy", "sao", "sao-equation-1"), "passes": ("sao", "sao-equation-1"),
        **{name: SAMPLED if name.startswith(SAMPLING) else WHOLE for name in OCCLUSIONS}}  # fmt: skip
LONG = ("near the lens", "near the observers", "blur", *OCCLUSIONS)
MEASURED = [
    pytest.param(case, id=case.name, marks=pytest.mark.slow if case.name in LONG else ())
    for case in CASES
    if isinstance(case, Case)
]
number = st.floats(-1e6, 1e6, width=32)
near_one = st.floats(-4, 4, width=32).map(lambda x: round(x * 8) / 8 if abs(x) > 2 else x)  # many of them equal
normal = st.one_of(st.just(0.0), number.filter(lambda x: abs(x) > 1e-6))


@pytest.mark.parametrize("case", MEASURED)
def test_every_row_is_what_its_case_states(case):
    """Nothing is excused that does not happen: what has a reason of its own is degraded."""
    rows = list(case.rows())
    for row in rows:
        assert row.verdict in (WITHIN, DEGRADED), row
        assert row.measured.decisions > 0
        assert (row.reason != "") == (row.verdict == DEGRADED)
    degraded = {row.path for row in rows if row.verdict == DEGRADED}
    named = set(case.stated) - {""}
    if case.paths == PATHS:
        assert degraded == (set(PATHS) if "" in case.stated else named)
    else:
        assert {row.path for row in rows} == set(HAVE.get(case.name, of_one_view()))
        assert named <= degraded
        assert degraded or case.stated.get("", FEW) == FEW


@pytest.mark.parametrize("case", [c for c in CASES if isinstance(c, Refusal)], ids=lambda c: f"{c.name}, {c.text}")
def test_what_cannot_be_served_is_refused(case):
    (row,) = case.rows()
    assert row.verdict == REFUSED, row


def test_estimators_without_exact_values_are_listed():
    lacks = [case for case in CASES if isinstance(case, NotExact)]
    assert {"lf", *WHOLE, *(lack.path for lack in lacks)} == set(of_one_view())
    assert [row.verdict for lack in lacks for row in lack.rows()] == [NOT_EXACT] * len(lacks)


# The error analysis


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@given(st.sampled_from([operator.add, operator.sub, operator.mul, operator.truediv]), normal, normal)
def test_bounds_hold_for_two_operations(dtype, operation, a, b):
    """(a / 3 op b / 7): operands that are rounded themselves."""
    work = Arithmetic.of(dtype)
    result = operation(*(work.number(x) / work.number(y) for x, y in ((a, 3), (b, 7))))
    with np.errstate(all="ignore"):
        value = operation(*(dtype(x) / dtype(y) for x, y in ((a, 3), (b, 7))))
    if np.isfinite(result.error):
        assert abs(Fraction(float(value)) - result.value) <= Fraction(result.error)
    else:
        assert operation is operator.truediv
        assert b == 0


def mixed(a, b, c):
    """A formula of the words that errors go through: operators, a root, a power and three choices."""
    root = np.sqrt(abs(a / 3) + b * b)
    bent = select((root > c) | (a < 0), root - c, c / (2 + root))
    return larger(0, smaller(1, bent * smoothstep(smaller(1, larger(0, bent))))) + 1 / (1 + power_of(bent))


def power_of(x):
    return power(smaller(1, larger(0, x)), 1.5)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@given(near_one, near_one, near_one)
def test_bounds_hold_for_formulas_in_which_rounding_may_choose(dtype, a, b, c):
    a, b, c = map(dtype, (a, b, c))
    made = mixed(*map(Arithmetic.of(dtype).number, (a, b, c)))
    assert abs(Fraction(float(mixed(a, b, c))) - made.value) <= Fraction(made.error)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_bounds_are_small_unless_rounding_chooses(dtype):
    number = Arithmetic.of(dtype).number
    eps = np.finfo(dtype).eps
    assert mixed(*map(number, (2.0, 0.5, 0.25))).error < 16 * eps
    third = number(1) / number(3)  # as is the root
    assert mixed(third, number(0.0), third).error > 0.01


@given(near_one, near_one, near_one)
def test_exact_numbers_are_those_of_mpmath(a, b, c):
    with mpmath.workprec(400):
        x, y, z = map(mpmath.mpf, (a, b, c))
        root = mpmath.sqrt(abs(x / 3) + y * y)
        bent = root - z if root > z or x < 0 else z / (2 + root)
        held = min(mpmath.mpf(1), max(mpmath.mpf(0), bent))
        right = min(1, max(0, bent * held**2 * (3 - 2 * held))) + 1 / (1 + mpmath.power(held, 1.5))
        value = mixed(*map(Arithmetic().number, (a, b, c))).value
        assert abs(mpmath.mpf(value.numerator) / value.denominator - right) < mpmath.mpf(10) ** -55


def test_conditions_in_doubt_are_joined_as_in_three_valued_logic():
    doubt = Doubt(True, Arithmetic())
    true = np.True_
    false = np.False_
    assert (~doubt).holds is False
    assert [in_doubt(each) for each in (doubt & true, true & doubt, doubt | false, false | doubt)] == [True] * 4
    assert [each is np.False_ for each in (doubt & false, false & doubt)] == [True] * 2
    assert [each is np.True_ for each in (doubt | true, true | doubt)] == [True] * 2
    assert not (doubt & ~doubt).holds
    with pytest.raises(TypeError, match="branches"):
        bool(Doubt(True, Arithmetic.of("float32")))


def test_what_is_exact_has_no_error():
    work = Arithmetic.of(np.float32)
    one = work.number(1)
    third = work.number(Fraction(1, 3))
    assert third.error == pytest.approx(2.0**-24 / 3)
    assert (one - work.number(2.0**-24)).error == 0  # 24 digits
    assert (one - work.number(2.0**-25)).error == pytest.approx(2.0**-24)
    assert (work.number(2.0**100) * work.number(2.0**100)).error == np.inf
    assert not one < work.number(1)
    for off, expected in ((0, False), (2.0**-27, True), (-(2.0**-27), False)):
        below = third < Arithmetic().number(Fraction(1, 3) + Fraction(off))
        assert in_doubt(below)
        assert below.holds is expected
    assert third < Arithmetic().number(Fraction(1, 3) + Fraction(2.0**-25))


# The table notices


def loses_digits(slits, a, b, c):
    return slits.u_0 + a / slits.z_m / (1 - c / slits.z_m), slits.v_0 + b / (slits.z_o - c)


def a_billionth_off(projection, points, image):
    land(projection, points, image)
    image[:, 0] += 1e-9


def steeper(*given):
    """An estimator's formulas that add a thousandth more; its bits stay."""
    made = FORMULAS_OF(*given)
    own = type(made.estimator)

    class Wrong(own):
        def term(self, *here):
            return 1.001 * own.term(self, *here)

        def step(self, *here):
            added, after = own.step(self, *here)
            return 1.001 * added, after

        def leave(self, *here):
            return 1.001 * own.leave(self, *here)

    return replace(made, estimator=Wrong(*made.estimator))


def short_moments(depth, prefilter):
    made = moment_pyramid(depth, prefilter)
    return made._replace(numbers=made.numbers.astype(np.float32).astype(np.float64))


FORMULAS_OF = Formulas.of
CLOUD = scene(np.random.default_rng(1).uniform(-0.3, 0.3, (8, 8, 3)))
CURVED = along_rays(find_display("picoarray"), 0, 0.5)
CURVED = replace(CURVED, texels=CURVED.texels[:5])
WRONG = {
    "optics.kernels.projection.project_crossed_slits": (
        loses_digits, lambda: measure.measure(near(2.5, 18, 0), "float32"),
    ),
    "optics.kernels.projection.land": (a_billionth_off, lambda: measure.measure(CURVED, "float64")),
    "ao.ssao.algorithm2": (
        lambda *inputs: SimpleNamespace(texture=1 - algorithm2(*inputs).texture),
        lambda: measure.measure(CLOUD, "float64"),
    ),
    "bench.stability.scalar_cases.moment_pyramid": (short_moments, lambda: scalar_cases.spread(2.0**-8, "float64")),
    "ao.post.blur": (
        lambda texture, sigma: blur(texture, sigma) - texture.dtype.type(1e-5) * texture,
        lambda: scalar_cases.blurred(1.0, "float32"),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_function_breaks_a_row_nearly_everywhere(monkeypatch, name):
    wrong, measured = WRONG[name]
    assert measured().exceeded == 0
    monkeypatch.setattr(f"lfssao.{name}", wrong)
    found = measured()
    assert found.exceeded > 0.8 * found.decisions


@pytest.mark.parametrize("name", EXACT)
def test_a_wrong_formula_of_an_estimator_breaks_a_row(monkeypatch, name):
    monkeypatch.setattr(occlusions, "_TERMS", 128)
    textures = conditions.buffers_of("linear" if name in FILTERED else "perspective")
    radius = 8 * conditions.texel_size(textures)
    right = occlusions.compare(name, textures, radius, "float32")
    assert right.exceeded == right.undecided == 0
    assert right.bound < (1e-3 if name in FILTERED else 1e-5)  # theirs cancels
    monkeypatch.setattr(Formulas, "of", steeper)
    monkeypatch.setattr(levels.formulas, "obscured", lambda *given: 1.001 * obscured(*given))
    assert occlusions.compare(name, textures, radius, "float32").exceeded > 0  # where there is occlusion


@pytest.mark.parametrize(("texel", "off", "verdict"), [
    (0, np.nan, BROKEN), (0, 2.0, BROKEN), (slice(None), 2.0**-6, BROKEN), (0, 1.01 * 2.0**-8, DEGRADED),
    (0, 0.99 * 2.0**-8, WITHIN),
])  # fmt: skip
def test_an_estimator_wrong_in_float32_breaks_a_row(monkeypatch, texel, off, verdict):
    """One texel that is no number or above 1; all off by a 64th, which few flipped texels do not excuse."""
    (case,) = (case for case in CASES if case.name == "coplanar")
    case = replace(case, inputs=case.inputs[:1], paths=("vo-area", "hbao"))
    assert [row.verdict for row in case.rows()] == [WITHIN] * 2

    def wrong(name, buffers, *inputs, **parameters):
        found = estimate(name, buffers, *inputs, **parameters)
        if found.texture.dtype == np.float32 and name == "hbao":
            found.texture.reshape(-1)[texel] += np.float32(off)
        return found

    monkeypatch.setattr(conditions, "estimate", wrong)
    assert [row.verdict for row in case.rows()] == [WITHIN, verdict]
    limits = [Case("", "", [("", lambda _, bound=bound: Measured(0, 0, 0, bound, 0, 0, 0, 1))], {"": (np.inf, "")})
              for bound in (2.0**-8, 1.01 * 2.0**-8)]  # fmt: skip
    assert [row.verdict for limit in limits for row in limit.rows()] == [WITHIN] * 2 + [DEGRADED] * 2


# The command


def test_the_command_prints_what_is_degraded_and_writes_the_files(tmp_path, capsys, monkeypatch):
    kept = tuple(case for case in CASES if case.name in ("ordinary", "offset") or isinstance(case, Refusal))
    monkeypatch.setattr("lfssao.bench.stability.cases.CASES", kept)
    table = tmp_path / "a.json"
    picture = tmp_path / "a.png"
    assert main(["bench", "stability", "--json", str(table), "--plot", str(picture)]) == 0
    lines = capsys.readouterr().out.splitlines()
    rows = json.loads(table.read_text())["rows"]
    shown = {line.split("  ")[0] for line in lines[1:-1]}
    assert shown == {row["case"] for row in rows if row["verdict"] != WITHIN}
    verdict = lines[0].index("verdict")
    assert all(line[verdict:].startswith((DEGRADED, REFUSED)) for line in lines[1:-1])
    (degraded,) = (line for line in lines[:-1] if DEGRADED in line)
    assert "1e8 + 0.7 (worst of 3)" in degraded
    counts = f"7 within bound, 3 degraded as stated, 0 no exact value, {len(rows) - 10} refused, 0 broken"
    assert lines[-1] == f"{len(rows)} rows: {counts}"
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert main(["bench", "stability", "--all"]) == 0
    assert len(capsys.readouterr().out.splitlines()) == 2 + len(rows)
    broken = Refusal("x", "x" * 60, lambda: None, "")
    monkeypatch.setattr("lfssao.bench.stability.cases.CASES", (broken,))
    assert main(["bench", "stability"]) == 1
    head, line, _ = capsys.readouterr().out.splitlines()
    assert line[head.index("verdict") :].startswith(f"{BROKEN}: it was served")
    assert main(["bench", "stability", "--plot", "a.txt"]) == 2
    assert "--plot: a.txt does not end in" in capsys.readouterr().err
