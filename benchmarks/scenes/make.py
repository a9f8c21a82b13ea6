"""Models the embedded scenes again and writes them: the files of ``lfssao/scene/meshes``, or of another folder.

    python benchmarks/scenes/make.py [FOLDER]

The same bits on every machine: the fields are + - * / sqrt of one element at a time.
"""

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from ammonite import ammonite
from armadillo import armadillo
from corner import corner
from gallery import boxes, clay
from numpy.typing import NDArray
from statue import statue

import lfssao
from lfssao.scene.mesh import Mesh

MESHES = Path(lfssao.__file__).parent / "scene" / "meshes"


def arrays(mesh: Mesh) -> dict[str, NDArray[Any]]:
    """Vertices (V, 3) float64, faces (F, 3) int32 and, of a painted mesh, linear RGB at the vertices (V, 3) float32."""
    named: dict[str, NDArray[Any]] = {"vertices": mesh.vertices, "faces": mesh.faces}
    if mesh.paint is not None and mesh.paint.vertex_colors is not None:
        named["colors"] = mesh.paint.vertex_colors
    return named


def main() -> None:
    parser = argparse.ArgumentParser(description="Write the embedded scenes as compressed NumPy arrays.")
    parser.add_argument("folder", nargs="?", type=Path, default=MESHES, help="default: where lfssao reads them")
    folder = parser.parse_args().folder
    creature = armadillo()
    for mesh in (statue(), ammonite(), creature, corner()):
        np.savez_compressed(folder / f"{mesh.name}.npz", **arrays(mesh))
    np.savez_compressed(folder / "gallery.npz", clay=clay(creature), **arrays(boxes()))


if __name__ == "__main__":
    main()
