"""Files and channels that ``lfssao compare`` finds: formats, names, rules, sizes and types."""

import re
import shutil
import zlib
from dataclasses import replace

import numpy as np
import OpenImageIO as oiio
import pytest
from compare_folders import LAYERS, MODULES, changed, compare, different, single, verdicts, write_image
from exr_parts import write_parts
from PIL import Image

import lfssao
from lfssao.files.exr import Part, read_exr, write_exr
from lfssao.verify.verdict import Verdict


def exr(channels, width=5, guard=0):
    """A function that writes a layer of zeros with so many channels."""
    zeros = np.zeros((4, width, channels), np.float32)
    return lambda path: write_exr(path, [Part("positions", ("P.X", "P.Y", "P.Z")[:channels], zeros, guard=guard)])


def image(dtype):
    return lambda path: write_image(path, np.ones((4, 5, 1), np.float32), dtype)


@pytest.mark.parametrize(("ending", "mine", "right", "code", "words"), [
    ("exr", exr(2), exr(3), 3, "there is no channel for P.Z: it has positions.P.X, positions.P.Y"),
    ("exr", exr(3), exr(2), 1, "P.Z is not in the reference"),
    ("exr", exr(1), exr(1, width=6), 3, "it has 5x4 texels, the reference's has 6x4"),
    # A cropped data window is no smaller image.
    ("exr", exr(1), exr(1, guard=1), 3, "its data window is larger by 0, 0, 0, 0 than the display"),
    ("exr", image("half"), image("float"), 3, "the reference's is of float32"),
    ("tif", image("double"), image("float"), 3, "the reference's is of float32"),
    ("tif", image("uint8"), image("float"), 3, "the reference's is of float32"),
])  # fmt: skip
def test_textures_of_another_shape_or_type_are_not_converted(tmp_path, capsys, ending, mine, right, code, words):
    files = tmp_path / f"a.{ending}", tmp_path / f"b.{ending}"
    mine(files[0])
    right(files[1])
    assert compare(*files) == code
    assert words in capsys.readouterr().out


def test_visibility_in_a_file_of_its_own_needs_no_name(tmp_path, reference):
    """And by another name it has one; a layer that is none of the reference is named with those that are."""
    for module in MODULES:
        for layer in ("ao_1", "merged"):
            np.save(tmp_path / f"{module}_{layer}.npy", 1 - single(reference, module, layer)[..., 0])
    chosen = ["--layers", "ao_1,merged"]
    assert compare(tmp_path, reference, *chosen) == 2
    assert compare(tmp_path, reference, *chosen, "--map", "1-ao_1", "--map", "1-merged") in (0, 1)
    assert compare(tmp_path, reference, *chosen, "--map", "1-ao_1") == 2
    assert compare(tmp_path, reference, "--layers", "merged", "--map", "1-ao", "--map", "1-merged") in (0, 1)
    assert compare(tmp_path, reference, "--layers", "ao_1", "--map", "1-ao") in (0, 1)
    rules = {"1-ao_1": "", "1-merged": "merged"}
    assert lfssao.compare(tmp_path, reference, layers=["ao_1", "merged"], rules=rules).exit_code in (0, 1)


@pytest.mark.parametrize(("words", "sentence"), [
    (["--layers", "mergd"], "there is no layer or channel of the reference 'mergd' (did you mean 'merged'?): choose "
     "one of depth, positions, color, ao_1, ao_2, merged, blurred, shaded"),
    (["--map", "1-ao_9"], "there is no layer or channel of the reference 'ao_9'"),
    (["--map", "x=1-ao_1", "--map", "1-ao_1"], "--map: '1-ao_1' is given twice"),
    (["--map", "ao_1=1-ao_1", "--map", "a=ao_1"], "--map: a layer is given twice"),
    (["--map", "x=ao"], "there is no layer or channel of the reference 'ao': choose one of depth"),
    (["--map", "1-depth"], "--map: depth has no visibility"),
])  # fmt: skip
def test_names_that_the_reference_does_not_have_are_refused_with_those_it_has(reference, capsys, words, sentence):
    assert compare(reference, reference, *words) == 4
    assert sentence in capsys.readouterr().err


def test_ao_stands_for_all_radii(tmp_path, reference):
    report = lfssao.compare(reference, reference, layers=["ao"], stored={"ao": "half"})
    assert {result.layer for result in report.results} == {"ao_1", "ao_2"}
    for module in MODULES:
        for layer in ("ao_1", "ao_2"):
            half = single(reference, module, layer).astype(np.float16).astype(np.float32)
            np.save(tmp_path / f"{module}_{layer}.npy", half[..., 0])
    assert lfssao.compare(tmp_path, reference, layers=["ao"], diagnosis=False).exit_code == 2
    assert lfssao.compare(tmp_path, reference, layers=["ao"], stored={"ao": "half"}).exit_code in (0, 1)


def test_one_file_a_layer_in_other_formats(tmp_path, reference):
    for module in MODULES:
        for layer in LAYERS:
            pixels = single(reference, module, layer)
            if layer in ("depth", "ao_1", "positions"):
                np.save(tmp_path / f"{module}_{layer}.npy", np.squeeze(pixels))
            elif layer == "ao_2":
                write_exr(tmp_path / f"{module}-{layer}.exr", [Part("", ("Y",), pixels)])
            else:
                write_image(tmp_path / f"{module}.{layer}.tif", pixels)
    report = lfssao.compare(tmp_path, reference)
    assert set(verdicts(report)) == {(module, layer) for module in MODULES for layer in LAYERS}
    assert not different(report)
    assert report.exit_code == 0


def test_one_part_with_layered_names_and_columns_first(tmp_path, reference):
    parts = read_exr(reference / "module_003.exr")
    names = [name for part in parts.values() for name in part.channels]
    pixels = np.concatenate([part.pixels for part in parts.values()], axis=-1)
    (tmp_path / "mine").mkdir()
    write_exr(tmp_path / "mine" / "module_003.exr", [Part("", tuple(names), pixels)])
    report = lfssao.compare(tmp_path / "mine" / "module_003.exr", reference / "module_003.exr")
    assert (report.exit_code, len(report.results), len(different(report))) == (0, len(LAYERS), 0)
    # A single file of a rendered folder has its manifest, and so its intervals.
    assert report.model == "shader"
    np.save(tmp_path / "a.npy", np.asfortranarray(pixels[..., :2]))
    np.save(tmp_path / "b.npy", np.ascontiguousarray(pixels[..., :2]).astype(">f4"))
    assert compare(tmp_path / "a.npy", tmp_path / "b.npy", "--exact") == 0


def test_names_by_map(tmp_path, capsys, reference):
    def rename(parts):
        out = dict(parts)
        out["ssao"] = replace(out.pop("merged"), name="ssao", channels=("R",))
        out["G"] = replace(out.pop("positions"), name="G", channels=("Z", "X", "Y"))
        return out

    mine = changed(reference, tmp_path / "mine", "module_003", rename) / "module_003.exr"
    right = reference / "module_003.exr"
    swapped = read_exr(mine)["G"]
    order = [swapped.channels.index(c) for c in ("Z", "X", "Y")]
    parts = read_exr(mine)
    parts["G"] = replace(swapped, channels=("X", "Y", "Z"), pixels=swapped.pixels[..., order])
    write_exr(mine, list(parts.values()))
    assert compare(mine, right) == 2
    assert compare(mine, right, "--map", "ssao=merged", "--map", "G=positions") == 0
    assert compare(mine, right, "--map", "ssao.R=merged.AO", "--map", "G.X=P.X", "--map", "G.Y=P.Y", "--map",
                   "G.Z=P.Z") == 0  # fmt: skip
    capsys.readouterr()
    assert compare(mine, right, "--map", "ssao=positions", "--map", "ssao=merged") == 3
    assert "'ssao' has 1 channels, positions has 3" in capsys.readouterr().out
    assert compare(mine, right, "--map", "blurred=merged", "--map", "G=positions") == 2
    assert compare(mine, right, "--map", "nothing=merged", "--map", "G=positions") == 2
    assert "module_003, merged: there is no layer or channel 'nothing'" in capsys.readouterr().out


def test_another_layers_channel_is_not_taken(tmp_path):
    """Without 'merged' its channel is not looked for in 'blurred', though that alone has a 'Y'."""
    ones = np.ones((4, 5), np.float32)
    for side, layers in (("mine", ["blurred"]), ("right", ["blurred", "merged"])):
        (tmp_path / side).mkdir()
        for layer in layers:
            np.save(tmp_path / side / f"module_000_{layer}.npy", ones)
    report = lfssao.compare(tmp_path / "mine", tmp_path / "right")
    assert report.exit_code == 2
    write_exr(tmp_path / "mine.exr", [Part("blurred", ("Y",), ones[..., None])])
    write_exr(tmp_path / "right.exr", [Part(name, ("Y",), ones[..., None]) for name in ("blurred", "merged")])
    report = lfssao.compare(tmp_path / "mine.exr", tmp_path / "right.exr")
    assert different(report) == {("right", "merged"): Verdict.MISSING}


def test_a_missing_layer_is_said_with_what_may_be_it(tmp_path, capsys, reference):
    """Another name, a wrong rule, files of other names."""

    def rename(parts):
        merged = parts.pop("merged")
        return {**parts, "ssao": replace(merged, name="ssao", channels=("ssao.R",))}

    mine = changed(reference, tmp_path / "mine", "module_004", rename)
    assert compare(mine, reference) == 2
    sentence = "if it is one of ssao.ssao.R, say so by --map, such as --map ssao.ssao.R=merged.AO"
    assert f"module_004, merged: there is no such layer; {sentence}" in capsys.readouterr().out
    assert compare(mine, reference, "--map", "nothing=merged", "--layers", "merged") == 2
    out = capsys.readouterr().out
    assert re.search("merged: there is no layer or channel 'nothing', which --map names: it has .*depth.Z", out)
    (tmp_path / "other").mkdir()
    shutil.copy(reference / "module_004.exr", tmp_path / "other" / "frame.exr")
    assert compare(tmp_path / "other", reference) == 2
    assert "has no file of it, such as module_003.exr or module_003_LAYER.npy" in capsys.readouterr().out


def test_plain_pictures(tmp_path, capsys):
    codes = np.random.default_rng(5).integers(0, 256, (9, 8, 4), np.uint8)
    Image.fromarray(codes).save(tmp_path / "a.png")
    other = codes.copy()
    other[3, 4, 1] ^= 1
    Image.fromarray(other).save(tmp_path / "b.png")
    assert compare(tmp_path / "a.png", tmp_path / "a.png") == 0
    assert "no interval is known" in capsys.readouterr().out
    assert compare(tmp_path / "a.png", tmp_path / "b.png") == 2
    report = lfssao.compare(tmp_path / "a.png", tmp_path / "b.png")
    (result,) = report.results
    # Alpha is not multiplied in: one code of one channel differs, by one.
    assert (result.metrics.differing, result.metrics.max_ulp, result.metrics.max_error) == (1, None, 1)
    assert (result.worst[0].column, result.worst[0].row) == (4, 3)


def test_folders_of_pictures(tmp_path):
    codes = np.arange(60, dtype=np.uint16).reshape(6, 10)
    for side in ("a", "b"):
        (tmp_path / side).mkdir()
        for name in ("one", "two"):
            Image.fromarray(codes).save(tmp_path / side / f"{name}.png")
    assert compare(tmp_path / "a", tmp_path / "b") == 0
    Image.fromarray(codes).save(tmp_path / "a" / "three.png")
    assert compare(tmp_path / "a", tmp_path / "b") == 1
    assert compare(tmp_path / "b", tmp_path / "a") == 2


def test_rows_from_below_by_their_tag_are_turned_and_other_sizes_are_not_decoded(tmp_path, capsys, reference):
    """A module's texture as TIFF of Orientation 4; and a PNG of more texels than memory holds, as its header says."""
    mine = tmp_path / "mine"
    mine.mkdir()
    for module in MODULES:
        pixels = read_exr(reference / f"{module}.exr")["merged"].pixels
        spec = oiio.ImageSpec(*pixels.shape[1::-1], 1, "float")
        spec.attribute("Orientation", 4)
        write_parts(mine / f"{module}_merged.tif", [(spec, np.ascontiguousarray(pixels[::-1]))])
    assert compare(mine, reference, "--layers", "merged") == 0
    (mine / f"{MODULES[0]}_merged.tif").unlink()
    path = mine / f"{MODULES[0]}_merged.png"
    Image.new("L", (4, 4)).save(path)
    data = bytearray(path.read_bytes())
    data[16:24] = (16_000).to_bytes(4, "big") * 2
    data[29:33] = zlib.crc32(data[12:29]).to_bytes(4, "big")
    path.write_bytes(data)
    capsys.readouterr()
    assert compare(mine, reference, "--layers", "merged") == 3
    assert "it has 16000x16000 texels, the reference's has" in capsys.readouterr().out


def test_z_of_a_vector_is_not_taken_for_depth(tmp_path):
    """Channels X, Y and Z are one layer, so that depth is missing."""
    flat = np.ones((4, 5, 3), np.float32)
    write_exr(tmp_path / "mine.exr", [Part("", ("X", "Y", "Z"), flat)])
    write_exr(tmp_path / "right.exr", [Part("depth", ("Z",), flat[..., :1]), Part("merged", ("AO",), flat[..., :1])])
    report = lfssao.compare(tmp_path / "mine.exr", tmp_path / "right.exr")
    assert verdicts(report)["right", "depth"] is Verdict.MISSING
