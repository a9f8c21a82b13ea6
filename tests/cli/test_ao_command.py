"""``lfssao ao``: the bits of ``lfssao render`` from its own textures, other files of them, what is refused."""

import re
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from exr_parts import read_parts, write_parts
from jobs import manifest_of, render, sentence
from PIL import Image

from lfssao import Part, WorldToImage, read_exr, write_exr
from lfssao.cli.main import main
from lfssao.optics.view import KINDS

HELP = Path(__file__).parents[2] / "lfssao" / "cli" / "help" / "ao.txt"
LAYERS = ["shaded", "depth", "positions", "color", "normals", "ao_1", "ao_2", "ao_3", "merged", "blurred"]
VIEWS = {
    "camera": ["--camera", "--guard", "3"],
    "module_002": ["--display", "convex", "--modules", "2:3"],
    "module_000": ["--display", "virtual", "--guard", "4"],
}
PASSES = ["--radii", "0.3,0,1.5", "--samples", "5", "--sampling", "jittered", "--seed", "3", "--blur", "1.5"]


@pytest.fixture(scope="module", params=VIEWS)
def rendered(request, tmp_path_factory):
    words = ["statue", "--normals", "--resolution", "40x30", *PASSES, *VIEWS[request.param]]
    return render(tmp_path_factory.mktemp("rendered"), *words), request.param


def run(folder, *words):
    """The parts of the one image file that the command writes."""
    assert main(["ao", *map(str, words), "-o", str(folder)]) == 0
    (path,) = folder.glob("*.exr")
    assert set(folder.iterdir()) == {path, folder / "manifest.json"}
    return read_exr(path)


def differing(mine, reference):
    """The parts whose bits, windows or metadata are not the reference's; it has metadata that tell whose it is, too."""
    bits = {part: (part.pixels.tobytes(), part.channels, part.guard) for part in [*mine.values(), *reference.values()]}
    pairs = [(part, reference[name]) for name, part in mine.items()]
    own = {part: {k: v for k, v in part.attributes.items() if k != "surface_texels"} for part in mine.values()}
    return [a.name for a, b in pairs if bits[a] != bits[b] or not own[a].items() <= b.attributes.items()]


def test_the_textures_of_render_give_its_bits(rendered, tmp_path):
    folder, name = rendered
    file = folder / f"{name}.exr"
    given = [word for option in ("--depth", "--positions", "--normals", "--image") for word in (option, file)]
    made = run(tmp_path, *given, "--buffers", folder if name == "camera" else folder / "manifest.json", *PASSES)
    assert list(made) == LAYERS
    assert differing(made, read_exr(file)) == []
    assert made["ao_1"].pixels.max() > 0.5


def test_files_of_other_renderers_give_the_same_bits(rendered, tmp_path, monkeypatch):
    """The help's command, on channels of other names and the numbers of the mapping as TOML."""
    folder, name = rendered
    monkeypatch.chdir(tmp_path)
    reference = read_exr(folder / f"{name}.exr")
    view = manifest_of(folder)["views"][0]["view"]
    depth = reference["depth"]
    positions = reference["positions"].pixels
    write_exr(Path("D.exr"), [Part("z buffer", ("far",), depth.pixels, guard=depth.guard)])
    alpha = np.concatenate([positions, np.ones_like(depth.pixels)], axis=-1)
    write_exr(Path("P.exr"), [Part("", ("R", "G", "B", "A"), alpha, guard=depth.guard)])
    np.save("P.npy", positions)
    mapping = WorldToImage(KINDS.index(view["world_to_image_kind"]), np.array(view["world_to_image"]))
    arguments = re.sub(r",\s+(?=\w+=)", "\n", repr(mapping).partition("(")[2].removesuffix(")"))
    Path("B.toml").write_text(f'kind = "{view["world_to_image_kind"]}"\n{arguments}\n')
    command = re.search(r"^ *lfssao ao (.*) --radii", HELP.read_text(encoding="utf-8"), re.MULTILINE)[1]
    for ending in ("exr", "npy"):
        made = run(tmp_path / ending, *command.replace("P.exr", f"P.{ending}").split(), *PASSES)
        assert list(made) == [layer for layer in LAYERS if layer not in ("shaded", "color", "normals")]
        if name != "camera":  # whose matrix is taken apart, and put together again
            assert differing(made, reference) == []
        assert np.mean(np.abs(made["merged"].pixels - reference["merged"].pixels) < 1e-6) > 0.98


@pytest.mark.parametrize("estimator", ["sao", "alchemy", "hemisphere", "vo-lines-normal"])
def test_any_estimator_and_its_parameters(tmp_path, estimator):
    words = ["--estimator", estimator, "--radii", "0.4", "--blur", "0"]
    words += ["--parameter", "log_q=2"] if estimator == "sao" else ["--samples", "5"]
    folder = render(tmp_path / "ref", "statue", "--camera", "--resolution", "40x30", "--normals", *words)
    file = folder / "camera.exr"
    given = [word for option in ("--depth", "--positions", "--normals", "--image") for word in (option, file)]
    assert differing(run(tmp_path / "out", *given, "--buffers", folder, *words), read_exr(file)) == []


def test_the_output_is_a_reference_for_compare_with_rows_as_the_renderer_has_them(tmp_path, monkeypatch, capsys):
    """Wrong AO is found, and right AO of a texture whose rows run upwards is right, by intervals."""
    folder = render(tmp_path / "ref", "statue", "--camera", "--resolution", "40x30", "--radii", "0.4", "--blur", "0")
    parts = read_exr(folder / "camera.exr")
    monkeypatch.chdir(tmp_path)
    np.save("camera.npy", parts["depth"].pixels[::-1])
    Path("B.toml").write_text('kind = "folder"\nfolder = "ref"\nname = "camera"\nrows = "below"\n')
    made = run(tmp_path / "out", "--depth", "camera.npy", "--buffers", "B.toml", "--radii", "0.4", "--blur", "0")
    assert np.array_equal(made["ao_1"].pixels, parts["ao_1"].pixels)
    Path("mine").mkdir()
    ao = parts["ao_1"].pixels[::-1]
    for texture, code in ((ao, 0), (ao[::-1], 2)):
        np.save("mine/camera_ao_1.npy", texture)
        assert main(["compare", "mine", "out", "--layers", "ao_1"]) == code
    assert capsys.readouterr().out.count("intervals of the error model 'shader'") == 2


@pytest.fixture
def inputs(tmp_path, monkeypatch):
    """A folder of textures and mappings, right and wrong ones."""
    monkeypatch.chdir(tmp_path)
    depth = np.linspace(-0.2, 0.2, 48, dtype=np.float16).reshape(6, 8)
    flat = np.zeros((6, 8, 1), np.float32)
    single = depth.astype(np.float32)
    x = (1 - single) * (np.arange(8) - 3.5)
    y = (1 + single) * (2.5 - np.arange(6)[:, None])
    arrays = {"half": depth, "D": single, "P": np.stack([x, y, single], axis=-1).astype(np.float32)}
    arrays |= {"small": arrays["P"][1:], "four": np.zeros((6, 8, 5), np.float32)}
    arrays["nan"] = np.full(single.shape, 0x7FA00000, np.uint32).view(np.float32)  # one that signals
    arrays |= {"whole": depth.astype(np.uint16), "double": depth.astype(np.float64), "hole": np.nan * arrays["P"]}
    for name, array in arrays.items():
        np.save(f"{name}.npy", array)
    for name, left, top in (("D", 0, 0), ("moved", 2, 3), ("narrow", -3, -3)):
        write_exr(Path("D.exr"), [Part("", ("Z",), flat)])
        ((spec, pixels),) = read_parts("D.exr")
        spec.x, spec.y = left, top
        write_parts(f"{name}.exr", [(spec, pixels)])
    write_exr(Path("small.exr"), [Part("", ("Y",), flat[1:])])
    Image.new("L", (8, 6)).save("a.png")
    write_exr(Path("two.exr"), [Part("a", ("a",), flat), Part("b", ("b",), flat)])
    slits = "z_m = 1\nz_o = -1\nu_0 = 4\nv_0 = 3\n"
    Path("B.toml").write_text(f'kind = "crossed slits"\nM = {np.eye(3, 4).tolist()}\n{slits}')
    Path("bad.toml").write_text(slits)
    return tmp_path


GIVEN = ("--positions", "P.npy", "--buffers", "B.toml", "--radii", "0.1")


def test_half_is_widened_exactly(inputs):
    half, single = (run(inputs / f"of {name}", "--depth", name, *GIVEN) for name in ("half.npy", "D.npy"))
    assert half["ao_1"].pixels.max() > 0
    assert differing(half, single) == []


def test_layers_of_a_file_with_several_are_named_by_map(inputs):
    """As Blender names them, of one part or of several, and vectors in channels X, Y and Z."""
    depth = np.load("D.npy")
    positions = np.load("P.npy")
    names = [f"V.{name}" for name in ("Combined.R", "Combined.G", "Combined.B", "Combined.A", "Mist.Z", "Depth.Z")]
    names += [f"V.Position.{axis}" for axis in "XYZ"]
    planes = np.concatenate([np.ones((6, 8, 5), np.float32), depth[..., None], positions], axis=-1)
    write_exr(Path("all.exr"), [Part("", tuple(names), planes)])
    write_exr(Path("apart.exr"), [Part(name, (name,), planes[..., [k]]) for k, name in enumerate(names[:6])])
    write_exr(Path("xyz.exr"), [Part("", ("X", "Y", "Z"), positions)])
    np.save("first.npy", np.moveaxis(positions, -1, 0))
    np.save("one.npy", depth[None])
    right = run(inputs / "right", "--depth", "D.npy", *GIVEN)
    assert right["ao_1"].pixels.max() > 0
    rules = ["--map", "V.Depth=depth"], ["--map", "V.Depth.Z=depth"]
    cases = [("all.exr", rule, "all.exr", ["--map", "V.Position=positions"]) for rule in rules]
    cases += [("apart.exr", rules[0], "xyz.exr", []), ("one.npy", [], "first.npy", [])]
    for number, (first, rule, second, more) in enumerate(cases):
        words = "--depth", first, "--positions", second, *GIVEN[2:], *rule, *more
        assert differing(run(inputs / f"{number}", *words), right) == []


def test_an_image_is_read_as_it_is_seen(inputs):
    """Rows stored from below by their tag, and both windows off the origin, give the bits of the plain file."""
    depth = np.load("D.npy")
    right = run(inputs / "right", "--depth", "D.npy", *GIVEN)
    for name, pixels in (("below.tif", depth[::-1]), ("off.exr", depth)):
        spec = oiio.ImageSpec(8, 6, 1, "float")
        if name == "below.tif":
            spec.attribute("Orientation", 4)
        else:
            spec.x = spec.y = spec.full_x = spec.full_y = -5
        write_parts(name, [(spec, np.ascontiguousarray(pixels)[..., None])])
        assert differing(run(inputs / name[:-4], "--depth", name, *GIVEN), right) == []


@pytest.mark.parametrize(("changes", "reason"), [
    ({"--positions": "small.npy"}, "--positions: small.npy: it has 8x5 texels, depth has 8x6"),
    ({"--estimator": "foo"}, "--estimator: there is no estimator 'foo'"),
    ({"--estimator": "alchemy", "--parameter": "k=x"}, "--parameter k: 'x' is not a number"),
    ({"--estimator": "alchemy"}, "estimator alchemy reads normals, and there is no normals texture"),
    ({"--positions": "D.npy"}, "--positions: D.npy: expected a layer positions or just one of 3 channels, it holds"),
    ({"--positions": "hole.npy"}, "positions: a number is not finite where there is a surface"),
    ({"--depth": "double.npy"}, "--depth: double.npy: it is of float64, expected float32 or half"),
    ({"--depth": "whole.npy"}, "--depth: whole.npy: it is of uint16, expected float32 or half"),
    ({"--depth": "nan.npy"}, "depth: nan at column 0, row 0 from above is no depth of depth_kind = 'image'"),
    ({"--depth": "moved.exr"}, "moved.exr: its data window reaches beyond its display window by -2, -3, 2, 3"),
    ({"--depth": "narrow.exr"}, "narrow.exr: its data window reaches beyond its display window by 3, 3, -3, -3"),
    ({"--depth": "two.exr"}, "--depth: two.exr: expected a layer depth or just one of 1 channel, it holds a of a; b"),
    ({"--depth": "none.npy"}, "none.npy: there is no such file"),
    ({"--map": "a=depth"}, "--depth: D.npy: there is no layer or channel 'a', which --map names"),
    ({"--map": "a=normals"}, "--map: there is no layer 'normals': choose one of depth, Z, depth.Z, positions"),
    ({"--depth": "two.exr", "--map": "b=a"}, "--map: there is no layer 'a'"),
    ({"--positions": "a.png"}, "--positions: a.png: it is of format png, not EXR, TIFF or NPY"),
    ({"--depth": "a.png"}, "--depth: a.png: it is of uint8, expected float32 or half, or depth_bits in the file of"),
    ({"--rotate": "small.exr"}, "--rotate: small.exr: it has 8x5 texels, textures with guard have 8x6"),
    ({"--image": "four.npy"}, "--image: four.npy: expected a layer color or just one of 3 channels"),
    ({"--buffers": "none.toml"}, "none.toml: there is no such file"),
    ({"--buffers": "bad.toml"}, "bad.toml: there is no kind 'None'"),
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
