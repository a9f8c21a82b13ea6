"""How much a verdict 'inside' means: widths and factors by other means, and when the verdict is a weak one."""

import json
from dataclasses import replace
from functools import partial
from statistics import median
from xml.etree import ElementTree

import numpy as np
import pytest
from compare_folders import changed, compare, different, poke, remade, rendered, single

import lfssao
from lfssao.verify.bounds.bounds import Bounds
from lfssao.verify.bounds.error_model import MODELS
from lfssao.verify.bounds.stored import TextureFormat
from lfssao.verify.case import IMAGES, VIEW, Case
from lfssao.verify.compare.power import Power, power_of
from lfssao.verify.compare.result import Tolerance
from lfssao.verify.kit.folder import read_case
from lfssao.verify.verdict import Verdict

TRIED = [0.999, 0.998, 0.995, 0.99, 0.98, 0.95, 0.9, 0.8, 0.7, 0.6, 0.5]  # as the help has them
SIZE = 9, 13


@pytest.fixture
def random():
    return np.random.default_rng(5)


@pytest.fixture
def depth(random):
    """A third of the texels see no surface."""
    return np.where(random.random(SIZE) < 1 / 3, np.inf, 1).astype(np.float32)


@pytest.fixture
def ao(random, depth):
    return np.where(depth < np.inf, random.uniform(0.1, 1, SIZE), 0).astype(np.float32)


def found(depth, own, bounds, stored=None, tolerance=Tolerance(), stage=VIEW, right=None, name="ao_1", **more):  # noqa: B008
    """The power of a texture of a view, by default the reference's own."""
    right = own if right is None else right
    case = Case("module_000", stage, "", {"guard": 0}, {}, {"depth": depth, name: right, **more})
    assert not bounds.outside(own).any()
    fails = partial(tolerance.fails, bounds, tuple(np.moveaxis(right.reshape(*SIZE, -1), -1, 0)))
    return power_of(name, {name: own}, case, bounds, stored, fails)


@pytest.mark.parametrize("least", [0.9995, 0.9985, 0.991, 0.97, 0.951, 0.949, 0.75, 0.51, 0.3])
def test_the_factor_is_the_first_that_leaves_an_interval_and_the_width_is_of_surfaces(random, depth, ao, least):
    """Each lower end is ``least`` of the texel's AO or less, one of them is just that."""
    share = np.where(ao == ao.max(), least, random.uniform(0, least, SIZE))
    lower = (ao * share).astype(np.float32)
    upper = (ao + random.uniform(0, 1, SIZE)).astype(np.float32)
    power = found(depth, ao, Bounds(lower, np.where(depth < np.inf, upper, 1e9).astype(np.float32)))
    assert power.factor == next((factor for factor in TRIED if factor < least), None)
    assert power.weak == (least < 0.95)
    seen = [(j, i) for j in range(SIZE[0]) for i in range(SIZE[1]) if depth[j, i] == 1]
    assert power.width == pytest.approx(median(float(upper[place]) - float(lower[place]) for place in seen))
    assert power.share == 1
    words = "even AO x 0.5 would pass" if least < 0.5 else f"AO x {power.factor} would be outside"
    assert str(power) == f"median width {power.width:.3g}; {words}"


def test_texels_that_may_stray_find_nothing(depth, ao):
    """Three texels have a point for an interval, all others what 0.8 x AO leaves and 0.7 does not."""
    places = np.argwhere(depth == 1)[:3].T
    lower = ao * np.float32(0.75)
    lower[tuple(places)] = ao[tuple(places)]
    powers = [found(depth, ao, Bounds(lower, ao, outliers=n)) for n in (2, 3)]
    assert [(power.factor, power.weak) for power in powers] == [(0.999, False), (0.7, True)]


def test_tolerances_hide_an_error_of_ao_and_make_no_verdict_weak(depth, ao):
    """A texel differs by (1 - factor) AO from the reference, which is mine here."""
    points = Bounds(ao, ao)
    for fail in (0.0015, 0.015, 0.3, 1):
        power = found(depth, ao, points, tolerance=Tolerance(fail))
        assert power.factor == next((factor for factor in TRIED if (1 - factor) * ao.max() > fail), None)
        assert not power.weak
    part = 100 * (depth == 1).mean()  # AO is wrong wherever there is a surface
    assert found(depth, ao, points, tolerance=Tolerance(0, part - 0.1)).factor == 0.999
    assert found(depth, ao, points, tolerance=Tolerance(0, part + 0.1)).factor is None


@pytest.mark.parametrize("visibility", [False, True])
@pytest.mark.parametrize("most", [255, 120, 60, 40, 13, 4])
def test_a_factor_has_to_change_a_code(random, depth, most, visibility):
    """Codes 0 to ``most`` of 8 bits: the largest is the first that a factor changes."""
    codes = np.where(depth < np.inf, random.integers(0, most + 1, SIZE), 0).astype(np.uint8)
    codes[tuple(np.argwhere(depth == 1)[0])] = most
    stored = TextureFormat("unorm8", visibility)
    ao = stored.read(255 - codes if visibility else codes)
    bounds = stored.bounds(Bounds(ao, ao), MODELS["strict"])
    changing = [factor for factor in TRIED if most * (1 - factor) > 0.5]
    assert found(depth, ao, bounds, stored).factor == (changing[0] if changing else None)


@pytest.mark.parametrize("format", ["float", "srgb8"])
def test_ao_times_a_factor_is_shaded_again(random, depth, ao, format):
    """The interval of a white image ends at 1 - 0.97 AO, which is brighter; a step of sRGB is coarser."""
    color = np.where(depth < np.inf, 1.0, 0.0).astype(np.float32)[..., None] * np.ones(3, np.float32)
    lower, upper = ((color * (1 - np.float32(factor) * ao)[..., None]).astype(np.float32) for factor in (1, 0.97))
    stored = None
    own = lower
    if format == "srgb8":
        stored = TextureFormat("srgb8")
        ends = stored.bounds(Bounds(lower, upper), MODELS["strict"])
        lower = ends.lower
        upper = ends.upper
        own = ends.lower
    power = found(depth, own, Bounds(lower, upper), stored, name="shaded", blurred=ao, color=color)
    assert power.factor == 0.95
    assert not power.weak
    wide = found(depth, own, Bounds(0 * lower, 0 * lower + 1), stored, name="shaded", blurred=ao, color=color)
    assert (wide.factor, wide.width, wide.weak) == (None, 1, True)
    dark = found(depth, 0 * own, Bounds(0 * lower, 0 * lower + 1), name="shaded", blurred=ao, color=color * 0.04)
    assert (dark.share, dark.weak) == (0, False)  # AO takes nothing that is worth the word from it
    alone = found(depth, own, Bounds(lower, upper), stored, name="shaded", color=color)
    assert str(alone) == f"median width {alone.width:.3g}"  # no AO is known


def test_a_texture_without_ao_to_speak_of_is_never_inside_weakly(depth):
    """A hundredth of the surface has to have AO of more than 0.05, in mine or in the reference."""
    any_value = Bounds(np.zeros(SIZE, np.float32), np.ones(SIZE, np.float32))
    depth = np.ones_like(depth)  # 117 texels
    dark = np.zeros(SIZE, np.float32)
    faint = np.full(SIZE, 0.04, np.float32)
    dark[0, :2] = 0.06
    for own, right, weak in ((dark, dark, True), (faint, faint, False), (0 * dark, dark, True), (dark, 0 * dark, True)):
        power = found(depth, own, any_value, right=right)
        assert (power.factor, power.weak) == (None, weak)
        assert str(power).endswith("even AO x 0.5 would pass" if weak else "there is hardly any AO")
    dark[0, 1] = 0.04
    assert not found(depth, dark, any_value).weak
    dark[0, 1] = 0.06
    assert not found(depth, dark, any_value, stage=IMAGES).weak  # as cases of a kit are not


def test_depth_and_colour_have_a_width_alone(depth):
    for name in ("depth", "color"):
        power = found(depth, depth, Bounds(depth - np.float32(0.25), depth + np.float32(0.5)), name=name)
        assert (power.width, power.factor, power.share, str(power)) == (0.75, None, None, "median width 0.75")


# Whole comparisons


@pytest.fixture(scope="module")
def tiny(tmp_path_factory):
    """Samples as near as 1e-9: rounding decides them all, and any AO is inside."""
    return rendered(tmp_path_factory.mktemp("tiny") / "reference", "--radii", "1e-9")


@pytest.fixture(scope="module")
def weak(tmp_path_factory, tiny):
    """Modules with AO made of noise."""
    mine = tiny
    random = np.random.default_rng(2)
    for module in ("module_003", "module_004"):
        seen = np.isfinite(single(tiny, module, "depth"))
        noise = np.where(seen, random.integers(0, 7, seen.shape) / 6, 0).astype(np.float32)
        mine = changed(mine, tmp_path_factory.mktemp("weak") / module, module, remade("ao_1", lambda _, n=noise: n))
    return mine


def test_any_ao_within_intervals_of_0_to_1_is_inside_weakly(tmp_path, capsys, tiny, weak):
    files = [tmp_path / name for name in ("a.json", "a.xml", "a.html", "a.png")]
    options = zip(("--json", "--junit", "--html", "--picture"), files, strict=True)
    assert compare(weak, tiny, *(word for pair in options for word in pair)) == 1
    lines = capsys.readouterr().out.splitlines()
    assert [line for line in lines if "even" in line] == [
        "module_003, ao_1: inside, weakly; median width 1; even AO x 0.5 would pass (the weakest of 2)"
    ]
    told = "ao_1 of 2 modules is inside, weakly: AO x 0.95 would be inside as well (module_003, module_004)"
    assert [line for line in lines if line.startswith("warning")] == [f"warning: {told}"]
    assert lines[-1] == "passes, with warnings (exit code 1)"
    made = json.loads(files[0].read_text())
    assert (made["format"], made["exit_code"], made["first_failure"]) == (3, 1, None)
    (one, other) = (result for result in made["results"] if result["verdict"] == "inside, weakly")
    assert (one["exit_code"], one["power"]["factor"], one["power"]["weak"]) == (1, None, True)
    assert one["power"]["width"] == pytest.approx(1, abs=1e-5)
    assert other["module"] == "module_004"
    suites = ElementTree.parse(files[1]).getroot()
    assert [said.text.partition(", ")[2][:6] for said in suites.iter("system-out")] == ["weakly", "weakly"]
    page = files[2].read_text()
    assert f"<li>{told}</li>" in page
    assert page.count('class="weak"') == 4  # a cell and a head each
    assert page.count("; even AO x 0.5 would pass.</p>") == 2
    report = lfssao.compare(weak, tiny)
    assert set(different(report).values()) == {Verdict.INSIDE_WEAKLY}
    cells = dict(zip(*(report.summary()[k] for k in (0, 4)), strict=True))
    assert (cells["stage"], cells["inside"], cells["weakly"]) == ("ao_1", "0", "2")
    assert "inside, weakly" in report._repr_html_()
    assert compare(weak, tiny, "--exact") == 2


def test_all_that_is_inside_says_how_much_that_means(tmp_path, reference):
    """A line a stage of the module that has least; AO an ulp off is inside, and 0.999 of it is not."""

    def below(pixels):
        return np.where((pixels > 0) & (pixels < np.inf), np.nextafter(pixels, np.float32(0)), pixels)

    mine = reference
    for module in ("module_003", "module_005"):
        for layer in ("color", "ao_2", "blurred"):
            mine = changed(mine, tmp_path / f"{module}{layer}", module, remade(layer, below))
    report = lfssao.compare(mine, reference)
    assert report.exit_code == 0
    assert "weakly" not in report.summary()[0]
    lines = [line.partition("; ")[::2] for line in str(report).splitlines() if "median width" in line]
    assert [head.split(", ")[1] for head, _ in lines] == ["color: inside", "ao_2: inside", "blurred: inside"]
    assert all(tail.endswith(" (the weakest of 2)") for _, tail in lines)
    assert [" AO x 0.999 would be outside " in tail for _, tail in lines] == [False, True, True]
    powers = {(r.module, r.layer): r.power for r in report.results}
    assert {key for key, power in powers.items() if power} == set(different(report))
    assert str(powers["module_003", "ao_2"]) in next(r.sentence for r in report.results if r.layer == "ao_2")


def test_the_weakest_module_could_be_farthest_off_and_then_has_the_widest_intervals(tiny, weak):
    report = lfssao.compare(weak, tiny)
    one = next(result for result in report.results if result.verdict is Verdict.INSIDE_WEAKLY)
    powers = Power(9.0, 0.999, 1.0), Power(0.1, None, 1.0), Power(0.2, None, 1.0), Power(0.5, 0.9, 1.0)
    results = [replace(one, module=f"module_{k:03d}", power=power) for k, power in enumerate(powers)]
    (line,) = (line for line in str(replace(report, results=tuple(results))).splitlines() if "median" in line)
    assert line.startswith("module_002, ao_1: inside, weakly; median width 0.2; even AO x 0.5 would pass (")
    assert line.endswith("(the weakest of 4)")


def test_a_wrong_texture_has_no_power(tmp_path, reference):
    mine = changed(reference, tmp_path / "mine", "module_004", poke("ao_2", (16, 24), 0.7))
    for options, verdict in (({}, Verdict.OUTSIDE), ({"fail": 1}, Verdict.WITHIN)):
        report = lfssao.compare(mine, reference, diagnosis=False, **options)
        assert different(report) == {("module_004", "ao_2"): verdict}
        assert {result.power for result in report.results} == {None}


def test_cases_of_a_kit_have_the_numbers_and_no_weak_verdict(tmp_path, small_kit):
    case = read_case(small_kit / "cases" / "algorithm2_conical")
    name = next(iter(case.outputs))
    bounds = case.bounds[name]
    np.save(tmp_path / f"{case.name}_{name}.npy", bounds.upper)
    (result,) = (r for r in lfssao.compare(tmp_path, small_kit, cases=[case.name]).results if r.layer == name)
    assert (result.verdict, result.power.weak) == (Verdict.INSIDE, False)
    seen = np.isfinite(case.inputs["depth"])
    assert result.power.width == pytest.approx(np.median((bounds.upper - bounds.lower)[seen]))
