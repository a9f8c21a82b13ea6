"""lfssao agree names the bug of a set of views, planted in a renderer that shares nothing with the reference."""

import json
from dataclasses import dataclass

import numpy as np
import pytest
from jobs import manifest_of, render
from planted_bugs import Renderer, turns_of

import lfssao
from lfssao.cli.main import main
from lfssao.verify.agree.bugs import Bug, _is_wrong, _merged_exchanges
from lfssao.verify.compare.metrics import Metrics
from lfssao.verify.compare.result import Result
from lfssao.verify.verdict import Verdict

WIDTH = 80
HEIGHT = 60
JOB = ["ammonite", "--camera", "--resolution", f"{WIDTH}x{HEIGHT}", "--layers", "depth,positions,normals,ao"]
STEREO = [*JOB, "--stereo", "0.3", "--radii", "8%"]


@dataclass(frozen=True)
class Job:
    """A rendered folder, and a renderer of each of its views by name."""

    folder: object
    views: dict

    @classmethod
    def rendered(cls, folder, *words):
        manifest = manifest_of(render(folder, *words))
        views = {}
        for entry in manifest["views"]:
            textures = {k: np.squeeze(p.pixels) for k, p in lfssao.read_exr(folder / entry["file"]).items()}
            if manifest["settings"]["estimator"] == "point":
                textures.pop("normals", None)
            views[entry["name"]] = Renderer(manifest["settings"], entry["view"], textures)
        return cls(folder, views)

    def right(self):
        """Textures of occlusion, by view, of a renderer without a bug."""
        made = manifest_of(self.folder)["settings"]["estimator"]
        return {name: r.ao(1) if made == "lf" else r.points() for name, r in self.views.items()}


@pytest.fixture(scope="module")
def eyes(tmp_path_factory):
    return Job.rendered(tmp_path_factory.mktemp("bugs") / "eyes", *STEREO)


def save(folder, textures):
    """Textures as files, by view and layer."""
    folder.mkdir()
    for name, texture in textures.items():
        np.save(folder / f"{name}.npy", np.ascontiguousarray(texture, np.float32))
    return str(folder)


def agree(tmp_path, *words):
    """The command's figures, as JSON and as text."""
    assert main(["agree", *map(str, words), "--json", str(tmp_path / "made.json")]) == 0
    text = (tmp_path / "made.json").read_text()
    return json.loads(text), text


def bugs_of(tmp_path, job, textures):
    """Names of bugs, each with its views, where occlusion is other textures."""
    mine = save(tmp_path / "mine", {f"{name}_ao_1": texture for name, texture in textures.items()})
    made, _ = agree(tmp_path, job.folder, "--mine", mine)
    return {bug["name"]: bug["views"] for bug in made["bugs"]}, made


def occlusion(r, depth, radius):
    """Algorithm 1 by a depth texture and a radius of each texel, a function of the distance along the axis."""
    (matrix, back), (v, u) = (r.mapping[1].reshape(4, 4), r.back), np.indices(depth.shape) + 0.5
    seen = np.where(np.isfinite(depth), depth, 0.5).astype(np.float64)
    points = np.stack([u, v, seen, np.ones_like(seen)], axis=-1) @ back.T
    points = points[..., :3] / points[..., 3:]
    (c, s), size = r.turns.astype(np.float64), radius(points @ matrix[3, :3] + matrix[3, 3])
    count = np.zeros(depth.shape)
    for x, y, z in r.samples:
        offset = np.stack([x * c - y * s, x * s + y * c, np.full_like(c, z)], axis=-1)
        image = (points + offset * size[..., None]) @ matrix[:, :3].T + matrix[:, 3]
        i, j, z_image = (image[..., k] / image[..., 3] for k in range(3))
        inside = (i >= 0) & (i < WIDTH) & (j >= 0) & (j < HEIGHT)
        there = np.clip(j, 0, HEIGHT - 1).astype(int), np.clip(i, 0, WIDTH - 1).astype(int)
        count += inside & (depth[there] < z_image)
    return np.where(np.isfinite(depth), r.seen(count / len(r.samples)), 0)


def in_texels(r, texels):
    """Occlusion of a radius of so many texels."""
    matrix = r.mapping[1].reshape(4, 4)
    focal = np.linalg.norm(np.cross(matrix[0, :3], matrix[3, :3]))
    return occlusion(r, r.depth, lambda distance: texels * distance / focal)


def one_matrix(left, right):
    return {"left": left.ao(1), "right": right.ao(1, mapping=left.mapping)}


def one_view(left, right):
    return {"left": left.ao(1), "right": right.ao(1, mapping=left.mapping, back=left.back)}


def one_inverse(left, right):
    return {"left": left.ao(1, back=right.back), "right": right.ao(1)}


def texels(left, right):
    return {"left": in_texels(left, 7.3), "right": in_texels(right, 7.3)}


def by_screen(left, right):
    turns = turns_of("hash", 0, HEIGHT, 2 * WIDTH)[:, :, WIDTH:]
    return {"left": left.ao(1), "right": right.ao(1, turns=turns)}


def exchanged(left, right):
    return {"left": right.ao(1), "right": left.ao(1)}


def copied(left, right):
    return {"left": left.ao(1), "right": left.ao(1)}


def other_depth(left, right):
    return {"left": left.ao(1), "right": right.ao(1, depth=left.depth)}


def other_points(left, right):
    return {"left": left.ao(1), "right": occlusion(right, left.depth, lambda distance: 0 * distance + right.radii[0])}


def flipped(left, right):
    return {"left": left.ao(1)[::-1], "right": right.ao(1)}


def one_radius(left, right):
    return {"left": left.ao(1), "right": right.ao(1, radius=1.5)}


BOTH = ["left", "right"]
PLACE = "turns by the place in a texture of all views side by side, not in the view's own"
BUGS = [
    (one_matrix, "the matrix world to image of left, the inverse of its own", ["right"]),
    (one_view, "the mapping of left", ["right"]),
    (one_inverse, "the inverse matrix of right, world to image of its own", ["left"]),
    (texels, "radius in texels", BOTH),
    (by_screen, PLACE, ["right"]),
    (exchanged, "the occlusion of left and right is exchanged", BOTH),
    (copied, "the occlusion of left", ["right"]),
    (other_depth, "the depth of left", ["right"]),
    (other_points, "the depth of left, and points of it", ["right"]),
    (flipped, "rows from below", ["left"]),
    (one_radius, "radius", ["right"]),
]


@pytest.mark.parametrize(("plant", "name", "views"), BUGS, ids=[bug[0].__name__ for bug in BUGS])
def test_a_bug_of_two_eyes_has_its_name(eyes, tmp_path, capsys, plant, name, views):
    found, made = bugs_of(tmp_path, eyes, plant(**eyes.views))
    assert {kind: sorted(named) for kind, named in found.items()} == {name: views}
    assert made["unexplained"] == []
    where = (
        "all views" if views == BOTH else "{} alone, not of {}".format(*sorted(BOTH, key=lambda eye: eye not in views))
    )
    said = capsys.readouterr().out
    assert f"bug of {where}: " in said
    assert "% of " in said


def test_the_radius_in_texels_is_told(eyes, tmp_path):
    _, made = bugs_of(tmp_path, eyes, texels(**eyes.views))
    (bug,) = made["bugs"]
    assert float(bug["words"].split()[2]) == pytest.approx(7.3, rel=0.003)
    assert " of left and right (" in bug["words"]


@pytest.mark.parametrize("layers", [["depth", "positions", "ao_1"], ["ao_1"]])
def test_a_wrong_separation_has_its_name(eyes, tmp_path, layers):
    """Eyes 1.2 times as far apart: all textures of these views, and of occlusion alone by their matrices."""
    wide = Job.rendered(tmp_path / "wide", *STEREO[:-3], "0.36", *STEREO[-2:])
    if len(layers) > 1:
        textures = {f"{n}_{layer}": getattr(r, layer) for n, r in wide.views.items() for layer in layers}
    else:
        textures = {f"{n}_ao_1": r.ao(1, mapping=wide.views[n].mapping, back=wide.views[n].back)
                    for n, r in eyes.views.items()}  # fmt: skip
    made, _ = agree(tmp_path, eyes.folder, "--mine", save(tmp_path / "mine", textures))
    (bug,) = made["bugs"]
    assert bug["name"] == "separation of the views"
    assert bug["views"] == BOTH
    assert float(bug["words"].split()[5]) == pytest.approx(1.2, rel=0.01)


@pytest.mark.parametrize(("plant", "name"), [
    (lambda left, right: left.normals, "the normals of left"),
    (lambda left, right: -right.normals, "normals with the other sign"),
])  # fmt: skip
def test_normals_of_the_other_eye_have_their_name(tmp_path, plant, name):
    job = Job.rendered(tmp_path / "eyes", *STEREO, "--estimator", "hemisphere")
    left, right = job.views.values()
    found, _ = bugs_of(tmp_path, job, {"left": left.points(), "right": right.points(normals=plant(left, right))})
    assert found == {name: ["right"]}


@pytest.fixture(scope="module")
def turned(tmp_path_factory):
    """Two cameras that look at one place from two sides, each a folder of its own."""
    path = tmp_path_factory.mktemp("turned")
    made = []
    for name, x in (("a", -0.8), ("b", 0.8)):
        words = [*JOB, "--eye", f"{x},1,4", "--target", "0,0.5,0", "--radii", "8%", "--estimator", "hemisphere"]
        made.append(Job.rendered(path / name, *words))
    return made


def axes_of(r, folder):
    """Right, up and towards the viewer, (3, 3), of a folder's only view."""
    cast = np.reshape(manifest_of(folder)["views"][0]["view"]["cast_from_world"], (3, 4))[:, :3]
    return cast * [[1], [1], [-1]]


def test_normals_in_the_view_space_of_the_other_camera_have_their_name(turned, tmp_path):
    """The second camera reads its own normals by the first one's view matrix; no order of folders changes a byte."""
    own = [axes_of(r, job.folder) for job in turned for r in job.views.values()]
    mine = []
    for k, job in enumerate(turned):
        (r,) = job.views.values()
        normals = r.normals @ own[0].T @ own[k]
        mine.append(save(tmp_path / f"mine{k}", {"camera_ao_1": r.points(normals=normals.astype(np.float32))}))
    folders = [job.folder for job in turned]
    texts = []
    for order in ((0, 1), (1, 0)):
        words = [str(folders[k]) for k in order] + [word for k in order for word in ("--mine", mine[k])]
        made, text = agree(tmp_path, *words, "--same", "0.1")
        texts.append(text)
    assert texts[0] == texts[1]
    (bug,) = made["bugs"]
    first, second = (f"camera of {folder}" for folder in folders)
    assert bug["name"] == f"normals in the view space of {first} taken for its own"
    assert bug["views"] == [second]


# Right pairs: scene, separation and words
PAIRS = [
    ("statue", "0.1", ["--radii", "5%"]),
    ("statue", "0.6", ["--radii", "12%", "--samples", "3"]),
    ("ammonite", "0.3", ["--radii", "0.05", "--rotate", "none"]),
    ("ammonite", "0.05", ["--radii", "20%", "--samples", "17", "--rotate", "tiles"]),
    ("corner", "0.5", ["--radii", "3%", "--guard", "4"]),
    ("statue", "0.3", ["--radii", "8%", "--estimator", "point"]),
    ("ammonite", "0.4", ["--radii", "10%", "--estimator", "hemisphere", "--samples", "5"]),
    ("corner", "0.2", ["--radii", "4%", "--estimator", "point", "--parameter", "remap=true"]),
]


@pytest.mark.parametrize(("scene", "separation", "words"), PAIRS)
def test_a_right_pair_is_not_accused(tmp_path, capsys, scene, separation, words):
    job = Job.rendered(tmp_path / "eyes", scene, *JOB[1:], "--stereo", separation, *words)
    guard = int(words[-1]) if "--guard" in words else 0
    cut = slice(guard, -guard or None)
    found, made = bugs_of(tmp_path, job, {name: texture[cut, cut] for name, texture in job.right().items()})
    assert found == {}
    assert made["unexplained"] == []
    assert "mine conforms to the reference in all views: no bug is named" in capsys.readouterr().out


def test_what_no_change_explains_is_not_named(eyes, tmp_path, capsys):
    """Noise of the size of a sample in one eye."""
    textures = eyes.right()
    noise = np.random.default_rng(3).integers(-1, 2, textures["left"].shape) / 8
    textures["left"] = np.where(np.isfinite(eyes.views["left"].depth), np.clip(textures["left"] + noise, 0, 1), 0)
    found, made = bugs_of(tmp_path, eyes, textures)
    assert found == {}
    assert made["unexplained"] == ["left"]
    assert "mine is wrong in left, and no change that was tried explains it" in capsys.readouterr().out


@pytest.fixture(scope="module")
def modules(tmp_path_factory):
    words = ["statue", "--modules", "8:12", "--resolution", "80x48", "--radii", "8%", "--layers", "depth,positions,ao"]
    return Job.rendered(tmp_path_factory.mktemp("modules") / "modules", *words)


def test_the_mapping_of_one_module_for_all_is_told_once(modules, tmp_path, capsys):
    first, *others = modules.views
    mapping = modules.views[first].mapping
    found, _ = bugs_of(tmp_path, modules, {name: r.ao(1, mapping=mapping) for name, r in modules.views.items()})
    assert found == {f"the mapping of {first}": others}
    assert f"bug of {', '.join(others[:-1])} and {others[-1]} alone, not of {first}: " in capsys.readouterr().out


def test_modules_in_reverse_order_are_exchanged(modules, tmp_path, capsys):
    right = modules.right()
    found, made = bugs_of(tmp_path, modules, dict(zip(right, reversed(list(right.values())), strict=True)))
    assert {name: sorted(views) for name, views in found.items()} == {
        "the occlusion of 4 views is exchanged": sorted(right)
    }
    assert "bug of all views: " in capsys.readouterr().out
    assert made["unexplained"] == []


@pytest.mark.parametrize(("verdict", "figures", "wrong"), [
    (Verdict.DIFFERENT, {"max_error": 1e-5}, False), (Verdict.DIFFERENT, {"max_error": 1e-4}, True),
    (Verdict.DIFFERENT, {"nan_mismatches": 1}, True), (Verdict.OUTSIDE, {"max_error": 1e-6}, True),
    (Verdict.INSIDE, {"max_error": 1e-4}, False), (Verdict.WITHIN, {"max_error": 1e-4}, False),
])  # fmt: skip
def test_rounding_where_no_interval_is_known_is_not_wrong(verdict, figures, wrong):
    assert _is_wrong(Result("left", "ao_1", verdict, metrics=Metrics(4, 1, **figures))) == wrong


def test_views_that_take_each_others_are_exchanged():
    """Two of three views; a copy is no exchange."""
    one = Bug("the depth of view_001", ("view_002",), "first")
    other = Bug("the depth of view_002", ("view_001",), "second")
    copy = Bug("the normals of view_001", ("view_002",), "third")
    words = "the depth of view_001 and view_002 is exchanged: first; second"
    assert _merged_exchanges([one, copy, other]) == (
        copy,
        Bug(words.partition(":")[0], ("view_002", "view_001"), words),
    )
    assert _merged_exchanges([one, copy]) == (one, copy)
