"""Base colours of a glTF's materials, their textures and what their transparency cuts out."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import features

from lfssao.core.elementary import PI, sincospi
from lfssao.scene.gltf.file import File
from lfssao.scene.gltf.item import Item
from lfssao.scene.images import opacity, texture
from lfssao.scene.mesh import REPEATED, Sampler

_WRAPS: dict[int, Any] = {10497: "repeat", 33648: "mirror", 33071: "clamp"}
_FILTERS: dict[int, Any] = {9728: True, 9729: False}
_FORMATS = {"EXT_texture_webp": "webp", "EXT_texture_avif": "avif"}
_LIGHT = {
    "KHR_materials_transmission": "transmissionFactor",
    "KHR_materials_diffuse_transmission": "diffuseTransmissionFactor",
}
_IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)


@dataclass(frozen=True, eq=False)
class Look:
    """Base colour of a material.

    factor: (3,) float32 linear RGB. alpha: its fourth number. image: (h, w, 3) float32 linear RGB. opacity: (h, w)
    float32, or None where the image is opaque. uv_set, uv_map: the set of texture coordinates that the image is read
    at, and what they go through: u' = (a u + b v) + c, v' = (d u + e v) + f, v downwards. least: alpha below it is cut
    out; None where alpha means nothing. blended: whether alpha below 1 lets light through.
    """

    place: str
    factor: NDArray[np.float32]
    alpha: float = 1.0
    image: NDArray[np.float32] | None = None
    opacity: NDArray[np.float32] | None = None
    sampler: Sampler = REPEATED
    uv_set: int = 0
    uv_map: tuple[float, ...] = _IDENTITY
    least: float | None = None
    blended: bool = False


def look_of(file: File, primitive: Item) -> Look:
    """Return the base colour of a primitive; white where it has no material."""
    number = file.number(primitive, "material", "materials")
    if number is None:
        return Look("its material", np.ones(3, np.float32))
    if number not in file.looks:
        file.looks[number] = _look(file, file.objects("materials")[number])
    found: Look = file.looks[number]
    return found


def _look(file: File, material: Item) -> Look:
    glossy = material.extension("KHR_materials_pbrSpecularGlossiness")
    color = material.item("pbrMetallicRoughness") if glossy is None else glossy
    keys = ("baseColorFactor", "baseColorTexture") if glossy is None else ("diffuseFactor", "diffuseTexture")
    factor = [1.0] * 4 if color is None else color.numbers(keys[0], 4, [1.0] * 4)
    if color is not None and not all(0.0 <= number <= 1.0 for number in factor):
        raise color.must(keys[0], "four numbers from 0 to 1")
    look = Look(material.place, np.array(factor[:3], np.float32), factor[3], **_alpha_mode(material))
    for name, key in _LIGHT.items():
        extension = material.extension(name)
        if extension is not None and extension.number(key, 0.0) > 0.0:
            file.assets.note(f"some of its materials let light through ({name}): they are opaque here")
    if material.item("normalTexture") is not None:
        file.assets.note("its normal maps are not read")
    info = None if color is None else color.item(keys[1])
    return look if info is None else _textured(file, look, info)


def _alpha_mode(material: Item) -> dict[str, Any]:
    mode = material.text("alphaMode", "OPAQUE")
    cutoff = material.number("alphaCutoff", 0.5)
    if mode not in ("OPAQUE", "MASK", "BLEND"):
        raise material.must("alphaMode", "OPAQUE, MASK or BLEND")
    if mode == "OPAQUE":
        return {}
    # A blended surface is there unless its alpha is 0.
    return {
        "least": cutoff if mode == "MASK" else float(np.nextafter(np.float32(0), np.float32(1))),
        "blended": mode == "BLEND",
    }


def _textured(file: File, look: Look, info: Item) -> Look:
    """A look with the texture that a textureInfo names."""
    named = file.named(info, "index", "textures")
    if named is None:
        raise info.must("index", "the number of a texture")
    transform = info.extension("KHR_texture_transform")
    uv_set = info.whole("texCoord", 0)
    uv_map = _IDENTITY
    if transform is not None:
        uv_set = transform.whole("texCoord", uv_set)
        sx, sy = transform.numbers("scale", 2, (1.0, 1.0))
        ox, oy = transform.numbers("offset", 2, (0.0, 0.0))
        # Counter-clockwise as the image is seen, v downwards; the extension's GLSL has the other sign.
        sine, cosine = sincospi(transform.number("rotation", 0.0) / PI)
        uv_map = (cosine * sx, sine * sy, ox, -(sine * sx), cosine * sy, oy)
    look = replace(look, sampler=_sampler(file, named), uv_set=uv_set, uv_map=uv_map)
    if file.assets.given is not None:
        if look.least is not None:
            file.assets.note(f"{look.place} may be transparent: the texture that is given is taken for opaque")
        return look
    image, alpha = _image(file, named, look.least is not None)
    return replace(look, image=image, opacity=alpha)


def _sampler(file: File, named: Item) -> Sampler:
    sampler = file.named(named, "sampler", "samplers")
    if sampler is None:
        return REPEATED
    found = []
    for key, default, known in (("wrapS", 10497, _WRAPS), ("wrapT", 10497, _WRAPS), ("magFilter", 9729, _FILTERS)):
        code = sampler.whole(key, default)
        if code not in known:
            raise sampler.must(key, f"one of {', '.join(map(str, known))}")
        found.append(known[code])
    return found[0], found[1], found[2]


def _image(file: File, named: Item, clear: bool) -> tuple[NDArray[np.float32], NDArray[np.float32] | None]:
    """Linear RGB of the image of a texture, and its opacity if it may be ``clear``."""
    image = None
    for name, kind in _FORMATS.items():
        extension = named.extension(name)
        if extension is not None and image is None and features.check(kind):
            image = file.named(extension, "source", "images")
    image = file.named(named, "source", "images") if image is None else image
    if image is None:
        others = " and ".join(named.values.get("extensions", {}))
        raise named.fault(
            f"has its image only for {others}, which is not read" if others else "names no image", "source"
        )
    key = image.place, clear
    if key not in file.images:
        found = file.view(image)
        inside = found is not None or image.text("uri").startswith("data:")
        data = None if not inside else bytes(found[1]) if found is not None else file.content(image)
        name = image.place if inside else image.text("uri")
        # Opacity first: it refuses images of 16 bits before they are loaded, when 8 are left.
        file.images[key] = file.assets.image(name, data, lambda each: (opacity(each) if clear else None, texture(each)))
    alpha, color = file.images[key]
    return color, alpha
