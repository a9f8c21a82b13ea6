"""Shaders of ordinary AO, ``tests/glsl``, written from the kit's specification, on the G-buffers of a rendered camera.

They compute as shaders do: in eye or world space and world units, with their own sines, cosines and square roots.
"""

import re
from pathlib import Path

import numpy as np
from glsl_renderer import run_shader
from jobs import manifest_of
from reference import dither
from reference.scalable import turns_of

import lfssao
from lfssao.files.exr import read_exr

SHADERS = Path(__file__).resolve().parents[1] / "glsl"
GROUP = 8


class Frame:
    """A camera's view that ``lfssao render`` made: its textures and the numbers that a shader's host hands over."""

    def __init__(self, folder):
        manifest = manifest_of(folder)
        (entry,), self.settings = manifest["views"], manifest["settings"]
        self.folder, self.name, self.view = folder, entry["name"], entry["view"]
        parts = read_exr(folder / entry["file"])
        self.textures = {name: np.squeeze(part.pixels) for name, part in parts.items()}
        self.options, (self.radius,) = self.settings["parameters"], self.settings["radii"]
        rotation = self.settings["rotation"]
        seed = self.settings["rotation_seed"]
        self.angles = np.zeros_like(self.textures["depth"])
        if rotation == "angles":
            self.angles = np.load(folder / "angles.npy")
        elif rotation != "none":
            self.angles = np.pi * np.array(dither.angles(rotation, *self.textures["depth"].shape, seed))

    @property
    def size(self):
        height, width = self.textures["depth"].shape
        return width, height

    def uniforms(self):
        """Numbers that all shaders read, by name."""
        back = np.array(self.view["world_from_cast"])
        right, up = (back[:, k] / np.linalg.norm(back[:, k]) for k in (0, 1))
        return {
            "size": self.size, "radius": self.radius, "right": right, "up": up, "eye": back[:, 3],
            "axis": self.view["cast_from_world"][2], "lens": self.view["lens"][:4], "planes": self.view["lens"][4:6],
        }  # fmt: skip

    def opengl(self):
        """World to eye, whose eye looks along -z, and OpenGL's projection, (4, 4) each."""
        (f_u, f_v, c_u, c_v, near, far), (width, height) = self.view["lens"][:6], self.size
        eye = np.vstack([np.array(self.view["cast_from_world"]) * [[1], [1], [-1]], [0, 0, 0, 1]])
        return eye, np.array([
            [2 * f_u / width, 0, 1 - 2 * c_u / width, 0], [0, 2 * f_v / height, 2 * c_v / height - 1, 0],
            [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)], [0, 0, -1, 0],
        ])  # fmt: skip

    def arrays(self):
        """Textures and tables, by the names of the shaders' buffers."""
        textures = {name.capitalize(): self.textures[name] for name in ("depth", "positions", "normals")}
        samples = self.settings["samples"]
        return textures | {
            "Angles": self.angles, "Axes": np.array(self.view["cast_from_world"])[:, :3],
            "Mapping": np.array(self.view["world_to_image"]), "Samples": np.zeros(1) if samples is None else samples,
        }  # fmt: skip


def levels_of(frame):
    count, (width, height) = 1, frame.size
    while count <= frame.options["max_level"] and max(width, height) > 1:
        width = -(-width // 2)
        height = -(-height // 2)
        count = count + 1
    return count if frame.options["mip"] != "none" else 1


def numbers_of(frame):
    """The uniforms of each shader's estimator, in world units."""
    o = frame.options
    r = 1.0 if frame.settings["units"] == "world" else frame.radius
    if frame.settings["estimator"] == "sao":
        made = {"intensity": o["intensity"] * r, "beta": o["beta"] * r, "epsilon": o["epsilon"] * r * r}
        turns = o["turns"] or turns_of(o["taps"])
        return made | {"taps": o["taps"], "turns": turns, "log_q": o["log_q"], "levels": levels_of(frame), "edge": 0.0}
    if frame.settings["estimator"] == "hbao":
        return {"bias": np.radians(o["bias"]), "around": o["directions"], "steps": o["steps"]}
    if frame.settings["estimator"] == "gtao":
        return {name: o[name] for name in ("slices", "steps", "start", "falloff", "power")}
    return {"bias": o["bias"] * r, "count": len(frame.settings["samples"])} if "bias" in o else {}


def draw(context, name, frame, defines, change=None):
    """Occlusion by a shader; ``change`` is (pattern, replacement) in its text."""
    return run(context, name, defines, change, frame.arrays(), {**frame.uniforms(), **numbers_of(frame)}, frame.size)


def run(context, name, defines, change, arrays, uniforms, size):
    """Occlusion of a texture of a size by a shader, of arrays and uniforms by their names."""
    text = (SHADERS / f"{name}.comp").read_text()
    if change is not None:
        text, count = re.subn(*change, text)
        assert count, f"nothing in {name}.comp is like {change[0]}"
    lines = "".join(f"#define {key} {value}\n" for key, value in defines.items())
    program = context.compute_shader(f"#version 430\n{lines}{text}")
    names = re.findall(r"binding = \d+\) \w+ buffer (\w+)", text)
    arrays = {**arrays, "Occlusion": np.zeros(size[::-1])}
    bound = [np.asarray(arrays[key], np.float32) for key in names]
    used = {key: value for key, value in uniforms.items() if key in program}
    (made,) = run_shader(context, program, [-(-n // GROUP) for n in size], bound, [names.index("Occlusion")], used)
    program.release()
    return made


def judged(context, name, frame, target, defines, change=None):
    """The report and the result on a shader's occlusion; the folder is written as a renderer would."""
    target.mkdir()
    for layer in ("depth", "positions", "normals"):
        np.save(target / f"{frame.name}_{layer}.npy", frame.textures[layer])
    np.save(target / f"{frame.name}_ao_1.npy", draw(context, name, frame, defines, change))
    report = lfssao.compare(target, frame.folder)
    (result,) = (r for r in report.results if r.layer == "ao_1")
    return report, result
