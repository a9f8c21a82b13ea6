"""Text that trimesh would not understand, and archives, which have no reader."""

import zipfile

import pytest

from lfssao.errors import InputError
from lfssao.scene.load import load_scene

CORNERS = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
OFF = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"


@pytest.mark.parametrize(("name", "content"), [
    ("a.off", f"OFF 3 1 0\n{OFF}"),
    ("a.off", f"OFF 3 1\n# nothing\n{OFF}"),
    ("a.off", f"3 1 0\n{OFF}"),
    ("a.off", f"OFF\t3\t1\t0\n{OFF}".replace(" ", "\t").replace("\n", "\r\n")),
    ("a.obj", "v\t0 0 0\nv\t1\t0\t0\n\tv 0 1 0\n\tf\t1 2 3\n"),
    ("a.obj", "\ufeffv 0 0 0\r\n  v 1 0 0\r\n  v 0 1 0\r\n  f 1 2 \\\r\n 3"),
])  # fmt: skip
def test_blanks_and_headers_of_text(tmp_path, name, content):
    (tmp_path / name).write_text(content, newline="")
    mesh = load_scene(tmp_path / name)
    assert (mesh.vertices.tolist(), mesh.faces.tolist()) == (CORNERS, [[0, 1, 2]])


def test_materials_of_an_obj_with_tabs(tmp_path):
    (tmp_path / "a.obj").write_text("mtllib\ta.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl\tm\nf 1 2 3\n")
    (tmp_path / "a.mtl").write_text("newmtl\tm\n\tKd\t1 0 1\n")
    assert load_scene(tmp_path / "a.obj").paint.factors.tolist() == [[1, 0, 1]]


@pytest.mark.parametrize("ending", ["zip", "3mf", "3dxml", "zae"])
def test_archives_have_no_reader(tmp_path, ending):
    with zipfile.ZipFile(tmp_path / f"a.{ending}", "w") as file:
        file.writestr("3D/a.model", OFF)
    with pytest.raises(InputError, match=r"it cannot be read as a mesh .*have no reader"):
        load_scene(tmp_path / f"a.{ending}")
