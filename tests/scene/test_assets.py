"""Files that a mesh names: pipes, places outside of its folder, images that expand."""

import os
import signal

import pytest
from PIL import Image

from lfssao.core import memory
from lfssao.errors import InputError
from lfssao.scene.load import load_scene

SQUARE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nmtllib a.mtl\nusemtl m\nf 1/1 2/2 3/3\n"


def mesh(folder, image="t.png"):
    (folder / "a.obj").write_text(SQUARE)
    (folder / "a.mtl").write_text(f"newmtl m\nmap_Kd {image}\n")
    return folder / "a.obj"


@pytest.fixture
def stops():
    """Stop after a while whoever waits for a pipe."""

    def stop(*_):
        raise TimeoutError

    before = signal.signal(signal.SIGALRM, stop)
    signal.alarm(20)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


@pytest.mark.usefixtures("stops")
def test_nobody_waits_for_a_pipe(tmp_path):
    path = mesh(tmp_path)
    os.mkfifo(tmp_path / "t.png")
    with pytest.raises(
        InputError, match=r"names the image 't\.png', which cannot be read \(.*it is not a regular file"
    ):
        load_scene(path)
    (tmp_path / "a.mtl").unlink()
    os.mkfifo(tmp_path / "a.mtl")
    (note,) = load_scene(path).notes
    assert "'a.mtl', which cannot be read" in note
    assert "it is not a regular file" in note
    (tmp_path / "a.gltf").write_text(
        '{"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}], '
        '"meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}], '
        '"accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}], '
        '"bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"uri": "a.mtl", "byteLength": 36}]}'
    )
    with pytest.raises(InputError, match="it is not a regular file"):
        load_scene(tmp_path / "a.gltf")


@pytest.mark.parametrize("name", ["../t.png", "/t.png", "C:\\elsewhere\\t.png", "a%20b.png"])
def test_names_of_images(tmp_path, name):
    """Paths of another machine mean the file of that name in the mesh's folder, and nothing is read outside of it."""
    folder = tmp_path / "inside"
    folder.mkdir()
    Image.new("L", (1, 1), 255).save(tmp_path / "t.png")
    path = mesh(folder, name)
    with pytest.raises(InputError, match=r"names the image .*, which is not there"):
        load_scene(path)
    Image.new("L", (1, 1), 0).save(folder / ("a b.png" if "%" in name else "t.png"))
    assert load_scene(path).paint.textures[0].tolist() == [[[0, 0, 0]]]


def test_images_that_expand_are_refused_before_they_do(tmp_path, monkeypatch):
    Image.new("1", (8000, 8000)).save(tmp_path / "t.png")
    path = mesh(tmp_path)
    with pytest.raises(InputError, match=r"'t\.png', which cannot be read \(its texels need 1\.8 GB of memory, too"):
        load_scene(path)
    with pytest.raises(
        InputError, match=r"t\.png: it cannot be read as an image \(its texels need 1\.8 GB of memory, too"
    ):
        load_scene(path, tmp_path / "t.png")
    Image.effect_noise((200, 200), 50).save(tmp_path / "t.png")
    assert load_scene(path).paint.textures[0].shape == (200, 200, 3)
    monkeypatch.setattr(memory, "available_memory", lambda: 10**6)
    with pytest.raises(InputError, match=r"its texels need 0\.0 GB of memory, 0\.0 GB are available"):
        load_scene(path)
