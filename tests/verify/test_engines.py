"""Published shaders in their engines' own conventions: kernel, noise, border and cleared buffers as they ship them.

The shaders are GLSL, ``tests/glsl``, written from what the engines compute; they run on any driver, and are judged by
``lfssao ao --like`` and ``lfssao compare`` alone. Bugs of one line are found, and most are named.
"""

import functools
from collections.abc import Callable
from dataclasses import dataclass

import ao_shaders
import noise_slices
import numpy as np
import pytest
from jobs import render
from reference.scalable import turns_of

import lfssao
from lfssao.cli.main import main
from lfssao.verify.diagnosis import diagnose

pytestmark = pytest.mark.slow
SIZE = 96, 72
R = 0.35  # world units, of the scene corner
TEXELS = 12 * 2.5  # radius of 12 heights of a texel per unit of depth, by a focal length of 2.5 heights


class Engine:
    """G-buffers of the scene corner as an OpenGL engine stores them, with its kernel and its noise."""

    def __init__(self, folder, scene, own, seed):
        frame = ao_shaders.Frame(
            render(folder / "lfssao", scene, "--camera", "--resolution", "{}x{}".format(*SIZE), "--radii", "0",
                   "--layers", "depth,positions,normals", "--normals")
        )  # fmt: skip
        rng, (eye, self.projection) = np.random.default_rng(seed), frame.opengl()
        there = np.isfinite(frame.textures["depth"])
        points = np.einsum("kc,ijc->ijk", eye[:3, :3], frame.textures["positions"].astype(float)) + eye[:3, 3]
        normals = np.einsum("kc,ijc->ijk", eye[:3, :3], frame.textures["normals"].astype(float))
        self.textures = {
            "Positions": np.where(there[..., None], points, [0, 0, own.cleared]), "Normals": normals,
            "Depth": np.where(there, frame.textures["depth"], 1.0),
        }  # fmt: skip
        if own.reverse:
            self.textures["Depth"] = np.where(there, 1 - frame.textures["depth"].astype(float), 0.0)
        if own.left:
            self.textures["Normals"] = frame.textures["normals"] * [1, 1, -1]
            eye = eye * [1, 1, -1, 1]
        self.view = eye
        self.textures["Positions"] = self.textures["Positions"].astype(own.stored)
        rows = slice(None, None, -1 if own.below else 1)
        self.textures = {name: np.float32(texture[rows]) for name, texture in self.textures.items()}
        directions = rng.normal(size=(16, 3))
        directions[:, 2] = abs(directions[:, 2])
        lengths = 0.1 + 0.9 * (np.arange(16) / 16) ** 2
        self.kernel = np.float32(directions / np.linalg.norm(directions, axis=1)[:, None] * lengths[:, None])
        self.directions = np.float32(directions / np.linalg.norm(directions, axis=1)[:, None])
        self.noise = np.float32(own.noise(rng.uniform(-1, 1, (4, 4, 3))))
        self.angles, self.planes, self.folder = own.angles(*np.indices(SIZE[::-1])), frame.view["lens"][4:6], folder
        f_u, f_v, c_u, c_v = self.lens = frame.view["lens"][:4]
        if own.below:
            self.lens = f_u, -f_v, c_u, SIZE[1] - c_v
        near, far = self.planes
        half = [[0, 0, near / (far - near), near * far / (far - near)]]  # of Direct3D's reversed depth
        matrix = np.vstack([self.projection[:2], half, self.projection[3:]]) if own.reverse else self.projection
        kinds = ("d3d reversed", "reversed") if own.reverse else ("opengl", "window")
        (folder / "camera.toml").write_text(
            f'kind = "camera"\nview = {eye.tolist()}\nprojection = {matrix.tolist()}\n'
            f'rows = "{"below" if own.below else "above"}"\nclip = "{kinds[0]}"\ndepth_kind = "{kinds[1]}"\n'
            f'positions_space = "view"\nnormals_space = "{"world" if own.left else "view"}"\n'
        )
        for name in self.textures:
            kind = own.stored if name == "Positions" else "f4"
            np.save(folder / f"{name.lower()}.npy", self.textures[name].astype(kind))
        np.save(folder / "kernel.npy", self.kernel)
        np.save(folder / "directions.npy", self.directions)
        np.save(folder / "noise.npy", self.noise)
        np.save(folder / "angles.npy", np.float32(self.angles))

    def draw(self, context, shader, defines, uniforms, change=None):
        """Occlusion by a shader, rows from below; ``change`` is (pattern, replacement) in its text."""
        common = {
            "size": SIZE, "side": 4, "count": len(self.kernel), "projection": self.projection.T.ravel(),
            "inverse_projection": np.linalg.inv(self.projection).T.ravel(), "planes": self.planes, "radius": R,
            "lens": self.lens, "view": self.view.T.ravel(),
        }  # fmt: skip
        arrays = {
            **self.textures, "Kernel": self.kernel, "Directions": self.directions, "Noise": self.noise,
            "Angles": self.angles, "Axes": np.diag([1, 1, -1]),
            "Golden": golden(16),
        }  # fmt: skip
        return ao_shaders.run(context, shader, defines, change, arrays, {**common, **uniforms}, SIZE)


def unit(noise):
    return noise[..., :2] / np.linalg.norm(noise[..., :2], axis=-1, keepdims=True)


def flat(noise):
    return np.dstack([unit(noise), 0 * noise[..., 0]])


def by_integers(j, i):
    """Angles that G3D makes of a texel's row and column; they are so large that their sums round."""
    return ((3 * i) ^ j + i * j) * 10


def by_recurrence(j, i):
    """Angles that r3d makes of them."""
    return 2 * np.pi * np.modf(0.7548776662466927 * i + 0.5698402909980532 * j)[0]


def by_gradient(j, i):
    """Interleaved gradient noise of a texel's row and column, and 0."""
    slope = 0.06711056 * (i + 0.5) + 0.00583715 * (j + 0.5)
    return np.dstack([np.modf(52.9829189 * np.modf(slope)[0])[0], 0 * slope])


def by_places(j, i):
    """Filament's tile for slices and their steps."""
    return np.dstack([(i + j) % 4 / 4 + i % 4 / 16, (j - i) % 4 / 4])


def in_8_bits(_):
    """A tile of two numbers of 0 to 1 in 8 bits."""
    return np.random.default_rng(8).integers(0, 256, (64, 64, 2)) / 255


def golden(n):
    """N8AO's kernel."""
    x, y = np.sqrt((np.arange(n) + 0.5) / n) * [np.cos(2.399963 * np.arange(n)), np.sin(2.399963 * np.arange(n))]
    return np.stack([x, y, np.sqrt(1 - (x * x + y * y))], axis=1)


@dataclass
class Own:
    """An engine's shader with defines and numbers, and the textures and options that it hands over."""

    shader: str
    defines: dict
    uniforms: dict
    cleared: float = 0.0  # z of view space without a surface
    noise: Callable = flat  # of numbers from -1 to 1
    stored: str = "f4"  # type of positions
    textures: tuple = ("depth", "normals")
    given: tuple = ("--rotate={folder}/noise.npy", "--rotate-rows=below")
    angles: Callable = by_recurrence
    below: bool = True  # whether row 0 is the lowest
    reverse: bool = False  # whether depth is 1 near and 0 far
    left: bool = False  # whether the world is left-handed, with normals in it


POINTS = {"textures": ("depth", "positions", "normals"), "given": ("--samples={folder}/kernel.npy", *Own.given)}
SMOOTH = {"FRAME": "cross(n, t)", "TERM": 0, "FILTER": 0}
R3D = {"log_q": 3, "taps": 16, "turns": turns_of(16), "levels": 1, "edge": 0.0}
G3D = {"log_q": 3, "taps": 11, "turns": 7, "levels": 6, "edge": 0.02 * R, "intensity": R}
ENGINES = {
    "learnopengl": Own("tangent", SMOOTH, {"bias": 0.05 * R}, 0.0, lambda v: v * [1, 1, 0], "f2", **POINTS),
    "vtk": Own("tangent", SMOOTH | {"FILTER": 1}, {"bias": 0.02 * R}, 0.0, flat, "f2", **POINTS),
    "sascha-willems": Own(
        "tangent", SMOOTH | {"FRAME": "cross(t, n)"}, {"bias": 0.05 * R}, -1.0, lambda v: 2 * v * [1, 1, 0] - 1,
        **POINTS,
    ),
    "threejs-ssao": Own(
        "tangent", SMOOTH | {"TERM": 1}, {"limits": (0.005, 0.1)}, 0.0, lambda v: np.repeat(v[..., :1], 3, axis=-1),
        **POINTS,
    ),
    "threejs-gtao": Own(
        "gtao_rises", {},
        {"exponent": 1.0, "thickness": 4 * R, "fall_off": 1.0, "power": 1.0, "slices": 3, "steps": 6},
        given=(*Own.given, "--parameter=background=cleared", "--parameter=cleared={far}"),  # less than thickness away
    ),
    "nvidia-hbao": Own(
        "hbao_taps", {}, {"bias": 0.1, "power": 1.5, "directions": 8, "steps": 4},
        noise=lambda v: np.dstack([unit(v), 0.5 + 0.5 * v[..., 2]]),
    ),
    "babylon-ssao2": Own(
        "kernel_shifts", {}, {"strength": 1.0, "base": 0.0, "max_z": 100.0, "min_z_aspect": 0.2},
        noise=lambda v: v * [1, 1, 0], given=("--samples={folder}/directions.npy", *Own.given),
    ),
    "xegtao": Own(
        "gtao_noise", {},
        {"side": 64, "falloff_range": 0.615, "distribution": 2.0, "thin": 0.0, "power": 2.2, "slices": 3, "steps": 3},
        noise=lambda _: noise_slices.hilbert_noise(), given=Own.given[:1], below=False,
    ),
    "bevy": Own(
        "bitmask_noise", {}, {"side": 64, "thickness": 0.25 / 0.7285 * R, "slices": 3, "steps": 3},
        noise=lambda _: noise_slices.hilbert_noise(), given=Own.given[:1], below=False,
    ),
    "filament-sao": Own(
        "spiral_squares", {},
        {"bias": 0.0005, "intensity": 1.0, "horizon": 0.0, "power": 1.0, "turns": 3.0, "taps": 7, "levels": 4},
        noise=lambda _: by_gradient(*np.indices(SIZE[::-1])),
    ),
    "filament-gtao": Own(
        "gtao_levels", {},
        {"levels": 4, "slices": 4, "steps": 3, "thickness": 0.05, "power": 1.0, "intensity": 1.0, "radius": 3 * R},
        noise=lambda _: by_places(*np.indices((4, 4))), given=(*Own.given, "--parameter=thickness=0.05"), reverse=True,
    ),
    "godot-4": Own(
        "halves_taps", {},
        {"intensity": 2.0, "horizon": 0.06, "power": 1.5, "fading": (50 * R, 300 * R), "radius": 3 * R},
        given=(f"--parameter=fade_from={50 * R}", f"--parameter=fade_to={300 * R}"), reverse=True, below=False,
    ),
    "unity-urp": Own(
        "random_taps", {},
        {"side": 64, "count": 8, "beta": 0.004, "epsilon": 1e-4, "intensity": 3.0, "falloff": 8.0, "contrast": 0.6},
        noise=in_8_bits, given=(*Own.given, "--parameter=tile=64", "--parameter=falloff=8"), reverse=True, left=True,
    ),
    "n8ao": Own(
        "golden_taps", {"TEXELS": 0}, {"side": 64, "count": 16, "falloff": 1.0, "bias": 0.02 * R}, noise=in_8_bits,
        given=(*Own.given, f"--parameter=bias={0.02 * R}"),
    ),
    "n8ao in texels": Own(
        "golden_taps", {"TEXELS": 1}, {"side": 64, "count": 16, "falloff": 1.0, "bias": 0.0, "radius": 12.0},
        noise=in_8_bits, given=(*Own.given, "--parameter=texels=true"),
    ),
    "r3d": Own(
        "sao", {"FACE": 0, "LANDING": 1, "FULL_TURN": "6.283185307179586"},
        R3D | {"intensity": 0.4 * R, "beta": 0.04 * R, "epsilon": 0.08 * R * R},
        given=("--rotate={folder}/angles.npy", "--rotate-rows=below"),
    ),
    "g3d": Own(
        "sao", {"FACE": 1, "LANDING": 1, "FULL_TURN": "6.28"}, G3D | {"beta": 0.01 * R, "epsilon": 0.01 * R * R},
        textures=("depth",), given=(), angles=by_integers, below=False,
    ),
}  # fmt: skip


@pytest.fixture(scope="module")
def engine(tmp_path_factory):
    """An engine's frame, and the folder of its reference, made when it is first asked for."""

    @functools.cache
    def made(name):
        own = ENGINES[name]
        folder = tmp_path_factory.mktemp(name)
        engine = Engine(folder, "statue", own, 7)
        given = [f"--{key}={folder / key}.npy" for key in own.textures]
        given.append(f"--radii={own.uniforms.get('radius', R)}")
        words = f"--buffers={folder}/camera.toml", f"--like={name.split()[0]}", f"-o={folder}/right"
        assert (
            main(["ao", *given, *(word.format(folder=folder, far=engine.planes[1]) for word in own.given), *words]) == 0
        )
        return engine

    return made


def compared(context, engine, target, name, change=None):
    target.mkdir()
    own = ENGINES[name]
    np.save(target / "depth_ao_1.npy", engine.draw(context, own.shader, own.defines, own.uniforms, change))
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
    "noise not tiled": ((r"p\.x % side", "p.x / side % side"), "tile of noise looked up at columns divided"),
    "normals inside out": ((r", n = (vec3\(.*\));", r", n = -\1;"), "normals with the other sign"),
    "kernel not folded": (
        (r"(kernel\[3 \* i \+ 2\])", r"(i % 2 == 0 ? 1.0 : -1.0) * \1"),
        "z of samples 1, 3, 5, ... with the other sign, 8 of 16: the kernel is not folded",
    ),
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
SPIRAL = {
    "bias forgotten": ((r"- beta\)", ")"), "beta 0 in place of"),
    "projection scale without its 1/2": ((r"radius \* lens.xy / z", "2.0 * radius * lens.xy / z"),
                                         "radius in texels x 2.000, as of a projection scale without its 1/2,"),
    "falloff squared": ((r"f \* f \* f", "f * f * radius * radius"), None),
    "epsilon of R": ((r"epsilon \+ vv", "2.5 * epsilon + vv"), ("epsilon", 2.5)),
    "spiral of 5 turns": ((r"float\(turns\)", "5.0"), "turns 5 in place of"),
    "without the half": ((r"\(float\(t\) \+ 0\.5\)", "(float(t) + 1.0)"), "taps at (i + 1) / n of the radius"),
    "turned the other way": ((r"\+ spin", "- spin"), "samples turned the other way"),
    "one tap less": ((r"t < taps", "t < taps - 1"), "the last tap left out"),
}  # fmt: skip
BUGS = {
    "learnopengl": HEMISPHERE,
    "vtk": HEMISPHERE | {"not filtered": ((r"#if FILTER", "#if 0"), "textures read in the nearest texel")},
    "sascha-willems": HEMISPHERE,
    "threejs-ssao": COMMON | {
        "a larger radius": ((r"c \+ radius", "c + 1.25 * radius"), ("radius", 1.25)),
        "radius in texels": ((r"c \+ radius", "c + 12.0 / float(size.y) * -c.z"), ("radius in texels", TEXELS)),
        "nearest surfaces hide": ((r"delta > limits\.x", "delta > 0.0"), "min_distance 0 in place of 0.005"),
        "farther surfaces hide": ((r"delta < limits\.y", "delta < 2.0 * limits.y"), ("max_distance", 2.0)),
        "x and y exchanged": (
            (r"3 \* i\] \* t \+ kernel\[3 \* i \+ 1\]", "3 * i + 1] * t + kernel[3 * i]"),
            "samples with x and y exchanged",
        ),
    },
    "threejs-gtao": {name: COMMON[name] for name in ("noise of rows from above", "noise not tiled")} | {
        "axis from the normal": ((r"cross\(d, v\)", "cross(d, n)"), None),
        "noise not unpacked": (
            (r"noise\[tile\], noise\[tile \+ 1\]", "0.5 + 0.5 * noise[tile], 0.5 + 0.5 * noise[tile + 1]"),
            "noise vectors are packed, (v + 1) / 2 in place of v",
        ),
        "normals inside out": ((r"n = (vec3\(normals.*\));", r"n = -\1;"), "normals with the other sign"),
        "uniform for cosine": ((r"visible \+= .*;", "visible += 0.5 * (2.0 - first - second);"),
                               "weighting uniform in place of cosine"),
        "slices by their projection": ((r"visible \+= ", "visible += length(n - across * dot(n, across)) * "),
                                       "projected true in place of false"),
        "horizon not in the hemisphere": (
            (r"first = dot\(v, plane\), second = -first", "first = -1.0, second = -1.0"), None,
        ),
        "fall-off forgotten": ((r", fall_off\)", ", 0.0)"), "fall_off 0 in place of 1"),
        "thickness in texels": ((r">= thickness", ">= 0.05 * thickness"), ("thickness", 0.05)),
        "a larger radius": ((r"d \* radius", "d * 1.25 * radius"), ("radius", 1.25)),
        "exponent of 2": ((r", exponent\)", ", 2.0 * exponent)"), ("exponent", 2.0)),
        "power of 1.5": ((r", power\)", ", 1.5 * power)"), ("power", 1.5)),
        "a step less": ((r"k < steps", "k < steps - 1"), "step 6 of each direction dropped"),
        "turned the other way": ((r"(, )(noise\[tile \+ 1\])", r"\1-\2"), "samples turned the other way"),
        "points at texels' centres": (
            (r"point_at\(uv, depth_at\(uv\)\)", "point_at((floor(uv * vec2(size)) + 0.5) / vec2(size), depth_at(uv))"),
            None,
        ),
    },
    "nvidia-hbao": {name: COMMON[name] for name in ("noise of rows from above", "noise not tiled")} | {
        "bias not taken off": ((r" - bias, 0\.0", ", 0.0"), None),
        "power forgotten": ((r"pow\((.*), power\)", r"\1"), ("power", 1 / 1.5)),
        "not doubled": ((r"sum \* 2\.0", "sum"), "sum divided by 64 in place of 32"),
        "bias not made up for": ((r"1\.0 / \(1\.0 - bias\) / ", "1.0 / "), ("sum", 0.9)),
        "falloff forgotten": (
            (r"clamp\(square \* inverse \+ 1\.0, 0\.0, 1\.0\)", "1.0"), "attenuation none in place of quadratic",
        ),
        "radius without its 1/2": (
            (r"radius \* 0\.5 \*", "radius *"), "radius in texels x 2.000, as of a projection scale without its 1/2,",
        ),
        "jitter forgotten": ((r"random\.z \* between \+ 1\.0", "1.0"), "noise vectors' z is left out"),
        "no texel further out": ((r"random\.z \* between \+ 1\.0", "random.z * between"), None),
        "taps not at centres": ((r"round\(far \* d\)", "far * d"), "snap false in place of true"),
        "last tap at the radius": ((r"float\(steps \+ 1\)", "float(steps)"), ("reach", 1.25)),
        "normals inside out": ((r"n = (vec3\(normals.*\));", r"n = -\1;"), "normals with the other sign"),
        "z of normals not turned": (
            (r", -normals", ", normals"), "z of normals in view space with the other sign",
        ),
        "turned the other way": ((r"d\.x \* random\.x - d\.y \* random\.y, d\.x \* random\.y \+ d\.y \* random\.x",
                                  "d.x * random.x + d.y * random.y, -d.x * random.y + d.y * random.x"),
                                 "samples turned the other way"),
        "not turned": ((r"d = vec2\(d\.x \* random.*;", ";"), "samples are not turned"),
    },
    "babylon-ssao2": {name: COMMON[name] for name in ("noise of rows from above", "noise not tiled")} | {
        "frame mirrored": ((r"b = cross\(n, t\)", "b = cross(t, n)"), "samples mirrored in y"),
        "noise not unpacked": ((r"vec3\(random \* 2\.0 - 1\.0", "vec3(random"), None),
        "normals inside out": ((r"n = (vec3\(normals.*\));", r"n = -\1;"), "normals with the other sign"),
        "z of normals not turned": (
            (r", -normals", ", normals"), "z of normals in view space with the other sign",
        ),
        "range check forgotten": (
            (r"\(1\.0 - smoothstep\(reach.*\)\);", "1.0;"), "range_check none in place of smoothstep",
        ),
        "strength of 1.5": ((r"- strength \*", "- 1.5 * strength *"), ("strength", 1.5)),
        "lengths not shifted": ((r"int\(random\.x \* 16\.0\)", "0"), "shifts directions in place of both"),
        "directions not shifted": ((r"int\(random\.y \* 16\.0\)", "0"), "shifts lengths in place of both"),
        "mean of one less": ((r"sum / 16\.0", "sum / 15.0"), "sum divided by 15 in place of 16"),
        "kernel not folded": ((r"directions\[k \+ 2\] \*", "(i % 2 == 0 ? 1.0 : -1.0) * directions[k + 2] *"), None),
        "x and y exchanged": (
            (r"\[k\] \* t \+ directions\[k \+ 1\]", "[k + 1] * t + directions[k]"), "samples with x and y exchanged",
        ),
        "a larger radius": ((r"way \* reach", "way * 1.3 * reach"), ("length of samples", 1.3)),
    },
    "xegtao": {
        "noise not tiled": ((r"p\.x % side", "p.x / side % side"), None),
        "normals inside out": ((r"n = (vec3\(normals.*\));", r"n = -\1;"), "normals with the other sign"),
        "z of normals not turned": (
            (r", -normals", ", normals"), "z of normals in view space with the other sign",
        ),
        "axis from the normal": ((r"cross\(ortho, v\)", "cross(ortho, n)"), None),
        "power forgotten": ((r"pow\((visible / float\(slices\)), power\)", r"\1"), ("power", 1 / 2.2)),
        "multiplier forgotten": ((r" \* 1\.457", ""), ("multiplier", 1 / 1.457)),
        "exact root": ((r"intBitsToFloat.*;", "sqrt(x);"), "root exact in place of bits"),
        "steps not at centres": ((r"round\(s \* omega\)", "s * omega"), "snap false in place of true"),
        "steps evenly": ((r", distribution\)", ", 1.0)"), "squared false in place of true"),
        "nearest step forgotten": ((r" \+ nearest;", ";"), "nearest 0 in place of 1.3"),
        "length not drawn": ((r"mix\(len, 1\.0, 0\.05\)", "len"), "longer 0 in place of 0.05"),
        "horizon not in the hemisphere": (
            (r"horizon0 = low0, horizon1 = low1", "horizon0 = -1.0, horizon1 = -1.0"), None,
        ),
    },
    "bevy": {
        "noise not tiled": ((r"p\.x % side", "p.x / side % side"), None),
        "normals inside out": ((r"n = (vec3\(normals.*\));", r"n = -\1;"), "normals with the other sign"),
        "z of normals turned": (
            (r", normals\[3 \* texel \+ 2\]", ", -normals[3 * texel + 2]"),
            "z of normals in view space with the other sign",
        ),
        "a larger radius": (
            (r"-0\.5 \* radius", "-0.5 * 1.457 * radius"), ("radius and thickness", (1.457, 1 / 1.457)),
        ),
        "as far up as across": (
            (r"(vec2\(d\.x, -d\.y\)) \* scale", r"\1 * scale * vec2(1.0, float(size.x) / float(size.y))"),
            "square true in place of false",
        ),
        "not between texels": (
            (r"d = between\(uv\)", "d = reversed_at(ivec2(floor(uv * vec2(size))))"),
            "textures read in the nearest texel",
        ),
        "steps evenly": ((r"s \* s \* vec2", "s * vec2"), None),
        "angles not over pi": ((r"v\)\)\) / PI;", "v)));"), "ao of 0 everywhere"),
        "ends not sorted": ((r"way < 0\.0 \? ends\.yx : ends", "ends"), None),
    },
    "filament-sao": {
        "noise not turning": ((r"\* 2\.4 \* random", "* 0.0 * random"), None),
        "normals inside out": ((r"n = (vec3\(normals.*\));", r"n = -\1;"), "normals with the other sign"),
        "z of normals turned": (
            (r", normals\[3 \* texel \+ 2\]", ", -normals[3 * texel + 2]"),
            "z of normals in view space with the other sign",
        ),
        "bias forgotten": ((r" \+ here\.z \* bias", ""), "bias 0 in place of 0.0005"),
        "root forgotten": ((r"sqrt\((.*)\);", r"\1;"), None),
        "power not doubled": ((r"2\.0 \* power", "power"), ("power", 0.5)),
        "intensity of a half": ((r"\* intensity", "* 0.5 * intensity"), "sum divided by 14 in place of 7"),
        "falloff not squared": ((r"weight \* weight \*", "weight *"), None),
        "radius without its 1/2": ((r"0\.5 \* projection", "projection"), None),
        "spiral of 5 turns": ((r"turns \* 2\.0", "5.0 * 2.0"), None),
        "not a texel away": ((r"max\(1\.0, ", "(") , None),
    },
    "filament-gtao": {
        "noise of rows from above": (
            (r"\bp\.y(?=\) & 3| - p\.x\) & 3)", "(size.y - 1 - p.y)"), "noise of rows from below",
        ),
        "slices not turned": ((r"turn = float.*, start", "turn = 0.0, start"), None),
        "steps not moved": ((r"start = float.*;", "start = 0.0;"), None),
        "normals inside out": ((r"n = (vec3\(normals.*\));", r"n = -\1;"), "normals with the other sign"),
        "z of normals turned": (
            (r", normals\[3 \* texel \+ 2\]", ", -normals[3 * texel + 2]"),
            "z of normals in view space with the other sign",
        ),
        "axis from the normal": ((r"axis = cross\(e, v\)", "axis = cross(e, n)"), None),
        "horizon not in the hemisphere": ((r"h = n \+ clamp.*;", ";"), None),
        "thickness forgotten": ((r"mix\(horizon, cosine, thickness\)", "horizon"), "thickness 0 in place of 0.05"),
        "fading forgotten": ((r"fading = clamp.*;", "fading = 0.0;"), None),
        "power of 1.5": ((r", power\)", ", 1.5 * power)"), ("power", 1.5)),
        "intensity of a half": ((r", intensity\)", ", 0.5 * intensity)"), ("intensity", 0.5)),
        "a larger radius": ((r"(?<!float )\bradius\b", "1.25 * radius"), ("radius", 1.25)),
        "not a texel away": ((r"max\((.*), float\(j \+ 1\)\)", r"\1"), None),
        "levels not read": ((r"levels - 1\)", "0)"), None),
        "length left out": ((r"visible \+= len \*", "visible +="), None),
        "a step less": ((r"j < steps;", "j < steps - 1;"), None),
    },
    "godot-4": {
        "normals inside out": ((r"n = normalize\((vec3\(normals.*\))\);", r"n = normalize(-\1);"),
                               "normals with the other sign"),
        "z of normals not turned": (
            (r", -normals\[3 \* texel \+ 2\]", ", normals[3 * texel + 2]"),
            "z of normals in view space with the other sign",
        ),
        "horizon forgotten": ((r" - horizon\)", ")"), "horizon 0 in place of 0.06"),
        "power of 1": ((r"pow\((.*), power\)", r"\1"), ("power", 1 / 1.5)),
        "intensity of 2.6": ((r"intensity \* sum", "1.3 * intensity * sum"), ("intensity", 1.3)),
        "a larger radius": ((r"(?<!float )\bradius\b", "1.25 * radius"), ("radius", 1.25)),
        "of one pass": ((r"a = parity.x \+ 2 \* parity.y", "a = 0"), None),
        "one turn": ((r"b = ORDER.*;", "b = 0;"), None),
        "turned the other way": ((r"float turn = ", "float turn = -"), None),
        "not scaled": ((r"scale = .*0\.07\) \*", "scale ="), None),
        "not mirrored": ((r"return min\(k, 2 \* n - 1 - k\)", "return min(k, n - 1)"), None),
        "not of the pass": ((r" \+ parity;", ";"), None),
        "fall-off of the whole radius": ((r"fall = .*;", "fall = -1.0 / (radius * radius);"), None),
        "point not drawn near": ((r"here\.z \*= 0\.99;", ""), None),
        "weights forgotten": ((r"TAPS\[i\]\.z", "1.0"), None),
        "one side": ((r"side = 1; side >= -1", "side = 1; side >= 1"), None),
    },
    "unity-urp": {
        "noise of rows from above": (
            (r"\(p \+ (int\(.*\))\) % side", r"ivec2(p.x + \1, 9 * side + size.y - 1 - p.y - \1) % side"),
            "noise of rows from below",
        ),
        "noise not shifted": ((r"int\(part \* float\(side\)\)", "0"), "shifted false in place of true"),
        "normals inside out": ((r"n = (vec3\(normals.*\));", r"n = -\1;"), "normals with the other sign"),
        "beta forgotten": ((r" - beta \* z", ""), "beta 0 in place of 0.004"),
        "epsilon of 0.0005": ((r"\+ epsilon", "+ 0.0005"), ("epsilon", 5.0)),
        "contrast forgotten": ((r"pow\((.*), contrast\)", r"\1"), ("contrast", 1 / 0.6)),
        "intensity of 2.5": ((r"\* intensity", "* 2.5"), ("sum", 2.5 / 3)),
        "falloff of 10": ((r"/ falloff\)", "/ 10.0)"), ("falloff", 1.25)),
        "range check forgotten": ((r"inside = .*;", "inside = 1.0;"), "range_check none in place of distance"),
        "mean of one less": ((r"/ float\(count\), 0", "/ float(count - 1), 0"), "sum divided by 7 in place of 8"),
        "a larger radius": ((r"way \* radius", "way * 1.3 * radius"), None),
        "not in the half ball": ((r"way \*= float.*;", ""), None),
        "not squared": ((r"fading \*= fading", "fading *= 1.0"), None),
        "angle of one turn": ((r" \* 100\.0", ""), None),
    },
    "n8ao": {
        "noise of rows from above": COMMON["noise of rows from above"],
        "noise not tiled": ((r"p\.x % side", "p.x / side % side"), None),
        "frame mirrored": ((r"b = cross\(n, t\)", "b = cross(t, n)"), None),
        "turned the other way": ((r"turn = random", "turn = -random"), None),
        "normals inside out": ((r"n = (vec3\(normals.*\));", r"n = -\1;"), "normals with the other sign"),
        "range check forgotten": ((r"weight = .*;", "weight = 1.0;"), "range_check none in place of smoothstep"),
        "falloff of a tenth of R": ((r" \* 0\.2;", " * 0.1;"), ("falloff", 0.5)),
        "bias forgotten": ((r"before >= bias", "before >= 0.0"), "bias 0 in place of"),
        "a larger radius": ((r"here \+ reach", "here + 1.3 * reach"), ("length of samples", 1.3)),
        "neighbours not left out": ((r"dot\(away, away\) >= 1\.0", "true"), "around false in place of true"),
        "points at R": ((r"fract\(random\.y .*\) \* way", "way"), "move false in place of true"),
        "x and y exchanged": (
            (r"golden\[3 \* i\], golden\[3 \* i \+ 1\]", "golden[3 * i + 1], golden[3 * i]"),
            "samples with x and y exchanged",
        ),
        "kernel not folded": (
            (r"golden\[3 \* i \+ 2\]", "(i % 2 == 0 ? 1.0 : -1.0) * golden[3 * i + 2]"),
            "z of samples 1, 3, 5, ... with the other sign, 8 of 16: the kernel is not folded",
        ),
        "mean of one less": ((r"max\(total, 1\.0\)", "(total - 1.0)"), "sum divided by 15 in place of 16"),
    },
    "r3d": SPIRAL | {
        "5 forgotten": ((r"\(5\.0 /", "(1.0 /"), ("intensity", 0.2)),
        "angles of rows from above": (
            (r"angles\[p\.y \* size\.x", "angles[(size.y - 1 - p.y) * size.x"), "noise of rows from below",
        ),
        "sine downwards": ((r", sin\(theta\)\)", ", -sin(theta))"), "sine down in place of up"),
        "cut down": ((r"p \+ ivec2\(offset\)", "ivec2(floor(vec2(p) + offset))"), "landing floor in place of truncate"),
    },
    "g3d": SPIRAL | {
        "5 forgotten": ((r"\(5\.0 /", "(1.0 /"), ("intensity", 0.2)),
        "angles of rows from below": (
            (r"angles\[p\.y \* size\.x", "angles[(size.y - 1 - p.y) * size.x"), None,
        ),
        "turned the other way": ((r"\+ spin", "- spin"), "samples turned the other way"),
        "level too low": ((r"- log_q", "- log_q + 1"), "log_q 2 in place of 3"),
        "edges averaged": ((r"< edge", "< 1e6"), "quad_edge"),
    },
}  # fmt: skip


@pytest.mark.parametrize("name", ENGINES)
def test_published_shaders_conform_with_their_own_kernel_and_noise(context, engine, tmp_path, name):
    report, result = compared(context, engine(name), tmp_path / "mine", name)
    assert report.exit_code == 0, result
    assert result.diagnosis is None


@pytest.mark.parametrize(("name", "bug"), [(name, bug) for name, bugs in BUGS.items() for bug in bugs])
def test_bugs_of_one_line_are_found_and_most_are_named(context, engine, tmp_path, monkeypatch, name, bug):
    if name in ("threejs-gtao", "filament-gtao"):  # 36 and 24 taps a texel: a search on as many would take long
        monkeypatch.setattr(diagnose, "_TRIED", 128)
        monkeypatch.setattr(diagnose, "_SEARCHED", 800)
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
    values = value if isinstance(value, tuple) else (value,)
    assert value is None or found.candidates[0].values == pytest.approx(values, rel=0.02)
