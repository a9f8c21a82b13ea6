"""How long starting takes: ``python benchmarks/bench_start.py``.

Seconds of ``import lfssao``; of the README's render (one module, 1024x768, five radii of 8) with an empty and with a
filled kernel cache, and how much of each is spent compiling (numba's own events); and of a render with the package's
folder read-only in effect (its kernel cache elsewhere).
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from lfssao.rendering.manifest import describe_machine

RENDER = """
import sys, time
from numba.core import event
spent = [0.0]
depth, start = [0], [0.0]
class Watch(event.Listener):
    def on_start(self, e):
        if depth[0] == 0: start[0] = time.perf_counter()
        depth[0] += 1
    def on_end(self, e):
        depth[0] -= 1
        if depth[0] == 0: spent[0] += time.perf_counter() - start[0]
event.register("numba:compile", Watch())
from lfssao.cli.main import main
code = main(["render", "-o", sys.argv[1]])
print("COMPILE", spent[0])
sys.exit(code)
"""


def import_seconds(repeats: int) -> list[float]:
    """Seconds of ``import lfssao`` in new processes."""
    program = "import time; t = time.perf_counter(); import lfssao; print(time.perf_counter() - t)"
    run = [sys.executable, "-c", program]
    return [float(subprocess.run(run, check=True, capture_output=True, text=True).stdout) for _ in range(repeats)]


def render_seconds(cache: Path, folder: Path) -> dict[str, float]:
    """Wall seconds of one render in a new process, and those of them spent compiling."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache)}
    start = time.perf_counter()
    run = [sys.executable, "-c", RENDER, str(folder)]
    done = subprocess.run(run, check=True, capture_output=True, text=True, env=environment)
    wall = time.perf_counter() - start
    return {"wall": wall, "compiling": float(done.stdout.split("COMPILE")[1])}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--json", type=Path, default=Path(__file__).parent / "results" / "start.json")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        imports = import_seconds(options.repeats)
        cold = render_seconds(folder / "cache", folder / "out")
        warm = [render_seconds(folder / "cache", folder / "out") for _ in range(options.repeats)]
    result = {"machine": describe_machine(os.cpu_count() or 1, sys.argv), "import": imports, "cold": cold, "warm": warm}
    print(f"import lfssao   {statistics.median(imports):.3f} s")
    print(f"first render    {cold['wall']:.1f} s, of which compiling {cold['compiling']:.1f} s")
    wall, compiling = (statistics.median(w[key] for w in warm) for key in ("wall", "compiling"))
    print(f"second render   {wall:.2f} s, of which compiling or loading compiled code {compiling:.2f} s")
    options.json.parent.mkdir(exist_ok=True)
    options.json.write_text(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
