"""``lfssao compare`` of renders that ask other modules: right ones conform, planted faults do not and are named."""

import shutil
from dataclasses import replace

import numpy as np
import pytest
from compare_folders import changed, different, remade, without_scene
from jobs import edit, manifest_of, render

import lfssao
from lfssao.files.exr import read_exr, write_exr
from lfssao.rendering.manifest import view_of
from lfssao.verify.diagnosis.buffers import padded_buffers
from lfssao.verify.verdict import Verdict

WORDS = ["statue", "--display", "sample-a", "--modules", "8:12", "--resolution", "96x60", "--radii", "0.3",
         "--neighbours", "2", "--layers", "depth,positions,ao"]  # fmt: skip
MODULE = "module_010"  # asks 9 and 11, which are rendered; 8 and 11 ask 7 and 12, which are not

SAMPLES = lfssao.make_samples("latin", 8)


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    return render(tmp_path_factory.mktemp("neighbours") / "reference", *WORDS)


def entry_of(folder, module):
    return next(entry for entry in manifest_of(folder)["views"] if entry["name"] == module)


def buffers_of(folder, module):
    """A module's textures, depth of the modules that it asks from the files of a folder too."""
    entry = entry_of(folder, module)
    parts = read_exr(folder / f"{module}.exr")
    others = []
    for other in entry["neighbours"]:
        depth = read_exr(folder / f"{other['name']}.exr")["depth"].pixels[..., 0]
        others.append((view_of("", other["view"]).world_to_image, depth))
    depth = parts["depth"].pixels[..., 0]
    positions = parts["positions"].pixels
    return lfssao.Buffers(view_of(module, entry["view"]), depth, positions, neighbours=others)


def occlusion(seen, radius=0.3):
    return lfssao.estimate("lf-neighbours", seen, radius, SAMPLES).texture[..., None]


def without(seen, module):
    """Module 10's textures without those of a module that it asks."""
    names = ["module_009", "module_011"]  # the lower one of equally near modules first
    return replace(seen, neighbours=[seen.neighbours[k] for k, name in enumerate(names) if name != module])


@np.errstate(all="ignore")
def by_hand(seen, joined):
    """Occlusion in float64: hidden are samples behind the surface in all modules' textures, or in any."""
    points = seen.positions[:, :, None].astype(np.float64) + 0.3 * SAMPLES
    hidden, shown = (np.zeros(points.shape[:3], bool) for _ in range(2))
    for mapping, depth in [(seen.view.world_to_image, seen.depth), *seen.neighbours]:
        u, v, z = np.moveaxis(mapping(points), -1, 0)
        inside = (u >= 0) & (u < depth.shape[1]) & (v >= 0) & (v < depth.shape[0])
        i, j = (np.where(inside, np.floor(c), 0).astype(int) for c in (u, v))
        hidden |= inside & (depth[j, i] < z)
        shown |= inside & ~(depth[j, i] < z)
    found = hidden & ~shown if joined == "and" else hidden
    made = np.where(np.isfinite(seen.depth), found.mean(axis=-1), 0)
    return made.astype(np.float32)[..., None]


def with_ao(reference, target, make):
    """A copy in which a module's occlusion is what is made of its textures."""
    seen = buffers_of(reference, MODULE)
    return changed(reference, target, MODULE, remade("ao_1", lambda _: make(seen)))


def with_other_depth(reference, target, shown):
    """A copy in which the occlusion of a module is made of other depth of those that it asks, ``shown`` or not."""
    rng = np.random.default_rng(5)
    others = {}
    for module in ("module_009", "module_011"):
        parts = read_exr(reference / f"{module}.exr")
        off = rng.normal(0, 0.02, parts["depth"].pixels.shape).astype(np.float32)
        others[module] = {**parts, "depth": replace(parts["depth"], pixels=parts["depth"].pixels + off)}
    seen = buffers_of(reference, MODULE)
    asked = [entry["name"] for entry in entry_of(reference, MODULE)["neighbours"]]
    depths = [others[module]["depth"].pixels[..., 0] for module in asked]
    neighbours = [(mapping, depth) for (mapping, _), depth in zip(seen.neighbours, depths, strict=True)]
    texture = occlusion(replace(seen, neighbours=neighbours))
    changed(reference, target, MODULE, remade("ao_1", lambda _: texture))
    for module, parts in others.items() if shown else ():
        write_exr(target / f"{module}.exr", list(parts.values()))
    return target


def test_a_right_render_conforms_bit_by_bit_and_with_rounding(reference, tmp_path):
    assert lfssao.compare(reference, reference).exit_code == 0
    with_rounding = with_ao(reference, tmp_path / "mine", lambda seen: np.nextafter(occlusion(seen), np.float32(0)))
    report = lfssao.compare(with_rounding, reference)
    assert different(report) == {(MODULE, "ao_1"): Verdict.INSIDE}
    assert report.exit_code == 0
    doubled = with_ao(reference, tmp_path / "doubled", lambda seen: by_hand(seen, "and"))
    assert lfssao.compare(doubled, reference).exit_code == 0


@pytest.mark.parametrize("fault", ["one neighbour missing", "no neighbours", "or"])
def test_planted_faults_are_outside(reference, tmp_path, fault):
    make = {
        "one neighbour missing": lambda seen: occlusion(replace(seen, neighbours=seen.neighbours[:1])),
        "no neighbours": lambda seen: occlusion(replace(seen, neighbours=[])),
        "or": lambda seen: by_hand(seen, "or"),
    }[fault]
    report = lfssao.compare(with_ao(reference, tmp_path / "mine", make), reference, diagnosis=False)
    assert different(report) == {(MODULE, "ao_1"): Verdict.OUTSIDE}
    assert report.exit_code == 2


@pytest.mark.parametrize("shown", [True, False])
def test_occlusion_is_judged_on_the_renderers_own_depth_of_the_modules_that_are_asked(reference, tmp_path, shown):
    """Others stand in only where it has none, which is said."""
    mine = with_other_depth(reference, tmp_path / "mine", shown)
    report = lfssao.compare(mine, reference, layers=["ao_1"], diagnosis=False)
    expected = {(MODULE, "ao_1"): Verdict.INSIDE if shown else Verdict.OUTSIDE}
    assert {key: verdict for key, verdict in different(report).items() if key[0] == MODULE} == expected
    assert not [note for note in report.notes if "whose depth" in note]


def without_depth(folder):
    for file in folder.glob("*.exr"):
        parts = read_exr(file)
        write_exr(file, [part for name, part in parts.items() if name == "ao_1"])
    return folder


def test_the_references_depth_stands_in_and_that_is_said(reference, tmp_path):
    mine = without_depth(with_other_depth(reference, tmp_path / "mine", False))
    report = lfssao.compare(mine, reference, layers=["ao_1"], diagnosis=False)
    assert different(report) == {(MODULE, "ao_1"): Verdict.OUTSIDE}
    (note,) = [note for note in report.notes if "whose depth" in note]
    assert note.startswith(f"{MODULE}: it asks module_009, module_011, whose depth is the reference's")


def test_depth_of_a_module_that_was_not_rendered_is_cast_from_the_mesh(reference, tmp_path):
    def rounded(parts):
        ao = np.nextafter(parts["ao_1"].pixels, np.float32(0))
        parts["ao_1"] = replace(parts["ao_1"], pixels=np.where(ao > 0, ao, 0))

    mine = changed(reference, tmp_path / "mine", "module_011", rounded)
    assert different(lfssao.compare(mine, reference)) == {("module_011", "ao_1"): Verdict.INSIDE}
    unknown = without_scene(reference, tmp_path / "unknown")
    report = lfssao.compare(mine, unknown)
    assert different(report) == {("module_011", "ao_1"): Verdict.DIFFERENT}
    assert "no interval of occlusion is known: it asks module_012, whose depth --mesh FILE would give" in str(report)


def test_a_manifest_that_does_not_say_which_modules_are_asked_gives_no_interval(reference, tmp_path):
    mine = with_ao(reference, tmp_path / "mine", lambda seen: np.nextafter(occlusion(seen), np.float32(0)))
    old = shutil.copytree(reference, tmp_path / "old")
    views = [{key: value for key, value in entry.items() if key != "neighbours"} for entry in manifest_of(old)["views"]]
    edit(old, "views", value=views)
    edit(old, "settings", "estimator", value="lf")  # as it was when that was an option of lf
    report = lfssao.compare(mine, old)
    assert different(report) == {(MODULE, "ao_1"): Verdict.DIFFERENT}
    assert "the manifest does not say which modules it asks" in str(report)


@pytest.mark.parametrize(("kind", "values", "make"), [
    ("radius", (1.07,), lambda seen: occlusion(seen, 0.3 * 1.07)),
    ("module_011 is not asked", (), lambda seen: occlusion(without(seen, "module_011"))),
    ("no other module is asked", (), lambda seen: occlusion(replace(seen, neighbours=[]))),
])  # fmt: skip
def test_a_planted_change_is_named(reference, tmp_path, kind, values, make):
    mine = with_ao(reference, tmp_path / "mine", make)
    (result,) = [r for r in lfssao.compare(mine, reference, layers=["ao_1"]).results if r.module == MODULE]
    best = result.diagnosis.candidates[0]
    assert (best.kind, result.diagnosis.fits) == (kind, True)
    assert best.values == pytest.approx(values, rel=0.01)


def test_a_rule_of_the_border_is_of_the_modules_own_texture_alone(reference):
    seen = buffers_of(reference, MODULE)
    larger = padded_buffers(seen, 3, "clamp")
    assert larger.depth.shape == (66, 102)
    assert larger.neighbours is seen.neighbours
