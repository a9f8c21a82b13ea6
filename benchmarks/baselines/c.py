"""Algorithm 2 in plain C, compiled on the spot."""

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from baselines.case import Case, FloatTexture, compared, equal_share

from lfssao.errors import MissingPackageError

SOURCE = Path(__file__).with_name("algorithm2.c")


def compile_library(folder: Path, source: Path, *options: str) -> ctypes.CDLL:
    """A shared library of a C file, -O3 for this processor, with OpenMP.

    Raises
    ------
    MissingPackageError
        If there is no C compiler, or it fails.
    """
    compiler = shutil.which("gcc") or shutil.which("clang") or shutil.which("cc")
    if compiler is None:
        raise MissingPackageError("there is no C compiler (gcc, clang, cc)")
    library = folder / f"{source.stem}{len(options)}.so"
    command = [compiler, "-O3", "-march=native", "-fopenmp", "-shared", "-fPIC", *options]
    done = subprocess.run([*command, "-o", str(library), str(source), "-lm"], capture_output=True, check=False)
    if done.returncode != 0:
        raise MissingPackageError(f"{compiler} does not compile {source.name}")
    return ctypes.CDLL(str(library))


def algorithm2(library: ctypes.CDLL, name: str, case: Case) -> Callable[[], FloatTexture] | None:
    """The C function of a name on a case; None where the library does not have it."""
    function = getattr(library, name, None)
    if function is None:
        return None
    ao = np.empty_like(case.depth)
    arrays = [
        array.ctypes.data_as(ctypes.c_void_p)
        for array in (case.depth, case.positions, case.image_offsets, case.numbers, ao)
    ]
    height, width = case.depth.shape

    def run() -> FloatTexture:
        function(width, height, len(case.image_offsets), *arrays)
        return ao

    return run


def measure(repeats: int, threads: int) -> dict[str, Any]:
    """One loop nest and, where the processor has them, vectors by hand; without contraction they give our bits."""
    case = Case.of(threads)
    with tempfile.TemporaryDirectory() as folder:
        fast = compile_library(Path(folder), SOURCE)
        exact = compile_library(Path(folder), SOURCE, "-ffp-contract=off")
        runs: dict[str, Callable[[], FloatTexture]] = {"lfssao": case.ours}
        equal = {}
        for name in ("plain_c", "avx2_c", "avx512_c"):
            run, same = algorithm2(fast, name, case), algorithm2(exact, name, case)
            if run is not None and same is not None:
                runs[name], equal[name] = run, equal_share(same(), case.ours())
        rows = compared(runs, repeats)
    for name, share in equal.items():
        rows[name]["equal_bits"] = share
    return {"rows": rows}
