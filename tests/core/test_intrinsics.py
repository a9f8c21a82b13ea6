"""Bare memory; kernels run as plain Python, by which a reader steps through them, with the same bits."""

import numba
import numpy as np
from jobs import digests_of, python, render

from lfssao.core.intrinsics import memory_of

COMMAND = ["corner", "--camera", "--resolution", "8x6", "--radii", "0.3", "--samples", "3"]


def test_textures_without_compiler_have_the_same_bits(tmp_path):
    words = ["render", *COMMAND, "-o", str(tmp_path / "plain")]
    script = "import sys, numba, lfssao.cli.main as m; assert numba.config.DISABLE_JIT; sys.exit(m.main(sys.argv[1:]))"
    done = python("-c", script, *words, NUMBA_DISABLE_JIT="1")
    assert done.stderr == ""
    plain = digests_of(tmp_path / "plain")
    assert plain
    assert plain == digests_of(render(tmp_path / "compiled", *COMMAND))


# Textures of estimators that are written as formulas, of a module's view and a camera's.
FORMULAS = """import numba, numpy as np
from lfssao import Camera, RayCaster, builtin_scene, find_display, module_views
from lfssao.ao.estimators.registry import ESTIMATORS, estimate
from lfssao.ao.textures import Buffers
mesh = builtin_scene("statue")
module = module_views(mesh, find_display("sample-a-conical").with_resolution(8, 6), range(4, 5))[0]
for view in (Camera.looking_at(mesh.bounds).view(8, 6), module):
    seen = Buffers.of(RayCaster(mesh, view.cast_from_world).gbuffer(view, None, "geometric"), view).turned("hash")
    for name, changes in (("oriented-hemisphere", {"range_check": "distance"}), ("oriented-hemisphere", {}),
                          ("alchemy", {"k": 2.5, "sigma": 9.0})):
        assert ESTIMATORS[name].formulas
        points, weights = ESTIMATORS[name].samples(5)
        made = estimate(name, seen, 1.0, points, weights, **changes).texture
        print(name, made.dtype, made.tobytes().hex())
print(numba.config.DISABLE_JIT)"""


def test_formulas_without_compiler_have_the_same_bits():
    compiled = python("-c", FORMULAS).stdout.splitlines()
    plain = python("-W", "ignore", "-c", FORMULAS, NUMBA_DISABLE_JIT="1").stdout.splitlines()
    assert [compiled.pop(), plain.pop()] == ["0", "1"]
    assert len(plain) == 6
    assert plain == compiled
    assert len({line.split()[-1] for line in plain}) > 2


@numba.njit
def looked_up(array, other):
    bare = memory_of(array)
    return bare[0], bare[2], memory_of(other) is None


def test_the_memory_of_an_array_has_its_numbers_and_of_none_there_is_none():
    for dtype in (np.float32, np.float64, np.int64, np.uint8):
        part = np.arange(9, dtype=dtype).reshape(3, 3)[1]  # it begins within another array
        assert looked_up(part, None) == (3, 5, True)


CHECKED = """import numba, numpy as np
from lfssao.core.intrinsics import memory_of
@numba.njit
def beyond(array):
    return memory_of(array)[len(array)]
try:
    print(beyond(np.zeros(3)))
except IndexError as error:
    print(error)"""


def test_with_numbas_check_of_indices_no_look_up_goes_beyond():
    assert python("-c", CHECKED, NUMBA_BOUNDSCHECK="1").stdout == "index is out of bounds\n"
