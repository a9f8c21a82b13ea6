"""The program that one would write from ``trimesh.ray`` and NumPy, its files as OpenImageIO's documentation has them.

``python benchmarks/plain_program.py SCENE`` starts it and renders nothing: packages, ``save_scene``'s mesh, the tree.
"""

import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import OpenImageIO as oiio
import trimesh


class Plain:
    """The program that one would write: trimesh casts the rays, NumPy does the rest, for all texels at once."""

    def __init__(self, mesh, view, samples, radii):
        self.to_physical = np.vstack([view.cast_from_world, [0, 0, 0, 1]])
        self.scene = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
        self.scene.apply_transform(self.to_physical)
        self.scene.ray.intersects_any([[0.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]])  # builds the tree, once for all modules
        self.samples, self.radii = samples, radii

    def textures(self, view) -> dict:
        """Channels and pixels of each part of a module's file."""
        m_x, m_z, y_o, z_o, u_scale, u_0, v_scale, v_0 = view.lens
        to_physical = self.to_physical
        to_world = view.world_from_cast
        # Rays: through the screen point of each texel's centre, the module's line and the observers' line.
        s_x, s_y = np.meshgrid(
            (np.arange(view.width) + 0.5 - u_0) / u_scale, (np.arange(view.height) + 0.5 - v_0) / v_scale
        )
        directions = np.stack([(m_x - s_x) / m_z, (y_o - s_y) / z_o, np.ones_like(s_x)], axis=-1).reshape(-1, 3)
        origins = np.stack([s_x, s_y, np.zeros_like(s_x)], axis=-1).reshape(-1, 3) + z_o * directions
        points, texels, _ = self.scene.ray.intersects_location(origins, directions, multiple_hits=False)
        depth = np.full(view.height * view.width, np.inf)
        depth[texels] = points[:, 2]
        surface = points @ to_world[:, :3].T + to_world[:, 3]
        world = np.full((view.height * view.width, 3), np.inf)
        world[texels] = surface
        layers = []
        for radius in self.radii:
            occluded = np.zeros(len(texels))
            for offset in self.samples * radius:
                x, y, z = ((surface + offset) @ to_physical[:3, :3].T + to_physical[:3, 3]).T
                u = u_0 + u_scale * (m_x + (x - m_x) * m_z / (m_z - z))
                v = v_0 + v_scale * (y_o + (y - y_o) * z_o / (z_o - z))
                i = np.floor(u).astype(int)
                j = np.floor(v).astype(int)
                inside = (i >= 0) & (i < view.width) & (j >= 0) & (j < view.height)
                there = np.clip(j, 0, view.height - 1) * view.width + np.clip(i, 0, view.width - 1)
                occluded += inside & (depth[there] < z)
            layer = np.zeros(view.height * view.width, np.float32)
            layer[texels] = occluded / len(self.samples)
            layers.append(layer.reshape(view.height, view.width))
        merged = np.max(layers, axis=0)
        weights = np.exp(-0.5 * np.arange(-3, 4) ** 2)
        padded = np.pad(merged, 3, mode="edge")
        rows = np.apply_along_axis(np.convolve, 1, padded, weights / weights.sum(), "valid")
        blurred = np.apply_along_axis(np.convolve, 0, rows, weights / weights.sum(), "valid").astype(np.float32)
        color = np.zeros((view.height * view.width, 3), np.float32)
        color[texels] = 1
        shaded = color.reshape(view.height, view.width, 3) * (1 - blurred[..., None])
        named = [(f"ao_{k}", layer) for k, layer in enumerate(layers, 1)] + [("merged", merged), ("blurred", blurred)]
        return {
            "shaded": (("R", "G", "B"), shaded),
            "depth": (("Z",), depth.reshape(view.height, view.width, 1)),
            "positions": (("P.X", "P.Y", "P.Z"), world.reshape(view.height, view.width, 3)),
            **{name: ((f"{name}.AO",), texture[..., None]) for name, texture in named},
        }


def write_plain(path: Path, parts: dict) -> None:
    """A multi-part EXR file as OpenImageIO's documentation has it."""
    specs = []
    for name, (channels, pixels) in parts.items():
        spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], oiio.FLOAT)
        spec.channelnames = channels
        spec.attribute("name", name)
        spec.attribute("compression", "zip")
        specs.append(spec)
    output = oiio.ImageOutput.create(str(path))
    for number, (_, pixels) in enumerate(parts.values()):
        opened = (
            output.open(str(path), specs[number], "AppendSubimage") if number else output.open(str(path), tuple(specs))
        )
        if not opened or not output.write_image(np.ascontiguousarray(pixels, np.float32)):
            raise OSError(output.geterror())
    if not output.close():
        raise OSError(output.geterror())


def save_scene(path: Path, mesh, view) -> None:
    """The program's input, in the format that takes the least time to read."""
    np.savez(path, vertices=mesh.vertices, faces=mesh.faces, cast_from_world=view.cast_from_world)


if __name__ == "__main__":
    with np.load(sys.argv[1]) as scene:
        found = SimpleNamespace(**scene)
    Plain(found, found, samples=None, radii=())
