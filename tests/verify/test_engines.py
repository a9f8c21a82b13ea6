"""Published shaders in their engines' own conventions: kernel, noise, border and cleared buffers as they ship them.

The shaders are GLSL, ``tests/glsl``, written from what the engines compute; they run on any driver, and are judged by
``lfssao ao --like`` and ``lfssao compare`` alone. Bugs of one line are found, and most are named.
"""

import functools

import ao_shaders
import numpy as np
import pytest
from jobs import render

import lfssao
from lfssao.cli.main import main

pytestmark = pytest.mark.slow
SIZE = 96, 72
R = 0.35  # world units, of the scene corner


class Engine:
    """G-buffers of the scene corner as an OpenGL engine stores them, with its kernel and its noise."""

    def __init__(self, folder, scene, cleared, noise, stored, seed):
        frame = ao_shaders.Frame(
            render(folder / "lfssao", scene, "--camera", "--resolution", "{}x{}".format(*SIZE), "--radii", "0",
                   "--layers", "depth,positions,normals", "--normals")
        )  # fmt: skip
        rng, (eye, self.projection) = np.random.default_rng(seed), frame.opengl()
        there = np.isfinite(frame.textures["depth"])
        points = np.einsum("kc,ijc->ijk", eye[:3, :3], frame.textures["positions"].astype(float)) + eye[:3, 3]
        normals = np.einsum("kc,ijc->ijk", eye[:3, :3], frame.textures["normals"].astype(float))
        self.textures = {
            "Positions": np.where(there[..., None], points, [0, 0, cleared]), "Normals": normals,
            "Depth": np.where(there, frame.textures["depth"], 1.0),
        }  # fmt: skip
        self.textures["Positions"] = self.textures["Positions"].astype(stored)
        self.textures = {name: np.float32(texture[::-1]) for name, texture in self.textures.items()}
        directions = rng.normal(size=(16, 3))
        directions[:, 2] = abs(directions[:, 2])
        lengths = 0.1 + 0.9 * (np.arange(16) / 16) ** 2
        self.kernel = np.float32(directions / np.linalg.norm(directions, axis=1)[:, None] * lengths[:, None])
        self.noise = np.float32(noise(rng.uniform(-1, 1, (4, 4, 3))))
        self.planes, self.folder = frame.view["lens"][4:6], folder
        (folder / "camera.toml").write_text(
            f'kind = "camera"\nview = {eye.tolist()}\nprojection = {self.projection.tolist()}\nclip = "opengl"\n'
            'rows = "below"\ndepth_kind = "window"\npositions_space = "view"\nnormals_space = "view"\n'
        )
        for name in self.textures:
            np.save(folder / f"{name.lower()}.npy", self.textures[name].astype(stored if name == "Positions" else "f4"))
        np.save(folder / "kernel.npy", self.kernel)
        np.save(folder / "noise.npy", self.noise)

    def draw(self, context, defines, bias, limits=(0, 0), change=None):
        """Occlusion by the shader, rows from below; ``change`` is (pattern, replacement) in its text."""
        uniforms = {
            "size": SIZE, "side": 4, "count": len(self.kernel), "projection": self.projection.T.ravel(),
            "planes": self.planes, "radius": R, "bias": bias * R, "limits": limits,
        }  # fmt: skip
        arrays = {**self.textures, "Kernel": self.kernel, "Noise": self.noise}
        return ao_shaders.run(context, "tangent", defines, change, arrays, uniforms, SIZE)


def unit(noise):
    return noise[..., :2] / np.linalg.norm(noise[..., :2], axis=-1, keepdims=True)


SMOOTH = {"FRAME": "cross(n, t)", "TERM": 0, "FILTER": 0}
# Defines and numbers of the shader, the z to which view space is cleared, and its noise of numbers from -1 to 1,
# and the type of positions.
ENGINES = {
    "learnopengl": ({"defines": SMOOTH, "bias": 0.05}, 0.0, lambda v: v * [1, 1, 0], "f2"),
    "vtk": (
        {"defines": SMOOTH | {"FILTER": 1}, "bias": 0.02}, 0.0, lambda v: np.dstack([unit(v), 0 * v[..., 0]]), "f2",
    ),
    "sascha-willems": (
        {"defines": SMOOTH | {"FRAME": "cross(t, n)"}, "bias": 0.05}, -1.0, lambda v: 2 * v * [1, 1, 0] - 1, "f4",
    ),
    "threejs-ssao": (
        {"defines": SMOOTH | {"TERM": 1}, "bias": 0.0, "limits": (0.005, 0.1)}, 0.0,
        lambda v: np.repeat(v[..., :1], 3, axis=-1), "f4",
    ),
}  # fmt: skip


@pytest.fixture(scope="module")
def engine(tmp_path_factory):
    """An engine's frame, and the folder of its reference, made when it is first asked for."""

    @functools.cache
    def made(name):
        _, cleared, noise, stored = ENGINES[name]
        folder = tmp_path_factory.mktemp(name)
        engine = Engine(folder, "statue", cleared, noise, stored, 7)
        given = [f"--{key}={folder / key}.npy" for key in ("depth", "positions", "normals")]
        own = f"--samples={folder}/kernel.npy", f"--rotate={folder}/noise.npy", "--rotate-rows=below"
        words = f"--buffers={folder}/camera.toml", f"--like={name}", f"--radii={R}", f"-o={folder}/right"
        assert main(["ao", *given, *own, *words]) == 0
        return engine

    return made


def compared(context, engine, target, name, change=None):
    target.mkdir()
    np.save(target / "depth_ao_1.npy", engine.draw(context, **ENGINES[name][0], change=change))
    report = lfssao.compare(target, engine.folder / "right", layers=("ao_1",))
    (result,) = (r for r in report.results if r.layer == "ao_1")
    return report, result


# A bug of one line, and the cause that is named, with its value; None where it is found and no name is asked for.
COMMON = {
    "frame mirrored": ((r"b = FRAME", "b = -(FRAME)"), "samples mirrored in y"),
    "noise not unpacked": (
        (r"(vec3\(noise\[tile\].*\));", r"0.5 + 0.5 * \1;"), "noise vectors are packed, (v + 1) / 2 in place of v",
    ),
    "noise of rows from above": ((r"\(p\.y % side\)", "((size.y - 1 - p.y) % side)"), "noise of rows from below"),
    "noise not tiled": ((r"p\.x % side", "p.x / side % side"), None),
    "normals inside out": ((r", n = (vec3\(.*\));", r", n = -\1;"), "normals with the other sign"),
    "kernel not folded": ((r"(kernel\[3 \* i \+ 2\])", r"(i % 2 == 0 ? 1.0 : -1.0) * \1"), None),
    "axis from the viewer": ((r"\+ kernel\[3 \* i \+ 2\] \* n\)", "- kernel[3 * i + 2] * normalize(c))"), None),
    "mean of one less": ((r"float\(count\)", "float(count - 1)"), "sum divided by 15 in place of 16"),
}  # fmt: skip
HEMISPHERE = COMMON | {
    "bias sign": ((r"s\.z \+ bias", "s.z - bias"), "bias with the other sign"),
    "bias forgotten": ((r"s\.z \+ bias", "s.z"), "bias 0 in place of"),
    "range check on another depth": ((r"abs\(c\.z - z\)", "abs(s.z - z)"), None),
    "range check forgotten": (
        (r"smoothstep\(.*\);", "1.0;"), "range_check none in place of smoothstep",
    ),
    "border not clamped": (
        (r"(vec2 uv = .*;)", r"\1 if (any(lessThan(uv, vec2(0))) || any(greaterThan(uv, vec2(1)))) continue;"),
        "samples outside the texture add nothing",
    ),
}  # fmt: skip
BUGS = {
    "learnopengl": HEMISPHERE,
    "vtk": HEMISPHERE | {"not filtered": ((r"#if FILTER", "#if 0"), "textures read in the nearest texel")},
    "sascha-willems": HEMISPHERE,
    "threejs-ssao": COMMON | {
        "a larger radius": ((r"c \+ radius", "c + 1.25 * radius"), ("radius", 1.25)),
        "radius in texels": ((r"c \+ radius", "c + 12.0 / float(size.y) * -c.z"), None),
        "nearest surfaces hide": ((r"delta > limits\.x", "delta > 0.0"), "min_distance 0 in place of 0.005"),
        "farther surfaces hide": ((r"delta < limits\.y", "delta < 2.0 * limits.y"), ("max_distance", 2.0)),
        "x and y exchanged": (
            (r"3 \* i\] \* t \+ kernel\[3 \* i \+ 1\]", "3 * i + 1] * t + kernel[3 * i]"),
            "samples with x and y exchanged",
        ),
    },
}  # fmt: skip


@pytest.mark.parametrize("name", ENGINES)
def test_published_shaders_conform_with_their_own_kernel_and_noise(context, engine, tmp_path, name):
    report, result = compared(context, engine(name), tmp_path / "mine", name)
    assert report.exit_code == 0, result
    assert result.diagnosis is None


@pytest.mark.parametrize(("name", "bug"), [(name, bug) for name, bugs in BUGS.items() for bug in bugs])
def test_bugs_of_one_line_are_found_and_most_are_named(context, engine, tmp_path, name, bug):
    change, cause = BUGS[name][bug]
    report, result = compared(context, engine(name), tmp_path / "mine", name, change)
    assert report.exit_code == 2
    found = result.diagnosis
    if cause is None:  # no other cause is said to explain it
        assert not found.fits, found.words("M")
        return
    kind, value = cause if isinstance(cause, tuple) else (cause, None)
    assert found.fits, found.words("M")
    assert found.candidates[0].kind.startswith(kind), found.words("M")
    assert value is None or found.candidates[0].values == pytest.approx((value,), rel=0.02)
