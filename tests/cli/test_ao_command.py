"""``lfssao ao``: the bits of ``lfssao render`` from its own textures, other files of them, what is refused."""

import re
from pathlib import Path

import numpy as np
import pytest
from exr_parts import read_parts, write_parts
from jobs import manifest_of, render, sentence

from lfssao import Part, WorldToImage, read_exr, write_exr
from lfssao.cli.main import main
from lfssao.optics.view import KINDS

README = Path(__file__).parents[2] / "README.md"
LAYERS = ["shaded", "ao_1", "ao_2", "ao_3", "merged", "blurred"]
VIEWS = {
    "camera": ["--camera", "--guard", "3"],
    "module_002": ["--display", "convex", "--modules", "2:3"],
    "module_000": ["--display", "virtual", "--guard", "4"],
}
PASSES = ["--radii", "0.3,0,1.5", "--samples", "5", "--sampling", "jittered", "--seed", "3", "--blur", "1.5"]


@pytest.fixture(scope="module", params=VIEWS)
def rendered(request, tmp_path_factory):
    words = ["statue", "--resolution", "40x30", *PASSES, *VIEWS[request.param]]
    return render(tmp_path_factory.mktemp("rendered"), *words), request.param


def run(folder, *words):
    """The parts of the one file that the command writes."""
    assert main(["ao", *map(str, words), "-o", str(folder)]) == 0
    (path,) = folder.iterdir()
    return read_exr(path)


def differing(mine, reference):
    """The parts whose bits, windows or metadata are not the reference's; it has metadata that tell whose it is, too."""
    bits = {part: (part.pixels.tobytes(), part.channels, part.guard) for part in [*mine.values(), *reference.values()]}
    pairs = [(part, reference[name]) for name, part in mine.items()]
    return [a.name for a, b in pairs if bits[a] != bits[b] or not a.attributes.items() <= b.attributes.items()]


def test_the_textures_of_render_give_its_bits(rendered, tmp_path):
    folder, name = rendered
    file = folder / f"{name}.exr"
    positions = [] if name == "camera" else ["--positions", file]
    mapping = folder if name == "camera" else folder / "manifest.json"
    made = run(tmp_path, "--depth", file, *positions, "--image", file, "--mapping", mapping, *PASSES)
    assert [path.name for path in tmp_path.iterdir()] == [file.name]
    assert list(made) == LAYERS
    assert differing(made, read_exr(file)) == []
    assert made["ao_1"].pixels.max() > 0.5


def test_files_of_other_renderers_give_the_same_bits(rendered, tmp_path, monkeypatch):
    """README's command, on channels of other names and the numbers of the mapping as TOML."""
    folder, name = rendered
    monkeypatch.chdir(tmp_path)
    reference, view = read_exr(folder / f"{name}.exr"), manifest_of(folder)["views"][0]["view"]
    depth, positions = reference["depth"], reference["positions"].pixels
    write_exr(Path("D.exr"), [Part("z buffer", ("far",), depth.pixels, guard=depth.guard)])
    alpha = np.concatenate([positions, np.ones_like(depth.pixels)], axis=-1)
    write_exr(Path("P.exr"), [Part("", ("R", "G", "B", "A"), alpha, guard=depth.guard)])
    np.save("P.npy", positions)
    mapping = WorldToImage(KINDS.index(view["world_to_image_kind"]), np.array(view["world_to_image"]))
    arguments = re.sub(r",\s+(?=\w+=)", "\n", repr(mapping).partition("(")[2].removesuffix(")"))
    back = "" if view["screen_to_world"] is None else f"screen_to_world = {view['screen_to_world']}\n"
    Path("M.toml").write_text(f'kind = "{view["world_to_image_kind"]}"\n{arguments}\n{back}')
    command = re.search(r"^lfssao ao (.*) --radii", README.read_text(encoding="utf-8"), re.MULTILINE)[1]
    for ending in ("exr", "npy"):
        words = command.replace("P.exr", f"P.{ending}").split()
        without = words if name != "camera" else words[:2] + words[4:]  # positions: Algorithm 1
        made = run(tmp_path / ending, *without, *PASSES)
        assert list(made) == LAYERS[1:]
        assert differing(made, reference) == []


@pytest.fixture
def inputs(tmp_path, monkeypatch):
    """A folder of textures and mappings, right and wrong ones."""
    monkeypatch.chdir(tmp_path)
    depth, flat = np.linspace(-0.2, 0.2, 48, dtype=np.float16).reshape(6, 8), np.zeros((6, 8, 1), np.float32)
    single = depth.astype(np.float32)
    arrays = {"half": depth, "D": single, "P": np.stack([single, single[::-1], single], axis=-1)}
    arrays |= {"small": arrays["P"][1:], "four": np.zeros((6, 8, 5), np.float32), "nan": np.float32(np.nan) * single}
    arrays |= {"whole": depth.astype(np.uint16), "double": depth.astype(np.float64), "hole": np.nan * arrays["P"]}
    for name, array in arrays.items():
        np.save(f"{name}.npy", array)
    for name, x, y in (("D", 0, 0), ("moved", 2, 3), ("narrow", -3, -3)):
        write_exr(Path("D.exr"), [Part("", ("Z",), flat)])
        ((spec, pixels),) = read_parts("D.exr")
        spec.x, spec.y = x, y
        write_parts(f"{name}.exr", [(spec, pixels)])
    write_exr(Path("two.exr"), [Part("a", ("a",), flat), Part("b", ("b",), flat)])
    slits = "z_m = 1\nz_o = -1\nu_0 = 4\nv_0 = 3\n"
    Path("M.toml").write_text(f'kind = "crossed slits"\nM = {np.eye(3, 4).tolist()}\n{slits}')
    Path("bad.toml").write_text(slits)
    return tmp_path


GIVEN = ("--positions", "P.npy", "--mapping", "M.toml", "--radii", "0.1")


def test_half_is_widened_exactly(inputs):
    half, single = (run(inputs / f"of {name}", "--depth", name, *GIVEN) for name in ("half.npy", "D.npy"))
    assert half["ao_1"].pixels.max() > 0
    assert differing(half, single) == []


@pytest.mark.parametrize(("changes", "reason"), [
    ({"--positions": None}, "--positions: they are missing, and the mapping of M.toml is not a matrix"),
    ({"--positions": "small.npy"}, "--positions: (5, 8, 3) of float32, expected (6, 8, 3) of float32"),
    ({"--positions": "D.npy"}, "--positions: D.npy: expected a layer positions or just one of 3 channels, it holds"),
    ({"--positions": "hole.npy"}, "--positions: a number is not finite where there is a surface"),
    ({"--depth": "double.npy"}, "--depth: double.npy: it is of float64, expected float32 or half"),
    ({"--depth": "whole.npy"}, "--depth: whole.npy: it is of uint16, expected float32 or half"),
    ({"--depth": "nan.npy"}, "--depth: a number is not finite where there is a surface"),
    ({"--depth": "moved.exr"}, "--depth: moved.exr: its data window begins at (2, 3), expected (0, 0), or (-N, -N)"),
    ({"--depth": "narrow.exr"}, "--depth: narrow.exr: its data window begins at (-3, -3)"),
    ({"--depth": "two.exr"}, "--depth: two.exr: expected a layer depth or just one of 1 channels, it holds a of a; b"),
    ({"--depth": "none.npy"}, "none.npy: there is no such file"),
    ({"--image": "four.npy"}, "--image: four.npy: expected a layer color or just one of 3 channels"),
    ({"--mapping": "none.toml"}, "none.toml: it cannot be read"),
    ({"--mapping": "bad.toml"}, "bad.toml: kind is None"),
    ({"--radii": "5%"}, "--radii: '5%' is not a number"),
    ({"--sampling": "foo"}, "--sampling: there is no"),
    ({"-o": "D.npy"}, "D.npy: the output folder cannot be made"),
    ({"-o": ".", "--depth": "D.exr"}, "--output: D.exr is an input, give another folder"),
])  # fmt: skip
def test_a_sentence_says_what_is_wrong(inputs, capsys, changes, reason):
    there = sorted(inputs.iterdir())
    words = {"--depth": "D.npy", **dict(zip(GIVEN[::2], GIVEN[1::2], strict=True)), "-o": "out", **changes}
    assert main(["ao", *(word for option, value in words.items() if value for word in (option, value))]) == 2
    assert reason in sentence(capsys)
    assert sorted(inputs.iterdir()) == there
