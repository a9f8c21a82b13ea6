"""How long sample sets take to make: ``python benchmarks/bench_samples.py``.

Milliseconds of this thread on the processor (other programs do not lengthen them), warm, of 4,096 points (64 from the
tables) by every method in every domain, the methods taking turns: median, least and greatest. The first calls, which
compile or load compiled code, stand apart. The limit is 50 ms.
"""

import argparse
import json
import statistics
import time
from pathlib import Path

from lfssao.rendering.manifest import describe_machine
from lfssao.samples import METHODS, sample_set

LIMIT = 50.0


def milliseconds(domain: str, method: str, n: int, seed: int) -> float:
    """Time of making one set."""
    start = time.thread_time()
    sample_set(domain, method, n, seed)
    return 1000 * (time.thread_time() - start)


def measure(repeats: int) -> dict[str, dict[str, float]]:
    """For each domain and method the first call, and median, least and greatest of the warm ones."""
    jobs = [(domain, name, method.most or 4096) for domain, of in METHODS.items() for name, method in of.items()]
    first = {job: milliseconds(*job, seed=0) for job in jobs}
    warm: dict[tuple[str, str, int], list[float]] = {job: [] for job in jobs}
    for seed in range(1, repeats + 1):
        for job in jobs:
            warm[job].append(milliseconds(*job, seed=seed))
    return {
        f"{name}, {domain}, {n}": {
            "first": first[job], "median": statistics.median(warm[job]), "least": min(warm[job]),
            "greatest": max(warm[job]),
        }
        for job in jobs
        for domain, name, n in (job,)
    }  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=9)
    parser.add_argument("--json", type=Path, default=Path(__file__).parent / "results" / "samples.json")
    options = parser.parse_args()
    results = measure(options.repeats)
    print(f"{'method, domain, points':<28} {'first':>9} {'median':>9} {'least':>9} {'greatest':>9}  ms")
    for name, of in results.items():
        late = "" if of["median"] < LIMIT else "  above the limit"
        print(f"{name:<28} {of['first']:9.2f} {of['median']:9.2f} {of['least']:9.2f} {of['greatest']:9.2f}{late}")
    options.json.parent.mkdir(exist_ok=True)
    options.json.write_text(json.dumps({"machine": describe_machine(1), "milliseconds": results}, indent=1) + "\n")


if __name__ == "__main__":
    main()
