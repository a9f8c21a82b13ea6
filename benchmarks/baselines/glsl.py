"""Algorithm 2 as a compute shader, on whatever OpenGL driver there is: Mesa's llvmpipe runs it on the processor."""

from pathlib import Path
from typing import Any

import numpy as np
from baselines.case import Case, FloatTexture, compared, equal_share

from lfssao.errors import MissingPackageError

SOURCE = Path(__file__).with_name("algorithm2.comp")
_GROUP = 8


def measure(repeats: int, threads: int) -> dict[str, Any]:
    """The shader with its textures in place: neither upload nor reading back is timed."""
    try:
        import moderngl
    except ImportError as error:
        raise MissingPackageError("moderngl is not installed: install lfssao[bench]") from error
    try:
        options: dict[str, Any] = {"standalone": True, "backend": "egl", "require": 430}
        context = moderngl.create_context(**options)
    except Exception as error:  # what drivers raise is not a type of its own
        raise MissingPackageError(f"there is no OpenGL 4.3 without a window ({error})") from error
    case = Case.of(threads)
    height, width = case.depth.shape
    program = context.compute_shader(SOURCE.read_text(encoding="utf-8"))
    program["size"], program["samples"] = (width, height), len(case.image_offsets)
    arrays = [case.depth, case.positions, case.image_offsets, case.numbers, np.full_like(case.depth, np.nan)]
    buffers = [context.buffer(np.ascontiguousarray(array).tobytes()) for array in arrays]
    for binding, buffer in enumerate(buffers):
        buffer.bind_to_storage_buffer(binding)

    def run() -> None:
        program.run(-(-width // _GROUP), -(-height // _GROUP))
        context.finish()

    rows = compared({"lfssao": case.ours, "glsl": run}, repeats)
    made: FloatTexture = np.frombuffer(buffers[-1].read(), np.float32).reshape(height, width)
    rows["glsl"]["equal_bits"] = equal_share(made, case.ours())
    rows["glsl"]["renderer"] = context.info["GL_RENDERER"]
    context.release()
    return {"rows": rows}
