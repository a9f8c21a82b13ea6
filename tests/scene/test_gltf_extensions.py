"""Extensions of glTF: which are rendered, noted or refused, one row each, and the values of those that are rendered."""

import io
import json

import numpy as np
import pytest
from gltf_files import CODES, QUAD, TURN, TURNED, UV, Gltf, linear, load, png, refused, uri
from PIL import Image

from lfssao.scene.load import load_scene

# All that the Khronos Group ratified (extensions/README.md of its repository, 2026), and others that files have.
# "-": neither surfaces nor base colours are changed. "changes": they are, as the test of that name shows. "refused":
# where it is required; where it is only used, it is noted by its name.
TABLE = {
    "KHR_animation_pointer": "-",
    "KHR_draco_mesh_compression": "refused",
    "KHR_gaussian_splatting": "refused",
    "KHR_interactivity": "refused",
    "KHR_lights_punctual": "-",
    "KHR_materials_anisotropy": "-",
    "KHR_materials_clearcoat": "-",
    "KHR_materials_diffuse_transmission": "changes",
    "KHR_materials_dispersion": "-",
    "KHR_materials_emissive_strength": "-",
    "KHR_materials_ior": "-",
    "KHR_materials_iridescence": "-",
    "KHR_materials_pbrSpecularGlossiness": "changes",
    "KHR_materials_sheen": "-",
    "KHR_materials_specular": "-",
    "KHR_materials_transmission": "changes",
    "KHR_materials_unlit": "-",
    "KHR_materials_variants": "changes",
    "KHR_materials_volume": "-",
    "KHR_mesh_quantization": "changes",
    "KHR_meshopt_compression": "refused",
    "KHR_node_hoverability": "-",
    "KHR_node_selectability": "-",
    "KHR_node_visibility": "changes",
    "KHR_texture_basisu": "changes",
    "KHR_texture_transform": "changes",
    "KHR_xmp": "-",
    "KHR_xmp_json_ld": "-",
    "EXT_lights_ies": "-",
    "EXT_lights_image_based": "-",
    "EXT_mesh_gpu_instancing": "changes",
    "EXT_mesh_manifold": "-",
    "EXT_meshopt_compression": "refused",
    "EXT_texture_avif": "changes",
    "EXT_texture_webp": "changes",
    "KHR_techniques_webgl": "refused",
    "MSFT_lod": "refused",
    "MSFT_texture_dds": "refused",
    "VENDOR_unheard_of": "refused",
}


@pytest.mark.parametrize("name", TABLE)
def test_the_table(tmp_path, name):
    """Declared, and as an object with nothing in it wherever an extension may stand."""
    made = Gltf(TEXCOORD_0=(UV,))
    made.header |= {"extensionsUsed": [name]}
    material = made.material(png())
    if TABLE[name] == "-":
        for item in (made.header, made.node, made.header["meshes"][0], material, made.header["scenes"][0]):
            item["extensions"] = {name: {}}
    mesh = load(made, tmp_path)
    assert mesh.notes == (
        (f"it uses the glTF extension {name}, which is not read",) if TABLE[name] == "refused" else ()
    )
    assert mesh.vertices.tolist() == np.array(QUAD, float).tolist()
    assert mesh.paint.textures[0] == pytest.approx(linear(CODES), abs=1e-6)
    made.header |= {"extensionsRequired": [name]}
    if TABLE[name] == "refused":
        refused(made.save(tmp_path / "a.glb"), f"it requires the glTF extension {name}, which is not read")
    else:
        assert load(made, tmp_path).notes == ()
    assert TABLE[name] != "changes" or f"test_{name.lower()}" in globals()


def test_khr_mesh_quantization(tmp_path):
    made = Gltf(TEXCOORD_0=([[0, 2], [3, 2], [3, 0], [0, 0]], "i2"), NORMAL=([[0, 0, 127]] * 4, "i1", True))
    made.first["attributes"]["POSITION"] = made.accessor(np.array(QUAD) * 100, "i1")
    made.node["scale"] = [0.01] * 3
    made.material(png())
    mesh = load(made, tmp_path)
    assert mesh.vertices == pytest.approx(np.array(QUAD, float), abs=1e-12)
    assert mesh.paint.uv.tolist() == [[0, -1], [3, -1], [3, 1], [0, 1]]
    assert (mesh.normals[:, 2] > 0).all()


def test_khr_texture_transform(tmp_path):
    """The lower left quarter of the image, turned clockwise by a quarter, as in the extension's own example."""
    made = Gltf(TEXCOORD_0=([[0, 0]] * 4,), TEXCOORD_1=(UV,))
    transform = {"offset": [0, 1], "rotation": np.pi / 2, "scale": [0.5, 0.5], "texCoord": 1}
    made.material(png(), info={"texCoord": 0, "extensions": {"KHR_texture_transform": transform}})
    # Downwards: (u, v) is read at (v / 2, 1 - u / 2); the quad's corners begin at the lower left with (0, 1).
    assert load(made, tmp_path).paint.uv == pytest.approx(np.array([[0.5, 0], [0.5, 0.5], [0, 0.5], [0, 0]]), abs=1e-12)
    transform |= {"rotation": 0.3, "scale": [2, 3], "offset": [0.1, 0.2]}
    c = np.cos(0.3)
    s = np.sin(0.3)
    u, v = np.array(UV).T * [[2], [3]]
    wanted = np.column_stack([c * u + s * v + 0.1, 1 - (c * v - s * u + 0.2)])
    assert load(made, tmp_path).paint.uv == pytest.approx(wanted, abs=1e-12)


def test_khr_materials_pbrspecularglossiness(tmp_path):
    made = Gltf(TEXCOORD_0=(UV,))
    material = made.material(png())
    info = material.pop("pbrMetallicRoughness")["baseColorTexture"]
    material["extensions"] = {
        "KHR_materials_pbrSpecularGlossiness": {"diffuseFactor": [0.25, 0.5, 1, 1], "diffuseTexture": info}
    }
    paint = load(made, tmp_path).paint
    assert paint.factors.tolist() == [[0.25, 0.5, 1]]
    assert paint.textures[0] == pytest.approx(linear(CODES), abs=1e-6)


@pytest.mark.parametrize(("name", "key"), [
    ("KHR_materials_transmission", "transmissionFactor"),
    ("KHR_materials_diffuse_transmission", "diffuseTransmissionFactor"),
])  # fmt: skip
def test_khr_materials_transmission(tmp_path, name, key):
    made = Gltf()
    made.material(extensions={name: {key: 0.5}}, normalTexture={"index": 0})
    assert load(made, tmp_path).notes == (
        f"some of its materials let light through ({name}): they are opaque here",
        "its normal maps are not read",
    )


test_khr_materials_diffuse_transmission = test_khr_materials_transmission


def test_khr_materials_variants(tmp_path):
    made = Gltf()
    made.material()["pbrMetallicRoughness"]["baseColorFactor"] = [0.5, 0, 0, 1]
    made.header["materials"] += [{}]
    made.header["extensions"] = {"KHR_materials_variants": {"variants": [{"name": "white"}]}}
    made.first["extensions"] = {"KHR_materials_variants": {"mappings": [{"material": 1, "variants": [0]}]}}
    made.header["animations"] = [{"channels": [], "samplers": []}]
    mesh = load(made, tmp_path)
    assert mesh.paint.factors.tolist() == [[0.5, 0, 0]]
    assert mesh.notes == (
        "its animations are not read: it stands in its rest pose",
        "its variants of materials are not read, only the default ones",
    )


def test_khr_node_visibility(tmp_path):
    made = Gltf()
    hidden = {"extensions": {"KHR_node_visibility": {"visible": False}}}
    made.header["nodes"] = [
        {"mesh": 0, "children": [1, 3]},
        {"mesh": 0, "children": [2], "translation": [3, 0, 0], **hidden},
        {"mesh": 0, "translation": [3, 0, 0], "extensions": {"KHR_node_visibility": {"visible": True}}},
        {"mesh": 0, "translation": [0, 5, 0], "extensions": {"KHR_node_visibility": {}}},
    ]
    assert load(made, tmp_path).bounds.tolist() == [[-1, -1, 0], [1, 6, 0]]


def test_ext_mesh_gpu_instancing(tmp_path):
    """Copies, turned after they are stretched, then the node's own transform; its children have no copies."""
    made = Gltf(NORMAL=([[0, 0, 1]] * 4,))
    places = np.array([[5, 0, 0], [0, 7, 0]])
    scales = np.array([[1, 1, 1], [2, 1, 1]])
    rows = {
        "TRANSLATION": made.accessor(places), "SCALE": made.accessor(scales),
        "ROTATION": made.accessor(np.array([[0, 0, 0, 127], [0, 0, 127, 0]]), "i1", True),
    }  # fmt: skip
    made.node |= {"extensions": {"EXT_mesh_gpu_instancing": {"attributes": rows}}, "rotation": TURN, "children": [1]}
    made.header["nodes"] += [{"mesh": 0}]
    quad = np.array(QUAD)
    turned = np.diag([-1, -1, 1])
    wanted = [(quad @ turn.T) + place for turn, place in ((np.eye(3), places[0]), (turned * scales[1], places[1]))]
    mesh = load(made, tmp_path)
    assert mesh.vertices == pytest.approx(np.concatenate([*wanted, quad]) @ TURNED.T, abs=1e-12)
    assert mesh.paint is None
    rows["_COLOR_0"] = made.accessor(places)
    assert load(made, tmp_path).notes == ("_COLOR_0 of copies of its meshes (EXT_mesh_gpu_instancing) is left out",)
    rows["SCALE"] = made.accessor(scales[:1])
    refused(made.save(tmp_path / "a.glb"), "TRANSLATION, ROTATION and SCALE must have one count")


@pytest.mark.parametrize("kind", ["webp", "avif"])
def test_ext_texture_webp(tmp_path, kind):
    """The image of the extension, also where there is another for readers that do not know it."""
    content = io.BytesIO()
    Image.new("RGB", (8, 8), (255, 0, 0)).save(content, kind)
    made = Gltf(TEXCOORD_0=(UV,))
    made.material(png())
    made.header["images"] += [{"uri": uri(content.getvalue(), f"image/{kind}")}]
    for others in ({"source": 0}, {}):
        made.header["textures"] = [{**others, "extensions": {f"EXT_texture_{kind}": {"source": 1}}}]
        texture = load(made, tmp_path).paint.textures[0]
        assert texture == pytest.approx(np.broadcast_to([1.0, 0, 0], (8, 8, 3)), abs=0.03)


test_ext_texture_avif = test_ext_texture_webp


def test_khr_texture_basisu(tmp_path):
    made = Gltf(TEXCOORD_0=(UV,))
    made.material(png())
    made.header["images"] += [{"uri": "t.ktx2"}]
    made.header["textures"] = [{"source": 0, "extensions": {"KHR_texture_basisu": {"source": 1}}}]
    assert load(made, tmp_path).paint.textures[0] == pytest.approx(linear(CODES), abs=1e-6)
    made.header["textures"][0].pop("source")
    path = made.save(tmp_path / "a.glb")
    refused(path, r"textures\[0\]\.source has its image only for KHR_texture_basisu, which is not read")
    (tmp_path / "t.png").write_bytes(png())
    assert len(load_scene(path, tmp_path / "t.png").paint.textures) == 1


def test_compressed_meshes_are_read_where_they_are_there_in_plain_form_too(tmp_path):
    made = Gltf()
    made.first["extensions"] = {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}}
    assert load(made, tmp_path).vertices.tolist() == np.array(QUAD, float).tolist()
    made.header["accessors"][0].pop("bufferView")
    refused(
        made.save(tmp_path / "a.glb"), r"primitives\[0\]: is compressed by KHR_draco_mesh_compression, which is not"
    )
    made = Gltf()
    packed = {"buffer": 0, "byteLength": 9, "byteStride": 12, "mode": "ATTRIBUTES", "count": 4}
    for view in made.header["bufferViews"]:
        view["extensions"] = {"EXT_meshopt_compression": packed}
    header = json.loads(made.save(tmp_path / "a.gltf").read_text())
    assert len(load_scene(tmp_path / "a.gltf").faces) == 2
    header["buffers"][0].pop("uri")
    (tmp_path / "a.gltf").write_text(json.dumps(header))
    refused(tmp_path / "a.gltf", r"buffers\[0\]: its data are compressed by EXT_meshopt_compression, which is not read")
