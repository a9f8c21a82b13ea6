"""Text that trimesh would not understand, and archives, whose members are checked before its readers see them."""

import io
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


def archive(compression=zipfile.ZIP_DEFLATED):
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", compression) as file:
        file.writestr("3D/a.model", bytes(range(256)) * 8)
    return packed.getvalue()


def patched(content, place, new):
    """The archive with other bytes at a place of its one entry in the directory at its end."""
    start = content.rindex(b"PK\1\2") + place
    return content[:start] + new + content[start + len(new) :]


@pytest.mark.parametrize("ending", ["3mf", "3dxml", "zae"])
@pytest.mark.parametrize(("content", "words"), [
    (archive()[:-30], "not a zip file"),
    (archive(zipfile.ZIP_STORED).replace(b"\0\1\2\3", b"\0\1\2\4", 1), r"'3D/a\.model' cannot be read \(Bad CRC"),
    (archive()[:60] + b"\xff" * 9 + archive()[69:], r"its member '3D/a\.model' cannot be read"),
    (archive(zipfile.ZIP_BZIP2), r"its member '3D/a\.model' is not deflated"),
    (patched(archive(), 8, b"\1\0"), r"its member '3D/a\.model' cannot be read \(.* is encrypted"),
    (patched(archive(), 24, b"\0\0\0\xf0"), r"its members need 4\.0 GB of memory, too much"),
])  # fmt: skip
def test_members_of_archives_that_cannot_be_read_are_refused_by_name(tmp_path, ending, content, words):
    (tmp_path / f"a.{ending}").write_bytes(content)
    with pytest.raises(InputError, match=words):
        load_scene(tmp_path / f"a.{ending}")
