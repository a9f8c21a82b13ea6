"""Intervals of what a light makes: no renderer outside, a wrong light and a wrong occlusion outside."""

import jobs
import numpy as np
import oracle_scenes as oracle
import pytest
import random_renderer as rr
from compare_folders import copied, different, ordered, single
from hypothesis import given, settings
from hypothesis import strategies as st
from reference import passes

import lfssao
from lfssao.files.exr import read_exr
from lfssao.verify.bounds.bounds import Bounds, exact_bounds
from lfssao.verify.bounds.error_model import MODELS
from lfssao.verify.bounds.post import shade_bounds
from lfssao.verify.bounds.stored import TextureFormat
from lfssao.verify.verdict import Verdict

SHAPE = (3, 5)
RENDERERS = 64
NOTHING = -np.inf, np.inf


@st.composite
def problems(draw):
    """Image, occlusion, normals and a light; texels without a surface, and some that graze the light."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    direction = tuple(rng.normal(size=3) * 10.0 ** rng.uniform(-12, 12))
    normals = oracle.unit(rng.normal(size=(*SHAPE, 3)))
    towards = oracle.unit(np.array(direction))
    normals[0] = oracle.unit(np.cross(normals[0], towards)) + towards * rng.normal(size=(SHAPE[1], 1)) * 1e-6
    rgb = rng.random((*SHAPE, 3))
    occlusion = rng.random(SHAPE)
    rgb[1], normals[1, ::2] = rgb[1] * rng.choice([-1.0, 1e-3, 0.0], (SHAPE[1], 1)), 0.0
    occlusion[2] = rng.choice([0.0, 1.0], SHAPE[1])
    ambient = draw(st.sampled_from([0.0, 1.0, 0.3, 0.5, 0.999, 1e-4]))
    place = draw(st.sampled_from(["ambient", "all"]))
    model = draw(st.sampled_from(["shader", "shader", "nearest"]))
    textures = [each.astype(np.float32) for each in (rgb, occlusion, normals)]
    return rng, textures, lfssao.Light(direction, ambient, place), model


@settings(max_examples=60)
@given(problems(), st.booleans())
def test_no_renderer_leaves_the_intervals(problem, half):
    """Each normalises normals again, or not; those of half floats it reads, or has as they were before."""
    rng, (rgb, occlusion, normals), light, name = problem
    normals[2] *= np.float32(1 if half else rng.choice([0.5, 1.5]))
    ar = oracle.arithmetic(name, rng, RENDERERS)
    model = MODELS[name]
    allowed = exact_bounds(normals)
    made = ar.full(normals)
    if half:
        read = normals.astype(np.float16).astype(np.float32)
        unknown = Bounds(*(np.full_like(normals, end) for end in NOTHING))
        allowed = TextureFormat("half").before_or_after(unknown, model, read)
        made = ar.choose(ar.lot(0.5), read, made)
    found = shade_bounds(rgb, exact_bounds(occlusion), model, allowed, light)
    shaded = rr.lit(ar, rgb, occlusion, made, light.direction, light.ambient, light.occlude == "all")
    oracle.assert_inside(shaded, found, "shaded")
    assert np.all((found.lower == 0) & (found.upper == 0) | (rgb != 0))


@given(problems())
def test_intervals_are_narrow_and_hold_all_between_the_ends_of_image_and_occlusion(problem):
    rng, (rgb, occlusion, normals), light, _ = problem
    how = light.direction, light.ambient, light.occlude
    found = shade_bounds(rgb, exact_bounds(occlusion), "shader", exact_bounds(normals), light)
    assert np.max(found.upper - found.lower) < 2e-5
    exact = shade_bounds(rgb, exact_bounds(occlusion), "strict", exact_bounds(normals), light)
    assert exact.lower.tobytes() == exact.upper.tobytes() == passes.light(rgb, occlusion, normals, *how).tobytes()
    ends = [
        np.sort([a, a + rng.normal(size=a.shape).astype(np.float32) / 9], axis=0) for a in (rgb, occlusion, normals)
    ]
    image, ao, facing = (Bounds(*end) for end in ends)
    for model in ("shader", "strict"):
        found = shade_bounds(image, ao, model, facing, light)
        for _ in range(8):
            chosen = [end[0] + (end[1] - end[0]) * rng.choice([0, 1, 0.3], end[0].shape) for end in ends]
            drawn = [np.clip(c, *end).astype(np.float32) for c, end in zip(chosen, ends, strict=True)]
            assert not found.outside(passes.light(*drawn, *how)).any()


SIZE = "--display", "sample-a", "--resolution", "64x48", "--modules", "10", "--radii", "3%", "--guard", "2"
LIGHT = "--light", "1,2,3", "--ambient", "0.4"


@pytest.fixture(scope="module", params=["ambient", "all"])
def reference(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp(request.param) / "reference"
    return jobs.render(folder, "statue", *SIZE, *LIGHT, "--occlude", request.param)


def textures_of(folder):
    """Image, blur and normals without the guard band, and the light of the manifest."""
    inner = slice(2, -2)
    image, normals = (single(folder, "module_010", name)[inner, inner] for name in ("color", "normals"))
    light = jobs.manifest_of(folder)["settings"]["light"]
    return image, single(folder, "module_010", "blurred")[..., 0], normals, tuple(light.values())


def turned(direction, degrees):
    x, y, z = direction
    c = np.cos(np.radians(degrees))
    s = np.sin(np.radians(degrees))
    return c * x + s * z, y, c * z - s * x


def judged(reference, folder, **textures):
    """The report on textures of the module, in files of their own beside all others."""
    mine = copied(reference, folder)
    parts = {name: ordered(part) for name, part in read_exr(mine / "module_010.exr").items() if name not in textures}
    lfssao.write_exr(mine / "module_010.exr", list(parts.values()))
    for name, texture in textures.items():
        np.save(mine / f"module_010_{name}.npy", texture)
    return lfssao.compare(mine, reference)


def test_another_light_and_another_occlusion_are_outside(reference, tmp_path):
    image, ao, normals, (direction, ambient, place) = textures_of(reference)
    right = passes.light(image, ao, normals, direction, ambient, place)
    assert right.tobytes() == single(reference, "module_010", "shaded").tobytes()
    more = passes.light(image, ao, normals, [9 * each for each in direction], ambient, place)
    assert judged(reference, tmp_path / "right", shaded=more).exit_code == 0
    for number, wrong in enumerate([
        (ao * np.float32(0.9), direction, ambient), (ao, turned(direction, 5), ambient),
        (ao, turned(direction, 0.1), ambient), (ao, direction, ambient + 0.01),
    ]):  # fmt: skip
        occlusion, towards, share = wrong
        shaded = passes.light(image, occlusion, normals, towards, share, place)
        report = judged(reference, tmp_path / str(number), shaded=shaded)
        assert different(report) == {("module_010", "shaded"): Verdict.OUTSIDE}


def test_ao_elsewhere_is_named_with_the_option_that_renders_it(reference, tmp_path):
    image, ao, normals, (direction, ambient, place) = textures_of(reference)
    other = {"ambient": "all", "all": "ambient"}[place]
    report = judged(reference, tmp_path / "mine", shaded=passes.light(image, ao, normals, direction, ambient, other))
    assert f"; render the reference with --occlude {other}" in str(report)
    assert "expected: the image times 1 - blurred, or lit by normals too, all the renderer's own" in str(report)


def test_half_floats_and_codes_conform_and_the_power_is_said(reference, tmp_path):
    """Normals are written as half floats, read and normalised again, and the picture is of 8 bits."""
    image, ao, normals, (direction, ambient, place) = textures_of(reference)
    whole = single(reference, "module_010", "normals").astype(np.float16)
    read = whole[2:-2, 2:-2].astype(np.float32)
    again = np.where(read.any(axis=2, keepdims=True), oracle.unit(read + (read == 0).all(axis=2, keepdims=True)), 0)
    for number, facing in enumerate((normals, read, again.astype(np.float32))):
        shaded = passes.light(image, ao, facing, direction, ambient, place)
        codes = np.floor(encoded(shaded) * 255 + 0.5).astype(np.uint8)
        for kind, stored in (("float", shaded), ("half", shaded.astype(np.float16)), ("codes", codes)):
            report = judged(reference, tmp_path / f"{kind}{number}", shaded=stored, normals=whole)
            (found,) = (each for each in report.results if each.layer == "shaded")
            assert report.exit_code == 0, str(report)
            assert (
                found.verdict is Verdict.EQUAL_BITS
                if not number and kind == "float"
                else "would be" in str(found.power)
            )
    wrong = passes.light(image, ao, normals, turned(direction, 5), ambient, place)
    report = judged(reference, tmp_path / "wrong", shaded=wrong.astype(np.float16), normals=whole)
    assert different(report)["module_010", "shaded"] is Verdict.OUTSIDE


def encoded(linear):
    linear = np.clip(linear.astype(np.float64), 0, 1)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def test_a_reference_without_normals_has_no_interval_and_a_wrong_light_is_refused(tmp_path, capsys):
    bare = jobs.render(tmp_path / "bare", "statue", *SIZE, *LIGHT, "--layers", "shaded,blurred,color")
    assert lfssao.compare(copied(bare, tmp_path / "mine"), bare).exit_code == 0
    shaded = np.nextafter(single(bare, "module_010", "shaded"), np.float32(9))
    report = judged(bare, tmp_path / "off", shaded=shaded)
    assert different(report) == {("module_010", "shaded"): Verdict.DIFFERENT}
    jobs.edit(bare, "settings", "light", "ambient", value=7)
    with pytest.raises(lfssao.InputError, match="ambient is 7, it must be a share from 0 to 1"):
        lfssao.compare(tmp_path / "mine", bare)
