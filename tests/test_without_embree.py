"""Where embreex cannot be installed, everything but ray casting works, and ray casting says what is missing."""

import subprocess
import sys

PREAMBLE = """
import sys
class Nowhere:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] == "embreex":
            raise ModuleNotFoundError(f"No module named '{name}'", name=name)
sys.meta_path.insert(0, Nowhere())
"""


def run(program, *arguments):
    command = [sys.executable, "-c", PREAMBLE + program, *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_every_module_imports_and_the_passes_work():
    done = run(
        """
import importlib, pkgutil
import numpy as np
import lfssao
modules = [m.name for m in pkgutil.walk_packages(lfssao.__path__, "lfssao.") if m.name != "lfssao.__main__"]
for name in modules:
    importlib.import_module(name)
mesh = lfssao.builtin_scene("ammonite")
view = lfssao.module_views(mesh, lfssao.find_display("virtual"))[0]
depth, positions = np.zeros((4, 6), np.float32), np.zeros((4, 6, 3), np.float32)
ao = lfssao.algorithm2(depth, positions, view.world_to_image, lfssao.make_samples(), 0.1).texture
shaded = lfssao.shade(np.ones((4, 6, 3), np.float32), lfssao.blur(lfssao.merge([ao, ao]), 1.0))
assert "embreex" not in sys.modules
print(len(modules), shaded.shape)
"""
    )
    assert done.returncode == 0, done.stderr
    count, shape = done.stdout.split(maxsplit=1)
    assert int(count) > 30
    assert shape.strip() == "(4, 6, 3)"


def test_ray_casting_says_what_is_missing(tmp_path):
    done = run(
        "from lfssao.cli import main; sys.exit(main(['render', 'ammonite', '-o', sys.argv[1]]))", str(tmp_path / "out")
    )
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "embreex" in done.stderr
    assert "ray casting" in done.stderr
    assert not (tmp_path / "out").exists()


def test_the_ground_truth_needs_it_only_where_it_is_asked_for():
    done = run(
        """
import numpy as np
import lfssao
mesh = lfssao.Mesh(np.array([[0.0, 0, 1], [1, 0, 1], [0, 1, 1]]), np.array([[0, 1, 2]]))
view = lfssao.Camera("perspective", (0, 0, 2), (0, 0, 0), (0, 1, 0), 1.0, 1.0, 3.0).view(2, 1)
up = np.tile([0.0, 0.0, 1.0], (1, 2, 1))
buffers = lfssao.Buffers(view, np.zeros((1, 2)), np.full((1, 2, 3), 0.1), up)
occluders = lfssao.Occluders(mesh)
print(lfssao.ray_cast_occlusion(occluders, buffers, 1.0).texture.min() > 0)
try:
    lfssao.ray_cast_occlusion(occluders, buffers, 1.0, intersector="embree")
except lfssao.MissingPackageError as error:
    print(error)
"""
    )
    assert done.returncode == 0, done.stderr
    covered, said = done.stdout.splitlines()
    assert covered == "True"
    assert said.startswith("ray casting needs the package embreex, which is not installed here")
