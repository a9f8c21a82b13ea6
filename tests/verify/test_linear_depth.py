"""Depth that is given as distances: its intervals follow its own digits, whatever the planes are declared to be."""

import json
from dataclasses import replace

import numpy as np
import oracle_scenes as oracle
import pytest
import random_renderer as rr
import random_sums as rs
from compare_folders import compare, verdicts
from jobs import render, sentence

import lfssao
from lfssao import Buffers, Camera, read_exr
from lfssao.ao.estimators.registry import estimate, find_estimator
from lfssao.ao.estimators.sao.texel_rays import texel_rays
from lfssao.ao.ssao import unprojected
from lfssao.cli.main import main
from lfssao.optics.camera import linear_view
from lfssao.rendering.conversion import buffers_of
from lfssao.rendering.view_file import read_description
from lfssao.verify.bounds.bounds import Bounds
from lfssao.verify.bounds.error_model import find_model
from lfssao.verify.bounds.points import point_bounds
from lfssao.verify.bounds.ssao import ao_bounds, checked_view, distance_error, image_depth, with_depth_ends
from lfssao.verify.bounds.view import ViewBounds
from lfssao.verify.compare.source import Reference
from lfssao.verify.judge import stage_inputs
from lfssao.verify.verdict import Verdict

WIDTH = 96
HEIGHT = 72
PLANES = {"engine's": (0.1, 50.0), "near": (2.0, 20.0)}
RADIUS = 0.3


class Frame:
    """The statue as a renderer sees it: its own casts in float64, and its matrices in the conventions of OpenGL."""

    def __init__(self, near, far, away=1.0):
        self.mesh, self.planes = lfssao.find_scene("statue"), (near, far)
        middle = self.mesh.bounds.mean(axis=0)
        eye = middle + away * np.array([1.8, 1.4, 3.2])
        self.view = Camera("perspective", tuple(eye), tuple(middle), (0, 1, 0), 2.6, near, far).view(WIDTH, HEIGHT)
        seen = lfssao.RayCaster(self.mesh, self.view.cast_from_world).gbuffer(self.view, None, "geometric")
        self.surface, self.normals = seen.triangle >= 0, seen.normals
        f_u, f_v, c_u, c_v = self.view.lens[:4]
        j, i = np.indices(self.surface.shape) + 0.5
        self.rays = np.stack([(i - c_u) / f_u, (c_v - j) / f_v, np.ones_like(i)], axis=-1)
        cast = self.mesh.vertices @ self.view.cast_from_world[:, :3].T + self.view.cast_from_world[:, 3]
        a, b, c = (cast[self.mesh.faces[np.maximum(seen.triangle, 0), k]] for k in range(3))
        n = np.cross(b - a, c - a)
        z = np.einsum("ijk,ijk->ij", n, a) / np.einsum("ijk,ijk->ij", n, self.rays)
        self.z = np.where(self.surface, z, np.inf)

    def positions(self, factor=1.0):
        """World positions of the casts themselves, rounded once, with distances times a factor."""
        back = self.view.world_from_cast
        z = np.where(self.surface, factor * self.z, 0)[..., None]
        points = (self.rays * z) @ back[:, :3].T + back[:, 3]
        return np.where(self.surface[..., None], points, np.inf).astype(np.float32)

    def depth(self, kind):
        """A depth buffer's float32 numbers, rounded once, and those of its background."""
        near, far = self.planes
        window = far / (far - near) * (1 - near / self.z)
        kinds = {"linear": (self.z, 0), "view-z": (-self.z, 0), "reversed": (1 - window, 0), "window": (window, 1)}
        values, background = kinds[kind]
        return np.where(self.surface, values, background).astype(np.float32)

    def write(self, folder, kind):
        """Files that ``lfssao ao`` takes, and the options that name them."""
        folder.mkdir()
        (near, far), (f_u, f_v) = self.planes, self.view.lens[:2]
        eye = np.vstack([self.view.cast_from_world * [[1], [1], [-1]], [0, 0, 0, 1]])
        projection = np.zeros((4, 4))
        projection[0, 0], projection[1, 1], projection[3, 2] = 2 * f_u / WIDTH, 2 * f_v / HEIGHT, -1
        projection[2, 2:] = -(far + near) / (far - near), -2 * far * near / (far - near)
        said = {"kind": "camera", "clip": "opengl", "depth_kind": kind, "view": eye.tolist()}
        lines = [
            f"{name} = {json.dumps(value)}\n" for name, value in (said | {"projection": projection.tolist()}).items()
        ]
        (folder / "camera.toml").write_text("".join(lines))
        np.save(folder / "frame.npy", self.depth(kind))
        np.save(folder / "normals.npy", self.normals)
        files = (
            "--depth",
            folder / "frame.npy",
            "--normals",
            folder / "normals.npy",
            "--buffers",
            folder / "camera.toml",
        )
        return [*map(str, files), "--radii", str(RADIUS), "--blur", "0"]


@pytest.fixture(scope="module", params=PLANES)
def frame(request):
    return Frame(*PLANES[request.param])


@pytest.fixture(scope="module")
def frames():
    return [Frame(*planes) for planes in PLANES.values()]


ESTIMATORS = {
    "g3d": ["--like", "g3d", "--units", "world"],
    **{name: ["--estimator", name] for name in ("lf", "alchemy", "hbao", "point", "oriented-hemisphere", "vo-points")},
}
SAMPLED = "lf", "point", "oriented-hemisphere"
# Least shares of occluded texels in which 0.9 and 0.98 of AO are outside.
FOUND = {"g3d": (0.8, 0.1)}


def judged(frame, folder, kind, name):
    """AO of an estimator that ``lfssao ao`` made, and its bounds as ``compare`` has them."""
    words = [*frame.write(folder, kind), *ESTIMATORS[name], *(["--samples", "16"] if name in SAMPLED else [])]
    assert main(["ao", *words, "-o", str(folder / "out")]) == 0
    reference = Reference.open(folder / "out")
    _, case = reference.read("frame", reference.described("frame"))
    bounds = ViewBounds(case.parameters, stage_inputs({}, case), find_model("shader")).find("ao_1")
    assert isinstance(bounds, Bounds)
    return case.outputs["ao_1"], bounds


@pytest.mark.parametrize("kind", ["linear", "reversed"])
@pytest.mark.parametrize("name", ESTIMATORS)
def test_intervals_follow_the_depth_that_is_given_and_not_the_planes(frames, tmp_path, name, kind):
    widths = []
    for k, frame in enumerate(frames):
        ao, bounds = judged(frame, tmp_path / str(k), kind, name)
        occluded = ao > 0.02
        assert occluded.sum() > 300
        assert not bounds.outside(ao).any()
        shares = [bounds.outside(ao * np.float32(factor))[occluded].mean() for factor in (0.9, 0.98, 0.0)]
        for share, least in zip(shares, (*FOUND.get(name, (0.9, 0.9)), 0.95), strict=True):
            assert share > least
        widths.append(np.mean((bounds.upper - bounds.lower)[occluded]))
    assert widths[0] == pytest.approx(widths[1], rel=0.05)


def test_compare_refuses_wrong_ao_of_distances_between_the_planes_of_engines(frames, tmp_path):
    frame = frames[0]
    words = [*frame.write(tmp_path / "given", "linear"), *ESTIMATORS["g3d"]]
    assert main(["ao", *words, "-o", str(tmp_path / "right")]) == 0
    parts = read_exr(tmp_path / "right" / "frame.exr")
    assert parts["depth"].pixels[frame.surface, 0].tobytes() == frame.depth("linear")[frame.surface].tobytes()
    assert parts["depth"].attributes["depth"].startswith("linear z")
    (tmp_path / "mine").mkdir()
    np.save(tmp_path / "mine" / "frame_depth.npy", frame.depth("linear"))  # 0 where there is no surface
    for factor, code in ((1, 0), (0.98, 2), (0.9, 2), (0, 2)):
        np.save(tmp_path / "mine" / "frame_ao_1.npy", parts["ao_1"].pixels * np.float32(factor))
        words = "--layers", "depth,ao_1", "--stored", "depth=linear", "--no-diagnosis"
        assert compare(tmp_path / "mine", tmp_path / "right", *words) == code


@pytest.mark.parametrize("kind", ["linear", "view-z", "reversed"])
def test_positions_are_those_of_the_numbers_given(frame, tmp_path, kind):
    given, (near, far) = frame.depth(kind).astype(np.float64), frame.planes
    frame.write(tmp_path / "given", kind)
    said = read_description(tmp_path / "given" / "camera.toml", "", (WIDTH, HEIGHT, 0))
    made = buffers_of({"depth": frame.depth(kind)}, said)
    z = near * far / (near + given * (far - near)) if kind == "reversed" else np.abs(given)
    back = frame.view.world_from_cast
    points = (frame.rays * z[..., None]) @ back[:, :3].T + back[:, 3]
    s = frame.surface
    np.testing.assert_allclose(made.depth[s], z[s], rtol=2.0**-24 if kind == "reversed" else 0)
    np.testing.assert_allclose(made.positions[s], points[s], rtol=2.0**-24, atol=1e-12)
    assert np.isinf(made.depth[~s]).all()


def test_half_distances_are_those_of_the_numbers_given(frame, tmp_path):
    frame.write(tmp_path / "given", "linear")
    said = read_description(tmp_path / "given" / "camera.toml", "", (WIDTH, HEIGHT, 0))
    half = frame.depth("linear").astype(np.float16).astype(np.float32)
    made = buffers_of({"depth": half}, said).depth
    assert made[frame.surface].tobytes() == half[frame.surface].tobytes()


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_a_linear_view_casts_distances_and_has_an_inverse(projection):
    mesh = lfssao.find_scene("statue")
    view = Camera.looking_at(mesh.bounds, projection).view(40, 30)
    linear = linear_view(view)
    caster = lfssao.RayCaster(mesh, view.cast_from_world)
    seen = caster.gbuffer(linear)
    usual = caster.gbuffer(view)
    there = np.isfinite(usual.depth)
    assert seen.positions.tobytes() == usual.positions.tobytes()
    z = (usual.positions[there] @ view.cast_from_world[2, :3]) + view.cast_from_world[2, 3]
    np.testing.assert_allclose(seen.depth[there], z, rtol=1e-6)
    image = linear.image_z(seen.depth)
    np.testing.assert_allclose(linear.world_to_image(usual.positions[there])[:, 2], image[there], rtol=1e-5)
    back = unprojected(image.astype(np.float64), linear.screen_to_world)
    np.testing.assert_allclose(back[there], usual.positions[there], atol=1e-5)
    assert np.isposinf(image[~there]).all()
    assert vars(linear_view(linear, False))["depth_kind"] == view.depth_kind
    assert linear_view(linear, False).world_to_image.numbers.tobytes() == view.world_to_image.numbers.tobytes()


def drawn_view(rng, near=0.05, far=60.0):
    """A perspective camera whose surfaces are many near planes away; at the origin samples round less."""
    eye = rng.uniform(2, 6, 3) * rng.choice([-1, 1], 3)
    target = (0.0, 0.1, 0.2)
    if rng.random() < 0.5:
        eye = np.zeros(3)
        target = (0.0, 0.0, -4.0)
    extent = rng.uniform(0.5, 4)
    return Camera("perspective", tuple(eye), target, (0.0, 1.0, 0.0), extent, near, far).view(4, 3)


def next_to_decisions(rng, view, n, radius, placed):
    """Buffers of distances in which samples lie next to a texel's edge or a surface, and the samples.

    ``placed``: by positions, which may turn; else by offsets from the points that Algorithm 1 makes of depth.
    """
    near, far = view.lens[4:6]
    lens = np.array([*view.lens[:4], 1.0, 20.0, 0.0, 0.0])  # planes between which scenes of ``critical_scene`` lie
    usual = linear_view(replace(view, lens=lens), False)
    turns = oracle.random_turns(rng, (3, 4)) if placed and rng.random() < 0.5 else None

    def moved(samples, number):
        return samples[number] if turns is None else oracle.turned(samples[number], turns)

    depth, positions, samples = oracle.critical_scene(rng, usual, n, radius, moved)
    while not placed and positions is not None:
        depth, positions, samples = oracle.critical_scene(rng, usual, n, radius)
    positions = np.zeros((3, 4, 3), np.float32) if positions is None else positions
    z = 1.0 / (1 - np.where(depth < np.inf, depth, 0).astype(float) * (1 - 1 / 20.0))
    window = np.where(depth < np.inf, far / (far - near) * (1 - near / z), np.inf)
    shown = Buffers(view, depth, positions, None, turns)
    vars(shown)["depth"] = window  # float64: reversed depth is rounded once
    return oracle.in_distances(shown), samples


@np.errstate(all="ignore")
def hidden_points(ar, given, samples, radius, back=None):
    """Shares of hidden samples by renderers that compare distances, or -1 / distance, (R, H, W)."""
    (kind, m), own = rr.mapping_of(given), rs.linear_z(ar, given)
    there = np.isfinite(given.depth)
    image = ar.divide(-1.0, own)
    point = rr.spread(ar, given.positions)
    turn = None if given.turns is None else rr.turn_of(ar, given.turns)
    if back is not None:
        v, u = np.mgrid[: there.shape[0], : there.shape[1]] + 0.5
        rows = [ar.total(rr.single(back[4 * k : 4 * k + 4]), [u, v, np.where(there, image, -1), 1.0]) for k in range(4)]
        point = [ar.divide(row, rows[3])[..., None] for row in rows[:3]]
    offset = rr.offsets_of(ar, samples, radius)
    u, v, z, valid = rr.to_image(ar, kind, m, point, offset, turn)
    far = rr.row(ar, m, 3, point, offset) if turn is None else rr.turned_row(ar, m, 3, point, offset, turn)
    inside, j, i = rr.inside(given.depth, u, v, valid)
    of = np.arange(ar.renderers)[:, None, None, None]
    behind = ar.choose(ar.lot(0.5), own[of, j, i] < far, image[of, j, i] < z)
    count = np.count_nonzero(inside & there[j, i] & behind, axis=-1)
    return np.where(there, rr.fraction(ar, count, len(samples)), 0.0)


@pytest.mark.parametrize("model", ["shader", "nearest"])
@pytest.mark.parametrize("name", ["lf", "point"])
def test_no_renderer_that_compares_distances_leaves_its_bounds(name, model):
    """It reads linear depth, or makes distances of reversed depth in float32."""
    differing = undecided = 0
    for seed in range(25):
        rng = np.random.default_rng(seed)
        view = drawn_view(rng)
        radius = float(rng.choice([0.01, 0.3, 1.0]))
        n = int(rng.choice([1, 3, 12, 33]))
        given, samples = next_to_decisions(rng, view, n, radius, name == "point")
        back = np.ravel(given.view.screen_to_world) if name == "lf" else None
        if name == "lf":
            depth, room = image_depth(given.view, given.depth, find_model(model))
            around = given.view.world_to_image, samples, radius, model, given.view.screen_to_world, given.turns, room
            found = ao_bounds(depth, None, *around)
        else:
            found = point_bounds("point", given, radius, samples, None, find_estimator("point").parameters, model)
        made = hidden_points(oracle.arithmetic(model, rng, 40), given, samples, radius, back)
        oracle.assert_inside(made, found, name)
        assert not found.outside(estimate(name, given, radius, samples).texture).any()
        differing += int((made.max(0) - made.min(0) > 1e-3).sum())
        undecided += int((found.undecided > 0).sum())
    assert undecided >= differing > 20


@pytest.mark.parametrize("model", ["shader", "nearest"])
def test_distances_and_image_z_that_renderers_make_are_within_their_errors_and_near_them(model):
    rng = np.random.default_rng(1)
    limits = find_model(model)
    view = Camera("perspective", (0, 0, 0), (0, 0, -4), (0, 1, 0), 1, 0.05, 60.0).view(40, 30)
    window = 60 / (60 - 0.05) * (1 - 0.05 / rng.uniform(0.1, 50, (30, 40)))
    shown = Buffers(view, np.zeros((30, 40), "f4"), np.zeros((30, 40, 3), "f4"))
    vars(shown)["depth"] = window
    given = oracle.in_distances(shown)
    ar = oracle.arithmetic(model, rng, 40)
    own = rs.linear_z(ar, given)
    image, (depth, room) = ar.divide(-1.0, own), image_depth(given.view, given.depth, limits)
    for made, right, error in ((own, given.depth, distance_error(limits)), (image, depth, room)):
        off = np.abs(made / right.astype(np.float64) - 1).max()
        assert 0.3 * error < off < error
    seen = with_depth_ends(
        checked_view(depth, given.positions, given.view.world_to_image, 1.0, depth_error=room), limits
    )
    assert ((seen.low <= image.min(0)) & (image.max(0) <= seen.high)).all()


SAO = {"mip": ["rotated", "min", "max"], "log_q": [0, 1], "beta": [0.0, 0.01], "quad_edge": [0.0, 0.3],
       "gauss": [0.0, 0.0, 3.0], "normals": ["face", "buffer"], "landing": ["floor", "truncate"]}  # fmt: skip


@pytest.mark.parametrize("model", ["shader", "nearest"])
def test_no_renderer_of_sao_that_reads_distances_leaves_its_bounds(model):
    angle = find_model(model).angle
    for seed in range(25):
        rng = np.random.default_rng(seed)
        view = drawn_view(rng)
        n = int(rng.choice([3, 5, 14]))
        shape = (3, 4)
        rays = texel_rays(view, np.dtype(np.float32))
        options = {name: values[rng.integers(len(values))] for name, values in SAO.items()}
        texel = min(abs(rays.numbers[k + 4]) * 4.0 * rays.units[k // 5] for k in (0, 5))
        radius = float(rng.choice([2, 4]) / (1 - 0.5 / n) * texel)
        edge = options["quad_edge"] * radius  # where pairs are averaged or not
        z = rng.choice([4.0, 4.0 + edge], shape) if edge else rng.choice([4.0, 4.0, 4.2, 5.0], shape)
        z += rng.choice([0, 0, 0.01], shape) * rng.random(shape)
        z[rng.random(shape) < 0.1] = np.inf
        near, far = view.lens[4:6]
        phi = np.pi * (2 * rng.integers(0, n, shape) + 1) / n
        angles = rng.choice([0, 0.5, 1, 1.5], shape) * np.pi - phi + rng.uniform(-1, 1, shape) * angle
        turns = np.stack([np.cos(angles), np.sin(angles)]).astype(np.float32)
        towards = oracle.unit(rng.normal(size=(*shape, 3)) - 2 * oracle.unit(view.cast_from_world[2, :3]))
        usual = Buffers(view, np.zeros(shape, "f4"), np.zeros((*shape, 3), "f4"), towards.astype("f4"), turns)
        vars(usual)["depth"] = np.where(np.isfinite(z), far / (far - near) * (1 - near / z), np.inf)
        given = oracle.in_distances(usual)
        options = {**find_estimator("sao").parameters, **options, "sharpness": 10.0, "taps": n, "turns": 1}
        found = point_bounds("sao", given, radius, None, None, options, model)
        make = lambda ar: rs.sao(ar, given, rays, radius, options, angle)  # noqa: B023, E731
        oracle.hold_renderers(model, rng, make, found)
        assert not found.outside(estimate("sao", given, radius, None, **options).texture).any()


def own_distances(window, planes):
    """Distances that a shader makes of its window depth in float32; 0 where there is none."""
    near, far = map(np.float32, planes)
    return np.where(window < 1, near * far / (far - window * (far - near)), np.float32(0)).astype(np.float32)


@pytest.mark.parametrize("name", ["sao", "point", "alchemy"])
def test_a_renderers_own_distances_are_a_stage_of_a_reference_of_window_depth(frame, tmp_path, name):
    """They are judged against window depth, and AO on them; a wrong distance is named there and not at AO."""
    words = [*frame.write(tmp_path / "given", "window"), "--estimator", name]
    assert main(["ao", *words, "-o", str(tmp_path / "right")]) == 0
    reference = Reference.open(tmp_path / "right")
    case = reference.described("frame")
    own = own_distances(frame.depth("window"), frame.planes)
    (tmp_path / "mine").mkdir()

    def report(distances, factor, **stored):
        """AO of those distances, times a factor, compared."""
        z = np.where(distances > 0, distances, np.float32(np.inf))
        points = frame.rays * np.where(z < 9e9, z, 0).astype(float)[..., None]
        back = frame.view.world_from_cast
        positions = np.where((z < 9e9)[..., None], points @ back[:, :3].T + back[:, 3], np.inf).astype(np.float32)
        seen = Buffers(linear_view(frame.view), z, positions, frame.normals)
        settings = case.parameters["rotation"], case.parameters["rotation_seed"]
        points = case.inputs.get("points")
        ao = estimate(name, seen.turned(*settings), RADIUS, points, **case.parameters["options"]).texture
        np.save(tmp_path / "mine" / "frame_depth.npy", distances)
        np.save(tmp_path / "mine" / "frame_ao_1.npy", ao * np.float32(factor))
        layers = ("depth", "ao_1")
        made = lfssao.compare(tmp_path / "mine", tmp_path / "right", layers=layers, stored=stored, diagnosis=False)
        return made, *(verdicts(made)["frame", layer] for layer in layers)

    made, depth, _ = report(own, 1, depth="linear")
    assert (made.exit_code, depth) == (0, Verdict.INSIDE)
    assert "depth: linear" in str(made)
    assert report(own, 0.9, depth="linear")[1:] == (Verdict.INSIDE, Verdict.OUTSIDE)
    _, depth, ao = report(own * np.float32(1.02), 1, depth="linear")
    assert depth is Verdict.OUTSIDE
    assert ao in (Verdict.EQUAL_BITS, Verdict.INSIDE)
    assert report(own, 1)[1] is Verdict.OUTSIDE


def test_right_positions_fit_distances_that_window_depth_made_worse(tmp_path):
    frame = Frame(*PLANES["engine's"], away=5.0)
    mine = tmp_path / "mine"
    assert main(["ao", *frame.write(tmp_path / "given", "window"), "-o", str(tmp_path / "right")]) == 0
    mine.mkdir()
    np.save(mine / "frame_depth.npy", own_distances(frame.depth("window"), frame.planes))
    words = "--layers", "depth,positions", "--stored", "depth=linear", "--no-diagnosis"
    for factor, code in ((1, 0), (1.01, 2)):
        np.save(mine / "frame_positions.npy", frame.positions(factor))
        assert compare(mine, tmp_path / "right", *words) == code


def test_own_distances_and_positions_are_judged_by_the_mesh(tmp_path):
    folder = render(tmp_path / "right", "statue", "--camera", "--resolution", "48x36", "--radii", "0.3", "--blur", "0")
    parts = read_exr(folder / "camera.exr")
    reference = Reference.open(folder)
    near, far = reference.described("camera").parameters["view"]["lens"][4:6]
    window = parts["depth"].pixels[..., 0]
    mine = tmp_path / "mine"
    mine.mkdir()
    own = own_distances(np.where(np.isfinite(window), window, np.float32(1)), (near, far))
    positions = parts["positions"].pixels
    for factor, code in ((1, 0), (1.001, 2)):
        np.save(mine / "camera_depth.npy", own * np.float32(factor))
        for side in (1, -1):
            beside = np.where(np.isfinite(positions), np.nextafter(positions, np.float32(side * 9)), positions)
            np.save(mine / "camera_positions.npy", beside)
            words = "--layers", "depth,positions", "--stored", "depth=linear", "--no-diagnosis"
            assert compare(mine, folder, *words) == code


@pytest.mark.parametrize(("words", "reason"), [
    (["depth=linear"], "--stored: depth cannot be 'linear': the reference is not of a camera"),
    (["ao_1=linear"], "--stored: ao_1 cannot be 'linear'; formats are"),
])  # fmt: skip
def test_distances_are_of_cameras_alone(tmp_path, capsys, words, reason):
    folder = render(tmp_path / "right", "statue", "--display", "virtual", "--resolution", "12x8", "--radii", "0.3")
    capsys.readouterr()
    assert compare(folder, folder, "--stored", *words) == 4
    assert reason in sentence(capsys)
