"""Stiff and extreme cases: every row of the table, and that the table would notice."""

import json
import operator
from dataclasses import replace
from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reference import textbook

from lfssao.ao.estimators.registry import ESTIMATORS, estimate
from lfssao.ao.moments import moment_pyramid
from lfssao.ao.post import blur
from lfssao.ao.ssao import algorithm2
from lfssao.bench.stability import conditions, measure, scalar_cases
from lfssao.bench.stability.cases import CASES
from lfssao.bench.stability.conditions import FEW
from lfssao.bench.stability.exact import CrossedSlits, GeneralDisplay
from lfssao.bench.stability.inputs import UNCHANGED, along_rays, display, near, scene
from lfssao.bench.stability.measure import PATHS, Measured
from lfssao.bench.stability.running_error import EXACT, Arithmetic
from lfssao.bench.stability.table import BROKEN, DEGRADED, REFUSED, WITHIN, Case, Refusal
from lfssao.cli.main import main
from lfssao.optics.display_file import find_display
from lfssao.optics.kernels.projection import land

HAVE = {"epsilon": ("alchemy", "sao", "sao-equation-1"), "passes": ("sao", "sao-equation-1")}
LONG = ("near the lens", "near the observers", "blur")
MEASURED = [
    pytest.param(case, id=case.name, marks=pytest.mark.slow if case.name in LONG else ())
    for case in CASES
    if isinstance(case, Case)
]
number = st.floats(-1e6, 1e6, width=32)
normal = st.one_of(st.just(0.0), number.filter(lambda x: abs(x) > 1e-6))


@pytest.mark.parametrize("case", MEASURED)
def test_every_row_is_what_its_case_states(case):
    """Nothing is excused that does not happen: what has a reason of its own is degraded."""
    rows = list(case.rows())
    for row in rows:
        assert row.verdict in (WITHIN, DEGRADED), row
        assert row.measured.decisions > 0
        assert (row.reason != "") == (row.verdict == DEGRADED)
    degraded, named = {row.path for row in rows if row.verdict == DEGRADED}, set(case.stated) - {""}
    if case.paths == PATHS:
        assert degraded == (set(PATHS) if "" in case.stated else named)
    else:
        assert {row.path for row in rows} == set(HAVE.get(case.name, ESTIMATORS))
        assert named <= degraded
        assert degraded or case.stated[""] == FEW


@pytest.mark.parametrize("case", [c for c in CASES if isinstance(c, Refusal)], ids=lambda c: f"{c.name}, {c.text}")
def test_what_cannot_be_served_is_refused(case):
    (row,) = case.rows()
    assert row.verdict == REFUSED, row


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


def test_what_is_exact_has_no_error():
    work = Arithmetic.of(np.float32)
    one, third = work.number(1), work.number(Fraction(1, 3))
    assert third.error == pytest.approx(2.0**-24 / 3)
    assert (one - work.number(2.0**-24)).error == 0  # 24 digits
    assert (one - work.number(2.0**-25)).error == pytest.approx(2.0**-24)
    assert (work.number(2.0**100) * work.number(2.0**100)).error == np.inf
    assert one.is_less(one) is False
    assert third.is_less(EXACT.number(Fraction(1, 3))) is None


# The table notices


def loses_digits(slits, a, b, c):
    return slits.u_0 + a / slits.z_m / (1 - c / slits.z_m), slits.v_0 + b / (slits.z_o - c)


def a_billionth_off(projection, points, image):
    land(projection, points, image)
    image[:, 0] += 1e-9


def short_moments(depth, prefilter):
    made = moment_pyramid(depth, prefilter)
    return made._replace(numbers=made.numbers.astype(np.float32).astype(np.float64))


CLOUD = scene(np.random.default_rng(1).uniform(-0.3, 0.3, (8, 8, 3)))
CURVED = along_rays(find_display("picoarray"), 0, 0.5)
CURVED = replace(CURVED, texels=CURVED.texels[:5])
WRONG = {
    "optics.kernels.projection.project_crossed_slits": (
        SimpleNamespace(py_func=loses_digits), lambda: measure.measure(near(2.5, 18, 0), "float32"),
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
    table, picture = tmp_path / "a.json", tmp_path / "a.png"
    assert main(["bench", "stability", "--json", str(table), "--plot", str(picture)]) == 0
    lines = capsys.readouterr().out.splitlines()
    rows = json.loads(table.read_text())["rows"]
    shown = {line.split("  ")[0] for line in lines[1:-1]}
    assert shown == {row["case"] for row in rows if row["verdict"] != WITHIN}
    verdict = lines[0].index("verdict")
    assert all(line[verdict:].startswith((DEGRADED, REFUSED)) for line in lines[1:-1])
    (degraded,) = (line for line in lines[:-1] if DEGRADED in line)
    assert "1e8 + 0.7 (worst of 3)" in degraded
    assert lines[-1] == f"{len(rows)} rows: 7 within bound, 3 degraded as stated, {len(rows) - 10} refused, 0 broken"
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


# Exact values


def exact_image(mapping, point):
    """U, v and z of a point; None outside the domain."""
    *image, in_domain = mapping.steps(EXACT)(point, np.zeros(3))
    return [float(number.value) for number in image] if in_domain else None


@pytest.mark.parametrize("kind", ["convex", "picoarray", "linear", "conical"])
def test_exact_images_are_those_of_the_textbook(kind):
    """With and without distortion of the lens, of points between observers and lens; outside there is no image."""
    given = replace(display(), diffuser=kind) if kind in ("linear", "conical") else find_display(kind)
    distorted = replace(given, modules=(replace(given.modules[0], k1=-0.05, k2=0.01),))
    mappings = [GeneralDisplay(distorted), *([CrossedSlits(given, UNCHANGED)] if kind == "linear" else [])]
    for mapping in mappings:
        d, (low, high) = mapping.display.module_numbers(0), np.array(given.roi)
        points = np.random.default_rng(3).uniform(low, high, (20, 3))
        exact = [exact_image(mapping, point) for point in points]
        seen = [(image, point) for image, point in zip(exact, points, strict=True) if image is not None]
        assert len(seen) >= 10
        for image, point in seen:
            right = textbook.image(d[:3], d[3:5], tuple(d[5:7]), d[7] != 0, d[8:17], d[17:22], point)
            assert image[:2] == pytest.approx(right, abs=1e-9)
        for beyond in (given.modules[0].z + 0.1, given.observer_z - 0.1):
            assert exact_image(mapping, (0.0, 0.0, beyond)) is None
