"""``compare`` returns a report on anything: two and three bugs at once, values that are no numbers, empty textures."""

import functools
import json
from dataclasses import replace

import numpy as np
import pytest
from compare_folders import changed, ordered, remade
from jobs import manifest_of, render
from planted_bugs import Renderer, moved, turned, turns_of

import lfssao
from lfssao.files.exr import read_exr, write_exr

WIDTH = 32
HEIGHT = 24
SIZE = "--resolution", f"{WIDTH}x{HEIGHT}", "--radii", "4%,7%"
JOBS = {
    "display": ("--display", "sample-a", "--modules", "9:11", *SIZE),
    "still": ("--display", "sample-a-conical", "--modules", "9:11", *SIZE, "--rotate", "none"),
    "curved": ("--display", "convex", "--modules", "20:22", *SIZE),
    "camera": ("--camera", *SIZE),
    **{
        name: ("--display", "sample-a", "--modules", "9:11", *SIZE, "--estimator", name, "--normals")
        for name in ("hemisphere", "alchemy", "vo-points")
    },
}
DRAWS = 1  # of each job


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A job's rendered folder, made when it is first asked for."""

    @functools.cache
    def rendered(job):
        return render(tmp_path_factory.mktemp(job) / "reference", "statue", *JOBS[job])

    return rendered


@functools.cache
def renderers(folder):
    """A renderer of each view of a folder, by its name."""
    manifest = manifest_of(folder)
    made = {}
    for entry in manifest["views"]:
        parts = read_exr(folder / entry["file"])
        textures = {name: np.squeeze(ordered(part).pixels) for name, part in parts.items()}
        settings = {**manifest["settings"], "samples": manifest["settings"]["samples"] or [[0.0, 0.0, 0.0]]}
        made[entry["name"]] = Renderer(settings, entry["view"], textures)
    return made


def compared(folder, target, own):
    """The report on a copy of a folder in which views have other textures, by view and layer."""
    target.mkdir()
    for name in renderers(folder):
        parts = {layer: ordered(part) for layer, part in read_exr(folder / f"{name}.exr").items()}
        for layer, texture in own.get(name, {}).items():
            pixels = np.asarray(texture, np.float32).reshape(parts[layer].pixels.shape)
            parts[layer] = replace(parts[layer], pixels=pixels)
        write_exr(target / f"{name}.exr", list(parts.values()))
    return lfssao.compare(target, folder)


# Arguments of ``Renderer.ao`` that are wrong, each drawn anew.
BUGS = {
    "turns": lambda r, rng: (
        [None, turns_of("tiles", 0, HEIGHT, WIDTH)][rng.integers(2)]
        if r.turns is None or rng.random() < 0.7
        else r.turns * np.float32([[[1]], [[-1]]])
    ),
    "image": lambda r, rng: [
        moved(*rng.uniform(-1, 1, 2)),
        moved(rng.uniform(-1, 1)),
        moved()[[1, 0]],
        np.array([[-1, 0, WIDTH], [0, 1, rng.uniform(-1, 1)]]),
    ][rng.integers(4)],
    "radius": lambda r, rng: rng.choice([0.0, 1e-6, 0.7, 1.3, 50.0]),
    "depth": lambda r, rng: [r.depth + np.float32(rng.normal(0, 0.02)), -r.depth, r.depth * 0, r.depth[::-1]][
        rng.integers(4)
    ],
    "samples": lambda r, rng: [
        r.samples * [1, -1, 0],
        turned(r.samples, rng.uniform(0, 360)),
        r.samples[rng.permutation(len(r.samples)) // 2],
        r.samples * 0,
    ][rng.integers(4)],
    "border": lambda r, rng: ["edge", "wrap", -np.inf][rng.integers(3)],
    "divisor": lambda r, rng: int(rng.integers(1, 20)),
    "behind": lambda r, rng: np.greater_equal,
    "positions": lambda r, rng: [r.physical, r.positions * [1, 1, -1], r.positions * 0][rng.integers(3)],
}


def sprinkled(texture, rng):
    made = np.array(texture, np.float32)
    places = rng.random(made.shape) < rng.choice([0.002, 0.1, 0.9])
    made[places] = rng.choice([np.nan, np.inf, -np.inf, 3e38, -1.0, 65504.0], np.count_nonzero(places))
    return made


def one_off(texture, rng):
    made = np.array(texture, np.float32)
    made.flat[rng.integers(made.size)] += rng.choice([1e-6, 0.3, np.nan])
    return made


# Changes of a finished texture.
LATER = [
    sprinkled,
    one_off,
    lambda texture, rng: np.full_like(texture, rng.choice([0, 1, 0.5, 1e10, np.inf, -np.inf, np.nan])),
    lambda texture, rng: 1 - texture,
    lambda texture, rng: texture[::-1],
    lambda texture, rng: texture[:, ::-1],
    lambda texture, rng: texture.astype(np.float16),
    lambda texture, rng: texture * np.float32(rng.uniform(0.3, 3)),
    lambda texture, rng: np.roll(texture, rng.integers(1, 9), axis=rng.integers(2)),
    lambda texture, rng: rng.random(texture.shape),
]


@np.errstate(all="ignore")
def wrong_textures(r, rng):
    """Two or three bugs at once: in the making of AO, or in what became of one of the textures."""
    own = {}
    layers = ["depth", "positions", "ao_1", "ao_2", "merged", "blurred", "shaded"]
    chosen = rng.permutation([*rng.choice(list(BUGS), 3, replace=False), *rng.choice(layers, 2)])
    number = int(rng.integers(2, 4))
    made = "normals" not in r.textures  # other estimators' occlusion is not made, what follows may be wrong
    bugs = {name: BUGS[name](r, rng) for name in map(str, chosen[:number]) if name in BUGS and made}
    if bugs:
        own = {f"ao_{k}": r.ao(k, **bugs) for k in (1, 2)}
    if rng.random() < 0.15:  # no texel has a surface
        own |= {layer: np.full_like(getattr(r, layer), np.inf) for layer in ("depth", "positions")}
    for layer in map(str, chosen[:number] if made else rng.choice(layers, number)):
        if layer in layers:
            texture = own.get(layer, getattr(r, layer))
            own[layer] = LATER[rng.integers(len(LATER))](texture, rng)
    return own


@pytest.mark.parametrize("job", JOBS)
def test_two_and_three_bugs_at_once_make_a_report(job, folder, tmp_path):
    made = renderers(folder(job))
    for number in range(DRAWS):
        rng = np.random.default_rng([number, *job.encode()])
        own = {name: wrong_textures(r, rng) for name, r in made.items() if rng.random() < 0.8}
        report = compared(folder(job), tmp_path / str(number), own)
        assert report.exit_code in (0, 1, 2)
        assert json.loads(json.dumps(report.as_dict(), allow_nan=False))["results"]
        assert str(report)


def test_a_cause_that_explains_another_texture_and_half_of_this_one_makes_a_report(folder, tmp_path):
    """Samples not turned in both, u shifted in one."""
    (name, r), *_ = renderers(folder("display")).items()
    own = {"ao_1": r.ao(1, turns=None), "ao_2": r.ao(2, turns=None, image=moved(0.31))}
    report = compared(folder("display"), tmp_path / "mine", {name: own})
    found = [result.diagnosis for result in report.results if result.layer == "ao_1" and result.diagnosis]
    assert [each.candidates[0].kind for each in found] == ["samples are not turned"]


@pytest.mark.parametrize("size", ["24x1", "1x24"])
def test_a_texture_of_one_line_makes_a_report(size, tmp_path):
    """No normals are made from the positions of a line."""
    job = "statue", "--display", "sample-a", "--modules", "9", "--resolution", size, "--radii", "9%"
    folder = render(tmp_path / "reference", *job, "--estimator", "alchemy", "--normals")
    change = remade("ao_1", lambda pixels: np.random.default_rng(1).random(pixels.shape, np.float32))
    (found,) = lfssao.compare(changed(folder, tmp_path / "mine", "module_009", change), folder, layers=["ao_1"]).results
    assert found.diagnosis.wrong >= 6
    assert not found.diagnosis.fits
