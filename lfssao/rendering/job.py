"""A render job as items that depend on nothing but the job: one view of one frame each."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import lfssao
from lfssao.core.affine import Matrix
from lfssao.errors import InputError
from lfssao.optics.view import View
from lfssao.rendering.manifest import describe_settings, describe_view, short_digest
from lfssao.rendering.settings import Settings
from lfssao.scene.mesh import Mesh


class Item(NamedTuple):
    """One EXR file to be: the number of a frame, and the index of a view in ``Job.views``."""

    frame: int
    view: int


@dataclass(frozen=True, eq=False)
class Job:
    """All that the textures of a job depend on, and where they go. It can be pickled.

    InputError if colour alone is asked for and the mesh has none, or pictures without the shaded texture.
    """

    mesh: Mesh  # before it is moved
    views: tuple[View, ...]  # of each frame
    settings: Settings
    folder: Path  # the output folder; with frames, the folder of their folders
    head: Mapping[str, Any]  # what the manifests say of the machine, the scene, the display and the samples
    neighbours: tuple[tuple[View, ...], ...]  # the adjacent modules that each view asks
    boxes: tuple[NDArray[np.float64], ...]  # around the scene in each frame, (2, 3)
    transforms: tuple[Matrix, ...] | None = None  # world -> world of each frame, (3, 4) float64; None for a still
    png: bool = False  # whether a picture of the shaded texture is written with each EXR file
    quilts: Mapping[str, str] = field(default_factory=dict)  # names of pictures of all views of a quilt, by layers
    panel: bool = False  # whether the panel's texture is written, of all lenses of a lenslet display

    def __post_init__(self) -> None:
        if self.settings.kept == ("color",) and self.mesh.paint is None:
            raise InputError(f"{self.mesh.name} has no colour, and no other layer was asked for")
        if self.png and "shaded" not in self.settings.kept:
            raise InputError("--png: it writes the layer shaded, which --layers leaves out")

    @property
    def has_sheet(self) -> bool:
        """Whether contact sheets are made: only where all layers that they show are kept."""
        shown = {"depth", "blurred", "shaded"} | ({"color"} if self.mesh.paint is not None else set())
        return shown <= set(self.settings.kept)

    @property
    def has_view(self) -> bool:
        """Whether a picture is made of what an eye sees: of a still by all modules of a display, if it has several."""
        display = self.head["display"]
        is_still = self.transforms is None
        return self.has_sheet and is_still and display is not None and 1 < len(self.views) == len(display["modules"])

    @property
    def frame_count(self) -> int:
        """How many frames there are, 1 for a still."""
        return 1 if self.transforms is None else len(self.transforms)

    def transform(self, frame: int) -> Matrix:
        """Return the affine map of a frame, (3, 4) float64."""
        return np.eye(3, 4) if self.transforms is None else self.transforms[frame]

    def frame_folder(self, frame: int) -> Path:
        """Return the folder of a frame's files, which holds all that a still's folder holds."""
        return self.folder if self.transforms is None else self.folder / f"frame_{frame:04d}"

    def path(self, item: Item) -> Path:
        """Return the item's EXR file."""
        return self.frame_folder(item.frame) / f"{self.views[item.view].name}.exr"

    def picture(self, item: Item) -> Path:
        """Return the picture of the item's shaded texture, for ``png``."""
        return self.path(item).with_suffix(".png")

    def items(self) -> list[Item]:
        """All items, frame by frame."""
        return [Item(frame, view) for frame in range(self.frame_count) for view in range(len(self.views))]

    def identity(self, item: Item) -> dict[str, str]:
        """Short digests of everything that the item's pixels depend on, by the names that users know."""
        view = self.views[item.view]
        described = describe_view(view)
        mapping = {name: described[name] for name in described if name not in ("width", "height", "guard")}
        return {
            **self._identity,
            "frame": short_digest(self.transform(item.frame).tolist()),
            "resolution": short_digest([view.width, view.height]),
            "guard": short_digest(view.guard),
            "view": short_digest(mapping),
        }

    @cached_property
    def _identity(self) -> dict[str, str]:
        """The part of the identity that is the same for all items."""
        scene = {name: value for name, value in self.head["scene"].items() if name.endswith("sha256")}
        settings = {name: short_digest(value) for name, value in describe_settings(self.settings).items()}
        return {"version": short_digest(lfssao.__version__), "scene": short_digest(scene), **settings}
