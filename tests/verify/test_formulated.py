"""The diagnosis by formulas: at texels they make the kernels' bits, and bugs of look-ups get their names.

Bugs are planted in the estimators of ``tests/reference``, which share nothing with the formulas.
"""

import functools
import inspect
from dataclasses import dataclass
from functools import partial
from itertools import product

import numpy as np
import pytest
from compare_folders import changed, remade
from jobs import manifest_of, render
from planted_displays import write_mesh
from reference import kit, points, volumetric

import lfssao
from lfssao.ao.estimators.registry import ESTIMATORS, estimate, find_estimator
from lfssao.ao.kernels import look_up
from lfssao.files.exr import read_exr
from lfssao.rendering import settings as settings_module
from lfssao.verify.case import described_turns, described_view
from lfssao.verify.compare.view_case import view_case
from lfssao.verify.diagnosis.formulated import Formulated
from lfssao.verify.diagnosis.views import sight_of
from lfssao.verify.verdict import Verdict

NAMES = [name for name in ESTIMATORS if find_estimator(name).reads_texels]
MESH = lfssao.builtin_scene("corner")


def display_view(name, module):
    display = lfssao.find_display(name).with_resolution(40, 30)
    return lfssao.module_views(MESH, display, range(module, module + 1))[0]


VIEWS = {
    "crossed slits": lambda: display_view("sample-a", 9),
    "matrix": lambda: lfssao.Camera.looking_at(MESH.bounds).view(40, 30),
    "display": lambda: display_view("convex", 20),
}


LOOK_UPS = [(name, {}) for name in NAMES] + [
    ("point", {"border": "clamp"}),
    ("point", {"border": "background", "background": "cleared", "cleared": 0.5}),
    ("oriented-hemisphere", {"border": "background", "background": "occludes", "range_check": "none"}),
    ("alchemy", {"border": "mirror", "background": "cleared"}),
    ("hbao", {"border": "repeat", "background": "cleared"}),
]


@pytest.mark.parametrize("kind", VIEWS)
@pytest.mark.parametrize(("name", "look_ups"), LOOK_UPS)
def test_at_texels_the_bits_are_those_of_the_kernels(name, look_ups, kind):
    view = VIEWS[kind]()
    estimator = find_estimator(name)
    gbuffer = lfssao.RayCaster(MESH, view.cast_from_world).gbuffer(view, None, "geometric")
    buffers = lfssao.Buffers.of(gbuffer, view).turned("hash" if estimator.turns else "none")
    given = estimator.default_samples(5)
    rows = np.arange(buffers.depth.size) // view.width
    options = estimator.parameters | look_ups | ({"second": 0.5} if "second" in estimator.parameters else {})
    columns = np.arange(buffers.depth.size) % view.width
    problem = Formulated(
        mine=rows, columns=columns, rows=rows, interval_width=0 * rows, excess=0 * rows, estimator=estimator,
        buffers=buffers, radius=0.3, points=given[0], weights=given[1], options=options,
        sight=sight_of(view, None, None), others={},
        centre=None, sampling={}, rotation="hash", seed=0, has_interval=True, look_ups=estimator.options(**options),
    )  # fmt: skip
    right = estimate(name, buffers, 0.3, *given, **options).texture.ravel()
    assert np.count_nonzero(right) > 60
    assert np.array_equal(problem.values(), right.astype(np.float64))


@pytest.mark.parametrize(("rule", "mode"), [
    (look_up.CLAMP, "edge"), (look_up.MIRROR, "symmetric"), (look_up.WRAP, "wrap"), (look_up.MIRROR_INSIDE, "reflect"),
    (look_up.VALUE, None),
])  # fmt: skip
def test_beyond_the_border_a_rule_says_the_texel(rule, mode):
    size = (5, 7)
    far = 9
    numbers = np.arange(35).reshape(size)
    filled = np.pad(numbers, far, mode) if mode else np.pad(numbers, far, "constant", constant_values=50)
    look = look_up.Look(rule, outside=50, matrix=np.eye(2, 3))
    for u, v in np.random.default_rng(0).uniform(-far, far + 5, (200, 2)):
        expected = filled[int(np.floor(v)) + far, int(np.floor(u)) + far]
        assert look_up.look_up(look, u, v, size) == expected
    assert look_up.look_up(look, np.nan, 1.0, size) == look_up.NOTHING


# Bugs

WIDTH = 36
HEIGHT = 27
SIZE = "--resolution", f"{WIDTH}x{HEIGHT}", "--radii", "9%", "--layers", "depth,positions,normals,ao"
WHERE = {
    "oriented-hemisphere": ("--display", "sample-a", "--modules", "0:1", "--samples", "12"),
    "alchemy": ("--camera",),
    "hbao": ("--camera", "--rotate", "tiles", "--parameter", "directions=4", "--parameter", "steps=4"),
    "vo-points": ("--display", "sample-a", "--modules", "0:1", "--rotate", "hash"),
    "vo-points-normal": ("--camera",),
    "vo-lines": ("--display", "sample-a", "--modules", "0:1", "--rotate", "ign"),
    "vo-lines-normal": ("--camera",),
}


@dataclass(frozen=True)
class Job:
    """The folder of a job of one view, the view's name, and what the estimators of ``tests/reference`` are given."""

    folder: object
    module: str
    parameters: dict
    inputs: dict

    @classmethod
    def rendered(cls, folder, scene, *words):
        manifest = manifest_of(render(folder, scene, *SIZE, *words))
        (entry,) = manifest["views"]
        case = view_case(folder, manifest, entry)
        parts = read_exr(folder / entry["file"])
        seen = {key: np.squeeze(parts[key].pixels) for key in ("depth", "positions", "normals")}
        view = described_view(case.parameters)
        turns = described_turns(case.parameters, seen)
        more = {"radius": case.parameters["radii"][0], "viewer_distance": view.viewer_distance().tolist()}
        inputs = {**seen, **case.inputs, "directions": lfssao.Buffers(view, **seen).directions}
        inputs |= {"turns": turns} if turns is not None else {}
        return cls(folder, entry["name"], {**case.parameters, **more}, inputs)

    def solved(self):
        """Occlusion by ``tests/reference``, a rounding off."""
        made = kit.solve("estimator", self.parameters, self.inputs)["occlusion"]
        return np.minimum(made * np.float32(1 + 2.0**-23), 1)

    def compared(self, texture, target, **how):
        """The result on a folder in which occlusion is another texture."""
        mine = changed(self.folder, target / "mine", self.module, remade("ao_1", lambda _: texture[..., None]))
        (result,) = lfssao.compare(mine, self.folder, layers=["ao_1"], **how).results
        return result

    def named(self, texture, target, **how):
        """The name of the texture's cause."""
        found = self.compared(texture, target, **how).diagnosis
        assert found.fits, found.words("M")
        return found.candidates[0].kind


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    """The job of an estimator and a scene, made when it is first asked for."""

    @functools.cache
    def made(name, scene="corner"):
        folder = tmp_path_factory.mktemp(name) / "reference"
        return Job.rendered(folder, scene, "--estimator", name, *WHERE[name])

    return made


def texel_with(change):
    """The reference's look-up at another image point, or of another number; change(u, v, calls)."""
    calls = iter(range(10**9))

    def texel_at(shape, image):
        u, v, _, status = image
        place = change(u, v, next(calls)) if status == 0 else None
        if place is None:
            return None
        i, j = map(int, np.floor(place))
        return (j, i) if 0 <= j < shape[0] and 0 <= i < shape[1] else None

    return texel_at


@pytest.fixture
def looking(monkeypatch):
    """Lets the reference look image points up by ``texel_with``."""

    def planted(change):
        for module in (points, volumetric):
            monkeypatch.setattr(module, "texel_at", texel_with(change))

    return planted


def clamped(u, v, call):
    return min(max(u, 0), WIDTH - 1), min(max(v, 0), HEIGHT - 1)


BUGS = {
    "look-ups at the nearest centre, half a texel off": lambda u, v, call: (u + 0.5, v + 0.5),
    "samples outside the texture held by clamp": clamped,
    "u and v transposed": lambda u, v, call: (v, u),
    "v flipped": lambda u, v, call: (u, HEIGHT - v),
    "u and v of half precision": lambda u, v, call: (np.float16(u), np.float16(v)),
}
PLANTED = [
    *product(WHERE, list(BUGS)[:2]),
    ("hbao", "u and v transposed"),
    ("vo-lines", "v flipped"),
    ("oriented-hemisphere", "u and v of half precision"),
]


@pytest.mark.parametrize("name", WHERE)
def test_a_right_texture_is_accused_of_nothing(job, tmp_path, name):
    result = job(name).compared(job(name).solved(), tmp_path)
    assert (result.verdict, result.diagnosis) == (Verdict.INSIDE, None)


@pytest.mark.parametrize(("name", "kind"), PLANTED)
def test_a_bug_of_look_ups_is_named(job, looking, tmp_path, name, kind):
    looking(BUGS[kind])
    assert job(name).named(job(name).solved(), tmp_path) == kind


@pytest.mark.parametrize(("name", "scene"), [("alchemy", "gallery"), ("hbao", "gallery")])
def test_a_border_that_holds_samples_is_judged_as_it_is_said(name, scene, looking, tmp_path):
    near = "--fov", "12", "--parameter", "border=clamp"  # so that the scene leaves the texture
    job = Job.rendered(tmp_path / "reference", scene, "--estimator", name, *WHERE[name], *near)
    opened = job.solved()
    looking(clamped)
    held = job.solved()
    assert job.compared(held, tmp_path).verdict is Verdict.INSIDE
    assert np.abs(held - opened).max() > 0.01
    (tmp_path / "opened").mkdir()
    assert job.named(opened, tmp_path / "opened") == "samples outside the texture add nothing"


def test_a_linear_filter_is_named_with_its_option(job, tmp_path):
    own = job("oriented-hemisphere")
    seen = {key: own.inputs[key] for key in ("depth", "positions", "normals")}
    buffers = lfssao.Buffers(described_view(own.parameters), **seen, turns=own.inputs.get("turns"))
    samples = own.inputs["points"]
    radius = own.parameters["radii"][0]
    wrong = estimate("oriented-hemisphere", buffers, radius, samples, filter="linear").texture
    found = own.compared(wrong, tmp_path).diagnosis
    assert found.fits, found.words("M")
    assert found.words("M").startswith("textures read between texels, by a linear filter explains 100.00 %")
    assert found.words("M").endswith("; render the reference with --parameter filter=linear")


@pytest.mark.parametrize(("name", "shift"), [("oriented-hemisphere", 0.03), ("vo-points", -0.83), ("alchemy", 0.02)])
def test_the_shift_is_told(job, looking, tmp_path, name, shift):
    """By few texels, too: other changes of the view move as many."""
    looking(lambda u, v, call: (u + shift, v))
    found = job(name).compared(job(name).solved(), tmp_path).diagnosis
    assert (found.candidates[0].kind, found.fits) == ("shift of u", True), found.words("M")
    assert found.candidates[0].values == pytest.approx((shift,), rel=0.15)


@pytest.mark.parametrize("name", WHERE)
def test_a_dropped_sample_is_named(job, looking, tmp_path, name):
    count = len(job(name).inputs.get("points", ()))
    kind = "sample 2 dropped"
    if name == "hbao":
        count = job(name).parameters["options"]["steps"]
        kind = "step 3 of each direction dropped"
    looking(lambda u, v, call: None if call % count == 2 else (u, v))
    assert job(name).named(job(name).solved(), tmp_path) == kind


def written(monkeypatch, name, *changes):
    """Let the text of an estimator of ``tests/reference`` have other words, (before, after) each."""
    function = kit.ESTIMATORS[name]
    whole = getattr(function, "func", function)
    text = inspect.getsource(whole)
    namespace = dict(vars(inspect.getmodule(whole)))
    for before, after in changes:
        assert before in text
        text = text.replace(before, after)
    exec(text, namespace)
    made = namespace[whole.__name__]
    monkeypatch.setitem(kit.ESTIMATORS, name, partial(made, **getattr(function, "keywords", {})))


OTHER = "(fraction + fraction if point is samples[3][0] else fraction)"
CLEARED = "np.where(depth[texel] < np.inf, positions[texel], 0)"
TEXTS = [
    ("vo-points", "samples outside the texture occluded", ("outside += 1", "outside, total = 1, total + fraction")),
    ("vo-points", "background counted as occluder",
     ("- scene.z[q]", "- (scene.z[q] if scene.z[q] < np.inf else -np.inf)")),
    ("vo-points", "depth bias", ("- scene.z[q]", "- (scene.z[q] + dtype(0.01))")),
    ("vo-points", "depth with the other sign", ("- scene.z[q]", "+ scene.z[q]")),
    ("vo-points", "sample 3 doubled", ("total + fraction", f"total + {OTHER}")),
    ("vo-points", "sample 3 doubled, mean of those that count",
     ("total + fraction", f"total + {OTHER} / (1 + samples[3][1])")),
    ("hbao", "direction 1 dropped", ("for y, x in around", "for y, x in around[:1] + around[2:]")),
    ("hbao", "direction 1 dropped, mean of those that count",
     ("for y, x in around", "for y, x in around[:1] + around[2:]"), ("dtype(count)", "dtype(count - 1)")),
    ("hbao", "sum divided by 5 in place of 4", ("dtype(count)", "dtype(count + 1)")),
    ("hbao", "step 4 of each direction dropped", ("range(1, steps + 1)", "range(1, steps)")),
    ("oriented-hemisphere", "z of samples 2, 5 with the other sign, 2 of 12: the kernel is not folded",
     ("abs(z) *", "(-abs(z) if z in table[[2, 5], 2] else abs(z)) *")),
    ("oriented-hemisphere", "z of samples 0, 1, 2, ... with the other sign, 12 of 12: the kernel is not folded",
     ("abs(z) *", "-abs(z) *")),
    ("oriented-hemisphere", "length of samples", ("[r * scene.linear", "[dtype(1.3) * r * scene.linear")),
    ("alchemy", "background as if cleared to 0",
     ("away = positions[texel]", f"away = {CLEARED}"), ("depth[texel] < np.inf and above", "above")),
]  # fmt: skip


@pytest.mark.parametrize(("name", "kind", "changes"), [(name, kind, changes) for name, kind, *changes in TEXTS])
def test_a_bug_of_the_text_is_named(job, monkeypatch, tmp_path, name, kind, changes):
    written(monkeypatch, name, *changes)
    own = job(name, "statue" if name == "alchemy" else "corner")  # before background
    assert own.named(own.solved(), tmp_path) == kind


def box(size, middle):
    """The triangles of a box along the axes, (12, 3, 3)."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * size + middle
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return corners[[part for a, b, c, d in quads for part in ([a, b, c], [a, c, d])]]


# A comparison of the reference's text, and the one that is written in its place; the cause; an option by which points
# stay in planes.
TIES = {
    "oriented-hemisphere": (("] >= bias", "] > bias"), "a surface as deep as a sample does not hide it", "bias=0"),
    "vo-points": (("before > 0", "before >= 0"), "a surface as deep as a sample hides it", "randomize=false"),
}


@pytest.mark.parametrize("name", TIES)
def test_another_answer_to_ties_is_named_where_bits_count(name, monkeypatch, tmp_path):
    """Points in planes that face the viewer, as surfaces do; an interval of renderers holds both answers."""
    change, kind, option = TIES[name]
    k = np.arange(8)
    rng = np.random.default_rng(1)
    table = np.stack([np.cos(k), np.sin(k), (k > 3) / 2], axis=-1) * np.linspace(0.3, 0.8, 8)[:, None]
    monkeypatch.setattr(settings_module, "make_samples", lambda *_: table)
    boxes = [box(rng.uniform(0.1, 0.25, 3), rng.uniform(-1, 1, 3) * [0.8, 0.5, 0.4]) for _ in range(20)]
    scene = write_mesh(tmp_path / "boxes.obj", np.concatenate([*boxes, box([1, 0.7, 0.01], [0, 0, -0.5])]))
    words = "--estimator", name, "--camera", "--sampling", "latin", "--samples", "8", "--parameter", option
    job = Job.rendered(tmp_path / "reference", str(scene), *words)
    written(monkeypatch, name, change)
    wrong = job.solved()
    assert job.named(wrong, tmp_path, model="strict") == kind
    (tmp_path / "more").mkdir()
    assert job.compared(wrong, tmp_path / "more").verdict is Verdict.INSIDE
