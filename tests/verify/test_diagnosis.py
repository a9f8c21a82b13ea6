"""The diagnosis of ``compare``: bugs planted in another renderer, with values drawn, are called by their names."""

import functools
import os
import zlib
from dataclasses import dataclass, replace

import numpy as np
import pytest
from compare_folders import changed, ordered
from jobs import manifest_of, render
from planted_bugs import Renderer, moved, turned, turns_of

import lfssao
from lfssao.cli.main import main
from lfssao.files.exr import read_exr
from lfssao.verify.bounds.depth import displaced
from lfssao.verify.bounds.error_model import MODELS
from lfssao.verify.compare.causes import causes_of
from lfssao.verify.compare.source import Reference
from lfssao.verify.diagnosis import diagnose
from lfssao.verify.diagnosis.diagnose import WrongTexture
from lfssao.verify.judge import judge, stage_inputs
from lfssao.verify.verdict import Judgement, Verdict

SIZE = "--resolution", "128x96"
JOBS = {
    "display": ("--display", "sample-a", "--modules", "8:11", *SIZE, "--blur", "1.3", "--radii", "3%,5%,8%"),
    "shared": ("--display", "sample-a", "--modules", "9:10", *SIZE, "--radii", "3%,5%", "--rotate", "none"),
    "camera": ("--camera", *SIZE, "--radii", "3%,4%"),
    "curved": ("--display", "convex", "--modules", "20:21", *SIZE, "--radii", "3%,4%"),
    "hemisphere": ("--display", "sample-a", "--modules", "9:10", *SIZE, "--radii", "5%", "--estimator", "hemisphere"),
    "point": ("--display", "sample-a", "--modules", "9:10", *SIZE, "--radii", "5%", "--estimator", "point"),
    "remapped": ("--display", "sample-a", "--modules", "9:10", *SIZE, "--radii", "5%", "--estimator", "point",
                 "--parameter", "remap=true", "--parameter", "range_check=true"),
    "lit": ("--display", "sample-a", "--modules", "9:10", *SIZE, "--radii", "5%", "--light", "1,2,3", "--ambient",
            "0.4"),
    "lit all": ("--display", "sample-a", "--modules", "9:10", *SIZE, "--radii", "5%", "--light", "1,2,3", "--occlude",
                "all"),
}  # fmt: skip


@dataclass(frozen=True)
class Bug:
    """The bug planted in a layer of a job: the texture made with values, which are drawn from ranges."""

    job: str
    layer: str
    kind: str  # the diagnosis, with the values in braces where its name has them
    make: object
    ranges: tuple = ()
    format: str = "float"

    def __str__(self):
        return f"{self.job}: {self.layer} {self.format}, {self.kind}"

    def draw(self, number):
        rng = np.random.default_rng([zlib.crc32(self.kind.encode()), number])
        return [rng.integers(*ends) if isinstance(ends[0], int) else rng.uniform(*ends) for ends in self.ranges]


STORE = {
    "float": np.asarray,
    "half": np.float16,
    "unorm8": lambda x: np.rint(255 * np.clip(x, 0, 1)) / 255,
    "cut8": lambda x: np.floor(255 * np.clip(x, 0, 1)) / 255,
    "unorm16": lambda x: np.rint(65535 * np.clip(x, 0, 1)) / 65535,
    "srgb8": lambda x: decoded(STORE["unorm8"](encoded(np.clip(x, 0, 1)))),
}
WIDTH = 128
HEIGHT = 96
FLIP_U = np.array([[-1, 0, WIDTH], [0, 1, 0]])
FLIP_V = np.array([[1, 0, 0], [0, -1, HEIGHT]])
SHIFT = ((-1.7, 1.7),)
NEAR = ((0.6, 1.6),)


def but(n, k, other):
    """How often each sample counts."""
    return np.where(np.arange(n) == k, other, 1)


def on_sphere(samples):
    return samples / np.linalg.norm(samples, axis=1)[:, None]


def mirrored(samples, axis):
    return samples * np.where(np.arange(3) == axis, -1, 1)


def ao(kind, make, *ranges, job="display"):
    return Bug(job, "ao_1" if job in ("hemisphere", "point", "remapped") else "ao_2", kind, make, ranges)


def by_camera(r, change):
    """Occlusion by a camera whose image is changed, a matrix of homogeneous texels and depth (u w, v w, z w, w)."""
    return r.ao(mapping=(r.mapping[0], np.ravel(change @ matrix_of(r))), back=r.back @ np.linalg.inv(change))


def matrix_of(r):
    return np.reshape(r.mapping[1], (4, 4)) / np.linalg.norm(r.mapping[1][12:15])


def zoomed(u, v):
    """Images larger by factors, about their middle."""
    change = np.diag([u, v, 1.0, 1.0])
    change[:2, 3] = (1 - u) * WIDTH / 2, (1 - v) * HEIGHT / 2
    return change


def of_angle(r, factor):
    """A camera whose vertical field of view, an angle, is larger by a factor."""
    _, v, _, distance = matrix_of(r)[:, :3]
    half = np.arctan(HEIGHT / 2 / np.linalg.norm(v - (v @ distance) * distance))
    return by_camera(r, zoomed(*[np.tan(half) / np.tan(factor * half)] * 2))


def of_planes(r, near=1.0, far=1.0):
    """A camera whose planes are at other distances: depth is slope - offset / distance."""
    _, _, z, distance = matrix_of(r)
    slope = z[:3] @ distance[:3]
    offset = slope * distance[3] - z[3]
    near = near * offset / slope
    far = far * offset / (slope - 1)
    change = np.eye(4)
    other = far * near / (far - near)
    change[2] = 0, 0, other / offset, far / (far - near) - slope * other / offset
    return by_camera(r, change)


AO = [
    *(ao("radius", lambda r, x: r.ao(radius=x), *NEAR, job=job) for job in ("display", "camera", "curved")),
    ao("field of view", of_angle, (0.7, 1.4), job="camera"),
    ao("aspect", lambda r, x: by_camera(r, zoomed(x, 1)), *NEAR, job="camera"),
    ao("near plane", lambda r, x: of_planes(r, near=x), (0.6, 0.95), job="camera"),
    ao("far plane", lambda r, x: of_planes(r, far=x), (1.1, 2.0), job="camera"),
    *(ao("shift of u", lambda r, x: r.ao(image=moved(x)), *SHIFT, job=job) for job in ("display", "camera", "curved")),
    ao("shift of v", lambda r, x: r.ao(image=moved(0, x)), *SHIFT),
    ao("shift of u and v", lambda r, x, y: r.ao(image=moved(x, y)), *SHIFT, *SHIFT),
    *(ao("depth bias", lambda r, x: r.ao(depth=r.depth + np.float32(x)), ends)
      for ends in ((0.008, 0.03), (-0.03, -0.008), (0.0008, 0.008), (-0.008, -0.0008))),
    ao("depth scale", lambda r, x: r.ao(depth=r.depth * np.float32(x)), (1.01, 1.2)),
    ao("strength", lambda r, x: r.ao() * x, (0.4, 0.95)),
    ao("power", lambda r, x: r.ao() ** x, (1.2, 2.5)),
    ao("turned samples", lambda r, x: r.ao(samples=turned(r.samples, x)), (20.0, 340.0)),
    ao("u flipped", lambda r: r.ao(image=FLIP_U)),
    ao("v flipped", lambda r: r.ao(image=FLIP_V)),
    ao("u and v flipped", lambda r: r.ao(image=FLIP_U + FLIP_V - moved())),
    ao("u and v transposed", lambda r: r.ao(image=moved()[[1, 0]])),
    ao("look-ups at the nearest centre, half a texel off", lambda r: r.ao(image=moved(0.5, 0.5))),
    ao("look-ups half a texel up and left", lambda r: r.ao(image=moved(-0.5, -0.5))),
    ao("texel corners in place of centres", lambda r: r.ao(back=r.back @ np.array(
        [[1, 0, 0, -0.5], [0, 1, 0, -0.5], [0, 0, 1, 0], [0, 0, 0, 1]])), job="camera"),
    ao("samples outside the texture occluded", lambda r: r.ao(border=-np.inf)),
    *(ao(f"samples outside the texture held by {name}", lambda r, mode=mode: r.ao(border=mode))
      for name, mode in (("clamp", "edge"), ("mirror", "symmetric"), ("wrap", "wrap"),
                         ("mirror without the edge", "reflect"))),
    ao("surDepth > smp.z in place of <", lambda r: r.ao(behind=np.greater, border=-np.inf)),
    ao("depth with the other sign", lambda r: r.ao(depth=-r.depth)),
    ao("background counted as occluder", lambda r: r.ao(depth=r.seen(r.depth, -np.inf))),
    ao("depth of half precision", lambda r: r.ao(depth=r.depth.astype(np.float16)), job="camera"),
    ao("positions of half precision", lambda r: r.ao(positions=r.positions.astype(np.float16).astype("f8"))),
    ao("samples mirrored in all axes", lambda r: r.ao(samples=-r.samples)),
    ao("length of sample 5", lambda r, x: r.ao(samples=r.samples * np.where(np.arange(8) == 5, x, 1)[:, None]), *NEAR),
    ao("samples of seed 17 in place of 0", lambda r: r.ao(samples=lfssao.make_samples(n=8, seed=17))),
    ao("turns of seed 5 in place of 0", lambda r: r.ao(turns=turns_of("hash", 5, HEIGHT, WIDTH))),
    ao("turns of the next column", lambda r: r.ao(turns=turns_of("hash", 0, HEIGHT + 1, WIDTH + 1)[:, :-1, 1:])),
    ao("turns of (row, column)", lambda r: r.ao(turns=turns_of("hash", 0, WIDTH, HEIGHT).transpose(0, 2, 1))),
    ao("offsets with x and y exchanged", lambda r: r.ao(
        samples=r.samples[:, [1, 0, 2]], turns=r.turns * np.float32([[[1]], [[-1]]]))),
    ao("rows from below", lambda r: r.ao()[::-1]),
    ao("columns from the right", lambda r: r.ao()[:, ::-1]),
    ao("bias", lambda r, x: r.ao() + x, (0.001, 0.1)),
    ao("1 - ao in place of ao", lambda r: 1 - r.ao()),
    *(ao("count divided by {} in place of 8", lambda r, n: r.ao(divisor=n), ends) for ends in ((9, 16), (4, 8))),
    *(ao(f"sample {{}} {words}, count divided by {n}",
         lambda r, k, times=times, n=n: r.ao(counts=but(8, k, times), divisor=n), (0, 8))
      for words, times, n in (("dropped", 0, 8), ("dropped", 0, 7), ("doubled", 2, 8), ("doubled", 2, 9))),
    *(ao(f"samples of '{name}'", lambda r, name=name: r.ao(samples=lfssao.make_samples(name, 8)))
      for name in ("jittered", "sobol")),
    ao("samples are not turned", lambda r: r.ao(turns=None)),
    ao("samples are not turned", lambda r: r.points(turns=None), job="hemisphere"),
    ao("samples turned the other way", lambda r: r.ao(turns=r.turns * np.float32([[[1]], [[-1]]]))),
    ao("samples turned by 'tiles'", lambda r: r.ao(turns=turns_of("tiles", 0, HEIGHT, WIDTH))),
    ao("samples turned by 'ign'", lambda r: r.ao(turns=turns_of("ign", 0, HEIGHT, WIDTH)), job="shared"),
    *(ao(f"samples mirrored in {'xyz'[k]}", lambda r, k=k: r.ao(samples=mirrored(r.samples, k))) for k in (2, 0)),
    *(ao(f"samples with {words} exchanged", lambda r, order=order: r.ao(samples=r.samples[:, order]))
      for words, order in (("x and y", [1, 0, 2]), ("y and z", [0, 2, 1]), ("x and z", [2, 1, 0]))),
    ao("samples without z", lambda r: r.ao(samples=r.samples * [1, 1, 0])),
    *(ao(f"the first 6 samples alone, count divided by {n}",
         lambda r, n=n: r.ao(counts=1.0 * (np.arange(8) < 6), divisor=n)) for n in (8, 6)),
    ao("samples on the sphere of radius R", lambda r: r.ao(samples=on_sphere(r.samples))),
    ao("the mapping of module_009", lambda r: r.ao(mapping=other(r, 1).mapping)),
    ao("the mapping of module_010 (modules in reverse order)", lambda r: r.ao(mapping=other(r, 2).mapping)),
    ao("positions in physical space", lambda r: r.ao(positions=r.physical)),
    ao("samples not turned to the normal's side", lambda r: r.points(normals=None), job="hemisphere"),
    ao("normals with the other sign", lambda r: r.points(normals=-r.normals), job="hemisphere"),
    ao("normals made from positions", lambda r: r.points(normals=r.sloped_normals()), job="hemisphere"),
    ao("radius", lambda r, x: r.points(radius=x), *NEAR, job="hemisphere"),
    ao("radius", lambda r, x: r.points(radius=x), *NEAR, job="point"),
    ao("2 max(0, ao - 1/2) in place of ao", lambda r: r.points(remap=True), job="point"),
    ao("flat surfaces hide themselves, ao in place of 2 max(0, ao - 1/2)", lambda r: r.points(remap=False),
       job="remapped"),
    ao("strength", lambda r, x: x * r.points(), (0.4, 0.95), job="remapped"),
    ao("no range check", lambda r: r.points(range_check=False), job="remapped"),
]  # fmt: skip


def of(layer):
    return lambda kind, make, *ranges, job="display": Bug(job, layer, kind, make, ranges)


merged, blurred, shaded, depth, positions, color = map(
    of, ("merged", "blurred", "shaded", "depth", "positions", "color")
)
LATER = [
    merged("mean in place of maximum", lambda r: r.layers.mean(axis=0)),
    merged("sum in place of maximum", lambda r: r.layers.sum(axis=0)),
    merged("minimum in place of maximum", lambda r: r.layers.min(axis=0)),
    *(merged(f"ao_{k + 1} missing", lambda r, k=k: np.delete(r.layers, k, axis=0).max(axis=0)) for k in range(3)),
    merged("1 - product of (1 - ao) in place of maximum", lambda r: 1 - np.prod(1 - r.layers, axis=0)),
    merged("strength", lambda r, x: r.merged * x, (0.4, 0.95)),
    merged("rows from below", lambda r: r.merged[::-1]),
    blurred("columns from the right", lambda r: r.blurred[:, ::-1]),
    blurred("the first pass of the blur of half precision", lambda r: r.blur(half=True)),
    shaded("rows from below", lambda r: r.shaded[::-1]),
    blurred("sigma", lambda r, x: r.blur(x), *NEAR),
    blurred("not blurred", lambda r: r.merged),
    blurred("blurred horizontally alone", lambda r: r.blur(axes=(1,))),
    blurred("blurred vertically alone", lambda r: r.blur(axes=(0,))),
    blurred("texels outside the texture zero", lambda r: r.blur(mode="constant")),
    blurred("texels outside the texture left out, weights normalised anew", lambda r: r.blur(mode="constant left out")),
    blurred("texels outside the texture held by mirror", lambda r: r.blur(mode="reflect")),
    blurred("texels outside the texture held by wrap", lambda r: r.blur(mode="wrap")),
    *(blurred(f"kernel cut at {n} sigma in place of 3", lambda r, n=n: r.blur(reach=n)) for n in (2, 4)),
    blurred("weights not normalised, Gaussian density", lambda r: r.blur(total=np.sqrt(2 * np.pi) * r.sigma)),
    blurred("weights not normalised, 1 in the middle", lambda r: r.blur(total=1.0)),
    shaded("image x ao in place of image x (1 - ao)", lambda r: r.shade(ao=1 - r.blurred)),
    shaded("shaded in sRGB", lambda r: decoded(encoded(r.color) * (1 - r.blurred[..., None]))),
    shaded("image without ao", lambda r: r.color),
    shaded("1 - ao without the image", lambda r: np.repeat(1 - r.blurred[..., None], 3, axis=-1)),
    shaded("shaded in sRGB and left there", lambda r: encoded(r.color) * (1 - r.blurred[..., None])),
    shaded("red and blue exchanged", lambda r: r.shade()[..., ::-1]),
    shaded("stored in sRGB", lambda r: encoded(r.shaded)),
    shaded("ao taken off twice", lambda r: r.shade(r.shaded)),
    shaded("merged in place of blurred", lambda r: r.shade(ao=r.merged)),
    shaded("strength", lambda r, x: r.shade(ao=r.blurred * x), (0.4, 0.95)),
    shaded("ao on all light in place of the ambient term", lambda r: r.lit(occlude="all"), job="lit"),
    shaded("ao on the ambient term in place of all light", lambda r: r.lit(occlude="ambient"), job="lit all"),
    shaded("light direction with the other sign", lambda r: r.lit(sign=-1), job="lit"),
    shaded("n . l below 0 not held at 0", lambda r: r.lit(faced=np.asarray), job="lit"),
    shaded("no light, image x (1 - ao)", lambda r: r.shade(), job="lit"),
    shaded("max(n . l, 0) not times 1 - ambient", lambda r: r.lit(direct=1 / 0.6), job="lit"),
    shaded("image x ao in place of image x (1 - ao)", lambda r: r.lit(ao=1 - r.blurred), job="lit"),
    shaded("strength", lambda r, x: r.lit(ao=r.blurred * x), (0.4, 0.95), job="lit all"),
    shaded("ambient", lambda r, x: r.lit(ambient=0.4 * x, direct=(1 - 0.4 * x) / 0.6), (0.5, 0.9), job="lit"),
]
GBUFFER = [
    depth("shift of u", lambda r, x: off_centre(x, 0), (-0.9, 0.9)),
    depth("shift of u and v", lambda r, x, y: off_centre(x, y), (0.2, 0.9), (-0.9, -0.2)),
    *(Bug("camera", "depth", f"eye {axis}", lambda r, x, k=k: of_eye(x * np.eye(3)[k]), ((0.01, 0.08),))
      for k, axis in enumerate("xy")),
    depth("depth bias", lambda r, x: r.depth + x, (0.004, 0.1)),
    depth("depth scale", lambda r, x: r.depth * x, (1.3, 80.0)),
    depth("depth with the other sign", lambda r: r.seen(-r.depth, np.inf)),
    depth("half precision", lambda r: r.depth.astype(np.float16)),
    depth("u flipped", lambda r: r.depth[:, ::-1]),
    depth("v flipped", lambda r: r.depth[::-1]),
    depth("the depth of module_009", lambda r: other(r, 1).depth),
    depth("the depth of module_010 (modules in reverse order)", lambda r: other(r, 2).depth),
    positions("positions in physical space", lambda r: r.physical),
    positions("positions of half precision", lambda r: r.positions.astype(np.float16)),
    positions("x with the other sign", lambda r: r.positions * [-1, 1, 1]),
    positions("x and y exchanged", lambda r: r.positions[..., [1, 0, 2]]),
    positions("y and z exchanged", lambda r: r.positions[..., [0, 2, 1]]),
    positions("x and z exchanged", lambda r: r.positions[..., [2, 1, 0]]),
    positions("z up in place of y up", lambda r: r.positions[..., [0, 2, 1]] * [1, -1, 1]),
    positions("scale", lambda r, x: r.positions * x, (20.0, 900.0)),
    positions("bias of y", lambda r, x: r.positions + np.array([0, x, 0]), (0.1, 0.6)),
    positions("shift of u and v", lambda r, x, y: r.unprojected(0.5 + x, 0.5 + y), *SHIFT, *SHIFT),
    positions("shift of v", lambda r, y: r.unprojected(v=0.5 + y), *SHIFT),
    positions("depth of half precision", lambda r: r.unprojected(depth=r.depth.astype(np.float16))),
    positions("rows from below", lambda r: r.positions[::-1]),
    positions("columns from the right", lambda r: r.positions[:, ::-1]),
    positions("v flipped", lambda r: r.unprojected(v=HEIGHT - 0.5 - 2 * np.indices(r.depth.shape)[0])),
    color("stored in sRGB", lambda r: encoded(r.color)),
    color("red and blue exchanged", lambda r: r.color[..., ::-1]),
    color("strength", lambda r, x: r.color * x, (0.4, 0.95)),
]  # fmt: skip
STORED = [
    replace(bug, format=format)
    for format, bug in (
        ("unorm8", ao("radius", lambda r, x: r.ao(radius=x), *NEAR)),
        ("half", ao("shift of u", lambda r, x: r.ao(image=moved(x)), *SHIFT)),
        ("unorm8", ao("count divided by {} in place of 8", lambda r, n: r.ao(divisor=n), (4, 8))),
        ("cut8", merged("codes cut, not rounded", lambda r: r.merged)),
        ("cut8", ao("codes cut, not rounded", lambda r: r.ao())),
        ("unorm8", merged("strength", lambda r, x: r.merged * x, (0.4, 0.95))),
        ("unorm16", merged("mean in place of maximum", lambda r: r.layers.mean(axis=0))),
        ("unorm8", blurred("sigma", lambda r, x: r.blur(x), *NEAR)),
        ("srgb8", shaded("strength", lambda r, x: r.shade(ao=r.blurred * x), (0.4, 0.95))),
        ("half", depth("depth bias", lambda r, x: r.depth + x, (0.01, 0.1))),
        ("srgb8", color("strength", lambda r, x: r.color * x, (0.4, 0.95))),
    )
]


def encoded(x):
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)


def decoded(x):
    return np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4)


@functools.cache
def mesh():
    return lfssao.builtin_scene("gallery")


def of_eye(shift):
    """Depth of the camera, moved without being turned."""
    camera = lfssao.Camera.looking_at(mesh().bounds)
    camera = replace(camera, eye=tuple(camera.eye + shift), target=tuple(camera.target + shift))
    view = camera.view(WIDTH, HEIGHT)
    return lfssao.RayCaster(mesh(), view.cast_from_world).gbuffer(view, color=None).depth


def off_centre(u, v):
    """Depth of module 8, looked at (u, v) texels off the centres."""
    view = lfssao.module_views(mesh(), lfssao.find_display("sample-a").with_resolution(WIDTH, HEIGHT), range(8, 9))[0]
    return lfssao.RayCaster(mesh(), view.cast_from_world).gbuffer(displaced(view, u, v), color=None).depth


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A job's rendered folder, made when it is first asked for."""

    @functools.cache
    def rendered(job):
        return render(tmp_path_factory.mktemp(job) / "reference", "gallery", *JOBS[job])

    return rendered


@functools.cache
def renderer(folder, number=0):
    manifest = manifest_of(folder)
    entry = manifest["views"][number]
    parts = read_exr(folder / f"{entry['name']}.exr")
    textures = {name: np.squeeze(ordered(part).pixels) for name, part in parts.items()}
    made = Renderer(manifest["settings"], entry["view"], textures)
    made.folder, made.name = folder, entry["name"]
    return made


def other(r, number):
    return renderer(r.folder, number)


def compared(r, target, options=None, **textures):
    """The results on a copy of a view with other textures."""

    def change(parts):
        for name, texture in textures.items():
            own = ordered(parts[name])
            parts[name] = replace(own, pixels=np.asarray(texture, np.float32).reshape(own.pixels.shape))

    mine = changed(r.folder, target / "mine", r.name, change)
    report = lfssao.compare(mine, r.folder, layers=list(textures), **(options or {}))
    return {result.layer: result for result in report.results if result.module == r.name}


@pytest.fixture
def tried(monkeypatch):
    """All changes that searches try."""
    found = []
    best = diagnose.Search.best

    def spy(search):
        found.extend(search.changes)
        return best(search)

    monkeypatch.setattr(diagnose.Search, "best", spy)
    return found


def agrees(kind, value, planted):
    value, planted = (x % 360 if kind == "turned samples" else x for x in (value, planted))
    return value == pytest.approx(planted, **({"abs": 0.01} if "shift" in kind else {"rel": 0.01}))


DRAWN = [
    (bug, number)
    for bug in (*AO, *LATER, *GBUFFER, *STORED)
    for number in range(2 if bug.ranges and os.environ.get("LFSSAO_WHOLE") else 1)
]


@pytest.fixture(autouse=True)
def few_texels(monkeypatch):
    """A third of the texels on which values are made good: these textures are small."""
    monkeypatch.setattr(diagnose, "_POLISHED", 200_000)


@pytest.mark.parametrize(("bug", "number"), DRAWN, ids=str)
def test_a_planted_bug_is_named(bug, number, folder, tmp_path, tried):
    r = renderer(folder(bug.job))
    values = bug.draw(number)
    with np.errstate(all="ignore"):
        texture = STORE[bug.format](bug.make(r, *values))
    stored = {} if bug.format == "float" else {bug.layer: bug.format.replace("cut", "unorm")}
    result = compared(r, tmp_path, {"stored": stored}, **{bug.layer: texture})[bug.layer]
    assert result.verdict is Verdict.OUTSIDE
    found = result.diagnosis
    best = result.diagnosis.candidates[0]
    assert (best.kind, found.fits) == (bug.kind.format(*values), True), found.words("M")
    for value, planted in zip(best.values, values, strict=False):  # some values stand in the name
        assert agrees(best.kind, value, planted)
    axes = [axis for change in tried if change.kind == best.kind for axis in change.axes]
    assert not {axis.value(step) for axis in axes for step in axis.steps} & set(values)


@pytest.mark.parametrize("number", range(2))
@pytest.mark.parametrize("bug", [
    ao("radius and shift of u", lambda r, x, y: r.ao(radius=x, image=moved(y)), (0.6, 0.8), (0.1, 0.3)),
    ao("samples are not turned and shift of u", lambda r, x: r.ao(turns=None, image=moved(x)), (0.2, 0.4)),
], ids=str)  # fmt: skip
def test_two_bugs_at_once_are_named_together(bug, number, folder, tmp_path):
    r = renderer(folder(bug.job))
    values = bug.draw(number)
    kinds = bug.kind.split(" and ")
    found = compared(r, tmp_path, **{bug.layer: bug.make(r, *values)})[bug.layer].diagnosis
    best = found.candidates[0]
    assert (best.kind, found.fits) == (bug.kind, True)
    assert all(map(agrees, kinds[-len(values) :], best.values, values))
    said = {"radius": "radius x {:.4f}", "shift of u": "u shifted by {:.3f} texels"}
    words = " and ".join(said.get(kind, kind) for kind in kinds).format(*best.values)
    assert found.words("module_008").startswith(f"{words} explains ")


def test_a_pair_of_changes_is_told_once_of_all_textures_and_with_texels_whose_samples_leave_them(folder, tmp_path):
    r = renderer(folder("display"))
    results = compared(r, tmp_path, **{f"ao_{k}": r.ao(k, turns=None, image=moved(0.31)) for k in (1, 2)})
    (cause,) = causes_of(list(results.values()))
    assert (cause.kind, cause.layers) == ("samples are not turned and shift of u", ("ao_1", "ao_2"))
    assert [result.diagnosis.left_out for result in results.values()] == [0, 0]


def test_changes_tie_in_all_textures_and_with_texels_whose_samples_leave_them(folder, tmp_path, monkeypatch):
    searched = WrongTexture._searched
    retry = WrongTexture._retry

    def twins(texture, *given):
        first = searched(texture, *given)[0]
        return [first, replace(first, change=replace(first.change, kind="twin"))]

    def with_twin(texture, known, changes, *given):
        return retry(texture, known, {**changes, "twin": replace(changes["shift of v"], kind="twin")}, *given)

    monkeypatch.setattr(WrongTexture, "_searched", twins)
    monkeypatch.setattr(WrongTexture, "_retry", with_twin)
    r = renderer(folder("display"))
    shifted = {f"ao_{k}": r.ao(k, image=moved(0, 0.3)) for k in (1, 2)}
    for result in compared(r, tmp_path, **shifted).values():
        found = result.diagnosis
        assert [candidate.kind for candidate in found.candidates[: found.equal]] == ["shift of v", "twin"]
        assert found.left_out == 0


def test_noise_is_explained_by_nothing(folder, tmp_path):
    r = renderer(folder("display"))
    found = compared(r, tmp_path, ao_2=np.random.default_rng(5).random(r.depth.shape))["ao_2"].diagnosis
    assert (found.fits, found.candidates) == (False, ())
    assert found.nearest < 0.3
    assert found.left_out > 0
    share = f"{100 * max(found.nearest, 0):.2f} % of {found.wrong} wrong texels"
    best = f"{share}, without {found.left_out} of which a sample leaves the texture"
    assert found.words("module_008") == f"no setting of lf comes near module_008 (best {best})"


@pytest.mark.parametrize(("kind", "make"), [
    ("radius", lambda r, size: r.ao(radius=1 + size)),
    ("shift of v", lambda r, size: r.ao(image=moved(0, size))),
    ("turned samples", lambda r, size: r.ao(samples=turned(r.samples, size))),
])  # fmt: skip
def test_a_change_is_named_that_turns_ten_texels(kind, make, folder, tmp_path, monkeypatch):
    for limit in ("_MOST", "_POLISHED"):  # as if the texture were ten times as large
        monkeypatch.setattr(diagnose, limit, 1)
    monkeypatch.setattr(diagnose, "_FEWEST", 600)
    r = renderer(folder("display"))
    size = 1e-5
    while np.count_nonzero(make(r, size) != r.ao_2) < 10:
        size *= 1.2
    found = compared(r, tmp_path, ao_2=make(r, size))["ao_2"].diagnosis
    assert found.texels > 0.9 * np.isfinite(r.depth).sum()  # each that the change makes wrong counts
    assert kind in [candidate.kind for candidate in found.candidates[: found.equal]], found.words("M")


def test_a_change_of_two_values_is_not_told_by_seven_texels(folder, tmp_path):
    r = renderer(folder("display"))
    size = 1e-5
    while np.count_nonzero(r.ao(image=moved(size, -size)) != r.ao_2) < 6:
        size *= 1.2
    found = compared(r, tmp_path, ao_2=r.ao(image=moved(size, -size)))["ao_2"].diagnosis
    assert not [c.kind for c in found.candidates if found.fits and len(c.values) > 1], found.words("M")


def test_a_diagnosis_can_be_left_out(folder, tmp_path, capsys):
    r = renderer(folder("display"))
    assert compared(r, tmp_path, {"diagnosis": False}, ao_2=r.ao(radius=1.3))["ao_2"].diagnosis is None
    words = ["compare", str(tmp_path / "mine"), str(r.folder), "--layers", "ao_2"]
    assert main([*words, "--no-diagnosis"]) == 2
    silent = capsys.readouterr().out
    assert main(words) == 2
    more = [line for line in capsys.readouterr().out.splitlines() if line not in silent.splitlines()]
    found = lfssao.compare(tmp_path / "mine", r.folder, layers=["ao_2"]).results[0].diagnosis
    assert more == [f"diagnosis: {found.words('module_008')}"]
    assert more[0].startswith("diagnosis: radius x 1.")


OTHERWISE = [("display", k) for k in range(3)] + [("camera", 0), ("curved", 0), ("hemisphere", 0), ("remapped", 0)]


@pytest.mark.parametrize("format", ["float", "unorm8"])
@pytest.mark.parametrize(("job", "number"), OTHERWISE)
def test_other_arithmetic_has_no_cause_nor_has_one_wrong_texel(job, number, format, folder, tmp_path):
    """Sums of another order, fused, by reciprocals, and rounded as they may be."""
    r = renderer(folder(job), number)
    if job in ("hemisphere", "remapped"):
        own = {"ao_1": r.points(seed=7)}
    else:
        own = {f"ao_{k + 1}": r.ao(k + 1, seed=k) for k in range(len(r.radii))}
    own = {name: STORE[format](texture) for name, texture in (*own.items(), ("blurred", r.blur(seed=3)))}
    own["shaded"] = STORE[format](r.shade(ao=own["blurred"]))
    options = {"stored": dict.fromkeys(own, format)}
    for result in compared(r, tmp_path, options, **own).values():
        assert (result.verdict in (Verdict.EQUAL_BITS, Verdict.INSIDE), result.diagnosis) == (True, None)
    surface = np.argwhere(np.isfinite(r.depth))
    (tmp_path / "wrong").mkdir()
    for texture in own.values():
        texture[tuple(surface[len(surface) // 2])] = 0.3  # no count over 8
    wrong = list(compared(r, tmp_path / "wrong", options, **own).values())
    assert {(result.verdict, result.outside) for result in wrong} == {(Verdict.OUTSIDE, 1)}
    assert {result.diagnosis.words("M") for result in wrong} == {"1 wrong texel is too few to tell a cause in M"}


@pytest.mark.parametrize("job", JOBS)
def test_texels_of_the_search_have_the_references_bits(job, folder):
    """The search runs ``lf`` by the formulas of ``point``."""
    r = renderer(folder(job))
    reference = Reference.open(folder(job))
    case = reference.read(r.name, reference.described(r.name))[1]
    wrong = WrongTexture("ao_1", r.ao_1, stage_inputs({}, case), case, Judgement(Verdict.EQUAL_BITS), MODELS["nearest"])
    low, high = wrong.problem(np.flatnonzero(np.isfinite(r.depth))).ends()
    assert np.array_equal(np.float32((low + high) / 2), r.ao_1[np.isfinite(r.depth)])


def test_a_count_of_equal_depths_is_named(folder):
    """On a flat surface at z = 0, where no arithmetic rounds z, half of the samples are as deep as it is."""
    r = renderer(folder("display"))
    reference = Reference.open(folder("display"))
    samples = r.samples * np.where(np.arange(24).reshape(8, 3) % 6 == 5, 0, 1)
    flat = r.seen(np.zeros_like(r.depth), np.inf)
    own = {"depth": flat, "positions": r.unprojected(depth=np.zeros_like(flat))}
    case = reference.read(r.name, reference.described(r.name))[1]
    case = replace(case, inputs={**case.inputs, "samples": samples})
    for behind, kind in ((np.less, None), (np.less_equal, "surDepth <= smp.z in place of <")):
        own["ao_2"] = r.ao(depth=flat, positions=own["positions"], samples=samples, behind=behind)
        judged = judge(own, case, "strict", ["ao_2"])["ao_2"]
        assert (judged.verdict is Verdict.OUTSIDE) == (kind is not None)
    found = WrongTexture("ao_2", own["ao_2"], stage_inputs(own, case), case, judged, MODELS["nearest"]).diagnose()
    assert (found.candidates[0].kind, found.fits) == (kind, True), found.words("M")
