"""The sampler as a GLSL function: the points of the table, bit for bit, as an OpenGL driver computes them."""

import numpy as np
import pytest
from glsl_renderer import run_shader
from reference.sequences import owen_burley

from lfssao.cli.main import main
from lfssao.samples import sample_set
from lfssao.samples.formats import to_glsl_function

COUNT = 256
MAIN = """
layout(local_size_x = 64) in;
layout(std430, binding = 0) buffer Cells { uvec4 cells[]; };
layout(std430, binding = 1) buffer Points { vec2 points[]; };
uniform uint first;
void main() {
    uint k = gl_GlobalInvocationID.x;
    cells[k] = uvec4(sample_cell(first + k), 0u);
    points[k] = sample_point(first + k);
}
"""


@pytest.mark.parametrize("seed", [0, 7, 2**32 + 5, 2**64 - 1])
def test_the_function_makes_the_points_of_the_table(context, seed):
    text = to_glsl_function(sample_set("square", "owen-burley", 1, seed)).decode()
    program = context.compute_shader(f"#version 430\n{text}{MAIN}")
    arrays = [np.zeros((COUNT, 4), np.uint32), np.zeros((COUNT, 2), np.float32)]
    cells, points = run_shader(context, program, (COUNT // 64, 1, 1), arrays, (0, 1), {"first": 0})
    right = np.array(owen_burley(COUNT, seed, 3))
    words = np.concatenate([(right[:, :2] + 1) / 2, right[:, 2:]], axis=1) * 2**32 - 0.5
    np.testing.assert_array_equal(cells[:, :3], words)
    exact = (np.floor(words[:, :2] / 2**9) + 0.5) / 2**22 - 1  # the first 23 bits and a half
    np.testing.assert_array_equal(points, exact)
    made = sample_set("square", "owen-burley", COUNT, seed).points
    assert np.abs(points - made).max() <= 2.0**-23


def test_the_command_writes_it_and_refuses_others(capsys):
    assert main(["samples", "make", "owen-burley", "--format", "glsl-function", "-n", "1"]) == 2
    assert "glsl-function is of owen-burley on the square, not of owen-burley on the ball" in capsys.readouterr().err
    assert main(["samples", "make", "owen-burley", "--domain", "square", "--format", "glsl-function", "-n", "8"]) == 0
    assert "vec2 sample_point(uint k)" in capsys.readouterr().out
