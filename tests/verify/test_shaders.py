"""Shaders of ordinary AO, judged by the command: right ones in several conventions, and a dozen bugs in each.

They share nothing with lfssao but the kit's specification (``tests/glsl``), compute in world units and on any driver.
"""

import functools
import re

import ao_shaders
import numpy as np
import pytest
from jobs import render

from lfssao.cli.main import main

pytestmark = pytest.mark.slow
TAU = "6.283185307179586"
RAW = "--parameter", "gauss=0", "--parameter", "quad_edge=0"
SLICES = [
    "--rotate", "ign", *(f"--parameter={each}" for each in (
        "randomize=false", "slices=3", "steps=4", "start=0.5", "distribution=squared", "falloff=0.615", "power=2.0"))
]  # fmt: skip
COSINE = "part * (cos_n + 2.0 * h * sin(tilt) - cos(2.0 * h - tilt)) / 4.0"
UNIFORM = "0.5 - 0.5 * clamp(horizon, -1.0, 1.0)"
# Shader, the defines of its convention, the scene and options of the reference.
RIGHT = {
    "sao": ("sao", {"FACE": 1, "LANDING": 0, "FULL_TURN": TAU}, ("corner", *RAW)),
    "sao of another hash, truncated, of 6.28": (
        "sao", {"FACE": 1, "LANDING": 1, "FULL_TURN": "6.28"},
        ("corner", *RAW, "--rotate", "common-hash", "--parameter", "landing=truncate", "--parameter", "full_turn=6.28"),
    ),
    "sao at the nearest texel, normals of a texture": (
        "sao", {"FACE": 0, "LANDING": 2, "FULL_TURN": TAU},
        ("statue", *RAW, "--rotate", "r2", "--parameter", "landing=nearest", "--parameter", "normals=buffer",
         "--parameter", "mip=none"),
    ),
    "hbao": ("hbao", {}, ("corner", "--rotate", "ign", "--parameter", "randomize=false", "--parameter", "bias=10")),
    "hbao without bias": ("hbao", {}, ("statue", "--rotate", "tiles", "--parameter", "randomize=false")),
    "gtao": ("gtao", {"WEIGHTED": COSINE}, ("corner", *SLICES)),
    "gtao, uniform": ("gtao", {"WEIGHTED": UNIFORM}, ("statue", *SLICES, "--parameter", "weighting=uniform")),
    "oriented": ("oriented", {"RANGE": 2}, ("statue",)),
    "oriented by distance": ("oriented", {"RANGE": 1}, ("corner", "--parameter", "range_check=distance")),
    "oriented without range check": ("oriented", {"RANGE": 0}, ("statue", "--parameter", "range_check=none")),
}  # fmt: skip
ESTIMATORS = {"sao": "sao", "hbao": "hbao", "gtao": "gtao", "oriented": "oriented-hemisphere"}

# The convention of a bug, its change of the shader's text or of what it is handed, and the cause that is named, with
# its value; None where it is found and no name is asked for.
SAO = "sao"
BUFFER = "sao at the nearest texel, normals of a texture"
HBAO = "hbao"
GTAO = "gtao"
ORIENTED = "oriented"
BUGS = {
    "bias forgotten": (SAO, (r"- beta\)", ")"), "beta 0 in place of 0.01"),
    "projection scale without its 1/2": (SAO, (r"radius \* lens.xy / z", "2.0 * radius * lens.xy / z"),
                                         "radius in texels x 2.000, as of a projection scale without its 1/2,"),
    "5 forgotten": (SAO, (r"\(5\.0 /", "(1.0 /"), ("intensity", 0.2)),
    "falloff squared": (SAO, (r"f \* f \* f", "f * f * radius * radius"), None),
    "epsilon of R": (SAO, (r"epsilon \+ vv", "2.5 * epsilon + vv"), ("epsilon", 2.5)),
    "truncated": (SAO, (r"ivec2\(floor\(vec2\(p\) \+ offset\)\)", "p + ivec2(offset)"),
                  "landing truncate in place of floor"),
    "angles of rows from below": (SAO, (r"angles\[p\.y", "angles[(size.y - 1 - p.y)"),
                                  "turns of rows from below"),
    "spiral of 5 turns": (SAO, (r"float\(turns\)", "5.0"), "turns 5 in place of 7"),
    "without the half": (SAO, (r"\(float\(t\) \+ 0\.5\)", "(float(t) + 1.0)"),
                         "taps at (i + 1) / n of the radius in place of (i + 1/2) / n"),
    "turned the other way": (SAO, (r"\+ spin", "- spin"), "samples turned the other way"),
    "level too low": (SAO, (r"- log_q", "- log_q + 1"), "log_q 2 in place of 3"),
    "one tap less": (SAO, (r"t < taps", "t < taps - 1"), "the last tap left out, sum divided as before"),
    "world normals taken for eye normals": (BUFFER, (r"return vec3\(dot", "return n; return vec3(dot"), None),
    "cut down": (BUFFER, (r"p \+ ivec2\(floor\(offset \+ 0\.5\)\)", "p + ivec2(floor(offset))"),
                 "landing floor in place of nearest"),
    "a step less": (HBAO, (r"k <= steps; k\+\+", "k < steps; k++"), "step 8 of each direction dropped"),
    "6 steps": (HBAO, (r"= steps|float\(steps\)", lambda m: m[0].replace("steps", "6")), "steps 6 in place of 8"),
    "attenuation forgotten": (HBAO, (r"\(1\.0 - rho \* rho\)", "1.0"), "attenuation none in place of quadratic"),
    "linear attenuation": (HBAO, (r"rho \* rho", "rho"), "attenuation linear in place of quadratic"),
    "bias forgotten here": (HBAO, (r" \+ bias", ""), "bias 0 in place of 10"),
    "bias in radians": (HBAO, (r" \+ bias", " + 1.5 * bias"), ("bias", 1.5)),
    "not turned": (HBAO, (r"spin = angles\[texel\]", "spin = 0.0"), "samples are not turned"),
    "turned back": (HBAO, (r"spin = ", "spin = -"), "samples turned the other way"),
    "normals inside out": (HBAO, (r"n = fetch3\(1, p\)", "n = -fetch3(1, p)"), "normals with the other sign"),
    "a larger radius": (HBAO, (r"(?<!float )\bradius\b", "(1.25 * radius)"), ("radius", 1.25)),
    "horizon never raised": (HBAO, (r"horizon = up;", ";"), None),
    "half the mean": (HBAO, (r"sum / float\(around\)", "0.5 * sum / float(around)"), "sum divided by 16 in place of 8"),
    "tangent plane forgotten": (HBAO, (r"rise = atan\(-dot\(n, out_there\) / facing\)", "rise = 0.0"), None),
    "axis from the normal": (GTAO, (r"cross\(along, v\)", "cross(along, normal)"), None),
    "half step missing": (GTAO, (r"float\(k\) \+ start", "float(k)"), "start 0 in place of 0.5"),
    "uniform for cosine": (GTAO, (r"WEIGHTED", "0.5 - 0.5 * horizon"), "weighting uniform in place of cosine"),
    "horizon not in the hemisphere": (GTAO, (r"horizon = low", "horizon = -1.0"), None),
    "falloff forgotten": (GTAO, (r"mix\(low, dot\(d, v\) / far, weight\)", "far < radius ? dot(d, v) / far : low"),
                          "falloff 0 in place of 0.615"),
    "falloff of the square": (GTAO, (r", weight\)\)", ", weight * weight))"), None),
    "power forgotten": (GTAO, (r"pow\((.*), power\)", r"\1"), ("power", 0.5)),
    "steps even": (GTAO, (r"way \* x \* x", "way * x"), "distribution even in place of squared"),
    "slices turned the other way": (GTAO, (r"spin = ", "spin = -"), "samples turned the other way"),
    "slices not turned": (GTAO, (r"spin = angles\[texel\]", "spin = 0.0"), "samples are not turned"),
    "normal inside out": (GTAO, (r"normal = fetch3\(1, p\)", "normal = -fetch3(1, p)"), None),
    "arc cosine by the polynomial": (
        GTAO, (r"return acos\(clamp\(x, -1\.0, 1\.0\)\)", "float a = (0.5 * PI - 0.156583 * abs(x)) * "
               "sqrt(max(0.0, 1.0 - abs(x))); return x < 0.0 ? PI - a : a"), None),
    "no bias": (ORIENTED, (r"- bias", ""), "bias 0 in place of 0.05"),
    "no range check": (ORIENTED, (r"smoothstep\(0\.0, 1\.0, radius / abs\(z_c - z\)\)", "1.0"),
                       "range_check none in place of smoothstep"),
    "range check by distance": (ORIENTED, (r"smoothstep\(0\.0, 1\.0, radius / abs\(z_c - z\)\)",
                                           "(abs(z_c - z) < radius ? 1.0 : 0.0)"),
                                "range_check distance in place of smoothstep"),
    "ball in place of half": (ORIENTED, (r"abs\((samples\[3 \* s \+ 2\])\)", r"\1"), None),
    "larger": (ORIENTED, (r"c \+ radius", "c + 1.3 * radius"), ("length of samples", 1.3)),
    "noise left out": (ORIENTED, (r"cos\(angles\[texel\]\) \* right \+ sin\(angles\[texel\]\) \* up", "right"),
                       "samples are not turned"),
    "noise upside down": (ORIENTED, (r"sin\(angles\[texel\]\) \* up", "-sin(angles[texel]) * up"),
                          "samples turned the other way"),
    "normals the other way": (ORIENTED, (r"vec3\(normals\[3 \* texel\]", "-vec3(normals[3 * texel]"),
                              "normals with the other sign"),
    "background hides": (ORIENTED, (r"there\.x\]\)\) continue;", "there.x])) { sum += 1.0; continue; }"), None),
    "mean of one less": (ORIENTED, (r"float\(count\)", "float(count - 1)"), "sum divided by 63 in place of 64"),
    "left-handed frame": (ORIENTED, (r"cross\(n, tangent\)", "cross(tangent, n)"), "samples mirrored in y"),
    "x and y exchanged": (ORIENTED, (r"o\.x \* tangent \+ o\.y \* bitangent", "o.y * tangent + o.x * bitangent"),
                          "samples with x and y exchanged"),
    "visibility": (ORIENTED, (r"= sum / float\(count\)", "= 1.0 - sum / float(count)"), "1 - ao in place of ao"),
}  # fmt: skip


@pytest.fixture(scope="module")
def frame(tmp_path_factory):
    """The frame of a convention, rendered when it is first asked for."""

    @functools.cache
    def rendered(convention):
        shader, _, words = RIGHT[convention]
        how = "--camera", "--resolution", "96x72", "--radii", "8%", "--layers", "depth,positions,normals,ao"
        folder = tmp_path_factory.mktemp(shader) / "reference"
        return ao_shaders.Frame(render(folder, *words, *how, "--estimator", ESTIMATORS[shader]))

    return rendered


def compared(context, frame, target, convention, change=None):
    """The report and the result on the occlusion of a convention's shader."""
    shader, defines, _ = RIGHT[convention]
    return ao_shaders.judged(context, shader, frame, target, defines, change)


@pytest.mark.parametrize("convention", RIGHT)
def test_right_shaders_are_right(context, frame, tmp_path, convention):
    report, result = compared(context, frame(convention), tmp_path / "mine", convention)
    assert report.exit_code == 0, result
    assert result.diagnosis is None


@pytest.mark.parametrize("bug", BUGS)
def test_bugs_are_found_and_most_are_named(context, frame, tmp_path, bug):
    convention, change, cause = BUGS[bug]
    report, result = compared(context, frame(convention), tmp_path / "mine", convention, change)
    assert report.exit_code == 2
    found = result.diagnosis
    if cause is not None:
        kind, value = cause if isinstance(cause, tuple) else (cause, None)
        assert (found.candidates[0].kind, found.fits) == (kind, True), found.words("M")
        assert value is None or found.candidates[0].values == pytest.approx((value,), rel=0.01)


def as_opengl_stores(frame, folder):
    """A frame as an OpenGL renderer hands it over: rows from below, its own depth, normals, angles and matrices."""
    (eye, projection), (_, height) = frame.opengl(), frame.size
    depth = frame.textures["depth"].astype(np.float64)
    normals = np.einsum("kc,ijc->ijk", eye[:3, :3], frame.textures["normals"].astype(np.float64))
    j, i = np.indices(depth.shape)
    own = ((3 * i) ^ (height - 1 - j) + i * (height - 1 - j)) * 10  # the integer that shaders turn into radians
    np.save(folder / "depth.npy", (2 * depth - 1)[::-1].astype(np.float32))
    np.save(folder / "normals.npy", (normals / 2 + 0.5)[::-1].astype(np.float32))
    np.save(folder / "angles.npy", np.float32(own)[::-1])
    (folder / "camera.toml").write_text(
        f'kind = "camera"\nview = {eye.tolist()}\nprojection = {projection.tolist()}\nclip = "opengl"\nrows = "below"\n'
        'depth_kind = "window-gl"\nnormals_space = "view"\nnormals_kind = "unorm"\n'
    )


def test_buffers_of_another_renderer_are_judged_in_two_commands(context, frame, tmp_path, capsys):
    """A shader of normals from a texture, its own hash in float32, lengths in world units; then with another bias."""
    theirs, mine, right = (tmp_path / name for name in ("theirs", "mine", "right"))
    theirs.mkdir()
    as_opengl_stores(frame("sao"), theirs)
    words = "--buffers", theirs / "camera.toml", "--rotate", theirs / "angles.npy", "--rotate-rows", "below"
    given = "--depth", theirs / "depth.npy", "--normals", theirs / "normals.npy", "--like", "r3d", "--units", "world"
    given += "--parameter", "sine=down"  # it is drawn in rows from above
    assert main(["ao", *map(str, (*given, *words)), "--radii", "0.5", "-o", str(right)]) == 0
    shown = ao_shaders.Frame(right)
    defines = {"FACE": 0, "LANDING": 1, "FULL_TURN": TAU}
    for change, code in ((None, 0), ((r"- beta\)", "- 0.5 * beta)"), 2)):
        mine.mkdir(exist_ok=True)
        made = ao_shaders.draw(context, "sao", shown, defines, change)
        np.save(mine / "depth_ao_1.npy", made[::-1])
        assert main(["compare", str(mine), str(right), "--layers", "ao_1"]) == code
    assert re.search(r"beta x 0\.(50|49)\d\d explains 99\.\d\d % of the \d+ wrong texels", capsys.readouterr().out)
