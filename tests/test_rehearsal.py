"""The rehearsal of a job: it loads what the job calls and nothing else, sees its scene, and writes nothing."""

import functools
import importlib
import json
import os
import pkgutil
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import numba
import numpy as np
import pytest

import lfssao.kernels
from lfssao import Settings, cluster, find_display, module_views, rehearsal
from lfssao import job as job_module
from lfssao.camera import PROJECTIONS, Camera
from lfssao.cli import main
from lfssao.errors import InputError
from lfssao.estimators.registry import ESTIMATORS
from lfssao.job import Job
from lfssao.pipeline import run_here
from lfssao.rehearsal import STEPS, rehearse
from lfssao.rendering import neighbour_views
from lfssao.samples import make_samples
from lfssao.scene.mesh import Mesh, Paint
from lfssao.work import Renderer, Work

DISPLAYS = ("virtual", "sample-a", "sample-b", "c80", "picoarray", "convex")
SIZE = 48, 36
MORE = len(os.sched_getaffinity(0))


def mesh(layers=1, textured=None, normals=False):
    """Two triangles that fill a rectangle, so many times behind each other."""
    corners = [(x, y, 0.1 * z) for z in range(layers) for y in (-1.0, 1.0) for x in (-1.0, 1.0)]
    faces = np.array([(4 * z + a, 4 * z + b, 4 * z + c) for z in range(layers) for a, b, c in ((0, 1, 2), (1, 3, 2))])
    count, paint = len(corners), None
    if textured is not None:
        images = (np.full((5, 7, 3), 0.5, np.float32), None) if textured else (None, None)
        factors, material = np.ones((2, 3), np.float32), np.arange(len(faces), dtype=np.int32) % 2
        paint = Paint(factors, material, images, np.zeros((count, 2)), np.full((count, 3), 0.5, np.float32))
    return Mesh(np.array(corners), faces, paint, np.array([(0.0, 0.0, 1.0)] * count) if normals else None)


def views_of(scene, name, modules=1, guard=0):
    if name in PROJECTIONS:
        return (Camera.looking_at(scene.bounds, name).view(*SIZE, guard),)
    display = find_display(name).with_resolution(*SIZE)
    middle = len(display.modules) // 2
    return tuple(module_views(scene, display, range(middle, middle + modules), guard))


def work_of(folder, scene=None, name="virtual", modules=1, guard=0, plan=True, radii=(0.2, 0.3), **settings):
    scene = scene or mesh()
    views, chosen = views_of(scene, name, modules, guard), Settings(radii, **settings)
    beside = ()
    if chosen.neighbours:
        display = find_display(name).with_resolution(*SIZE)
        middle = len(display.modules) // 2
        beside = tuple(neighbour_views(scene, display, chosen.neighbours, range(middle, middle + modules), guard))
    return Work(scene, views, chosen, folder, {}, neighbours=beside, plan=plan)


def kernels():
    """All that is compiled for calls from Python, by file and name; loops are compiled with what calls them."""
    for module in pkgutil.iter_modules(lfssao.kernels.__path__):
        path = f"lfssao.kernels.{module.name}"
        for name, function in vars(importlib.import_module(path)).items():
            compiled = getattr(function, "head", function)
            if "_loop_" in name:
                continue
            if isinstance(compiled, numba.core.dispatcher.Dispatcher) and compiled.py_func.__module__ == path:
                yield (path, name), compiled


def reading_once(load):
    """The function that finds compiled code on disk, for one that keeps what it found."""
    found = {}

    def load_overload(signature, context):
        if found.get(signature) is None:
            found[signature] = load(signature, context)
        return found[signature]

    return load_overload


@pytest.fixture(scope="module", autouse=True)
def code_is_read_once():
    """What ``called`` forgets, again and again, is machine code already: linking it took most of these tests' time."""
    with pytest.MonkeyPatch.context() as patch:
        for _, compiled in kernels():
            patch.setattr(compiled._cache, "load_overload", reading_once(compiled._cache.load_overload))
        yield


def called(work):
    """Files, names and signatures of the kernels that something calls, each as if for the first time."""
    for _, compiled in kernels():
        compiled._reset_overloads()
        compiled.overloads.clear()
    for path, module in list(sys.modules.items()):
        if path.startswith("lfssao."):
            for kept in vars(module).values():
                if isinstance(kept, functools._lru_cache_wrapper):
                    kept.cache_clear()
    work()
    return {(*name, str(types)) for name, compiled in kernels() for types in compiled.overloads}


def calls_of_both(work, name="virtual"):
    """What the rehearsal of a work calls, and what the work itself does, trees and files included.

    Without what making its display has called before.
    """
    together = min(3, len(work.items()))
    work.folder.mkdir()
    of_display = called(lambda: views_of(work.mesh, name))
    of_rehearsal = called(lambda: list(rehearse(Renderer(work, MORE), work.items(), together)))
    of_job = called(lambda: list(run_here(Renderer(work, MORE), work.items(), MORE, 2 * together)))
    return of_rehearsal - of_display, of_job - of_display


CASES = {
    **{name: {"name": name} for name in (*DISPLAYS, *PROJECTIONS)},
    "three modules": {"modules": 3, "name": "c80"},
    "tree of boxes": {"scene": mesh(20)},
    "tree of boxes, camera": {"scene": mesh(20), "name": "perspective"},
    "vertex colours": {"scene": mesh(textured=False)},
    "bilinear texture": {"scene": mesh(textured=True)},
    "nearest texture": {"scene": mesh(textured=True), "color_filter": "nearest"},
    "normals": {"normals": "geometric"},
    "smooth normals": {"scene": mesh(normals=True), "normals": "smooth"},
    "no smooth normals there": {"normals": "smooth"},
    "neighbours": {"name": "sample-a", "neighbours": 2},
    "guard": {"guard": 5},
    "no plan": {"plan": False},
    "no plan, curved": {"plan": False, "name": "convex"},
    "one radius": {"radii": (0.2,)},
    "one radius twice": {"radii": (0.2, 0.2)},
    "many radii": {"radii": tuple(0.1 + 0.01 * k for k in range(20))},
    "radius 0": {"radii": (0.0,)},
    "radius 0, sao": {"radii": (0.0,), "estimator": "sao", "name": "perspective"},
    "decided radii": {"radii": (1e-4, 2e-4)},
    "no blur": {"blur": 0.0},
}


@pytest.mark.parametrize("case", CASES)
def test_a_rehearsal_calls_the_kernels_of_the_job(tmp_path, case):
    of_rehearsal, of_job = calls_of_both(work_of(tmp_path / "out", **CASES[case]), CASES[case].get("name", "virtual"))
    assert of_rehearsal == of_job


@pytest.mark.parametrize("name", ["sample-a", "convex", "orthographic"])
@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_a_rehearsal_calls_the_kernels_of_every_estimator(tmp_path, estimator, name):
    of_rehearsal, of_job = calls_of_both(work_of(tmp_path / "out", name=name, estimator=estimator), name)
    assert of_rehearsal == of_job


def test_a_rehearsal_leaves_many_samples_to_the_job(tmp_path):
    work = work_of(tmp_path / "out", samples=make_samples("latin", 160))
    of_rehearsal, of_job = calls_of_both(work)
    assert of_rehearsal < of_job
    assert not any(path.endswith("ssao") for path, _, _ in of_rehearsal)  # tiles may decide all of them
    assert {path.rpartition(".")[2] for path, _, _ in of_job - of_rehearsal} <= {"ssao", "tile_bounds", "tiled_ssao"}


def test_a_rehearsal_calls_nothing_where_nothing_is_seen(tmp_path):
    scene = mesh()
    beside = Mesh(scene.vertices + np.array((0.0, 100.0, 0.0)), scene.faces)
    work = Work(beside, views_of(scene, "virtual"), Settings((0.2,)), tmp_path / "out", {})
    renderer, steps = Renderer(work, 1), []
    renderer.prepare(work.items()[0])
    assert called(lambda: steps.extend(rehearse(renderer, work.items(), 1))) == set()
    assert steps == []


@pytest.mark.parametrize("layers", [1, 20])
@pytest.mark.parametrize("name", [*DISPLAYS, *PROJECTIONS])
def test_a_rehearsal_sees_its_scene_and_writes_nothing(tmp_path, monkeypatch, name, layers):
    seen, real = [], rehearsal.render_view

    def render_view(*arguments):
        seen.append(real(*arguments))
        return seen[-1]

    monkeypatch.setattr(rehearsal, "render_view", render_view)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    work = work_of(tmp_path / "out", mesh(layers), name)
    assert len(list(rehearse(Renderer(work, 1), work.items(), 1))) == STEPS
    (textures,) = seen
    assert textures.merged.size < 1000
    assert np.isfinite(textures.gbuffer.depth).mean() > 0.1
    assert textures.merged.max() > 0
    assert list(tmp_path.iterdir()) == []


def test_each_kind_of_rays_is_rehearsed_once(tmp_path):
    scene = mesh()
    views = (*views_of(scene, "virtual"), *views_of(scene, "convex", 2), *views_of(scene, "virtual"))
    work = Work(scene, views, Settings((0.2,)), tmp_path / "out", {})
    assert [item.view for item in rehearsal._of_each_kind(work, work.items())] == [0, 1]
    assert [item.view for item in rehearsal._of_each_kind(work, work.items()[2:])] == [2, 3]


# --- In a job

COMMAND = ["render", "ammonite", "--display", "sample-a", "--modules", "3:6", "--resolution", "32x24", "--radii", "1%",
           "--samples", "2"]  # fmt: skip


def test_seconds_apart_are_no_rendering(tmp_path, monkeypatch):
    clock = [100.0]
    monkeypatch.setattr(job_module.time, "perf_counter", lambda: clock[0])
    work = work_of(tmp_path)
    head = {"load": 7.0}
    job = Job(work, {}, head)
    clock[0] += 1.0
    with job.apart("load_kernels"):
        clock[0] += 10.0
    clock[0] += 3.0
    (done,) = run_here(Renderer(work, 1), work.items(), 1, 2)
    job.add(*done)
    seconds = json.loads((tmp_path / "manifest.json").read_text("utf-8"))["seconds"]
    assert (seconds["load"], seconds["load_kernels"], seconds["render"]) == (7.0, 10.0, 4.0)
    assert head == {"load": 7.0}


@pytest.fixture
def rehearsed(monkeypatch):
    """What is rehearsed: items and how many views are hashed together."""
    out, real = [], rehearsal.rehearse

    def watched(renderer, items, together):
        out.append(([item.view for item in items], together))
        return real(renderer, items, together)

    monkeypatch.setattr(rehearsal, "rehearse", watched)
    return out


def test_a_job_rehearses_what_is_still_to_be_done(tmp_path, rehearsed):
    command = [*COMMAND, "-o", str(tmp_path)]
    assert main(command) == 0
    assert json.loads((tmp_path / "manifest.json").read_text("utf-8"))["seconds"]["load_kernels"] > 0
    (tmp_path / "module_004.exr").unlink()
    assert main([*command, "--resume"]) == 0
    assert main([*command, "--resume"]) == 0
    assert rehearsed == [([0, 1, 2], 3), ([1], 1)]


def test_workers_rehearse_nothing(tmp_path, monkeypatch, rehearsed):
    @contextmanager
    def executor_of(_scheduler, _count):
        with ThreadPoolExecutor(1) as executor:
            yield executor, 1

    monkeypatch.setattr(cluster, "executor_of", executor_of)
    assert main([*COMMAND, "-o", str(tmp_path), "--scheduler", "local"]) == 0
    assert rehearsed == []


def test_a_rehearsal_that_fails_ends_the_job_and_leaves_an_earlier_one(tmp_path, monkeypatch, capsys):
    command = [*COMMAND, "-o", str(tmp_path)]
    assert main(command) == 0
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}

    def fail(*_):
        raise InputError("it does not work")

    monkeypatch.setattr(rehearsal, "render_view", fail)
    assert main([*command, "--seed", "3"]) == 2
    assert capsys.readouterr().err == "lfssao: it does not work\n"
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
