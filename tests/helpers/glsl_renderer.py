"""A renderer of GLSL 4.3 compute shaders, written from the kit's specification: no kernel of lfssao runs here.

It solves cases of the stages that renderers have. Any driver will do; Mesa's llvmpipe needs no graphics card.
"""

import os
from pathlib import Path

import moderngl
import numpy as np
import pytest
from reference.mapping import offsets, rounded
from reference.passes import blur_table, blur_weights

SHADERS = Path(__file__).parent / "glsl"
KINDS = ("crossed slits", "matrix", "display")
_GROUP = 8


def open_context():
    """An OpenGL 4.3 context without a window."""
    return moderngl.create_context(standalone=True, backend="egl", require=430)


def without_opengl(error):
    """Skip; but a CI that skipped these tests would prove nothing."""
    reason = f"no OpenGL 4.3 context by EGL: {error}"
    if os.environ.get("CI"):
        pytest.fail(reason)
    pytest.skip(reason)


def run_shader(context, program, groups, arrays, output, uniforms):
    """Run a program on arrays bound in order; those whose numbers are in ``output`` as they are then."""
    buffers = [context.buffer(np.ascontiguousarray(array).tobytes()) for array in arrays]
    for binding, buffer in enumerate(buffers):
        buffer.bind_to_storage_buffer(binding)
    for uniform, value in uniforms.items():
        program[uniform] = tuple(value) if np.ndim(value) else value
    program.run(*groups)
    context.memory_barrier()
    made = [np.frombuffer(buffers[k].read(), arrays[k].dtype).reshape(arrays[k].shape).copy() for k in output]
    for buffer in buffers:
        buffer.release()
    return made


class Renderer:
    """Compute shaders of one context."""

    def __init__(self, context):
        self.context = context
        self.programs = {
            path.stem: context.compute_shader(self.source(path)) for path in sorted(SHADERS.glob("*.comp"))
        }

    def source(self, path):
        """A shader's text, with that of the mappings before it where it has one to do."""
        mapping = (SHADERS / "mapping.glsl").read_text() if path.stem == "occlusion" else ""
        return f"#version 430\n{mapping}{path.read_text()}"

    def run(self, name, groups, arrays, output, **uniforms):
        """Run a program on arrays bound in order, and read one of them back as float32 or uint32."""
        return run_shader(self.context, self.programs[name], groups, arrays, output, uniforms)

    def _occlusion(self, kind, numbers, parameters, inputs, places):
        depth = inputs["depth"]
        table = np.array(offsets(parameters["radius"], inputs["samples"]), np.float32)
        height, width = depth.shape
        made = np.full_like(depth, np.nan)
        outside = np.zeros(1, np.uint32)
        turns = inputs.get("turns", np.zeros(1, np.float32))
        arrays = [np.array(rounded(numbers)), depth, places, table, made, outside, turns]
        made, outside = self.run(
            "occlusion", (-(-width // _GROUP), -(-height // _GROUP)), arrays, (4, 5), size=(width, height),
            kind=KINDS.index(kind), samples=len(table), algorithm1="screen_to_world" in parameters,
            turning="turns" in inputs,
        )  # fmt: skip
        return {"occlusion": made, "outside": outside.astype(np.int64), "offsets": table}

    def algorithm1(self, parameters, inputs):
        back = np.array(rounded(parameters["screen_to_world"]))
        return self._occlusion("matrix", parameters["world_to_screen"], parameters, inputs, back)

    def algorithm2(self, parameters, inputs):
        mapping = parameters["mapping"]
        return self._occlusion(mapping["kind"], mapping["numbers"], parameters, inputs, inputs["positions"])

    def merge(self, parameters, inputs):
        layers = inputs["layers"]
        count = len(layers)
        texels = layers[0].size
        merged = np.full_like(layers[0], np.nan)
        groups = (-(-texels // 64),)
        return {"merged": self.run("merge", groups, [layers, merged], (1,), texels=texels, count=count)[0]}

    def blur(self, parameters, inputs):
        source = inputs["source"]
        exact = np.array(blur_weights(parameters["sigma"]))
        weights = blur_table(parameters["sigma"])
        height, width = source.shape
        passes = [source]
        for direction in ((1, 0), (0, 1)) if len(weights) > 1 else ():
            arrays = [passes[-1], weights, np.full_like(source, np.nan)]
            groups = -(-width // _GROUP), -(-height // _GROUP)
            passes += self.run(
                "blur", groups, arrays, (2,), size=(width, height), direction=direction, reach=len(weights) // 2
            )
        return {
            "blurred": passes[-1], "horizontal": passes[len(passes) // 2], "weights": weights, "weights_float64": exact,
        }  # fmt: skip

    def shade(self, parameters, inputs):
        image = inputs["image"]
        arrays = [image, inputs["occlusion"], np.full_like(image, np.nan)]
        return {"shaded": self.run("shade", (-(-image.size // 64),), arrays, (2,), numbers=image.size)[0]}

    def light(self, parameters, inputs):
        image = inputs["image"]
        direction = parameters["direction"]
        length = np.sqrt((direction[0] * direction[0] + direction[1] * direction[1]) + direction[2] * direction[2])
        arrays = [image, inputs["occlusion"], inputs["normals"], np.full_like(image, np.nan)]
        numbers = {"towards": tuple(each / length for each in direction), "ambient": parameters["ambient"]}
        numbers |= {"on_all": parameters["occlude"] == "all", "numbers": image.size}
        return {"shaded": self.run("light", (-(-image.size // 64),), arrays, (3,), **numbers)[0]}

    def frame(self, parameters, inputs):
        g = parameters["guard"]

        def crop(texture):
            return np.ascontiguousarray(texture[g : texture.shape[0] - g, g : texture.shape[1] - g])

        algorithm = self.algorithm1 if "screen_to_world" in parameters else self.algorithm2
        layers = [algorithm({**parameters, "radius": r}, inputs)["occlusion"] for r in parameters["radii"]]
        merged = self.merge({}, {"layers": np.array(layers)})["merged"]
        blurred = crop(self.blur(parameters, {"source": merged})["blurred"])
        shaded = self.shade({}, {"image": crop(inputs["image"]), "occlusion": blurred})["shaded"]
        made = {f"ao_{k + 1}": crop(layer) for k, layer in enumerate(layers)}
        return {"shaded": shaded, "merged": crop(merged), "blurred": blurred, **made}

    def solve(self, stage, parameters, inputs):
        return getattr(self, stage)(parameters, inputs)


STAGES = ("algorithm1", "algorithm2", "merge", "blur", "shade", "light", "frame")
