"""The same job on other processes: dask's workers, one of which is killed, and any executor; equal digests."""

import json
import logging
import os
import signal
import subprocess
import sys
import threading
import time
import warnings
import weakref
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import suppress
from itertools import product
from multiprocessing import get_context
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import urlopen

import pytest
from jobs import digests_of, python, render

import lfssao
from lfssao.errors import InputError
from lfssao.files.whole import _namespace
from lfssao.optics.display_file import find_display
from lfssao.rendering import output
from lfssao.rendering.cluster import executor_of
from lfssao.rendering.job import Job
from lfssao.rendering.manifest import describe_scene
from lfssao.rendering.run import Renderer, run_here, run_item, run_on
from lfssao.rendering.settings import Settings
from lfssao.rendering.views import module_views
from lfssao.scene.builtin import builtin_scene

COMMAND = ["ammonite", "--display", "sample-a", "--resolution", "160x96", "--radii", "0.05,0.1"]
COUNT = 21


@pytest.fixture(scope="module")
def local(tmp_path_factory):
    return digests_of(render(tmp_path_factory.mktemp("local"), *COMMAND))


@pytest.fixture(scope="module")
def cluster():
    """A scheduler and two worker processes of this machine."""
    from distributed import LocalCluster

    with warnings.catch_warnings():  # dask's own: they are not what is tested, and nothing of ours runs here
        warnings.simplefilter("ignore")
        quiet = {"dashboard_address": "127.0.0.1:0", "silence_logs": logging.CRITICAL}
        with LocalCluster(n_workers=2, threads_per_worker=1, **quiet) as made:
            yield made


def processes(cluster):
    from distributed import Client

    with Client(cluster.scheduler_address) as client:
        return sorted(client.run(os.getpid).values())


@pytest.mark.slow
def test_a_killed_worker_costs_nothing_but_time(local, cluster, tmp_path, capsys):
    folder = tmp_path / "out"
    before = processes(cluster)
    assert len(set(before)) == 2
    killed = []
    # The traces of a worker that is killed while it writes.
    folder.mkdir()
    (folder / f".module_020.{_namespace()}.{before[0]}.{0:016x}.part.exr").write_text("half")

    def kill_one():
        while not folder.exists() or sum(name.startswith("module_") for name in os.listdir(folder)) < 3:
            time.sleep(0.002)
        os.kill(before[0], signal.SIGKILL)
        killed.append(sum(name.startswith("module_") for name in os.listdir(folder)))

    killer = threading.Thread(target=kill_one)
    killer.start()
    file = tmp_path / "scheduler.json"  # as 'dask scheduler --scheduler-file' writes it
    file.write_text(json.dumps(cluster.scheduler.identity()))
    render(folder, *COMMAND, "--scheduler", str(file))
    killer.join()
    assert killed[0] < COUNT  # in the middle
    assert before[0] not in processes(cluster)
    assert digests_of(folder) == local
    names = [f"module_{k:03d}.exr" for k in range(COUNT)]
    assert sorted(os.listdir(folder)) == ["contact.png", "manifest.json", *names, "view.png"]
    captured = capsys.readouterr()
    assert captured.out.startswith(f"{folder}: {COUNT} EXR files, manifest.json, contact.png, view.png\n")


def test_what_a_worker_refuses_is_said_here(cluster, tmp_path, capsys):
    (tmp_path / "module_004.exr").mkdir()
    render(tmp_path, *COMMAND, "--scheduler", cluster.scheduler_address, code=2)
    error = capsys.readouterr().err.splitlines()
    assert [line for line in error if line.startswith("lfssao: ")] == error[-1:]
    assert f"{tmp_path / 'module_004.exr'}: it cannot be written" in error[-1]
    assert not (tmp_path / "manifest.json").exists()


@pytest.mark.slow
def test_a_scheduler_of_this_job_alone(local, tmp_path):
    """In a process of its own, with warnings as errors from its start."""
    words = *COMMAND, "--scheduler", "local", "-o", tmp_path / "out"
    done = python("-W", "error::UserWarning", "-m", "lfssao", "render", *words)
    assert done.stderr == ""
    assert done.stdout.count("\n") == 3
    assert digests_of(tmp_path / "out") == local


def test_no_scheduler_no_package_and_threads_that_are_not_ours(tmp_path, capsys, monkeypatch):
    def refused(*words):
        render(tmp_path / "out", *COMMAND, *words, code=2)
        assert not (tmp_path / "out").exists()
        return capsys.readouterr().err

    there = "--scheduler", "tcp://127.0.0.1:1"
    assert "--threads does not go with a scheduler's address" in refused("--threads", "1", *there)
    monkeypatch.setattr("lfssao.rendering.cluster._SECONDS_TO_ANSWER", 0.3)
    assert "--scheduler: no dask scheduler answers at tcp://127.0.0.1:1" in refused(*there)
    file = tmp_path / "file.json"
    for text, why in (
        ("", "not a JSON file"), ("{}", "it holds no address"), ('{"address": 1}', "it holds no address"),
        ('{"address": "tcp://127.0.0.1:1"}', "no dask scheduler answers"), ("[]", "it holds no address"),
    ):  # fmt: skip
        file.write_text(text)
        assert why in refused("--scheduler", str(file)), text
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert "pip install 'lfssao[dask]'" in refused("--scheduler", "local")


# Any executor


def job_in(folder, count=COUNT):
    mesh = builtin_scene("ammonite")
    display = find_display("sample-a").with_resolution(160, 96)
    views = tuple(module_views(mesh, display, range(count)))
    head = {"scene": describe_scene(mesh), "display": None, "sampling": {"method": "latin", "count": 8, "seed": 0}}
    return Job(mesh, views, Settings((0.05, 0.1)), folder, head, ((),) * len(views), (mesh.bounds,))


def textures_of(results):
    return [{name: t["sha256"] for name, t in result.entry["textures"].items()} for result in results]


class Backwards(Executor):
    """Completes the last of four items first, once it has all of them."""

    def __init__(self):
        self.todo = []

    def submit(self, function, *arguments):
        self.todo.append((Future(), function, arguments))
        for future, call, values in reversed(self.todo if len(self.todo) == 4 else []):
            future.set_result(call(*values))
        return self.todo[-1][0]


EXECUTORS = {
    "threads": lambda: ThreadPoolExecutor(3),
    "processes": lambda: ProcessPoolExecutor(1, mp_context=get_context("spawn")),
    "backwards": Backwards,
}


@pytest.mark.parametrize("kind", EXECUTORS)
def test_any_executor_makes_the_same_and_results_come_by_item(local, tmp_path, kind):
    job = job_in(tmp_path, 4)
    with EXECUTORS[kind]() as executor:
        results = list(run_on(executor, job, job.items(), 1))
    assert textures_of(results) == local[:4]
    assert sorted(os.listdir(tmp_path)) == [f"module_{k:03d}.exr" for k in range(4)]


def test_a_worker_of_another_version_or_without_the_folder(tmp_path):
    (item,) = job_in(tmp_path, 1).items()
    with pytest.raises(InputError, match=r"a worker runs lfssao \S+, the job 9\.9"):
        run_item(job_in(tmp_path, 1), item, 1, "9.9")
    with pytest.raises(InputError, match="a worker does not see it: it needs the same folder"):
        run_item(job_in(tmp_path / "other", 1), item, 1, lfssao.__version__)


def test_a_local_scheduler_answers_nobody_else_and_shows_no_pages():
    """Without its keys a client of this machine is turned away."""
    from distributed import Client

    with executor_of("local", 1) as (executor, _, share):
        assert executor.submit(len, share([1, 2, 3])).result() == 3
        (address,) = executor._client.run_on_scheduler(lambda dask_scheduler: [dask_scheduler.address])
        assert address.startswith("tls://127.0.0.1:")
        ports = [executor._client.run_on_scheduler(lambda dask_scheduler: dask_scheduler.http_server.port)]
        ports += executor._client.run(lambda dask_worker: dask_worker.http_server.port).values()
        assert 8787 not in ports  # dask warns where another cluster has it
        for port, page in product(ports, ("status", "info/main/workers.html", "metrics", "health", "sysmon")):
            with pytest.raises(HTTPError, match="404"):
                urlopen(f"http://127.0.0.1:{port}/{page}")
        for stranger in (address, address.replace("tls", "tcp")):
            with pytest.raises((OSError, TypeError)):
                Client(stranger, timeout=1)


# In this process


class Untouched:
    """A view's textures, of which only their number is told apart."""

    def __init__(self, item):
        self.item = item


@pytest.mark.parametrize("ahead", [1, 3, 5])
def test_no_more_views_are_in_memory_than_asked_for(tmp_path, monkeypatch, ahead):
    """Writing is held until no more items come."""
    gate = threading.Event()
    alive = weakref.WeakSet()
    most = []
    job = job_in(tmp_path, 8)

    def textures(_, item):
        made = Untouched(item)
        alive.add(made)
        return made

    monkeypatch.setattr(Renderer, "textures", textures)

    def write(_work, item, _textures):
        gate.wait(0.06 + 0.1 * (item.view % 2))  # each second one is written much later
        most.append(len(alive))
        return item

    monkeypatch.setattr(output, "write_view", write)
    assert len(list(run_here(Renderer(job, 2), job.items(), 2, ahead))) == 8
    assert max(most) == ahead


def test_files_are_written_while_the_next_passes_run(tmp_path, monkeypatch):
    """The passes of the second view end once the first one's file is begun, and that once they have begun."""
    begun = threading.Event()
    computing = threading.Event()
    job = job_in(tmp_path, 4)

    def textures(_, item):
        if item.view == 1:
            computing.set()
            assert begun.wait(20)
        return Untouched(item)

    def write(_work, item, _textures):
        begun.set()
        assert computing.wait(20)
        return item

    monkeypatch.setattr(Renderer, "textures", textures)
    monkeypatch.setattr(output, "write_view", write)
    assert len(list(run_here(Renderer(job, 2), job.items(), 2, 2))) == 4


def test_files_that_were_begun_are_finished_when_the_job_is_stopped(tmp_path):
    job = job_in(tmp_path, 6)
    results = run_here(Renderer(job, 2), job.items(), 2, 3)
    next(results)
    results.close()
    names = sorted(os.listdir(tmp_path))
    assert names == [f"module_{k:03d}.exr" for k in range(len(names))]
    assert len(names) < 6


@pytest.mark.slow
@pytest.mark.parametrize("scheduler", [(), ("--scheduler", "local")], ids=["here", "local"])
def test_sigterm_leaves_whole_files_and_nothing_else(tmp_path, scheduler):
    """No half-written file, no worker, no folder of dask; the session of the command has no process left."""
    folder = tmp_path / "out"
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    command = [sys.executable, "-m", "lfssao", "render", "ammonite", "--display", "sample-a", *scheduler, "-o", folder]
    running = subprocess.Popen(
        command, stderr=subprocess.PIPE, env={**os.environ, "TMPDIR": str(temporary)}, start_new_session=True
    )
    while running.poll() is None and not list(tmp_path.glob("out/module_*")):
        time.sleep(0.01)
    running.terminate()
    assert running.communicate(timeout=60)[1].decode().count("\n") <= 1
    assert running.returncode == 130
    names = os.listdir(folder)
    assert 0 < len(names) < COUNT
    assert all(name.startswith("module_") for name in names)
    assert os.listdir(temporary) == []
    end = time.monotonic() + 20
    while time.monotonic() < end and (alive := _alive(running.pid)):
        time.sleep(0.1)
    assert not alive


def _alive(session):
    """Statuses of the session's processes, without those that only wait to be read by their parent."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            state, _, _, number = path.read_text().rpartition(") ")[2].split()[:4]
            found += [path] if int(number) == session and state != "Z" else []
    return found
