"""Runs a job: renders each item and writes its file, in this process or on an executor."""

import threading
import time
from collections import deque
from collections.abc import Callable, Generator, Mapping, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import ExitStack, closing
from functools import partial
from itertools import groupby
from typing import Any

import numba

from lfssao import __version__
from lfssao.ao.estimators.registry import find_estimator
from lfssao.ao.textures import Neighbour
from lfssao.core.arguments import MOST_TEXELS
from lfssao.core.memory import available_memory, check_available
from lfssao.core.threads import kernel_threads
from lfssao.errors import InputError
from lfssao.files.exr import use_one_thread_a_file
from lfssao.files.whole import output_folder
from lfssao.gbuffer.caster import DepthCache, RayCaster, textures_kept
from lfssao.rendering import output
from lfssao.rendering.contact import write_animation
from lfssao.rendering.job import Item, Job
from lfssao.rendering.passes import render_view
from lfssao.rendering.textures import Textures
from lfssao.rendering.viewer import LightField
from lfssao.scene.mesh import moved

Results = Generator[output.Result, None, None]


def run(
    job: Job,
    threads: int,
    found: Mapping[Item, output.Result],
    executor: Executor | None,
    sent: Any,
    seconds: Mapping[str, float],
) -> Generator[Item, None, None]:
    """Render a job: write each item's file, the contact sheet and manifest of each frame after its items, an animation.

    Yields each item that is rendered, once its file is there, in the order of ``job.items()``. Raises InputError if the
    scene leaves float32, or a file cannot be written; files that were begun are finished first.

    ``threads`` are those of each kernel, and of writing files where there is no executor. ``found`` are items that an
    earlier job left whole (``recover``), and are not rendered again. ``executor`` runs whole items wherever the same
    folder is, on processes or by dask, and ``sent`` is what stands for the job there; without one they run here.
    ``seconds`` are of earlier steps, for manifests.
    """
    start = time.perf_counter()
    rest = [item for item in job.items() if item not in found]
    field = output.empty_field(job) if executor is None and job.has_view else None
    if executor is None:
        renderer = Renderer(job, threads)
        if rest:
            renderer.prepare(rest[0])  # a scene that is refused leaves no folder
        results = run_here(renderer, rest, threads, _views_at_once(job, threads + 2) if threads > 1 else 1, field)
    else:
        results = run_on(executor, sent, rest, threads)
    with ExitStack() as stack:
        for folder in (job.folder, *(job.frame_folder(frame) for frame in range(job.frame_count))):
            stack.enter_context(output_folder(folder))
        output.make_ready(job, rest)
        stack.enter_context(closing(results))
        pictures = []
        step = 1 + job.frame_count // output.MOST_PICTURES
        for frame, items in groupby(job.items(), lambda item: item.frame):
            views = []
            for item in items:
                if item in found:
                    views.append(found[item])
                else:
                    views.append(next(results))
                    yield item
            picture = output.write_frame(job, frame, views, {**seconds, "render": time.perf_counter() - start}, field)
            if picture is not None and frame % step == 0:
                pictures.append(picture)
        if job.transforms is not None and pictures:
            write_animation(job.folder / output.ANIMATION, pictures)


def check_memory(width: int, height: int, radius_count: int, texel_bytes: int, bent: bool = False) -> None:
    """Refuse (InputError) a texture, its guard band included, that is too large for int32 numbers or for memory."""
    texels = width * height
    if texels > MOST_TEXELS:
        raise InputError(f"resolution {width}x{height}: a texture has at most {MOST_TEXELS} texels")
    passes = f"resolution {width}x{height}: the passes of one texture and {radius_count} radii"
    check_available(passes, needed_memory(texels, radius_count, texel_bytes, bent))


def needed_memory(texels: int, radius_count: int, texel_bytes: int, bent: bool = False) -> int:
    """Return bytes that one view takes, from its ray cast to its file; ``texel_bytes`` is the estimator's.

    bent: whether bent normals, three numbers a radius, are kept.
    """
    # Peaks, measured at 12 and 48 million texels with 5 and with 40 radii: shading and writing take 108 bytes a texel,
    # the estimate of the last radius 40 and the estimator's own, next to the textures of the other radii.
    return texels * ((16 if bent else 4) * radius_count + max(108, 40 + texel_bytes))


def _views_at_once(job: Job, most: int) -> int:
    """Return how many views may be in memory at the same time, at least 1 and at most ``most``."""
    available = available_memory()
    if available is None:
        return most
    radius_count = len(job.settings.radii)
    texel_bytes = find_estimator(job.settings.estimator).texel_bytes
    known = radius_count, texel_bytes, "bent" in job.settings.kept
    needed = max(needed_memory(view.width * view.height, *known) for view in job.views)
    return max(1, min(most, available // needed))


class Renderer:
    """Runs the passes of one item after another; the trees are built anew where the scene or a camera has moved."""

    def __init__(self, job: Job, threads: int) -> None:
        self.job = job
        self._threads = min(threads, int(numba.config.NUMBA_NUM_THREADS))
        self._caster: RayCaster | None = None
        self._place = b""
        self._depths: DepthCache | None = None
        self._frame = 0  # of the depth textures
        self._build_seconds = 0.0

    def prepare(self, item: Item) -> RayCaster:
        """Return the ray caster for an item's frame; an InputError if the mesh leaves float32 in cast space."""
        transform = self.job.transform(item.frame)
        view = self.job.views[item.view]
        place = transform.tobytes() + view.cast_from_world.tobytes()
        if self._caster is None or self._place != place:
            self._caster = None  # one at a time in memory
            if self._frame != item.frame:
                self._depths = None
                self._frame = item.frame
            start = time.perf_counter()
            mesh = moved(self.job.mesh, transform)
            self._caster = RayCaster(mesh, view.cast_from_world, self._threads)
            self._place = place
            self._build_seconds += time.perf_counter() - start
        return self._caster

    def adjacent(self, item: Item) -> list[Neighbour]:
        """Mapping and depth texture of each module that an item of the frame that is prepared asks."""
        neighbours = self.job.neighbours[item.view]
        if self._depths is None and neighbours:
            self._depths = DepthCache(self.prepare(item), textures_kept(self.job.neighbours))
        return [] if self._depths is None else self._depths.neighbours(neighbours, self.job.settings.caster)

    def textures(self, item: Item) -> Textures:
        """Return an item's textures; their seconds include those of building trees for it."""
        job = self.job
        with kernel_threads(self._threads):
            caster = self.prepare(item)
            textures = render_view(caster, job.views[item.view], job.settings, self.adjacent(item))
        textures.seconds["build_bvh"], self._build_seconds = self._build_seconds, 0.0
        return textures


def run_here(
    renderer: Renderer, items: Sequence[Item], threads: int, ahead: int, field: LightField | None = None
) -> Results:
    """Yield results of the items in their order, rendered in the calling thread; other threads write files meanwhile.

    At most ``ahead`` views are in memory; with 1 nothing is rendered while a file is written. Files that were begun are
    finished where one cannot be written (InputError) or the generator is closed.
    """
    use_one_thread_a_file()
    waiting: deque[Future[output.Result]] = deque()
    with ThreadPoolExecutor(threads) as pool:
        for item in items:
            while len(waiting) >= ahead or (waiting and waiting[0].done()):
                yield waiting.popleft().result()
            textures = renderer.textures(item)
            if field is not None:
                output.put_view(field, renderer.job, item, textures)
            waiting.append(pool.submit(output.write_view, renderer.job, item, textures))
        while waiting:
            yield waiting.popleft().result()


def run_on(executor: Executor, job: Any, items: Sequence[Item], threads: int) -> Results:
    """Results of the items in their order, passes and files run by an executor that hands over the job (InputError)."""
    futures = [executor.submit(run_item, job, item, threads, __version__) for item in items]
    try:
        for future in futures:
            yield future.result()
    finally:
        for future in futures:
            future.cancel()


_here: list[Renderer] = []
_one_at_a_time = threading.Lock()  # threads of a worker share its trees


def run_item(job: Job, item: Item, threads: int, version: str) -> output.Result:
    """Run one item in a worker, which keeps the last job with its trees; InputError if it does not fit the job."""
    if version != __version__:
        raise InputError(f"a worker runs lfssao {__version__}, the job {version}")
    if not job.folder.is_dir():
        raise InputError(f"{job.folder}: a worker does not see it: it needs the same folder")
    with _one_at_a_time:
        if not _here or _here[0].job is not job:
            use_one_thread_a_file()
            _here[:] = [Renderer(job, threads)]
        textures = _here[0].textures(item)
    return output.write_view(job, item, textures)


def recover(job: Job, threads: int, bar: Callable[..., Any] = iter) -> dict[Item, output.Result]:
    """Return the items that an earlier job left whole (``output.recover_view``); ``bar`` passes on one step an item."""
    use_one_thread_a_file()
    with ThreadPoolExecutor(threads) as pool:
        results = list(bar(pool.map(partial(output.recover_view, job), job.items())))
    return {item: result for item, result in zip(job.items(), results, strict=True) if result is not None}
