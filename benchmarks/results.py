"""One page of results: ``python benchmarks/results.py`` measures the papers' claims and writes RESULTS.md.

Numbers go to results/papers.json as they are measured, pictures beside it. ``--only NAME`` measures what the name is
part of, as 'VO' or 'LF table 1', or the parts of the estimators' errors, 'parts', and leaves the rest; without it
``lfssao bench work-precision`` is run too, in its own folder, where it goes on after an interruption. ``--quick`` tries
all with small textures, in a folder results-quick; ``--page`` measures nothing and writes the page; ``--controls``
measures the claims' controls alone, by the claims' numbers as they are.
"""

import argparse
import json
import platform
import shutil
import time
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import papers_common
from error_parts import measure as measure_parts
from error_parts import parts_text
from papers_page import CLAIMS, page, work_precision_text

from lfssao.bench.work_precision.advise import COMMITTED, ERRORS, pareto_front, points_of, read_result
from lfssao.cli.bench_work_precision import FIGURES, FOLDER
from lfssao.cli.main import main as lfssao_command
from lfssao.rendering.manifest import describe_machine

PAGE = Path(__file__).parent / "RESULTS.md"


def fronts_only(result: dict[str, Any]) -> dict[str, Any]:
    """A result with the points of its fronts alone, which are all that ``advice`` reads."""
    kept = [
        point
        for error in ERRORS
        for radii in result["setup"]["grid"]["radii"]
        for point in pareto_front(points_of(result, error, radii))
    ]
    estimators = {
        name: {**each, "points": [p for p in each["points"] if any(p.items() <= point.items() for point in kept)]}
        for name, each in result["estimators"].items()
    }
    return {**result, "estimators": estimators}


def measure(name: str, scale: papers_common.Scale) -> dict[str, Any]:
    """A claim's numbers, its control's, and when and where they were measured."""
    start = time.process_time()
    machine = describe_machine(1)
    measured = CLAIMS[name].measure(scale)
    return {
        "measured": measured, "control": control(name, scale, measured),
        "quick": scale.quick, "seconds": round(time.process_time() - start, 1),
        "date": datetime.now(UTC).date().isoformat(), "processor": machine["processor"] or platform.machine(),
        "lfssao": machine["lfssao"],
    }  # fmt: skip


def control(name: str, scale: papers_common.Scale, measured: papers_common.Found) -> papers_common.Found:
    """Numbers that the claim's judge must refuse."""
    return CLAIMS[name].control(scale._replace(pictures=False), measured)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--only", metavar="NAME", default="")
    parser.add_argument("--page", action="store_true")
    parser.add_argument("--controls", action="store_true")
    options = parser.parse_args()
    folder = Path("results-quick") if options.quick else papers_common.RESULTS
    folder.mkdir(exist_ok=True)
    path = folder / "papers.json"
    target = folder / "RESULTS.md" if options.quick else PAGE
    result = json.loads(path.read_text()) if path.exists() else {}
    names = [] if options.page else [name for name in CLAIMS if options.only in name]
    if options.controls:
        names = [name for name in names if name in result]
    for k, name in enumerate(names, 1):
        print(f"{k} of {len(names)}: {name}", end=" ", flush=True)
        scale = papers_common.Scale(options.quick, folder)
        if options.controls:
            entry = result[name] | {"control": control(name, scale, result[name]["measured"])}
        else:
            entry = measure(name, scale)
        result[name] = json.loads(json.dumps(entry, default=float))
        path.write_text(json.dumps({key: result[key] for key in CLAIMS if key in result}, indent=1) + "\n")
        print(f"{result[name]['seconds']:.0f} s", flush=True)
    if options.only in ("", "parts") and not (options.page or options.controls):
        measure_parts(papers_common.Scale(options.quick, folder))
    if not (options.only or options.page or options.controls):
        words = ["-o", str(folder / "run")] if options.quick else []
        code = lfssao_command(["bench", "work-precision", *["--quick"][: options.quick], *words])
        if code:
            raise SystemExit(code)
        for file in (folder / "run" if options.quick else FOLDER).glob("work-precision*"):
            shutil.copy(file, folder)
        if not options.quick:  # what the package answers 'bench advise' from
            fronts = fronts_only(read_result(folder / FIGURES))
            COMMITTED.write_text(json.dumps(fronts, separators=(",", ":")) + "\n")
    target.write_text(page(result, work_precision_text() + parts_text()))
    print(f"wrote {target}")


if __name__ == "__main__":
    main()
