"""lfssao agree: textures of known content in two eyes before a wall, orders of views, and what is refused."""

import json
import shutil
from math import sqrt

import numpy as np
import pytest
from jobs import edit, manifest_of, render, sentence
from PIL import Image

from lfssao import read_exr, write_exr
from lfssao.ao.reference import occluded_fraction
from lfssao.cli.main import main
from lfssao.rendering.manifest import digest
from lfssao.samples import texel_turns
from lfssao.verify.agree.measure import disagreement, share_points
from lfssao.verify.agree.split import SameSamples, estimated, has_seed, other_samples, split
from lfssao.verify.agree.truth import Truth, noise
from lfssao.verify.agree.views import open_folders, read_views

# A wall, |x| < 4 and |y| < 4 at z = 0, and a card, |x| < 0.3 and |y| < 0.3 at z = 1, before it.
WALL = "v -4 -4 0\nv 4 -4 0\nv 4 4 0\nv -4 4 0\nf 1 2 3 4\n"
CARD = "v -.3 -.3 1\nv .3 -.3 1\nv .3 .3 1\nv -.3 .3 1\nf 5 6 7 8\n"
WORDS = ["--camera", "--stereo", "0.6", "--eye", "0,0,4", "--target", "0,0,1"]
WORDS += ["--fov", "60", "--resolution", "48x40", "--samples", "4"]
EYES = {"left": -0.3, "right": 0.3}


@pytest.fixture(scope="module")
def rooms(tmp_path_factory):
    """A folder of the wall, and one of the wall and the card, both eyes each."""
    path = tmp_path_factory.mktemp("agree")
    for name, text in (("wall", WALL), ("card", WALL + CARD)):
        (path / f"{name}.obj").write_text(text)
        render(path / name, str(path / f"{name}.obj"), *WORDS, "--radii", "0.5")
    return path


@pytest.fixture
def wall(rooms, tmp_path):
    return shutil.copytree(rooms / "wall", tmp_path / "wall")


@pytest.fixture
def card(rooms, tmp_path):
    return shutil.copytree(rooms / "card", tmp_path / "card")


def paint(folder, value):
    """Put ``value(name, positions)`` into ao_1 of both eyes."""
    for number, name in enumerate(EYES):
        path = folder / f"{name}.exr"
        parts = read_exr(path)
        positions = parts["positions"].pixels
        parts["ao_1"].pixels[..., 0] = value(name, positions)
        write_exr(path, list(parts.values()))
        edit(folder, "views", number, "textures", "ao_1", "sha256", value=digest(parts["ao_1"].pixels))
    return folder


def agree(tmp_path, *words):
    """The text that the command writes."""
    assert main(["agree", *map(str, words), "--json", str(tmp_path / "made.json")]) == 0
    return (tmp_path / "made.json").read_text()


def constants(left, right):
    return lambda name, positions: left if name == "left" else right


def test_two_constants_differ_everywhere(wall, tmp_path, capsys):
    found = json.loads(agree(tmp_path, paint(wall, constants(0.2, 0.5))))
    made = found["disagreement"]["reference"]
    assert made["rms"] == pytest.approx(0.3, abs=1e-7)
    assert made["above"] == 1
    # One pair a point: each eye sees its own texels, and most of the other's.
    assert found["views"] == ["left", "right"]
    assert 0.9 * found["points"] < found["shared"] == found["pairs"] < found["points"]
    said = capsys.readouterr().out
    assert f"{found['shared']:,} are seen by two or more" in said
    assert "reference        0.3000 100.00 %" in said


def test_what_depends_on_the_place_alone_agrees_within_the_reading(wall, tmp_path):
    """The nearest texel is half a texel away, and a texel of the wall is 8 tan(30 degrees) / 40 wide."""
    made = json.loads(agree(tmp_path, paint(wall, lambda name, positions: positions[..., 0] / 8 + 0.5)))
    assert 0 < made["disagreement"]["reference"]["rms"] < 0.5 * sqrt(1 / 3) / 40
    assert made["disagreement"]["reference"]["above"] == 0


def test_half_of_the_wall_differs_by_half(wall, tmp_path):
    """Squares are averaged, not the differences."""
    lit = paint(wall, lambda name, positions: np.where(positions[..., 1] > 0, 0.5 * (name == "left"), 0.25))
    made = json.loads(agree(tmp_path, lit))["disagreement"]["reference"]
    assert made["above"] == pytest.approx(0.5, abs=0.03)
    assert made["rms"] == pytest.approx(0.5 * sqrt(made["above"]), rel=1e-12)


def test_a_point_that_the_card_hides_from_an_eye_does_not_count(card):
    """The card is 0.9 in both, the wall 0.2 and 0.5: whoever read the card for the wall would be off by 0.4 or 0.7."""

    def value(name, positions):
        return np.where(positions[..., 2] > 0.5, 0.9, 0.2 if name == "left" else 0.5)

    views = read_views(open_folders([paint(card, value)], "ao_1"), None)
    shared = share_points(views)
    left, right = shared.read([seen.arrays["ao_1"] for seen in views], "")
    off = np.abs(left - right)
    before = shared.points[:, 2] > 0.5
    assert before.any()
    np.testing.assert_array_equal(off[before], 0)
    np.testing.assert_allclose(off[~before], 0.3, atol=1e-7)
    # Lines from the eyes at z = 4 to the wall meet the card's plane at a quarter of the way back.
    for eye in EYES.values():
        x = 0.75 * shared.points[~before, 0] + 0.25 * eye
        y = 0.75 * shared.points[~before, 1]
        assert not ((np.abs(x) < 0.25) & (np.abs(y) < 0.25)).any()


def save(folder, **textures):
    """Another renderer's files, by names."""
    folder.mkdir(exist_ok=True)
    for name, texture in textures.items():
        np.save(folder / f"{name}.npy", np.broadcast_to(texture, (40, 48)))
    return folder


def test_another_renderers_textures_beside_the_references(wall, tmp_path, capsys):
    paint(wall, constants(0.25, 0.375))
    mine = save(tmp_path / "mine", left_ao_1=np.float32(0.2), right_ao_1=np.float32(0.5))
    made = json.loads(agree(tmp_path, wall, "--mine", mine))["disagreement"]
    assert made["mine"]["rms"] == pytest.approx(0.3, abs=1e-7)
    assert made["mine"]["above"] == 1
    assert made["reference"] == {"rms": 0.125, "above": 1}
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines[1:4]] == ["ao_1", "mine", "reference"]


def test_mine_is_found_and_stored_as_compare_says(wall, tmp_path):
    """Codes of 8 bits; files by a pattern; visibility."""
    mine = save(tmp_path / "mine", a_left=np.uint8(255), a_right=np.uint8(204))
    words = ["--mine", mine, "--files", "a_{module}.npy=vis", "--map", "vis=1-ao_1"]
    made = json.loads(agree(tmp_path, wall, *words))["disagreement"]["mine"]
    assert made["rms"] == pytest.approx(0.2, abs=1e-7)


def test_one_folder_of_mine_for_each_folder(wall, tmp_path):
    """Files of one name are of the folder in the same place, in either order."""
    shutil.copytree(wall, tmp_path / "again")
    folders = [wall, tmp_path / "again"]
    mine = []
    for number, value in enumerate((0.25, 0.75)):
        mine.append(save(tmp_path / f"mine{number}", left_ao_1=np.float32(value), right_ao_1=np.float32(value)))
    texts = [agree(tmp_path, *folders[::s], "--mine", mine[::s][0], "--mine", mine[::s][1]) for s in (1, -1)]
    assert texts[0] == texts[1]
    # Each point is seen by its own view in both folders; of its four views' six pairs four are of two folders.
    assert 4 / 6 <= json.loads(texts[0])["disagreement"]["mine"]["above"] < 0.72
    assert json.loads(agree(tmp_path, *folders, "--mine", mine[0]))["disagreement"]["mine"]["rms"] == 0


@pytest.mark.parametrize(("textures", "words", "wrong"), [
    ({"left_ao_1": np.float32(0)}, [], "ao_1 of right: there is no file of this view"),
    ({"left_ao_1": np.float32(0), "right_x": np.float32(0)}, [], "ao_1 of right: there is no such layer"),
    ({"left_ao_1": np.float32(0), "right_ao_1": np.float32(np.nan)}, [], "of right is not finite"),
    ({"left_ao_1": np.float64(0), "right_ao_1": np.float32(0)}, [], "ao_1 of left: it is of float64"),
    ({"left_ao_1": np.float32(0)}, ["--mine", "MINE", "--mine", "MINE"], "--mine: 3 are given"),
    ({"left_ao_1": np.float32(0)}, ["--files", "x_{module}.npy"], "--files: no file is 'x_{module}.npy'"),
])  # fmt: skip
def test_what_is_wrong_with_mine_is_one_sentence(rooms, tmp_path, capsys, textures, words, wrong):
    mine = str(save(tmp_path / "mine", **textures))
    words = [word.replace("MINE", mine) for word in words]
    assert main(["agree", str(rooms / "wall"), "--mine", mine, *words]) == 2
    assert wrong in sentence(capsys)


def test_rays_of_a_wall_agree_to_the_bit(wall, tmp_path, rooms, capsys):
    """It hides nothing of itself: 1/2 of the whole ball, whatever the textures hold."""
    made = json.loads(agree(tmp_path, paint(wall, constants(0.2, 0.5)), "--truth", "--mesh", rooms / "wall.obj"))
    assert made["disagreement"]["rays"] == {"rms": 0, "above": 0}
    assert made["noise_of_rays"] == 0
    assert "rays             0.0000   0.00 %" in capsys.readouterr().out
    views = read_views(open_folders([wall], "ao_1"), None)
    shared = share_points(views)
    rays = Truth(views[0], str(rooms / "wall.obj"))
    values = shared.read([rays.cast(*both)[0] for both in zip(views, shared.places, strict=True)], "rays")
    np.testing.assert_array_equal(values, 0.5)


def test_rays_know_a_crease(tmp_path):
    """A floor, z = 0, and a wall, x = 0, that is 4 high: (arccos c - c sqrt(1 - c^2)) / pi, c = x / R."""
    (tmp_path / "crease.obj").write_text(
        "v 0 -4 0\nv 4 -4 0\nv 4 4 0\nv 0 4 0\nv 0 -4 4\nv 0 4 4\nf 1 2 3 4\nf 1 4 6 5\n"
    )
    words = [*WORDS[:2], "0.3", "--eye", "2,0,5", "--target", "1,0,0", "--resolution", "24x20", "--radii", "0.5"]
    crease = str(tmp_path / "crease.obj")
    folder = render(tmp_path / "crease", crease, *words, "--estimator", "gtao")
    views = read_views(open_folders([folder], "ao_1"), None)
    shared = share_points(views)
    rays = Truth(views[0], crease)
    errors = []
    for seen, places in zip(views, shared.places, strict=True):
        texture, error = rays.cast(seen, places)
        errors.append(error)
        read = np.isin(np.arange(480).reshape(20, 24), places)
        x, y, z = np.moveaxis(seen.arrays["positions"], 2, 0)
        floor = read & (z < 1e-4) & (np.abs(y) < 3) & (x > 0.01)
        c = np.minimum(x[floor] / 0.5, 1)
        off = texture[floor] - (np.arccos(c) - c * np.sqrt(1 - c * c)) / np.pi
        near = c < 0.95
        assert np.sqrt(np.mean(off[near] ** 2)) < 0.005 / sqrt(2)
        np.testing.assert_allclose(off, 0, atol=0.015)
        assert near.sum() > 50
        deepest = texture.argmax()
        (one,) = np.flatnonzero(rays.cast(seen, np.array([deepest, -1]))[0])  # other texels cast no rays
        assert one == deepest
        assert error.max() <= 0.003
    found = json.loads(agree(tmp_path, folder, "--truth", "--mesh", crease))
    assert found["noise_of_rays"] == noise(shared, errors)
    assert 0 < found["noise_of_rays"] < 0.005


def test_noise_of_rays_by_hand(wall):
    """Errors 0.003 and 0.004 have 0.005 in the difference of each pair."""
    views = read_views(open_folders([wall], "ao_1"), None)
    assert noise(share_points(views), [np.full((40, 48), e) for e in (0.003, 0.004)]) == pytest.approx(0.005, rel=1e-12)


@pytest.mark.parametrize("words", [
    [], ["--rotate", "none"], ["--estimator", "sao", "--guard", "3"], ["--estimator", "gtao"],
    ["--estimator", "vo-points", "--sampling", "halton"],
])  # fmt: skip
def test_the_own_seed_gives_the_references_bits(rooms, tmp_path, words):
    """And another one gives others, or there is no other."""
    layers = "depth,positions,normals,ao"
    room = str(rooms / "card.obj")
    folder = render(tmp_path / "made", room, *WORDS[:-2], "--radii", "0.5", "--layers", layers, *words)
    for seen in read_views(open_folders([folder], "ao_1"), None):
        own = seen.arrays["ao_1"]
        np.testing.assert_array_equal(estimated(seen, None, 0), own)
        other = estimated(seen, other_samples(seen), 1)
        assert has_seed(seen) == (other != own).any()


@pytest.mark.parametrize(("words", "layer"), [
    (["--estimator", "gtao", "--rotate", "none"], "ao_1"), (["--layers", "positions,ao"], "ao_1"), ([], "merged"),
])  # fmt: skip
def test_samples_without_another_seed_have_no_parts(rooms, tmp_path, words, layer):
    folder = render(tmp_path / "made", str(rooms / "card.obj"), *WORDS[:-2], "--radii", "0.5", *words)
    assert json.loads(agree(tmp_path, folder, "--layer", layer))["parts_of_reference"] is None


def test_the_disagreement_of_a_tilted_wall_is_noise_of_samples(tmp_path, capsys):
    """Turns about z put more or fewer samples behind it; both eyes see all of it within R, by the guard band."""
    (tmp_path / "tilted.obj").write_text("v -8 -8 -4\nv 8 -8 4\nv 8 8 4\nv -8 8 -4\nf 1 2 3 4\n")
    room = str(tmp_path / "tilted.obj")
    found = json.loads(agree(tmp_path, render(tmp_path / "made", room, *WORDS, "--radii", "0.5", "--guard", "10")))
    parts = found["parts_of_reference"]
    rms = found["disagreement"]["reference"]["rms"]
    assert rms > 0.1
    assert sum(parts.values()) == pytest.approx(rms**2, rel=1e-12)
    assert abs(parts["rest"]) < 0.07 * rms**2
    assert abs(parts["missing"]) < 0.01 * rms**2
    assert "% noise of samples" in capsys.readouterr().out


def test_the_disagreement_at_borders_is_no_noise(rooms, tmp_path, capsys):
    """Turns about z change nothing on a wall z = 0 but for samples that leave the texture, which the other eye sees."""
    found = json.loads(agree(tmp_path, rooms / "wall"))
    parts = found["parts_of_reference"]
    square = found["disagreement"]["reference"]["rms"] ** 2
    assert parts["missing"] + parts["rest"] > 0.1 * square
    assert parts["missing"] > 0.05 * square
    assert sum(parts.values()) == pytest.approx(square, rel=1e-12)
    assert f"{100 * parts['missing'] / square:.1f} % missing surface, " in capsys.readouterr().out


def test_what_a_card_hides_of_a_wall_is_missing_surface(rooms, tmp_path):
    """Each eye finds samples before the wall behind the card, which are in the open for the other eye."""
    words = [*WORDS[:-2], "--radii", "0.5", "--guard", "10", "--samples", "16"]
    for name, least, most in (("card", 0.2, 0.5), ("wall", 0.0, 0.01)):
        folder = render(tmp_path / name, str(rooms / f"{name}.obj"), *words)
        found = json.loads(agree(tmp_path, folder))
        square = found["disagreement"]["reference"]["rms"] ** 2
        assert least * square <= found["parts_of_reference"]["missing"] <= most * square


@pytest.mark.parametrize("words", [["--guard", "1"], ["--estimator", "point"]])
def test_the_same_samples_are_looked_up_in_the_other_eyes_depth(rooms, tmp_path, words):
    """By Algorithm 2 as it is printed, of points with the turns of the texels that they come from."""
    layers = ["--layers", "depth,positions,normals,ao"]
    folder = render(tmp_path / "made", str(rooms / "card.obj"), *WORDS, "--radii", "0.5", *layers, *words)
    views = read_views(open_folders([folder], "ao_1"), None)
    shared = share_points(views)
    assert SameSamples(shared).is_known
    own = [seen.arrays["ao_1"] for seen in views]
    values = SameSamples(shared).values(own, None, 0)
    np.testing.assert_array_equal(np.isfinite(values), np.stack(shared.places) >= 0)
    settings = manifest_of(folder)["settings"]
    size = views[0].view.height, views[0].view.width
    turns = texel_turns("hash", *size, settings["rotation_seed"], np.dtype(np.float32))
    checked = 0
    for n in range(0, len(shared.points), 7):
        k = shared.owners[n]
        row, column = (x + views[0].view.guard for x in divmod(int(shared.places[k][n]), 48))
        other = views[1 - k]
        depth = next(layer.texture for layer in other.layers if layer.name == "depth")
        given = shared.points[n].astype(np.float32), other.view.world_to_image, settings["samples"], 0.5
        checked += float(occluded_fraction(depth, *given, turns[:, row, column])) == values[1 - k, n]
        assert values[k, n] == own[k].reshape(-1)[shared.places[k][n]]
    assert checked >= 0.98 * len(range(0, len(shared.points), 7))  # ties are of the order of sums


def test_estimators_that_make_points_of_depth_tell_no_missing_surface(rooms, tmp_path):
    words = ["--estimator", "sao", "--rotate", "hash", "--radii", "0.5", "--layers", "depth,positions,normals,ao"]
    folder = render(tmp_path / "made", str(rooms / "card.obj"), *WORDS[:-2], *words)
    found = json.loads(agree(tmp_path, folder))
    parts = found["parts_of_reference"]
    rms = found["disagreement"]["reference"]["rms"]
    assert parts.pop("missing") is None
    assert sum(parts.values()) == pytest.approx(rms**2, rel=1e-12)


def test_the_parts_of_known_noise_are_found(wall):
    """The left view is 0.25 above the right one, and each value has noise of its own of deviation 0.1."""
    views = read_views(open_folders([wall], "ao_1"), None)
    draw = np.random.default_rng(5).normal(0, 0.1, (2, 2, 40, 48))
    own, others = draw + np.reshape([0.25, 0.0], (2, 1, 1))
    parts = split(share_points(views), own, others)
    assert parts.noise == pytest.approx(2 * 0.1**2, rel=0.1)
    assert parts.missing is None
    assert parts.rest == pytest.approx(0.25**2, rel=0.1)


def test_the_parts_of_known_values_are_found(wall):
    """The left view is 0.5 above the right one, and by the same samples 0.25 with one seed and 0.125 with the other."""
    views = read_views(open_folders([wall], "ao_1"), None)
    shared = share_points(views)
    own, others = ([np.full((40, 48), each) for each in pair] for pair in ((0.75, 0.25), (0.5, 0.0)))
    seen = np.where(np.stack(shared.places) >= 0, 1.0, np.nan)
    parts = split(shared, own, others, (seen * [[0.25], [0.0]], seen * [[0.125], [0.0]]))
    assert parts.missing == 0.25 * 0.125
    assert parts.rest == 0.5 * 0.5 - 0.25 * 0.125
    assert parts.noise == 0.0


def test_a_picture_of_the_points(wall, tmp_path):
    agree(tmp_path, paint(wall, constants(0.2, 0.2)), "--picture", tmp_path / "same.png")
    agree(tmp_path, paint(wall, constants(0.2, 0.5)), "--picture", tmp_path / "other.png")
    same, other = (np.asarray(Image.open(tmp_path / f"{name}.png").convert("RGB")) for name in ("same", "other"))
    assert same.shape == other.shape
    # From the brightest of the colour map to the darkest, in the wall's place
    dark = [picture[200:250, 150:250].sum(axis=2) < 100 for picture in (same, other)]
    assert not dark[0].any()
    assert dark[1].mean() > 0.1


def test_by_hand():
    values = np.array([[0.0, 0.5, np.nan, 0.25], [0.5, np.nan, np.nan, 0.25], [0.25, 0.75, 1.0, 0.3125]])
    # Pairs: 0.5, 0.25, 0.25 of the first point, 0.25 of the second, none of the third, 0, 0.0625, 0.0625 of the last.
    found = disagreement(values)
    assert found.rms == sqrt((0.25 + 3 * 0.0625 + 2 * 0.0625**2) / 7)
    assert found.above == 4 / 7


def test_no_order_of_folders_or_views_changes_a_bit(card, tmp_path):
    """Also that of the files of a folder, and of views in the manifest."""
    paint(card, lambda name, positions: np.sin(7 * positions[..., 0] + (name == "left")) ** 2)
    wide = shutil.copytree(card, tmp_path / "wide")
    paint(wide, lambda name, positions: np.cos(9 * positions[..., 1] + (name == "left")) ** 2)
    texts = [agree(tmp_path, card, wide), agree(tmp_path, wide, card)]
    texts.append(agree(tmp_path, wide / "right.exr", card / "right.exr", wide / "left.exr", card / "left.exr"))
    edit(card, "views", value=manifest_of(card)["views"][::-1])
    texts.append(agree(tmp_path, card, wide))
    assert len(set(texts)) == 1
    assert json.loads(texts[0])["pairs"] > json.loads(texts[0])["shared"]


def test_values_in_any_order_have_the_same_bits():
    values = np.random.default_rng(3).random((7, 500))
    values[values > 0.9] = np.nan
    found = disagreement(values)
    orders = np.random.default_rng(4).permuted([range(7)] * 9, axis=1)
    assert all(disagreement(values[order]) == found for order in orders)
    assert disagreement(values[:, ::-1]) == found


def test_a_guard_band_changes_where_texels_stand_and_nothing_else(rooms, tmp_path):
    """The band is of texels beyond the view, of which depth and positions alone have any."""
    words = ["--radii", "0.5", "--guard", "6"]
    banded = render(tmp_path / "banded", str(rooms / "wall.obj"), *WORDS, *words)
    value = constants(0.2, 0.5)
    for name in EYES:
        assert read_exr(banded / f"{name}.exr")["positions"].pixels.shape == (52, 60, 3)
    for number, name in enumerate(EYES):
        parts = read_exr(banded / f"{name}.exr")
        parts["ao_1"].pixels[..., 0] = value(name, None)
        write_exr(banded / f"{name}.exr", list(parts.values()))
        edit(banded, "views", number, "textures", "ao_1", "sha256", value=digest(parts["ao_1"].pixels))
    plain = paint(shutil.copytree(rooms / "wall", tmp_path / "plain"), value)
    made = [json.loads(agree(tmp_path, folder)) for folder in (banded, plain)]
    for each in made:
        del each["parts_of_reference"]  # turns are those of the texels' places
    assert made[0] == made[1]


def test_chosen_modules(tmp_path):
    words = ["statue", "--resolution", "40x24", "--radii", "5%", "--samples", "1", "--modules", "9:12"]
    folder = render(tmp_path / "statue", *words)
    assert json.loads(agree(tmp_path, folder))["views"] == ["module_009", "module_010", "module_011"]
    assert json.loads(agree(tmp_path, folder, "--modules", "10:12"))["views"] == ["module_010", "module_011"]


@pytest.mark.parametrize(("words", "wrong"), [
    (["WALL", "--layer", "ao_7"], "has no 'ao_7': choose one of shaded, depth"),
    (["WALL", "--layer", "depth"], "--layer: 'depth' is none of occlusion"),
    (["WALL", "WALL/left.exr"], "a view is given twice"),
    (["WALL/left.exr"], "there is one view: two are needed"),
    (["WALL", "CARD"], "are of two scenes"),
    (["WALL/../wall.obj"], "it is not what 'lfssao render' writes, its views are not known"),
    (["WALL/.."], "there is no image"),
    (["WALL", "--same", "1e-9"], "no point of the surface is seen by two views, within 1e-09"),
    (["WALL", "--same", "0"], "--same: 0 is not a number above 0"),
    (["WALL", "--json", "nowhere/a.json"], "--json: there is no folder nowhere"),
    (["WALL", "--map", "a=ao_1"], "--map and --files are of --mine"),
    (["WALL", "--mesh", "WALL.obj"], "--mesh is of --truth"),
    (["WALL", "--truth"], "is no embedded one: give its file by --mesh"),
    (["WALL", "--truth", "--mesh", "CARD.obj"], "card.obj is not the scene that the reference was rendered of"),
    (["WALL", "--truth", "--mesh", "WALL.obj", "--layer", "merged"], "rays are of one radius, ao_1 or another"),
    (["WALL", "--estimator", "none.py"], "--estimator: none.py"),
    (["WALL", "--picture", "a.gif"], "--picture: a.gif does not end in .png or .svg or .pdf"),
    (["WALL", "WIDE"], "are rendered with other radii"),
])  # fmt: skip
def test_what_cannot_agree_is_one_sentence(rooms, tmp_path, capsys, words, wrong):
    if "WIDE" in words:
        render(tmp_path / "wide", str(rooms / "wall.obj"), *WORDS, "--radii", "0.25")
        capsys.readouterr()
    places = {"WALL": rooms / "wall", "CARD": rooms / "card", "WIDE": tmp_path / "wide"}
    for name, place in places.items():
        words = [word.replace(name, str(place)) for word in words]
    assert main(["agree", *words]) == 2
    assert wrong in sentence(capsys)


@pytest.mark.parametrize(("keys", "value"), [
    (["sampling"], "x"), (["sampling", "seed"], []), (["settings"], {}), (["settings", "estimator"], []),
    (["settings", "rotation_seed"], "x"), (["views", 1, "view", "guard"], "x"),
])  # fmt: skip
def test_manifests_that_render_did_not_write_are_one_sentence(wall, capsys, keys, value):
    edit(wall, *keys, value=value)
    assert main(["agree", str(wall)]) == 2
    assert str(wall) in sentence(capsys)


def test_spoiled_folders_are_one_sentence(wall, capsys):
    edit(wall, "views", 0, "view", "width", value=47)
    assert main(["agree", str(wall)]) == 2
    assert "textures of left are not of its view's size" in sentence(capsys)
    edit(wall, "views", 0, "textures", "ao_1", "sha256", value="0")
    assert main(["agree", str(wall)]) == 2
    assert "its part ao_1 is not what manifest.json describes" in sentence(capsys)
    edit(wall, "views", 0, "textures", value={"ao_1": manifest_of(wall)["views"][0]["textures"]["ao_1"]})
    assert main(["agree", str(wall)]) == 2
    assert "it has no layer positions" in sentence(capsys)
