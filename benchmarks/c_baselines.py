"""The C programs of ``baselines/``, compiled on the spot."""

import ctypes
import os
import subprocess
from pathlib import Path

SOURCES = Path(__file__).with_name("baselines")
# libgomp reads it as it is loaded. Its threads would spin after each call and take a core from the next program.
os.environ["OMP_WAIT_POLICY"] = "passive"


def compile_baselines(folder: Path, threads: int, *options: str) -> ctypes.CDLL:
    """All C files in one library, by gcc -O3 -march=native with OpenMP and the options given."""
    library = folder / f"baselines{len(options)}.so"
    command = [os.environ.get("CC", "gcc"), "-O3", "-march=native", "-fopenmp", "-shared", "-fPIC", *options]
    subprocess.run([*command, "-o", str(library), *map(str, sorted(SOURCES.glob("*.c"))), "-lm"], check=True)
    loaded = ctypes.CDLL(str(library))
    loaded.set_threads(threads)
    return loaded
