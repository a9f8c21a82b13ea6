"""What a job computes, as items that depend on nothing but the work: one view of one frame each."""

import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from lfssao.ao.estimators.neighbours import DepthCache
from lfssao.core.affine import Matrix
from lfssao.errors import InputError
from lfssao.gbuffer.caster import RayCaster
from lfssao.optics.view import View
from lfssao.rendering.animation import frame_bounds, moved
from lfssao.rendering.manifest import describe_settings, describe_view, short_digest
from lfssao.rendering.passes import Textures, render_view
from lfssao.rendering.settings import Settings
from lfssao.scene.mesh import Mesh


class Item(NamedTuple):
    """One EXR file to be: the number of a frame, and the place of a view in ``Work.views``."""

    frame: int
    view: int


@dataclass(frozen=True, eq=False)
class Work:
    """All that the textures of a job depend on, and where they go. It can be pickled.

    Attributes
    ----------
    mesh : Mesh
        The scene before it is moved.
    views : tuple of View
        What is rendered in each frame.
    settings : Settings
        What the AO passes are run with.
    folder : Path
        Where to; with frames, the folder of their folders.
    scene : mapping
        What the manifest says of the mesh (``lfssao.rendering.manifest.describe_scene``).
    transforms : tuple of (3, 4) float64, or None
        The affine map world -> world of each frame; None for a still.
    neighbours : tuple of tuple of View
        For each view those of the modules that are asked beside it; empty where none are.
    boxes : tuple of (2, 3) float64
        The box around the scene in each frame, world units; made here where not given.
    """

    mesh: Mesh
    views: tuple[View, ...]
    settings: Settings
    folder: Path
    scene: Mapping[str, Any]
    transforms: tuple[Matrix, ...] | None = None
    neighbours: tuple[tuple[View, ...], ...] = ()
    boxes: tuple[NDArray[np.float64], ...] = ()

    def __post_init__(self) -> None:
        if not self.boxes:
            boxes = [self.mesh.bounds] if self.transforms is None else frame_bounds(self.mesh, self.transforms)
            object.__setattr__(self, "boxes", tuple(boxes))
        if self.settings.kept == ("color",) and self.mesh.paint is None:
            raise InputError(f"{self.mesh.name} has no colour, and no other layer was asked for")

    @property
    def has_sheet(self) -> bool:
        """Whether a contact sheet is made: only where all that it shows is kept."""
        shown = {"depth", "blurred", "shaded"} | ({"color"} if self.mesh.paint is not None else set())
        return shown <= set(self.settings.kept)

    @property
    def frame_count(self) -> int:
        """How many frames there are, 1 for a still."""
        return 1 if self.transforms is None else len(self.transforms)

    def transform(self, frame: int) -> Matrix:
        """The affine map of a frame, (3, 4) float64."""
        return np.eye(3, 4) if self.transforms is None else self.transforms[frame]

    def frame_folder(self, frame: int) -> Path:
        """Where a frame's files go: each holds what a still's folder holds."""
        return self.folder if self.transforms is None else self.folder / f"frame_{frame:04d}"

    def path(self, item: Item) -> Path:
        """The item's EXR file."""
        return self.frame_folder(item.frame) / f"{self.views[item.view].name}.exr"

    def items(self) -> list[Item]:
        """All items, frame by frame, but frames in which the scene is in the same place after each other."""
        first: dict[bytes, int] = {}
        groups = [first.setdefault(self.transform(frame).tobytes(), frame) for frame in range(self.frame_count)]
        frames = sorted(range(self.frame_count), key=groups.__getitem__)
        return [Item(frame, view) for frame in frames for view in range(len(self.views))]

    def identity(self, item: Item) -> dict[str, str]:
        """Short digests of everything that the item's pixels depend on, by what users call it."""
        view = self.views[item.view]
        described = describe_view(view)
        mapping = {name: described[name] for name in described if name not in ("width", "height", "guard")}
        return {
            **self._identity,
            "frame": short_digest(self.transform(item.frame).tolist()),
            "resolution": short_digest([view.width, view.height]),
            "guard": short_digest(view.guard),
            "view": short_digest([mapping, view.ray_kind, view.lens.tolist(), view.world_from_cast.tolist()]),
        }

    @cached_property
    def _identity(self) -> dict[str, str]:
        """The part of the identity that all items share."""
        from lfssao import __version__

        scene = {name: value for name, value in self.scene.items() if name.endswith("sha256")}
        settings = {name: short_digest(value) for name, value in describe_settings(self.settings).items()}
        return {"version": short_digest(__version__), "scene": short_digest(scene), **settings}


class Renderer:
    """Runs the passes of one item after another; the trees are built anew only where the scene has moved.

    Parameters
    ----------
    work : Work
        What the items are of.
    threads : int
        Threads of each kernel; never more than numba has.
    """

    # numba's own pool of threads cannot run two parallel kernels at once.
    _one_at_a_time = threading.Lock()

    def __init__(self, work: Work, threads: int) -> None:
        self.work = work
        self._threads = min(threads, int(numba.config.NUMBA_NUM_THREADS))
        self._caster: RayCaster | None = None
        self._depths: DepthCache | None = None
        self._place = b""
        self._build_seconds = 0.0

    def prepare(self, item: Item) -> RayCaster:
        """The ray caster for an item's frame.

        Raises
        ------
        InputError
            If the mesh leaves the range of float32 in the space rays are cast in.
        """
        transform = self.work.transform(item.frame)
        if self._caster is None or self._place != transform.tobytes():
            self._caster = None  # one at a time in memory
            start = time.perf_counter()
            mesh, view = moved(self.work.mesh, transform), self.work.views[item.view]
            self._caster, self._place = RayCaster(mesh, view.cast_from_world, self._threads), transform.tobytes()
            self._depths = DepthCache(self._caster, 2 * self.work.settings.neighbours + 1)
            self._build_seconds += time.perf_counter() - start
        return self._caster

    def textures(self, item: Item) -> Textures:
        """An item's textures; their seconds include those of building trees for it."""
        with self._one_at_a_time:
            numba.set_num_threads(self._threads)
            caster, view = self.prepare(item), self.work.views[item.view]
            others = self.work.neighbours[item.view] if self.work.neighbours else ()
            assert self._depths is not None  # made with the caster
            neighbours = self._depths.neighbours(others, self.work.settings.caster)
            textures = render_view(caster, view, self.work.settings, neighbours)
            textures.seconds["build_bvh"], self._build_seconds = self._build_seconds, 0.0
            return textures
