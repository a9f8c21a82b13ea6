"""Small mesh files, and what a loaded mesh is at its corners."""

import numpy as np

from lfssao.scene.load import load_scene

# A square of the plane z = 0, counterclockwise from its corner at (-1, -1).
CORNERS = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])


def rows(*tables):
    """Lines of text, each with one row of every table."""
    return "".join(" ".join(f"{value:g}" for row in each for value in row) + "\n" for each in zip(*tables, strict=True))


def linear(codes, most=255):
    """Linear light of sRGB codes, by IEC 61966-2-1."""
    value = np.asarray(codes, np.float64) / most
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def loaded(folder, name, content, **beside):
    """The mesh of a file and of those beside it, by name without the ending '.mtl'."""
    for other, text in beside.items():
        (folder / f"{other}.mtl").write_bytes(text if isinstance(text, bytes) else text.encode())
    (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    return load_scene(folder / name)


def triangles(mesh):
    """Corners of triangles, (F, 3, 3)."""
    return mesh.vertices[mesh.faces]


def area(mesh):
    """The area of all triangles."""
    a, b, c = np.moveaxis(triangles(mesh), 1, 0)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def colors(mesh):
    """Colours of the corners of triangles without an image, (F, 3, 3)."""
    given = mesh.paint.vertex_colors
    at_corners = np.ones((len(mesh.faces), 3, 3)) if given is None else given[mesh.faces].astype(np.float64)
    return mesh.paint.factors[mesh.paint.face_material][:, None] * at_corners


def textured(mesh):
    """Texture coordinates of corners, (F, 3, 2), and which triangles have an image."""
    images = np.array([texture is not None for texture in mesh.paint.textures])
    return mesh.paint.uv[mesh.faces], images[mesh.paint.face_material]
