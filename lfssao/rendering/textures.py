"""All textures of one view, and the files that they are written to."""

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL.Image import fromarray

from lfssao.errors import InputError, check_type
from lfssao.files.exr import Part, write_exr
from lfssao.files.pictures import image_png
from lfssao.files.srgb import to_codes
from lfssao.files.whole import write_whole
from lfssao.gbuffer.caster import GBuffer
from lfssao.optics.view import View, without_guard
from lfssao.rendering import contact
from lfssao.rendering.manifest import digest
from lfssao.rendering.settings import Settings
from lfssao.summary import Summary, listed, size_of

FloatTexture = NDArray[np.float32]

_OCCLUSION = "occlusion: 0 open, 1 covered; visibility is 1 - AO"


@dataclass(frozen=True, eq=False, repr=False)
class Textures(Summary):
    """All textures of one view.

    Attributes
    ----------
    view : View
        What they show.
    gbuffer : GBuffer
        Depth, positions and colour, the view's guard band included; what follows has it cropped. Positions, colour and
        normals are None where they are not kept; depth is always there.
    ao : tuple of (H, W) float32
        Occlusion, one texture a radius; empty where it is not kept, as all below are None.
    merged, blurred : (H, W) float32 or None
        Maximum over the radii; the same after the blur.
    shaded : (H, W, 3) float32 or None
        The colour texture (white on the surface where the mesh has no colour) with AO.
    outside : tuple of int
        Samples of each radius that fell outside the texture or the mapping's domain; empty where AO was not computed.
    surface_texels : int
        Texels of the depth texture that see a surface.
    settings : Settings
        What they were made by; its ``kept`` says which layers are here.
    seconds : dict
        Wall time of each pass; the first call of a kernel after an install includes compiling it.
    bent : tuple of (H, W, 3) float32
        Bent normals, one texture a radius; empty where they are not kept.

    Examples
    --------
    >>> textures = lfssao.render("corner", lfssao.find_display("virtual").with_resolution(64, 48))[0]
    >>> textures.merged.shape, len(textures.ao), bool(textures.merged.max() <= 1)
    ((48, 64), 5, True)
    """

    view: View
    gbuffer: GBuffer
    ao: tuple[FloatTexture, ...]
    merged: FloatTexture | None
    blurred: FloatTexture | None
    shaded: FloatTexture | None
    outside: tuple[int, ...]
    surface_texels: int
    settings: Settings
    seconds: dict[str, float]
    bent: tuple[FloatTexture, ...] = ()

    def _facts(self) -> dict[str, object]:
        surface = f"at {self.surface_texels / self.gbuffer.depth.size:.1%} of the texels"
        named = {"view": self.view.name, "texels": size_of(self.gbuffer.depth), "layers": " ".join(self.layers)}
        return {**named, "radii": listed(self.settings.radii), "surface": surface}

    @property
    def layers(self) -> tuple[str, ...]:
        """Which layers are kept."""
        return self.settings.kept

    def save(self, path: str | Path) -> None:
        """Write a file as ``lfssao render`` does: .exr, a part a layer, or .png, ``shaded`` in 8-bit sRGB.

        InputError for another ending, for .png if shaded was not kept, and if the file cannot be written.
        """
        check_type("path", path, str | Path)
        ending = Path(path).suffix.lower()
        if ending == ".exr":
            write_exr(path, exr_parts(self))
        elif ending != ".png":
            raise InputError(f"{path}: it does not end in .exr or .png, the files that textures are written to")
        elif self.shaded is None:
            raise InputError(f"{path}: shaded is not among the layers {', '.join(self.layers)}, write an .exr")
        else:
            picture = shaded_png(self.shaded)
            write_whole(Path(path), lambda part: part.write_bytes(picture))

    @cached_property
    def image(self) -> FloatTexture:
        """The image without AO, (H, W, 3): the colour texture, or white on the surface.

        InputError if the layer color was not kept.
        """
        if "color" not in self.layers:
            raise InputError(f"there is no image: color is not among the layers {', '.join(self.layers)}")
        if self.gbuffer.color is not None:
            return without_guard(self.gbuffer.color, self.view.guard)
        return contact.white(without_guard(self.gbuffer.depth, self.view.guard))

    def _repr_png_(self) -> bytes | None:
        if self.blurred is None or self.shaded is None or "color" not in self.layers:
            return None
        normals = self.gbuffer.normals
        normals = None if normals is None else without_guard(normals, self.view.guard)
        image = contact.without_ao(self.image, normals, self.settings.light)
        return image_png(contact.strip(image, self.blurred, self.shaded, 320))


def exr_parts(textures: Textures) -> list[Part]:
    """The layers of one view that are kept as the parts of an EXR file, the shaded image first: viewers show part 0.

    Channels: R G B (shaded); Z (depth); P.X P.Y P.Z (world position); color.R color.G color.B; ao_K.AO for radius K,
    merged.AO, blurred.AO; N.X N.Y N.Z (world normals) and bent_K.X bent_K.Y bent_K.Z (bent normals) if asked for. AO is
    occlusion everywhere, and the metadata says so. Depth, positions, colour and normals keep the guard band, as a data
    window larger than the display window.
    """
    gbuffer = textures.gbuffer
    guard = textures.view.guard
    settings = textures.settings
    depth = {"depth": textures.view.depth_kind}
    world = {"space": "world"}
    occlusion = {"AO": _OCCLUSION}
    layers: list[tuple[str, str, NDArray[np.float32] | None, dict[str, Any], int]] = [
        ("shaded", "R G B", textures.shaded, depth, 0),
        ("depth", "Z", gbuffer.depth if "depth" in textures.layers else None, depth, guard),
        ("positions", "P.X P.Y P.Z", gbuffer.positions, world, guard),
        ("color", "color.R color.G color.B", gbuffer.color, {"space": "linear RGB"}, guard),
        ("normals", "N.X N.Y N.Z", gbuffer.normals, world, guard),
    ]
    for k, texture in enumerate(textures.ao):
        # As text: EXR's numbers are 32 bits wide.
        of_radius = {"radius": float(settings.radii[k]), "outside": str(textures.outside[k])}
        layers.append((f"ao_{k + 1}", f"ao_{k + 1}.AO", texture, occlusion | of_radius, 0))
    for k, bent in enumerate(textures.bent):
        name = f"bent_{k + 1}"
        of_radius = {"radius": float(settings.radii[k])}
        layers.append((name, f"{name}.X {name}.Y {name}.Z", bent, world | of_radius, 0))
    layers.append(("merged", "merged.AO", textures.merged, occlusion, 0))
    layers.append(("blurred", "blurred.AO", textures.blurred, occlusion | {"sigma": float(settings.blur)}, 0))
    # Zip would make these 3 to 8 % smaller, and the default job 0.4 s slower. White ones have three equal channels.
    parts = []
    noisy = {"blurred"} if gbuffer.color is None else {"blurred", "shaded"}
    for name, channels, values, metadata, band in layers:
        if values is not None:
            pixels = values.reshape(*values.shape[:2], -1)
            attributes = {**metadata, "sha256": digest(pixels), "channels": channels}
            packing = "rle" if name in noisy else "zip"
            parts.append(Part(name, tuple(channels.split(" ")), pixels, attributes, band, packing))
    return [with_attributes(parts[0], surface_texels=textures.surface_texels), *parts[1:]]


def with_attributes(part: Part, **attributes: str | int) -> Part:
    """Return a part with more metadata."""
    return replace(part, attributes={**part.attributes, **attributes})


def shaded_png(shaded: NDArray[np.float32]) -> bytes:
    """Linear colour (H, W, 3) as an 8-bit sRGB picture, a PNG file."""
    return image_png(fromarray(to_codes(shaded)))
