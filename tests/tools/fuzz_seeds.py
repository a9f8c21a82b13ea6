"""Whole files that `fuzz.py` mutates: small, and the same bytes each time."""

import base64
import io
import json
import zipfile

import numpy as np
import trimesh
from PIL import Image

Files = dict[str, bytes]

_QUADS = """ply
format ascii 1.0
comment TextureFile t.png
element vertex 5
property double x
property double y
property double z
property ushort red
property ushort green
property ushort blue
element face 2
property list uchar int vertex_indices
property list uchar float texcoord
element tristrips 1
property list int int vertex_indices
end_header
0 0 0 1 2 3 1 -1 0 4 5 6 1 1 0 7 8 9 -1 1 0 65535 0 1 -1 -1 0 2 3 4
4 0 1 2 3 8 0 0 1 0 1 1 0 1
5 1 2 3 4 0 10 0 0 1 0 1 1 0 1 0 0
7 0 1 2 -1 2 3 4
"""
_COLORED = """COFF
5 2 0
0 0 0 255 0 0 1  1 -1 0 255 0 0 1  1 1 0 0 255 0 1
-1 1 0 0 255 0 1
-1 -1 0 0 0 255 1
5 1 2 3 4 0
3 0 1 2
"""
_TEXTURED = """mtllib a.mtl
v -1 -1 0
v 1 -1 0 1 0 0
v 1 1 0
v -1 1 0.5
vn 0 0 1
vt 0 0
vt 1 0
vt 1 1
usemtl red
f 1/1/1 2/2/1 3/3/1
usemtl picture
f -4/-3/-1 -2/-2/-1 -1/-1/-1
f 1 2 3 4
"""


def meshes() -> list[Files]:
    """One seed a format, several for those that have kinds; the textured ones name files beside them."""
    box = trimesh.creation.box(extents=(1, 2, 3))
    colored = box.copy()
    colored.visual.vertex_colors = np.arange(len(box.vertices) * 4, dtype=np.uint8).reshape(-1, 4)
    faces = box.copy()
    faces.visual.face_colors = np.arange(len(box.faces) * 4, dtype=np.uint8).reshape(-1, 4)
    picture = io.BytesIO()
    Image.fromarray(np.arange(48, dtype=np.uint8).reshape(4, 4, 3)).save(picture, "PNG")
    material = b"newmtl red\nKd 1 0.2 0\nnewmtl picture\nKd 0.8 0.8 0.8\nmap_Kd -s 1 1 -o 0 0 -clamp off t.png\n"
    beside = {"a.mtl": material, "t.png": picture.getvalue()}
    seeds = [{"a.obj": _TEXTURED.encode(), **beside}]
    for name, mesh, options in (
        ("a.obj", box, {}),
        ("a.ply", colored, {"encoding": "ascii"}),
        ("a.ply", colored, {}),
        ("a.ply", faces, {}),
        ("a.stl", box, {}),
        ("a.stl", box, {"file_type": "stl_ascii"}),
        ("a.off", box, {}),
    ):
        content = mesh.export(**{"file_type": name[2:], **options})
        seeds.append({name: content if isinstance(content, bytes) else content.encode()})
    attributes = bytearray(box.export(file_type="stl"))
    attributes[84 + 48 :: 50] = bytes([0x1F]) * len(box.faces)
    attributes[84 + 49 :: 50] = bytes([0x80]) * len(box.faces)
    seeds += [{"a.ply": _QUADS.encode(), **beside}, {"a.off": _COLORED.encode()}, {"a.stl": bytes(attributes)}]
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(zipfile.ZipInfo("a.obj"), _TEXTURED)
    zipped = packed.getvalue()
    return [*seeds, *_gltf(box, colored, picture.getvalue()), {"a.zip": zipped}, {"a.3mf": zipped}, {"a.zae": zipped}]


def _gltf(box: trimesh.Trimesh, colored: trimesh.Trimesh, picture: bytes) -> list[Files]:
    """A scene of two nodes and a textured mesh: as GLB, as glTF with its buffers beside it, and within it."""
    scene = trimesh.Scene()
    scene.add_geometry(box, "one", "box", transform=np.diag([2.0, 1, 1, 1]))
    moved = trimesh.transformations.translation_matrix((3, 0, 0))
    scene.add_geometry(colored, "two", "colored", parent_node_name="one", transform=moved)
    square = trimesh.Trimesh([[-1, -1, 0], [1, -1, 0], [1, 1, 0]], [[0, 1, 2]], process=False)
    image = Image.open(io.BytesIO(picture))
    look = trimesh.visual.material.PBRMaterial(baseColorTexture=image, baseColorFactor=[255, 51, 102, 255])
    square.visual = trimesh.visual.TextureVisuals(uv=[[0, 0], [1, 0], [1, 1]], material=look)
    scene.add_geometry(square, "three", "square")
    apart = {name.replace("model", "a"): content for name, content in scene.export(file_type="gltf").items()}
    header = json.loads(apart["a.gltf"])
    for part in header["buffers"]:
        part["uri"] = "data:application/octet-stream;base64," + base64.b64encode(apart[part["uri"]]).decode()
    main = {"a.gltf": apart.pop("a.gltf"), **apart}
    return [{"a.glb": scene.export(file_type="glb")}, main, {"a.gltf": json.dumps(header, indent=1).encode()}]
