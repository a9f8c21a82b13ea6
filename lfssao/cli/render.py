"""``lfssao render``: textures of every module of a display, or of a camera."""

import argparse
import os
import sys
import time
from contextlib import ExitStack, closing
from functools import partial

import numba

from lfssao.ao.estimators.registry import find_estimator
from lfssao.cli.job_options import add_options, job_of
from lfssao.cli.terminal import printable, progress, working
from lfssao.core.threads import MOST_THREADS
from lfssao.errors import InputError
from lfssao.rendering.manifest import PANEL
from lfssao.rendering.output import ANIMATION, VIEW
from lfssao.rendering.run import recover, run


def add_to(render: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    render.description = """Ray cast a scene from every optical module of a light field display, compute ambient
        occlusion for several radii (by LF Algorithm 2, or by --estimator), merge, blur and multiply it in, and write
        one EXR file a module, manifest.json, contact.png and, of a whole display, view.png: what an eye in its middle
        sees. A quilt has views for modules, by LF Algorithm 1, and a picture of all of them; a lenslet display has
        lenses, and panel.exr, the panel's one texture of each layer."""
    render.set_defaults(run=_render)
    add_options(render, output=True)


def _render(options: argparse.Namespace) -> None:
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1)
    threads = min(options.threads or MOST_THREADS, cores, int(numba.config.NUMBA_NUM_THREADS))
    if not options.output:
        raise InputError("--output is empty, it must name a folder")
    if options.threads is not None and (options.scheduler or "local") != "local":
        raise InputError("--threads does not go with a scheduler's address: its workers have their own")
    start = time.perf_counter()
    with working("load"):
        job = job_of(options, threads)
    if options.scheduler is not None and find_estimator(job.settings.estimator).text:
        raise InputError("--scheduler: its workers do not know an estimator of one's own, leave one of the two out")
    seconds = {"load": time.perf_counter() - start}
    total = len(job.items())
    executor = None
    sent = job
    verifying = partial(progress, total=total, desc="verify", unit="module")
    found = recover(job, threads, verifying) if options.resume else {}
    with ExitStack() as stack:
        if options.scheduler is not None and len(found) < total:
            from lfssao.rendering.cluster import executor_of  # late: most renders have no scheduler

            workers = executor_of(options.scheduler, min(threads, total - len(found)))
            executor, threads, share = stack.enter_context(workers)
            sent = share(job)
        bar = stack.enter_context(progress(total=total, initial=len(found), unit="module"))
        # Closed before the bar: files that were begun are finished first.
        for _ in stack.enter_context(closing(run(job, threads, found, executor, sent, seconds))):
            bar.update()
    written = f"{len(job.views)} EXR file{'s' * (len(job.views) > 1)}"
    written += f", {len(job.views)} PNG" * job.png + ", manifest.json"
    written += ", contact.png" * job.has_sheet + ", view.png" * job.has_view
    written += "".join(f", {name}" for name in job.quilts.values()) + f", {PANEL}" * job.panel
    if job.transforms is not None:
        written = f"{job.frame_count} frame{'s' * (job.frame_count > 1)}, each {written}"
        written += f"; {ANIMATION}" * job.has_sheet
    print(printable(f"{job.folder}: {written}"))
    if job.has_view:
        made = ", without AO and with it" if job.settings.light is None else ", without light and AO, and with both"
        both = made if job.mesh.paint is not None else ""
        print(printable(f"open {job.folder / VIEW}: what an eye in the middle sees{both}"))
        print(printable(f"try next: lfssao view {job.folder} --eye-x 0.4 -o right.png"))
    if job.panel and "shaded" in job.settings.kept:
        print(printable(f"try next: lfssao view {job.folder} --html eye.html"))
    sys.stdout.flush()
