"""The diagnosis by running an estimator: changes planted in its occlusion, with noise as of float32, are named."""

from dataclasses import replace

import numpy as np
import pytest
from compare_folders import changed, remade
from jobs import manifest_of, render

import lfssao
from lfssao.files.exr import read_exr
from lfssao.samples import texel_turns
from lfssao.verify.case import described_turns, described_view
from lfssao.verify.compare.view_case import view_case
from lfssao.verify.diagnosis import diagnose
from lfssao.verify.diagnosis.sampling import stretched_tiles
from lfssao.verify.verdict import Verdict

JOBS = {
    "sao": ("--camera",),
    "alchemy": ("--camera", "--eye", "2,2.5,5"),
    "hbao": ("--display", "sample-a", "--modules", "9:10", "--rotate", "tiles"),
    "vo-points": ("--display", "sample-a", "--modules", "9:10", "--rotate", "hash"),
    "vo-lines": ("--display", "sample-a", "--modules", "9:10", "--rotate", "ign"),
    "vo-area": ("--camera",),
}


@pytest.fixture(scope="module")
def view(tmp_path_factory):
    """The folder of an estimator's job, made when it is first asked for, its view's name, buffers and case."""

    def rendered(name):
        layers = "--layers", "depth,positions,normals,ao", "--resolution", "96x72", "--radii", "6%"
        folder = tmp_path_factory.mktemp(name) / "reference"
        manifest = manifest_of(render(folder, "statue", "--estimator", name, *JOBS[name], *layers))
        (entry,) = manifest["views"]
        case = view_case(folder, manifest, entry)
        parts = read_exr(folder / entry["file"])
        depth, positions, normals = (np.squeeze(parts[layer].pixels) for layer in ("depth", "positions", "normals"))
        turns = described_turns(case.parameters, {"depth": depth})
        buffers = lfssao.Buffers(described_view(case.parameters), depth, positions, normals, turns)
        return folder, entry["name"], buffers, case

    made = {}
    return lambda name: made[name] if name in made else made.setdefault(name, rendered(name))


def occlusion(buffers, case, radius=1.0, samples=None, **options):
    """The estimator's occlusion with changes, and noise: of 3e-6 where no interval is known, else of a rounding."""
    name = case.parameters["estimator"]
    tables = case.inputs
    points = tables.get("points") if samples is None else samples
    chosen = {**case.parameters["options"], **options}
    made = lfssao.estimate(name, buffers, radius * case.parameters["radii"][0], points, tables.get("weights"), **chosen)
    noise = np.random.default_rng(1).uniform(-1, 1, made.texture.shape)
    noise *= 3e-6 * (made.texture > 0) if name == "vo-area" else 2.0**-23 * made.texture
    return (made.texture + noise).astype(np.float32)


def with_turns(buffers, turns):
    return replace(buffers, turns=np.ascontiguousarray(turns, np.float32))


def with_normals(b, made):
    """Normals by a matrix that is made of the view's, whose rows are right, up and away from the viewer."""
    matrix = made(b.view.cast_from_world[:, :3])
    return replace(b, normals=np.ascontiguousarray(np.einsum("kl,ijl->ijk", matrix, b.normals), np.float32))


def compared(folder, module, texture, target):
    mine = changed(folder, target / "mine", module, remade("ao_1", lambda _: texture[..., None]))
    (result,) = lfssao.compare(mine, folder, layers=["ao_1"]).results
    return result


def other_hash(b):
    return with_turns(b, texel_turns("common-hash", *b.depth.shape, 0, b.depth.dtype))


@pytest.mark.parametrize(("name", "kind", "values", "make"), [
    ("sao", "taps 11 in place of 9", (), lambda b, c: occlusion(b, c, taps=11)),
    ("sao", "samples turned by 'common-hash'", (), lambda b, c: occlusion(other_hash(b), c)),
    ("sao", "reach", (1.137,), lambda b, c: occlusion(b, c, reach=1.137)),
    ("sao", "ao x {:.4f}", (0.9995,), lambda b, c: np.float32(0.9995) * occlusion(b, c)),
    ("alchemy", "sigma", (1.713,), lambda b, c: occlusion(b, c, sigma=1.713)),
    ("alchemy", "radius", (0.931,), lambda b, c: occlusion(b, c, 0.931)),
    ("alchemy", "normals with the other sign", (), lambda b, c: occlusion(replace(b, normals=-b.normals), c)),
    *(("alchemy", kind, (), lambda b, c, axes=axes: occlusion(with_normals(b, axes), c)) for kind, axes in (
        ("z of normals in view space with the other sign", lambda view: view.T @ np.diag([1, 1, -1]) @ view),
        ("y of normals in view space with the other sign", lambda view: view.T @ np.diag([1, -1, 1]) @ view),
        ("normals of world space taken for view space", lambda view: (np.diag([1, 1, -1]) @ view).T),
        ("normals of world space taken for left-handed view space", lambda view: view.T),
        ("normals of view space taken for world space", lambda view: np.diag([1, 1, -1]) @ view),
        ("normals of left-handed view space taken for world space", lambda view: view),
    )),
    ("hbao", "radius", (0.8,), lambda b, c: occlusion(b, c, 0.8)),
    ("hbao", "bias", (21.36,), lambda b, c: occlusion(b, c, bias=21.36)),
    ("vo-points", "samples mirrored in y", (), lambda b, c: occlusion(b, c, samples=c.inputs["points"] * [1, -1, 1])),
    ("vo-points", "samples turned by 'common-hash'", (), lambda b, c: occlusion(other_hash(b), c)),
    *(("vo-points", kind, (), lambda b, c, turns=turns: occlusion(replace(b, turns=turns(b)), c)) for kind, turns in (
        ("samples are not turned", lambda b: None),
        ("samples turned the other way", lambda b: b.turns * np.float32([[[1]], [[-1]]])),
        ("turns of rows from below", lambda b: np.ascontiguousarray(b.turns[:, ::-1])),
    )),
    ("vo-lines", "ao x {:.4f}", (0.83,), lambda b, c: np.float32(0.83) * occlusion(b, c)),
    ("vo-lines", "randomize false in place of true", (), lambda b, c: occlusion(b, c, randomize=False)),
    ("vo-area", "radius", (1.2345,), lambda b, c: occlusion(b, c, 1.2345)),
])  # fmt: skip
def test_a_planted_change_is_named(view, tmp_path, name, kind, values, make):
    folder, module, buffers, case = view(name)
    result = compared(folder, module, make(buffers, case), tmp_path)
    found = result.diagnosis
    best = found.candidates[0]
    assert (best.kind, found.fits) == (kind.replace("ao x {:.4f}", "strength"), True), found.words("M")
    assert best.values == pytest.approx(values, rel=0.01)


def test_a_factor_and_a_bias_are_told_together_where_occlusion_is_1(view, tmp_path):
    folder, module, _, _ = view("sao")
    right = read_exr(folder / f"{module}.exr")["ao_1"].pixels[..., 0]
    found = compared(folder, module, np.float32(1 - 5e-7) * right, tmp_path).diagnosis
    assert {candidate.kind for candidate in found.candidates[: found.equal]} == {"strength", "bias"}, found.words("M")


def test_texels_are_those_that_are_counted_and_not_those_that_are_searched(view, tmp_path, monkeypatch):
    monkeypatch.setattr(diagnose, "_SEARCHED", 400)
    folder, module, buffers, case = view("sao")
    found = compared(folder, module, occlusion(buffers, case)[::-1], tmp_path).diagnosis
    assert (found.candidates[0].kind, found.fits) == ("rows from below", True)


QUOTIENT = "tile of noise looked up at {} divided by its side, in place of the remainder"
TILED = {  # row and column of a tile of 3 x 3 that a texel (i, j) of 14 x 11 reads
    QUOTIENT.format("columns"): lambda i, j: (j % 3, i // 3 % 3),
    QUOTIENT.format("rows"): lambda i, j: (j // 3 % 3, i % 3),
    QUOTIENT.format("rows from below"): lambda i, j: ((10 - (10 - j) // 3) % 3, i % 3),
    QUOTIENT.format("columns and rows"): lambda i, j: (j // 3 % 3, i // 3 % 3),
    QUOTIENT.format("columns and rows from below"): lambda i, j: ((10 - (10 - j) // 3) % 3, i // 3 % 3),
    "tile of noise once over the texture, not repeated": lambda i, j: (int(3 * j / 11), int(3 * i / 14)),
}


def test_tiles_of_noise_have_mistakes_of_their_own():
    tile = np.random.default_rng(3).random((2, 3, 3))
    noise = np.tile(tile, (1, 4, 5))[:, :11, :14]
    made = {name: other(noise) for name, other in stretched_tiles(noise)}
    assert made.keys() == TILED.keys()
    for name, place in TILED.items():
        read = np.array([[tile[:, *place(i, j)] for i in range(14)] for j in range(11)])
        assert np.array_equal(made[name], np.moveaxis(read, 2, 0)), name
    assert [*stretched_tiles(np.random.default_rng(4).random((2, 11, 14)))] == []
    assert [*stretched_tiles(np.ones((2, 11, 14)))] == []


def test_noise_gets_no_name(view, tmp_path):
    folder, module, buffers, _ = view("alchemy")
    noise = np.random.default_rng(2).random(buffers.depth.shape, np.float32)
    result = compared(folder, module, np.where(np.isfinite(buffers.depth), noise, 0).astype(np.float32), tmp_path)
    assert result.verdict in (Verdict.DIFFERENT, Verdict.OUTSIDE)
    assert not result.diagnosis.fits
