"""Imports of the modules, how kernels are compiled, that docstrings tell the truth, and equal bits."""

import ast
import dataclasses
import functools
import importlib
import inspect
import json
import math
import pkgutil
import re
import subprocess
import sys
import tomllib
from graphlib import TopologicalSorter
from pathlib import Path

import batch
import machine_code
import numba
import pytest
from golden import GOLDEN
from jobs import python

import lfssao
from lfssao.ao.formulas import Seen
from lfssao.ao.kernels import post, ssao
from lfssao.core import jit
from lfssao.samples.kernels import ball

TESTS = Path(__file__).parents[1]
PACKAGE = Path(lfssao.__file__).parent
SOURCES = sorted(PACKAGE.rglob("*.py"))
# Kernels are the files of a folder of that name, and the arithmetic below them.
ARITHMETIC = {"elementary.py", "philox.py"}
KERNELS = [p for p in SOURCES if p.parent.name == "kernels" or (p.parent.name == "core" and p.name in ARITHMETIC)]
# A package imports only from floors below its own.
FLOORS = {
    "errors": 0, "summary": 0, "core": 1, "files": 2, "scene": 3, "optics": 3, "samples": 3, "gbuffer": 4, "ao": 5,
    "rendering": 6, "verify": 7, "testing": 8, "viz": 8, "bench": 9, "cli": 10, "__main__": 11, "__init__": 11,
}  # fmt: skip
# Each third-party package that only one room names.
ROOMS = {
    "trimesh": "scene", "mapbox_earcut": "scene", "embreex": "gbuffer", "OpenImageIO": "files",
    "distributed": "rendering", "hypothesis": "verify", "jinja2": "verify", "ipywidgets": "viz", "tqdm": "cli",
    "shtab": "cli",
}  # fmt: skip
OF_NUMBA = {"config", "get_num_threads", "set_num_threads"}
COMPILER = {"core/jit.py": {"njit"}, "core/intrinsics.py": {"extending", "types"}, "core/numbers.py": {"types"},
            "core/ball_type.py": {"types"}, "core/doubts.py": {"types"}, "core/sectors.py": {"types"},
            "core/corners.py": {"types"}}  # fmt: skip
# Files of numba's types, and the modules of it that they name.
TYPES = {
    "core/jit.py": {"numba.core", "numba.extending"}, "core/vectors.py": {"numba.extending"},
    "core/places.py": {"numba.extending"}, "core/quotients.py": {"numba.extending"},
    "core/corners.py": {"numba.extending"},
    "core/functions.py": {"numba.extending"}, "core/sectors.py": {"numba.extending"},
    "core/ball_type.py": {"numba.core", "numba.extending"}, "core/balls.py": {"numba.extending"},
    "core/doubts.py": {"numba.extending"},
    "core/numbers.py": {"numba.core", "numba.core.typeconv", "numba.core.typing.templates", "numba.extending"},
}  # fmt: skip


@functools.cache
def imports(path):
    """Every module that a file imports, anywhere in it."""
    found = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            found.append("." * node.level + (node.module or ""))
    return found


# Layers


def name_of(path):
    return str(path.relative_to(PACKAGE))


def room_of(path):
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def test_every_room_has_a_floor():
    rooms = {room_of(path) for path in SOURCES}
    assert rooms == set(FLOORS)
    assert len([path for path in PACKAGE.glob("*.py") if not path.name.startswith("__")]) <= 4


def test_imports_go_down():
    for path in SOURCES:
        own = room_of(path)
        rooms = {module.split(".")[1] for module in imports(path) if module.startswith("lfssao.")} - {own}
        assert own == "__init__" or [room for room in rooms if FLOORS[room] >= FLOORS[own]] == [], path


@pytest.mark.parametrize("package", ROOMS)
def test_a_package_is_named_in_one_room(package):
    named = {room_of(path) for path in SOURCES for module in imports(path) if module.split(".")[0] == package}
    assert named == {ROOMS[package]}


def test_compare_imports_scikit_image_in_one_place():
    """Its modules import each other in circles: threads that enter them at two places may wait for each other."""
    places = [(path.name, module) for path in SOURCES if room_of(path) == "verify" for module in imports(path)]
    assert [place for place in places if place[1].startswith("skimage")] == [("metrics.py", "skimage.metrics")]


@pytest.mark.parametrize("path", KERNELS, ids=name_of)
def test_kernels_import_arithmetic_and_kernels_only(path):
    for module in imports(path):
        if module.startswith("lfssao."):
            assert module.startswith("lfssao.core.") or ".kernels" in module, module
        else:
            assert module in {"numpy", "numba", "math", "typing"}, module


@pytest.mark.parametrize("path", [p for p in KERNELS if p.name != "__init__.py"], ids=name_of)
def test_all_functions_of_the_numba_layer_are_kernels(path):
    for node in ast.walk(ast.parse(path.read_text())):
        assert not isinstance(node, ast.AsyncFunctionDef | ast.Lambda)
        if isinstance(node, ast.ClassDef):
            assert [ast.unparse(base) for base in node.bases] == ["NamedTuple"], node.name
        if isinstance(node, ast.FunctionDef) and node.args.args[0].arg != "self":  # of a view, which formulas read
            decorators = [d.func if isinstance(d, ast.Call) else d for d in node.decorator_list]
            assert [ast.unparse(d) for d in decorators] in (["kernel"], ["formula"]), node.name


@pytest.mark.parametrize("path", SOURCES, ids=name_of)
def test_a_file_names_of_numba_what_it_may(path):
    """Its threads; the compiler and its events in core/jit.py alone, how intrinsics are made in core/intrinsics.py."""
    tree = list(ast.walk(ast.parse(path.read_text())))
    private = path.name == "intrinsics.py"
    named = {alias.name for node in tree if isinstance(node, ast.ImportFrom) and node.module == "numba"
             for alias in node.names}  # fmt: skip
    attributes = [node for node in tree if isinstance(node, ast.Attribute)]
    named |= {node.attr for node in attributes if ast.unparse(node.value) == "numba"}
    named |= {alias.asname or "" for node in tree if isinstance(node, ast.Import)
              for alias in node.names if alias.name == "numba"} - {""}  # fmt: skip
    assert named <= OF_NUMBA | COMPILER.get(name_of(path), set())
    own = {module for module in imports(path) if re.match(r"llvmlite|numba\.", module)}
    assert private or own <= TYPES.get(name_of(path), set())
    assert private or path not in KERNELS or not any(node.attr.startswith("_") for node in attributes)


# Tests


def public_files():
    """The files that define what ``lfssao``, ``lfssao.samples`` and ``lfssao.testing`` export."""
    found = {PACKAGE / "ao" / "reference.py"}
    for door in (PACKAGE / "__init__.pyi", PACKAGE / "samples" / "__init__.pyi"):
        found |= {door.parent.joinpath(*name[1:].split(".")).with_suffix(".py") for name in imports(door)}
    for module in imports(PACKAGE / "testing.py"):
        found.add(PACKAGE.joinpath(*module.split(".")[1:]).with_suffix(".py"))
    found = {path for path in found if path.is_file()}
    return sorted(found)


@pytest.mark.parametrize("path", public_files(), ids=name_of)
def test_a_public_file_has_its_test_file(path):
    """In the tests' folder of its room: test_FILE.py, or test_FOLDER_FILE.py."""
    room = TESTS / path.relative_to(PACKAGE).parts[0] if path.parent != PACKAGE else TESTS / "project"
    names = {f"test_{path.stem}.py", f"test_{path.parent.name}_{path.stem}.py"}
    assert names & {test.name for test in room.rglob("test_*.py")}


def module_of(path):
    """The dotted name of a file, of a package that of its folder."""
    parts = ["lfssao", *path.relative_to(PACKAGE).with_suffix("").parts]
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_of(path) for path in SOURCES}


@functools.cache
def exported():
    """The module that each name of a package comes from, by the packages' stubs, whose names are imported late."""
    found = {}
    for door in PACKAGE.rglob("__init__.pyi"):
        package = module_of(door)
        for node in ast.walk(ast.parse(door.read_text())):
            if isinstance(node, ast.ImportFrom):
                source = f"{package}.{node.module}" if node.module else package
                found |= {f"{package}.{alias.name}": source for alias in node.names}
    return found


def targets(path):
    """The modules of the package that a file imports, at its top, in functions, or for types alone."""
    names = exported()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in MODULES)
        elif isinstance(node, ast.ImportFrom):
            for alias in node.names:
                name = f"{node.module}.{alias.name}"
                yield name if name in MODULES else names.get(name, node.module)


def test_imports_have_no_circle():
    """Among the modules of the package, late imports too; a floor's own modules could be in one."""
    graph = {module_of(path): {*targets(path)} for path in SOURCES}
    assert {"lfssao.samples.rotation", "lfssao.ao.estimators.own"} <= {each for made in graph.values() for each in made}
    TopologicalSorter(graph).prepare()


def modules_of_command(*words):
    """How many modules of the package a command has loaded when it ends."""
    script = """import sys
from lfssao.cli.main import main
assert main(sys.argv[1:]) == 0
print(sum(name.partition('.')[0] == 'lfssao' for name in sys.modules))"""
    return int(python("-c", script, *words).stdout.splitlines()[-1])


def test_commands_load_few_modules(tmp_path):
    """A render of a whole display, with the picture that an eye sees, and a comparison of its folder."""
    folder = str(tmp_path / "made")
    assert modules_of_command("render", "corner", "--resolution", "32x24", "-o", folder) <= 90
    assert (tmp_path / "made" / "view.png").exists()
    assert modules_of_command("compare", folder, folder) <= 140


# Sizes


LONG = re.compile(r"# Long\b.*: ")  # a comment that says why a function or a file is as long as it is


def length(function):
    """Lines of a function without its docstring."""
    first = function.body[1] if ast.get_docstring(function) and len(function.body) > 1 else function.body[0]
    return function.end_lineno - first.lineno + 1


def test_functions_and_files_are_short():
    for path in SOURCES:
        text = path.read_text()
        lines = text.splitlines()
        assert len(lines) <= 400 or any(LONG.match(line) for line in lines[:40]), path
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.FunctionDef) and length(node) > 60:
                assert any(LONG.search(line) for line in lines[node.lineno - 1 : node.end_lineno]), (path, node.name)


# Sentences

ROOMS_BESIDE = ("tests/**", "benchmarks/**", "docs")
PROSE = [*SOURCES, *(p for room in ROOMS_BESIDE for p in sorted(PACKAGE.parent.glob(f"{room}/*.py")))]


def sentences(path):
    text = path.read_text()
    nodes = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    docs = [ast.get_docstring(node) or "" for node in ast.walk(ast.parse(text)) if isinstance(node, nodes)]
    comments = [line.strip().removeprefix("# ") for line in text.splitlines() if line.strip().startswith("# ")]
    for part in [*(p for doc in docs for p in doc.split("\n\n")), *comments]:
        yield from re.split(r"(?<=[.:?])\s+(?=[A-Z])", part.strip())


def test_no_sentence_begins_with_a_subordinate():
    for path in PROSE:
        assert [each for each in sentences(path) if re.match(r"(Of|What|Where|Whoever)\b", each)] == [], path


def test_no_fastmath():
    assert jit.FLAGS["fastmath"] is False
    assert jit.FLAGS["error_model"] == "numpy"
    for kernel in (ssao.algorithm2.compiled, ball.algorithm3, post.blur_horizontal.compiled):
        assert kernel.targetoptions["fastmath"] is False


@pytest.mark.parametrize("path", sorted((TESTS / "reference").glob("*.py")), ids=lambda path: path.name)
def test_the_reference_of_the_tests_imports_nothing_from_lfssao(path):
    found = {name.split(".")[0] for name in imports(path)}
    assert found <= {"numpy", "reference", *sys.stdlib_module_names} - {"importlib"}


def test_the_top_folder_holds_what_it_may():
    top = TESTS.parent
    if not (top / ".git").exists():
        pytest.skip("not a git checkout")
    files = subprocess.run(["git", "-C", str(top), "ls-files"], capture_output=True, text=True, check=True).stdout
    entries = {line.split("/")[0] for line in files.splitlines()}
    allowed = {
        "pyproject.toml",
        "lfssao",
        "tests",
        "benchmarks",
        "notebooks",
        "docs",
        "README.md",
        "LICENSE",
        "CHANGELOG.md",
        "CONTRIBUTING.md",
        "CITATION.cff",
    }
    assert {"pyproject.toml", "lfssao", "tests", "LICENSE"} <= entries
    assert {entry for entry in entries if not entry.startswith(".")} <= allowed


def test_all_files_that_name_the_version_name_the_same():
    top = TESTS.parent
    project = tomllib.loads((top / "pyproject.toml").read_text())["project"]
    assert project["version"] == lfssao.__version__
    assert f"\nversion: {lfssao.__version__}\n" in (top / "CITATION.cff").read_text()
    assert f"# What changed\n\n## {lfssao.__version__}\n" in (top / "CHANGELOG.md").read_text()


# Docstrings


def public_objects():
    """Every public function, kernel, class and method defined in lfssao, by its full name."""
    for info in pkgutil.walk_packages([str(PACKAGE)], "lfssao."):
        if info.name.endswith("__main__"):
            continue
        module = importlib.import_module(info.name)
        for name, value in vars(module).items():
            plain = getattr(value, "py_func", value)
            if name.startswith("_") or getattr(plain, "__module__", None) != info.name:
                continue
            if inspect.isclass(plain):
                yield f"{info.name}.{name}", plain
                for method, attribute in vars(plain).items():
                    function = getattr(attribute, "__func__", getattr(attribute, "fget", attribute))
                    if not method.startswith("_") and inspect.isfunction(function):
                        yield f"{info.name}.{name}.{method}", function
            elif inspect.isfunction(plain):
                yield f"{info.name}.{name}", plain


OBJECTS = dict(public_objects())


def section(doc, title):
    """Names that a numpydoc section lists, or None where there is no such section."""
    found = re.search(rf"^{title}\n-+\n(.*?)(?=^\S[^\n]*\n-+\n|\Z)", doc, re.MULTILINE | re.DOTALL)
    if not found:
        return None
    entries = [line.split(" : ")[0] for line in found[1].splitlines() if line and not line.startswith(" ")]
    return [name.strip().lstrip("*") for entry in entries for name in entry.split(",")]


def test_documented_parameters_are_those_of_the_signature():
    for name, thing in OBJECTS.items():
        doc = inspect.getdoc(thing) or inspect.getdoc(getattr(Seen, name.rpartition(".")[2], None))
        assert doc, name
        assert not doc.startswith(f"{thing.__name__}("), f"{name}: a dataclass without a docstring"
        documented = section(doc, "Parameters")
        if documented is not None:
            parameters = inspect.signature(thing).parameters
            assert documented == [each for each in parameters if each not in ("self", "cls")], name
        if dataclasses.is_dataclass(thing):
            assert section(doc, "Attributes") in (None, [field.name for field in dataclasses.fields(thing)]), name


def test_all_names_resolve_and_are_described():
    assert {"lfssao.ao.post.blur", "lfssao.ao.kernels.ssao.algorithm2", "lfssao.optics.view.View"} <= set(OBJECTS)
    assert sorted(set(lfssao.__all__)) == sorted(lfssao.__all__)
    for name in lfssao.__all__:
        assert inspect.getdoc(getattr(lfssao, name)), name
        assert name in dir(lfssao)
    with pytest.raises(AttributeError, match="nothing"):
        _ = lfssao.nothing


# Equal bits


@numba.njit(fastmath=True)
def fused(x, y):
    return x * y + x


@numba.njit
def sine(x):
    return math.sin(x)


@numba.njit
def remainder(x, y):
    return x % y


@pytest.mark.parametrize(
    ("function", "arguments", "fault"),
    [(fused, (1.0, 2.0), "fmul fast"), (sine, (1.0,), "llvm.sin.f64"), (remainder, (1.0, 2.0), "frem")],
)
def test_loose_arithmetic_and_libm_are_seen_in_code(function, arguments, fault):
    function(*arguments)
    (code,) = function.inspect_llvm().values()
    assert fault in machine_code.faults(code)


@pytest.mark.slow
def test_results_do_not_depend_on_threads_or_cpu(generic_cpu, tmp_path):
    """One and two threads, on this CPU's best instructions and on those that every CPU of its kind has.

    The other process compiles all anew, as the code of kernels that are read from disk cannot be looked at: no kernel
    of it fuses or reorders arithmetic, or calls libm.
    """
    generic = json.loads(python(batch.__file__, **generic_cpu, NUMBA_CACHE_DIR=str(tmp_path)).stdout)
    assert generic.pop("golden") == json.loads(GOLDEN.read_text())
    code = generic.pop("code")
    assert len(code) > 150
    assert {name: faults for name, faults in code.items() if faults} == {}
    for group, (one_generic, two_generic) in generic.items():
        one = batch.digests(group, 1)
        most = batch.digests(group, numba.config.NUMBA_NUM_THREADS)
        assert len(one) >= 6, group
        assert one == most, group
        assert one == one_generic, group
        assert one == two_generic, group
