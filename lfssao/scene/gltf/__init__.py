"""glTF 2.0: the default scene in its rest pose, with base colours."""

from pathlib import Path

from lfssao.errors import InputError
from lfssao.scene.assets import Assets
from lfssao.scene.gltf.file import File
from lfssao.scene.gltf.nodes import Nodes
from lfssao.scene.gltf.primitives import parts_of
from lfssao.scene.part import Part

# Extensions that are read where they change surfaces or base colours; the others here change neither.
EXTENSIONS = frozenset({
    "KHR_animation_pointer", "KHR_lights_punctual", "KHR_materials_anisotropy", "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission", "KHR_materials_dispersion", "KHR_materials_emissive_strength",
    "KHR_materials_ior", "KHR_materials_iridescence", "KHR_materials_pbrSpecularGlossiness", "KHR_materials_sheen",
    "KHR_materials_specular", "KHR_materials_transmission", "KHR_materials_unlit", "KHR_materials_variants",
    "KHR_materials_volume", "KHR_mesh_quantization", "KHR_node_hoverability", "KHR_node_selectability",
    "KHR_node_visibility", "KHR_texture_basisu", "KHR_texture_transform", "KHR_xmp", "KHR_xmp_json_ld",
    "EXT_lights_ies", "EXT_lights_image_based", "EXT_mesh_gpu_instancing", "EXT_mesh_manifold", "EXT_texture_avif",
    "EXT_texture_webp",
})  # fmt: skip


def read_gltf(path: Path, data: bytes, assets: Assets) -> list[Part]:
    """Return the triangles of a glTF's or GLB's default scene, one part a primitive and copy.

    Nodes, skins, morph targets and copies stand in their rest pose. Colours are base colours: factor x texture x
    vertex colour. InputError, with the key that is wrong, for a file that is broken, requires an extension that is not
    read, or has a surface with parts cut out.
    """
    file = File(path, data, assets)
    used, required = file.extensions
    if strange := [name for name in required if name not in EXTENSIONS]:
        raise InputError(f"{path}: it requires the glTF extension {strange[0]:.40}, which is not read")
    for name in used:
        if name not in EXTENSIONS:
            assets.note(f"it uses the glTF extension {name:.40}, which is not read")
    if file.objects("animations"):
        assets.note("its animations are not read: it stands in its rest pose")
    if file.root.extension("KHR_materials_variants") is not None:
        assets.note("its variants of materials are not read, only the default ones")
    nodes = Nodes(file)
    parts = [part for number in nodes.shown() for part in parts_of(file, nodes, number)]
    if not parts and file.objects("meshes"):
        raise file.root.fault("it has meshes, but none of triangles at a node that its scene shows")
    return parts
