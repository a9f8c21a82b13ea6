"""Textures of fewer bits, and of visibility, in ``lfssao compare``: right ones conform, one step more does not."""

from dataclasses import replace

import jobs
import numpy as np
import oracle_scenes as oracle
import pytest
import random_renderer as rr
from compare_folders import compare, copied, different, rendered, single, write_image

import lfssao
from lfssao import Camera, builtin_scene, module_views
from lfssao.ao.post import blur_weights
from lfssao.ao.ssao import algorithm1, algorithm2
from lfssao.files.exr import Part, read_exr, write_exr
from lfssao.optics.view import KINDS, WorldToImage
from lfssao.samples import texel_turns
from lfssao.verify.bounds.bounds import Bounds, exact_bounds
from lfssao.verify.bounds.error_model import MODELS
from lfssao.verify.bounds.stored import TextureFormat
from lfssao.verify.case import VIEW, Case
from lfssao.verify.judge import judge
from lfssao.verify.verdict import Verdict

AO = ("ao_1", "ao_2", "merged", "blurred")
CODES = {"unorm8": (255, np.uint8), "unorm16": (65535, np.uint16), "srgb8": (255, np.uint8)}


def encode(values, kind):
    """The codes that a renderer writes into a texture of a format."""
    if kind == "half":
        return values.astype(np.float16)
    values = np.clip(values.astype(np.float64), 0, 1)
    if kind == "srgb8":
        values = np.where(values <= 0.0031308, 12.92 * values, 1.055 * values ** (1 / 2.4) - 0.055)
    return np.floor(values * CODES[kind][0] + 0.5).astype(CODES[kind][1])


def decode(codes, kind, before=None):
    """The values that a texture unit reads of it."""
    values = codes.astype(np.float64) if kind == "half" else codes / CODES[kind][0]
    if kind == "srgb8":
        values = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
    return values.astype(np.float32)


def render(source, target, module, kinds, alter=lambda layer, codes: codes, ending="npy", read=decode):
    """A renderer's folder, a module of which has layers stored in some formats, each made of what is read before it.

    ``alter`` changes what is stored before it is written and read; ``read`` makes of codes, kind and the texture before
    storing what the next layers are made of.
    """
    (copied(source, target) / f"{module}.exr").unlink()
    manifest = jobs.manifest_of(source)
    entry = next(entry["view"] for entry in manifest["views"] if entry["name"] == module)
    mapping = WorldToImage(KINDS.index(entry["world_to_image_kind"]), np.array(entry["world_to_image"]))
    samples = np.array(manifest["settings"]["samples"])
    radii = manifest["settings"]["radii"]
    guard = entry["guard"]
    back = entry["screen_to_world"]
    made = {}
    how = manifest["settings"]["rotation"], entry["height"], entry["width"], manifest["settings"]["rotation_seed"]
    turns = texel_turns(*how, np.dtype(np.float32))

    def store(layer, texture):
        codes = alter(layer, encode(texture, kinds[layer]) if layer in kinds else texture)
        made[layer] = read(codes, kinds[layer], texture) if layer in kinds else codes
        if layer == "depth" and kinds.get(layer) == "unorm16":
            made[layer] = np.where(codes == 65535, np.float32(np.inf), made[layer])
        cut = 0 if layer in ("depth", "positions", "color") else guard
        shown = codes[cut : len(codes) - cut, cut : codes.shape[1] - cut]
        if ending == "png" and layer in kinds:
            write_image(target / f"{module}_{layer}.png", shown.reshape(*shown.shape[:2], -1), shown.dtype.name)
        else:
            np.save(target / f"{module}_{layer}.npy", shown)

    for layer in ("depth", "color"):
        store(layer, np.squeeze(single(source, module, layer)))
    positions = single(source, module, "positions")
    store("positions", np.where(np.isfinite(positions), np.nextafter(positions, np.float32(9)), positions))
    for number, radius in enumerate(radii, start=1):
        if back is None:
            ao = algorithm2(made["depth"], made["positions"], mapping, samples, radius, turns)
        else:
            ao = algorithm1(made["depth"], np.array(back), mapping.numbers.reshape(4, 4), samples, radius, turns)
        store(f"ao_{number}", ao.texture)
    store("merged", lfssao.merge([made[f"ao_{k + 1}"] for k in range(len(radii))]))
    store("blurred", lfssao.blur(made["merged"], manifest["settings"]["blur_sigma"]))
    store("shaded", lfssao.shade(made["color"], made["blurred"]))
    return target


@pytest.fixture(scope="module")
def guarded(tmp_path_factory):
    return rendered(tmp_path_factory.mktemp("guarded") / "reference", "--guard", "3")


def of_registers(codes, kind, before):
    return before


def cut_down(codes, kind, before):
    """The number of the format below: neither the one that is stored nor the one before."""
    if kind == "half":
        near = before.astype(np.float16)
        return np.where(near > before, np.nextafter(near, np.float16(0)), near).astype(np.float32)
    return decode(np.floor(before.astype(np.float64) * CODES[kind][0]).astype(CODES[kind][1]), kind)


@pytest.mark.parametrize("folder", ["reference", "guarded"])
@pytest.mark.parametrize(("kinds", "said", "ending"), [
    (dict.fromkeys((*AO, "depth", "color", "shaded"), "half"), {}, "npy"),
    (dict.fromkeys((*AO, "color", "shaded"), "unorm8"), {"color": "unorm8", "shaded": "unorm8"}, "png"),
    ({**dict.fromkeys(AO, "unorm8"), "color": "srgb8", "shaded": "srgb8"}, {}, "png"),
    (dict.fromkeys((*AO, "color", "shaded"), "unorm16"), {}, "png"),
], ids=["half", "unorm8", "srgb8", "unorm16"])  # fmt: skip
def test_a_renderer_that_stores_fewer_bits_conforms(tmp_path, request, folder, kinds, said, ending):
    source = request.getfixturevalue(folder)
    mine = render(source, tmp_path / "mine", "module_004", kinds, ending=ending)
    report = lfssao.compare(mine, source, stored=said)
    assert report.exit_code == 0
    own = {r.layer: r for r in report.results if r.module == "module_004"}
    assert {name: r.stored for name, r in own.items() if r.stored} == {n: f"stored as {k}" for n, k in kinds.items()}
    assert own["merged"].verdict is own["shaded"].verdict is Verdict.INSIDE
    assert all(f"{name}: stored as {kind}; its interval is wider" in str(report) for name, kind in kinds.items())
    assert lfssao.compare(mine, source, stored=said, exact=True).exit_code == 2


@pytest.mark.parametrize("kind", ["float", "srgb8"])
def test_a_colour_that_differs_where_there_is_a_guard_band(tmp_path, guarded, kind):
    """Color has the band and shaded has not: each is judged, diagnosed and drawn in its own size."""
    redder = lambda layer, codes: np.roll(codes, 1, 2) if layer in ("color", "shaded") else codes  # noqa: E731
    kinds = {} if kind == "float" else {"color": kind, "shaded": kind}
    mine = render(guarded, tmp_path / "mine", "module_004", kinds, redder)
    words = "--html", tmp_path / "a.html", "--json", tmp_path / "a.json", "--picture", tmp_path / "a.png"
    assert compare(mine, guarded, *words) == compare(mine, guarded, "--no-diagnosis") == 2
    results = lfssao.compare(mine, guarded).results
    wrong = {r.layer: (r.module, r.metrics.texels) for r in results if r.verdict is Verdict.OUTSIDE}
    assert wrong == {"color": ("module_004", (48 + 6) * (32 + 6)), "shaded": ("module_004", 48 * 32)}


def test_a_cameras_depth_of_16_bits_has_no_surface_at_its_largest_code(tmp_path):
    jobs.render(tmp_path / "camera", "statue", "--camera", "--resolution", "48x32", "--radii", "4%")
    mine = render(tmp_path / "camera", tmp_path / "mine", "camera", {"depth": "unorm16"})
    report = lfssao.compare(mine, tmp_path / "camera")
    assert (report.exit_code, different(report)["camera", "depth"]) == (0, Verdict.INSIDE)

    def nearer(_, codes):
        return codes - (codes == 65535) if codes.dtype == np.uint16 else codes

    mine = render(tmp_path / "camera", tmp_path / "wrong", "camera", {"depth": "unorm16"}, nearer)
    assert different(lfssao.compare(mine, tmp_path / "camera"))["camera", "depth"] is Verdict.OUTSIDE


@pytest.mark.parametrize(("name", "kind", "behind"), [
    ("ao_1", "half", "merged"), ("merged", "half", "blurred"), ("merged", "unorm8", "blurred"),
    ("merged", "unorm16", "blurred"), ("blurred", "unorm8", "shaded"),
])  # fmt: skip
def test_one_step_off_fails_alone_and_so_does_what_is_made_of_values_rounded_otherwise(
    tmp_path, reference, name, kind, behind
):
    def off(layer, codes):
        if layer == name:
            codes[16, 24] = np.nextafter(codes[16, 24], np.float16(9)) if kind == "half" else codes[16, 24] + 1
        return codes

    for how, wrong in (({"alter": off}, name), ({"read": cut_down}, behind), ({"read": of_registers}, None)):
        mine = render(reference, tmp_path / str(wrong), "module_004", {name: kind}, **how)
        report = lfssao.compare(mine, reference, diagnosis=False)
        failing = {r.layer: r.outside for r in report.results if report.code(r)}
        assert set(failing) == {wrong} - {None}
        assert wrong != name or failing[wrong] == 1


@pytest.mark.parametrize("kinds", [
    dict.fromkeys((*AO, "color", "shaded"), "half"), {**dict.fromkeys(AO, "unorm8"), "color": "srgb8"},
], ids=["half", "unorm8"])  # fmt: skip
@pytest.mark.parametrize("folder", ["reference", "guarded"])
def test_layers_may_be_made_before_those_they_are_made_of_are_stored(tmp_path, request, folder, kinds):
    source = request.getfixturevalue(folder)
    mine = render(source, tmp_path / "mine", "module_004", kinds, read=of_registers)
    assert lfssao.compare(mine, source).exit_code == 0


def right_view(name):
    """A view, and image depths of the surfaces of its scene."""
    if name == "camera":
        planes = near, far = 0.1, 50.0
        place = (0.0, 0.0, 5.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0)
        levels = far / (far - near) * (1 - near / np.array([2.0, 3.0, 5.0, 7.0]))
        return Camera("perspective", *place, 3.0, *planes).view(7, 5), levels
    display = lfssao.find_display(name).with_resolution(7, 5)
    return module_views(builtin_scene("statue"), display, range(3, 4))[0], None


def stored_by(ar, made, kind, visibility=False):
    """Textures as they are read, and as the next ones are made of them: read, of registers, or some of each."""
    if kind == "float":
        return made, made
    codes = encode(ar.subtract(1, made) if visibility else made, kind)
    read = decode(codes, kind)
    read = (np.float32(1) - read if visibility else read).astype(np.float64)
    some = np.where(ar.rng.random(made.shape) < 0.5, read, made)
    return read, ar.choose(ar.lot(0.4), read, ar.choose(ar.lot(0.5), made, some))


def judge_renderers(name, kind, visibility, seed):
    """Names of the textures outside their intervals, of renderers of any arithmetic that store occlusion and colour."""
    (view, levels), rng, n, sigma, radii = right_view(name), np.random.default_rng(seed), 6, 0.6, (0.3, 0.2)
    depth, positions, samples = oracle.critical_scene(rng, view, n, radii[0], levels=levels)
    rgb = rng.random((*depth.shape, 3)).astype(np.float32)
    mapping = view.world_to_image
    ar = rr.Arithmetic(rng, 24)
    back = view.screen_to_world if positions is None else None
    color, shown = stored_by(ar, ar.full(rgb), "srgb8" if kind == "unorm8" else kind)
    read = {"color": color}
    made = []
    for k, radius in enumerate(radii, start=1):
        given = depth, positions, mapping.kind, mapping.numbers, samples, radius, None if back is None else back.ravel()
        points = rr.image_points(ar, *given)
        way = rng.choice(rr.WAYS) if name == "camera" else "window"
        ao = rr.occlusion(ar, depth, *points, way, (0.1, 50.0))
        read[f"ao_{k}"], ao = stored_by(ar, ao, kind, visibility)
        made.append(ao)
    read["merged"], merged = stored_by(ar, np.maximum(*made), kind, visibility)
    table = blur_weights(sigma)
    read["blurred"], blurred = stored_by(ar, rr.blur(ar, merged, sigma, len(table) // 2, table)[0], kind, visibility)
    shaded = rr.shade(ar, shown, blurred)
    read["shaded"], _ = stored_by(ar, shaded, kind)
    stored = {} if kind == "float" else {layer: TextureFormat(kind, visibility and layer in AO) for layer in read}
    stored |= {"color": TextureFormat("srgb8")} if kind == "unorm8" else {}
    parameters = {
        "mapping": {"kind": KINDS[mapping.kind], "numbers": mapping.numbers}, "screen_to_world": back, "sigma": sigma,
        "guard": 0, "radii": radii, "colored": True, "rotation": "none",
    }  # fmt: skip
    inputs = {"depth": depth, "color": rgb} | ({} if positions is None else {"positions": positions})
    outputs = inputs | {layer: np.zeros_like(texture[0], np.float32) for layer, texture in read.items()}
    case = Case("", VIEW, "", parameters, {"samples": samples}, outputs, {"color": exact_bounds(rgb)})
    outside = []
    for r in range(ar.renderers):
        mine = inputs | {layer: texture[r].astype(np.float32) for layer, texture in read.items()}
        found = judge(mine, case, "shader", list(read), stored)
        outside += [layer for layer, judged in found.items() if judged.verdict is Verdict.OUTSIDE]
    return outside


STORES = [("float", False), ("half", False), ("unorm8", False), ("unorm16", False), ("unorm8", True), ("half", True)]


@pytest.mark.parametrize(("kind", "visibility"), STORES)
@pytest.mark.parametrize("name", ["sample-a", "convex", "camera"])
def test_no_right_renderer_is_outside_whatever_it_stores(name, kind, visibility):
    assert [judge_renderers(name, kind, visibility, seed) for seed in range(4)] == [[]] * 4


@pytest.mark.parametrize("kind", ["half", "unorm8"])
def test_renderers_that_keep_numbers_are_outside_of_what_is_made_of_stored_ones_alone(monkeypatch, kind):
    monkeypatch.setattr(TextureFormat, "before_or_after", lambda self, bounds, model, read=None: exact_bounds(read))
    assert {"blurred", "shaded"} <= set(judge_renderers("sample-a", kind, False, 0))


def test_float32_files_hold_formats_that_the_user_says(tmp_path, reference, capsys):
    mine = render(reference, tmp_path / "mine", "module_004", {"merged": "unorm8"})
    file = mine / "module_004_merged.npy"
    codes = np.load(file)
    np.save(file, codes * np.float32(1 / 255))  # some are an ulp off the quotient
    assert compare(mine, reference) == 2
    assert compare(mine, reference, "--stored", "merged=unorm8") == 0
    assert compare(mine, reference, "--stored", "merged=unorm16") == 2
    np.save(file, codes)
    assert compare(mine, reference, "--stored", "merged=unorm16") == 3
    assert "it is of uint8" in capsys.readouterr().out
    for wrong in ("merged=unorm4", "merged=srgb8", "positions=half", "nothing=half", "merged"):
        assert compare(mine, reference, "--stored", wrong) == 4
        assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize("kind", ["", "half", "unorm8"])
def test_visibility_is_taken_for_occlusion(tmp_path, reference, capsys, kind):
    """Merged visibility is written, read, blurred and written so, and shades."""
    mine = copied(reference, tmp_path / "mine")
    seen = 1 - single(reference, "module_004", "merged")[..., 0]
    codes = encode(seen, kind) if kind else seen
    light = lfssao.blur(decode(codes, kind) if kind else seen, 1.0)
    parts = read_exr(mine / "module_004.exr")
    shaded = single(reference, "module_004", "color") * light[..., None]
    parts["shaded"] = replace(parts["shaded"], pixels=shaded, channels=("R", "G", "B"))
    parts["blurred"] = Part("light", ("Y",), light[..., None])
    write_exr(mine / "module_004.exr", [part for name, part in parts.items() if name != "merged"])
    rules = {"1-merged.AO": "vis.Y", "1-blurred": "light"}

    def failing(**more):
        report = lfssao.compare(mine, reference, **{"rules": rules, "diagnosis": False, **more})
        own = {r.layer: r for r in report.results if r.module == "module_004"}
        words = ["1 - visibility"] + [f"stored as {kind}"] * bool(kind)
        assert own["merged"].stored in (", ".join(words), ", ".join(words[1:]))
        return {name for name, r in own.items() if report.code(r)}

    np.save(mine / "module_004_vis.npy", codes)
    assert failing() == set()
    assert failing(model="strict") == {"blurred", "shaded"}
    assert failing(rules={"merged.AO": "vis.Y", "1-blurred": "light"}) >= {"merged", "blurred"}
    codes[16, 24] += 1 if kind == "unorm8" else 1e-3
    np.save(mine / "module_004_vis.npy", codes)
    assert "merged" in failing()
    for wrong in (["vis.Y=1-depth"], ["vis=merged", "--map", "vis=1-merged"]):
        assert compare(mine, reference, "--map", *wrong) == 4
        assert capsys.readouterr().err.count("\n") == 1


KINDS_OF_CODES = [("half", False), ("unorm8", False), ("unorm8", True), ("unorm16", False), ("srgb8", False)]


def all_codes(kind):
    """The codes of a format from 0 on, and as numbers with equal steps between neighbours' middles."""
    if kind == "half":
        codes = np.arange(0x7C01, dtype=np.uint16).view(np.float16)  # zero, subnormal, normal, infinite
        return codes, np.minimum(codes.astype(np.float64), 65536)
    codes = np.arange(CODES[kind][0] + 1).astype(CODES[kind][1])
    return codes, codes.astype(np.float64)


@pytest.mark.parametrize(("kind", "visibility"), KINDS_OF_CODES)
def test_values_before_storing_are_those_that_are_stored_as_what_is_read(kind, visibility):
    """For all codes: what lies 0.45 of a step from one is, 0.55 is not; nothing is that is not allowed."""
    codes, steps = all_codes(kind)
    read = decode(codes, kind)[None]
    read = np.float32(1) - read if visibility else read
    end = np.float32(1e6)
    anything = Bounds(np.full_like(read, -end), np.full_like(read, end))
    found = TextureFormat(kind, visibility).before_or_after(anything, MODELS["strict"], read)
    for part, within in ((0.45, True), (0.55, False)):
        between = decode(steps[:-1] + part * np.diff(steps), kind)[None]
        between = np.float32(1) - between if visibility else between
        inside = (found.lower[:, :-1] <= between) & (between <= found.upper[:, :-1])
        assert (inside == within).all()
    if kind != "half":  # its range has no ends
        ends = (found.upper[0, 0], found.lower[0, -1]) if visibility else (found.lower[0, 0], found.upper[0, -1])
        assert ends == ((end, -end) if visibility else (-end, end))
    held = TextureFormat(kind, visibility).before_or_after(exact_bounds(read), MODELS["strict"], read)
    assert np.array_equal(held.lower, read)
    assert np.array_equal(held.upper, read)
    wrong = TextureFormat(kind, visibility).before_or_after(
        exact_bounds(read + 100), MODELS["strict"], read
    )  # wrong before it was stored
    finite = (np.abs(found.lower) < end) & (np.abs(found.upper) < end) & (read < end)
    assert np.array_equal(wrong.lower[finite], found.lower[finite])
    assert np.array_equal(wrong.upper[finite], found.upper[finite])


@pytest.mark.parametrize(("kind", "visibility"), KINDS_OF_CODES)
def test_bounds_of_stored_values_are_the_nearest_of_the_format(kind, visibility):
    """For all codes: what lies 0.45 of a step above one is stored as that, 0.55 as the next, the middle as either."""
    codes, steps = all_codes(kind)

    def inside(part, chosen):
        values = decode(steps[:-1] + part * np.diff(steps), kind)[None]
        read = decode(chosen, kind)[None]
        values, read = (1 - values, 1 - read) if visibility else (values, read)
        return ~TextureFormat(kind, visibility).bounds(exact_bounds(values), MODELS["strict"]).outside(read)

    below = codes[:-1]
    above = codes[1:]
    assert inside(0.45, below).all()
    assert not inside(0.45, above).any()
    assert inside(0.55, above).all()
    assert not inside(0.55, below).any()
    if not visibility:  # 1 less a middle is rounded
        assert inside(0.5, below).all()
        assert inside(0.5, above).all()
    beyond = TextureFormat(kind).bounds(exact_bounds(np.float32([[-1e-9, 1e6]])), MODELS["shader"])
    assert not beyond.outside(decode(codes[[0, -1]], kind)[None]).any()
