"""The command line: what it refuses and how, interrupts, the progress bar."""

import ctypes
import fcntl
import os
import pty
import re
import select
import shlex
import shutil
import signal
import struct
import subprocess
import sys
import termios
import time
from importlib.resources import files
from io import StringIO

import numpy as np
import pytest
from exr_parts import read_parts
from jobs import manifest_of, python, render, sentence

from lfssao import __version__
from lfssao.cli.bench import BENCHES
from lfssao.cli.main import COMMANDS, command_line, main
from lfssao.cli.terminal import progress

SMALL = ["statue", "--resolution", "64x48"]
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def refused(capsys, folder, *words):
    """The one sentence of a refused command, which must not have made its output folder."""
    render(folder / "new" / "out", *words, code=2)
    assert not (folder / "new").exists()
    return sentence(capsys)


BAD_VALUES = {
    "--resolution": ("5", "0x5", "5x0", "-5x5", "5x-5", "nanx5", "1.5x2", "5x5x5", "x", "", "9" * 5000 + "x1",
                     "1000000x1000000", "60000x35000", "٤x٤"),
    "--modules": ("0:0", "3:2", "-1:2", "a:b", ":", "0:", ":1", "", "0:22", "0:99999999999999999999", "0:1:2"),
    "--radii": ("nan", "inf", "-inf", "-1", "-1,2", "1,-2", "-5%", "abc", "", "1,", ",1", "1e400", "1e31", "%", "1;2"),
    "--samples": ("0", "-1", "nan", "inf", "1.5", "abc", "", "1000000000", "1_0", "9" * 5000, "٤"),
    "--layers": ("", "ao_1", "depth,", "all", "Depth", "depth;ao"),
    "--blur": ("-1", "nan", "inf", "-inf", "abc", "", "1e9"),
    "--seed": ("-1", "abc", "1.5", "", str(2**64), "9" * 5000, "nan"),
    "--threads": ("0", "-1", "abc", "1.5", "", "1000000", "inf"),
    "--display": ("foo", "", "Virtual"),
    "--sampling": ("foo", "", "spiral"),
    "--camera": ("foo", ""),
    "--normals": ("up",),
    "--filter": ("cubic",),
    "--caster": ("vulkan",),
    "--guard": ("-1",),
    "--frames": ("0", "-1", "1.5", "", "10001", "x", "a.txt", "missing.json", "٤"),
    "--scheduler": ("", "remote", "127.0.0.1:8786", "tcp://", "tcp://a", "tcp://a b:1", "http://a:1"),
}  # fmt: skip


@pytest.mark.parametrize(("option", "value"), [(o, v) for o, values in BAD_VALUES.items() for v in values])
def test_bad_values_are_refused_by_the_options_name(capsys, tmp_path, option, value):
    sentence = refused(capsys, tmp_path, "statue", option, value)
    assert option.removeprefix("--") in sentence
    assert len(sentence) < 220


FILES = {"line\nbreak.obj": "", "fine.obj": TRIANGLE, "b.png": "garbage"}


@pytest.mark.parametrize(("words", "part"), [
    (["statue", "--display", "foo"], "'foo': choose one of c80, convex, picoarray, sample-a, sample-a-conical, "),
    (["statue", "--sampling", "foo"], "'foo': choose one of random, jittered, latin, poisson"),
    (["statue", "--display", "Sample_A"], "there is no display 'Sample_A' (did you mean 'sample-a'?)"),
    (["statue", "--camera", "foo"], "'foo': choose one of perspective, orthographic"),
    (["statue", "--display", "sample-a", "--modules", "20:22"], "modules 20:22 are not a part of 0:21"),
    (["statue", "--layers", "finest"], "'finest': choose one of depth, positions, color, normals, ao, bent"),
    (["statue", "--samples", "0"], "0 is not from 1 to 65536"),
    (["statue", "--caster", "vulkan"], "caster: there is no choice 'vulkan': choose one of exact, embree"),
    (["statue", "--radii", "1,-2"], "-2 is not a radius from 0"),
    (["statue", "--radii", "-1,2"], "-1 is not a radius from 0"),
    (["statue", "--resolution", "1000000x1000000"], "at most 2147483647 texels"),
    (["statue", "--resolution", "45000x45000"], "GB of memory"),
    (["statue", "extra"], "extra"),
    (["statue", "--nope"], "--nope"),
    (["statue", "--sampli", "latin"], "--sampli (did you mean '--sampling'?) (see lfssao render --help)"),
    (["statue", "--samples"], "--samples: expected one argument"),
    (["statue", "--texture", "a.png"], "--texture: the embedded scene statue takes none"),
    (["statue", "--camera", "--display", "virtual"], "--display does not go with --camera"),
    (["statue", "--camera", "--modules", "0:1"], "--modules does not go with --camera"),
    (["statue", "--eye", "3,2,5"], "--eye, --target, --up and --fov place a camera: they need --camera"),
    (["statue", "--camera", "--eye", "3,2"], "--eye: '3,2' is not three numbers X,Y,Z"),
    (["statue", "--estimator", "best"], "--estimator: there is no estimator 'best'"),
    (["statue", "--parameter", "sigma"], "--parameter: 'sigma' is not NAME=VALUE"),
    (["statue", "--parameter", "sigma=2"], "--parameter: estimator lf has no parameter 'sigma'"),
    (["statue", "--neighbours", "-1"], "-1 is not from 0"),
    (["statue", "--neighbours", "21", "--modules", "9:13"], "is 21: sample-a has 20 modules besides module 9"),
    (["statue", "--neighbours", "2", "--estimator", "hemisphere"], "neighbours are for estimator lf"),
    (["statue", "--neighbours", "1", "--camera"], "--neighbours does not go with --camera"),
    (["statue", "--rotate", "hsh"], "there is no rotation 'hsh' (did you mean 'hash'?)"),
    (["statue", "--rotate", "ign", "--estimator", "multiresolution"], "multiresolution do not turn by it"),
    (["statue", "--rotate", "ign", "--neighbours", "2", "--display", "c80"], "estimator lf-neighbours do not turn"),
    (["n" * 300], "n: there is no such file, and no embedded scene of that name (gallery, turntable, "),
    (["teapot"], "teapot: there is no such file, and no embedded scene of that name (gallery, turntable, "),
    (["teapot.obj"], "teapot.obj: there is no such file"),
    (["/"], "/: it is a folder"),
    (["line\nbreak.obj"], "line\\nbreak.obj: the file is empty"),
    (["fine.obj", "--texture", "c.png"], "c.png: there is no such file"),
    (["fine.obj", "--texture", "b.png"], "b.png: it cannot be read as an image"),
])  # fmt: skip
def test_sentence_says_what_is_wrong_and_what_would_be_right(capsys, tmp_path, monkeypatch, words, part):
    monkeypatch.chdir(tmp_path)
    for name, content in FILES.items():
        (tmp_path / name).write_text(content)
    assert part in refused(capsys, tmp_path, *words)


def test_huge_requests_are_refused_before_memory_is_taken(capsys, tmp_path):
    import resource

    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for option in (["--resolution", "40000x40000"], ["--samples", "10000000000"], ["--blur", "1e15"]):
        refused(capsys, tmp_path, "statue", *option)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 500_000  # kB


def test_commands_without_their_words(capsys):
    for words, part in (
        (["paint"], "there is no command 'paint': choose one of render, "),
        (["rendr", "statue"], "there is no command 'rendr' (did you mean 'render'?): choose one of "),
        (["samples", "mak"], "there is no action 'mak' (did you mean 'make'?): choose one of make, check, plot"),
        (["bench", "stabilty"], "there is no bench 'stabilty' (did you mean 'stability'?)"),
        (["help", "rendr"], "did you mean 'render'"),
        (["ao", "--depth", "d.exr"], "are required: --buffers, --radii"),
        (["ao", "--dept", "d.exr"], "unrecognized arguments: --dept (did you mean '--depth'?)"),
        (["render", "statue", "-o", ""], "--output is empty"),
        (["render", "-output", "a"], "unrecognized arguments: -output (did you mean '--output'?)"),
        (["render", "-out", "a"], "unrecognized arguments: -out (did you mean '--output'?)"),
        (["render", "--radius=1%"], "unrecognized arguments: --radius (did you mean '--radii'?)"),
        (["render", "--verbose"], "unrecognized arguments: --verbose (see lfssao render --help)"),
    ):
        assert main(words) == 2
        assert part in sentence(capsys)


@pytest.mark.parametrize("place", ["file", "file/a", "file/a/b", "link", "/proc/lfssao", "/proc", "/dev/null"])
def test_output_that_cannot_be_written(capsys, tmp_path, place):
    (tmp_path / "file").write_text("mine")
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    # A file in the way is seen before the scene is loaded.
    render(tmp_path / place, *(SMALL if place.startswith("/proc") else ["teapot.obj"]), code=2)
    assert f"{tmp_path / place}: the output folder cannot be" in sentence(capsys)
    assert sorted(os.listdir(tmp_path)) == ["file", "link"]
    assert (tmp_path / "file").read_text() == "mine"


@pytest.mark.parametrize("words", [
    "render NAME -o out", "render statue -o NAME", "render -o out --display NAME", "view NAME", "compare NAME .",
    "compare . NAME", "samples check NAME.csv", "kit NAME", "ao --depth NAME --buffers NAME --radii 1 -o out",
])  # fmt: skip
def test_a_name_that_no_file_can_have_is_one_sentence(tmp_path, monkeypatch, capsys, words):
    monkeypatch.chdir(tmp_path)
    assert main(words.replace("NAME", "n" * 300).split()) == (4 if words.startswith("compare") else 2)
    assert capsys.readouterr().err.count("\n") == 1
    assert os.listdir(tmp_path) == []


def test_refused_command_leaves_a_folder_as_it_was(capsys, tmp_path):
    (tmp_path / "module_000.exr").write_text("mine")
    before = os.stat(tmp_path).st_mtime_ns
    for words in (["teapot.obj"], ["statue", "--samples", "0"], ["statue", "--resolution", "60000x60000"]):
        render(tmp_path, *words, code=2)
    assert os.listdir(tmp_path) == ["module_000.exr"]
    assert os.stat(tmp_path).st_mtime_ns == before
    assert (tmp_path / "module_000.exr").read_text() == "mine"


def test_the_folder_has_a_default(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["render", *SMALL, "--modules", "10"]) == 0
    assert "module_010.exr" in os.listdir(tmp_path / "out")


def test_name_of_a_scene_wins_over_a_folder(tmp_path, monkeypatch):
    # `lfssao render statue -o statue` makes such a folder; it must work twice.
    monkeypatch.chdir(tmp_path)
    for _ in range(2):
        render("statue", *SMALL)
    assert (tmp_path / "statue" / "module_000.exr").exists()


def test_degenerate_faces_are_said(capsys, tmp_path):
    (tmp_path / "a.obj").write_text(f"mtllib no.mtl\n{TRIANGLE}f 1 1 2\nf 2 2 2\n")
    (tmp_path / "b.obj").write_text(f"{TRIANGLE}f 1 1 2\n")
    for name, wanted in (
        ("a", ["2 faces without an area are left out", "it names 'no.mtl', which is not there"]),
        ("b", ["1 face without an area is left out"]),
    ):
        render(tmp_path / name, str(tmp_path / f"{name}.obj"), "--resolution", "8x6", "--radii", "10%")
        said = capsys.readouterr().err.splitlines()
        assert len(said) == len(wanted)
        for line, part in zip(said, wanted, strict=True):
            assert f"{name}.obj: {part}" in line
        assert manifest_of(tmp_path / name)["scene"]["degenerate_faces_left_out"] == (2 if name == "a" else 1)


@pytest.mark.parametrize("words", [[], *([name] for name in COMMANDS), *(["bench", name] for name in BENCHES)])
def test_every_command_has_help(capsys, words):
    with pytest.raises(SystemExit) as caught:
        main([*words, "--help"])
    assert caught.value.code == 0
    assert f"usage: {' '.join(['lfssao', *words])}" in capsys.readouterr().out


@pytest.mark.parametrize("words", [[], ["samples"], ["bench"]])
def test_without_a_command_the_help_is_printed(capsys, words):
    assert main(words) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith(f"usage: {' '.join(['lfssao', *words])}")


@pytest.mark.parametrize("words", [[], ["render"], ["samples", "make"]])
def test_help_is_a_command_too(capsys, words):
    with pytest.raises(SystemExit) as caught:
        main(["help", *words])
    assert caught.value.code == 0
    said = capsys.readouterr().out
    with pytest.raises(SystemExit):
        main([*words, "--help"])
    assert capsys.readouterr().out == said


HELPS = sorted((files("lfssao.cli") / "help").iterdir(), key=lambda path: path.name)


@pytest.mark.parametrize("path", HELPS, ids=lambda path: path.name)
def test_examples_of_helps_are_commands(path):
    """Each line that begins with two spaces and lfssao is one, up to two spaces or a comment."""
    lines = re.findall(r"^  (lfssao (?:[^ \n#]| (?=\S))+)", path.read_text(), re.MULTILINE)
    assert lines
    for line in lines:
        words = shlex.split(line.removesuffix(" ...").replace("$TASK", "0"))[1:]
        given = [*words, "--radii", "1", "--buffers", "B"] if line.endswith("...") else words
        assert words[0] == "help" or callable(command_line().parse_args(given).run)


def test_every_help_has_an_example():
    of_commands = {*COMMANDS, "all", *(f"samples_{name}" for name in ("make", "check", "plot"))} - {"samples", "bench"}
    assert {path.name for path in HELPS} == {
        f"{name}.txt" for name in (*of_commands, *(f"bench_{name.replace('-', '_')}" for name in BENCHES))
    }


@pytest.mark.parametrize(("words", "option"), [
    ("compare a b --tolerance 0.1", "--fail"), ("compare a b --threshold=1", "--fail"),
    ("compare a b --tolerence 1", "--fail"),
    ("render --size 5x5", "--resolution"), ("render --spp 4", "--samples"), ("render --outdir a", "--output"),
    ("render --smaples 4", "--samples"), ("render --Radii 1", "--radii"), ("render --bluur 1", "--blur"),
    ("view out --eyex 1", "--eye-x"), ("ao --normal n", "--normals"), ("samples make latin --sead 1", "--seed"),
])  # fmt: skip
def test_an_option_that_may_be_meant_is_named(capsys, words, option):
    assert main(words.split()) in (2, 4)
    assert f"(did you mean '{option}'?)" in sentence(capsys)


@pytest.mark.parametrize(
    "words", ["render --tolerance 1", "render --foo", "compare a b --gamma 2", "view out --fps 24"]
)
def test_no_option_is_named_that_is_far_from_it(capsys, words):
    assert main(words.split()) in (2, 4)
    assert "did you mean" not in sentence(capsys)


def test_options_stand_in_groups(capsys):
    for command, titles in (("render", ("views", "occlusion, blur and light", "output")), ("compare", ("reports",))):
        with pytest.raises(SystemExit):
            main([command, "--help"])
        said = capsys.readouterr().out
        assert [title for title in titles if f"\n{title}:\n  -" not in said] == []


def test_version_and_help_of_all_commands_import_none():
    script = "import sys, lfssao.cli.main as cli; cli.main(sys.argv[1:])"
    for word, said in (("--version", f"lfssao {__version__}\n"), ("--help", "usage: lfssao")):
        done = python("-X", "importtime", "-c", script, word)
        assert done.stdout.startswith(said)
        assert not re.search(
            r"\b(numpy|numba|llvmlite|trimesh|embreex|skimage|scipy|OpenImageIO|PIL|tqdm)\b", done.stderr
        )


def test_help_names_every_option(capsys):
    with pytest.raises(SystemExit):
        main(["render", "--help"])
    out = capsys.readouterr().out
    for option in (*BAD_VALUES, "--output", "--texture"):
        assert option in out
    for name in ("gallery", "statue", "ammonite", "armadillo", "sample-a", "jittered", "orthographic"):
        assert name in out


def test_extreme_meshes_give_textures_without_nan(tmp_path, capsys):
    mesh = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    for scale, offset in ((9e29, 0.0), (2e-30, 0.0), (1.0, 1e5)):
        corners = "".join("v {!r} {!r} {!r}\n".format(*v) for v in (mesh * scale + offset).tolist())
        (tmp_path / "a.obj").write_text(corners + "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n")
        for more in (["--radii", "10%"], ["--radii", "10%", "--camera"], ["--radii", "1e30,0"]):
            render(tmp_path / "out", str(tmp_path / "a.obj"), "--resolution", "16x12", *more)
        for name in ("module_000", "camera"):
            parts = read_parts(tmp_path / "out" / f"{name}.exr")
            assert len(parts) > 5
            assert not any(np.isnan(pixels).any() for _, pixels in parts)
    said = capsys.readouterr().err.splitlines()
    assert [line for line in said if "left there of another job" not in line and "did you mean" not in line] == []


def test_a_scene_too_far_from_the_origin_is_refused(tmp_path, capsys):
    """At 1e6 float32 positions are 1 / 16 apart: a texel that is wider knows its place, one that is narrower not."""
    corners = "v 1e6 0 0\nv 1000001 0 0\nv 1e6 1 0\nf 1 2 3\n"
    (tmp_path / "a.obj").write_text(corners)
    for more in (["--display", "virtual"], ["--camera"]):
        job = [str(tmp_path / "a.obj"), *more, "--radii", "10%", "--resolution"]
        render(tmp_path / "out", *job, "24x24", code=2)
        assert "the scene is 1 large and reaches 1e+06 from the world's origin" in sentence(capsys)
        assert not (tmp_path / "out").exists()
        render(tmp_path / "out", *job, "16x16")
        capsys.readouterr()
        shutil.rmtree(tmp_path / "out")


# In a process of its own


def start(*words):
    command = [sys.executable, "-m", "lfssao", "render", *words]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)


def test_python_m_in_a_pipe_says_one_line_and_nothing_else(tmp_path):
    process = start("ammonite", "--resolution", "64x48", "--camera", "-o", str(tmp_path / "out"))
    out, error = process.communicate(timeout=60)
    assert process.returncode == 0
    assert error == b""  # no bar, no warnings
    assert out.decode() == f"{tmp_path / 'out'}: 1 EXR file, manifest.json, contact.png\n"


def test_folder_name_that_is_not_text(tmp_path):
    folder = os.fsencode(tmp_path) + b"/caf\xe9"
    process = start("statue", "--resolution", "8x6", "--radii", "10%", "-o", folder)
    out, error = process.communicate(timeout=60)
    assert (process.returncode, out) == (2, b"")
    assert error.count(b"\n") == 1
    assert b"needs names in UTF-8" in error
    assert os.listdir(tmp_path) == []


def test_reader_of_the_output_may_be_gone(tmp_path):
    process = start(*SMALL, "-o", str(tmp_path / "out"))
    process.stdout.close()
    error = process.stderr.read()
    process.stderr.close()
    assert (process.wait(timeout=60), error) == (0, b"")


def on_terminal(words, columns=80, **variables):
    """Exit code and everything that a command writes to a terminal."""
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24 if columns else 0, columns, 0, 0))
    environment = {name: v for name, v in (os.environ | variables).items() if name not in ("COLUMNS", "LINES")}
    process = subprocess.Popen(
        [sys.executable, "-m", "lfssao", *words], stdout=theirs, stderr=theirs, stdin=theirs, env=environment
    )
    os.close(theirs)
    text = b""
    while select.select([ours], [], [], 60)[0]:
        try:
            chunk = os.read(ours, 4096)
        except OSError:  # Linux's way of saying that the other end is closed
            break
        if not chunk:
            break
        text += chunk
    os.close(ours)
    return process.wait(timeout=60), text.decode()


@pytest.mark.parametrize("columns", [80, 0])  # 0: a terminal that does not know its width, as of many containers
def test_terminal_shows_a_bar_with_a_rate(tmp_path, columns):
    words = ["render", *SMALL, "--modules", "0:3", "-o", str(tmp_path)]
    code, text = on_terminal(words, columns)
    assert code == 0
    assert re.search(r" 0/3 \[", text)
    assert re.search(r"\b3/3 \[.*[0-9.]+ ?(module/s|s/module)", text)
    assert text.replace("\r", "").endswith(f"{tmp_path}: 3 EXR files, manifest.json, contact.png\n")


def test_a_terminal_sees_kernels_compile_and_a_pipe_does_not(tmp_path):
    words = ["samples", "make", "latin", "-n", "2"]
    code, text = on_terminal(words, NUMBA_CACHE_DIR=str(tmp_path / "first"))
    assert code == 0
    numbers = re.findall(r"compiling kernels \(first run only\) (\d+)/24", text)
    assert [int(n) for n in dict.fromkeys(numbers)] == list(range(1, len({*numbers}) + 1))
    assert len({*numbers}) > 1
    piped = python("-m", "lfssao", *words, NUMBA_CACHE_DIR=str(tmp_path / "second"))
    assert piped.stderr == ""
    assert text.replace("\r", "").endswith(piped.stdout)


def test_no_commands_import_compiles_kernels_before_that_is_shown(tmp_path):
    script = """import importlib, sys
from lfssao.core.jit import report_compiling
with report_compiling(print, print):
    for name in sys.argv[1:]:
        importlib.import_module("lfssao.cli." + name.replace("-", "_"))"""
    words = *COMMANDS, *(f"bench_{name}" for name in BENCHES)
    assert python("-c", script, *words, NUMBA_CACHE_DIR=str(tmp_path)).stdout == ""


def test_a_bar_goes_on_while_a_step_takes_long(monkeypatch):
    class Terminal(StringIO):
        def isatty(self):
            return True

    monkeypatch.setattr(sys, "stderr", Terminal())
    with progress(total=2, file=sys.stderr) as bar:
        before = sys.stderr.getvalue().count("\r")
        patience = time.monotonic() + 60
        while sys.stderr.getvalue().count("\r") < before + 2 and time.monotonic() < patience:
            time.sleep(0.05)
        assert sys.stderr.getvalue().count("\r") >= before + 2
        bar.update()
    assert "1/2" in sys.stderr.getvalue()


def test_message_after_a_bar_has_a_line_of_its_own(tmp_path):
    (tmp_path / "module_001.exr").mkdir()
    code, text = on_terminal(["render", *SMALL, "--modules", "0:3", "-o", str(tmp_path)])
    assert code == 2
    assert "1/3 [" in text
    last = text.replace("\r\n", "\n").split("\n")[-2]
    assert last.startswith("lfssao: ")
    assert "module_001.exr: it cannot be written" in last


def test_interrupt_inside_a_callback_from_llvm_is_not_lost(monkeypatch, capsys):
    # As numba compiles on a first run: C calls Python, and ctypes drops what is raised there.
    source = "def callback():\n    os.kill(os.getpid(), signal.SIGINT)\n    done.append('called')\n"
    done = []
    names = {"os": os, "signal": signal, "done": done}
    exec(compile(source, "/site-packages/llvmlite/binding/executionengine.py", "exec"), names)
    in_c = ctypes.CFUNCTYPE(None)(names["callback"])

    def hold(_options):
        in_c()
        done.append("returned")
        time.sleep(30)

    monkeypatch.setattr("lfssao.cli.render._render", hold)
    assert main(["render", "-o", "nowhere"]) == 130
    assert done == ["called", "returned"]
    assert capsys.readouterr().err == (
        "lfssao: interrupted; every file that was written is whole; the same command with --resume goes on\n"
    )
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
