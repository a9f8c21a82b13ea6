"""Mutated files of every kind that is read: each is read or refused in a sentence, in bounded time and memory."""

import fuzz
import pytest

pytestmark = pytest.mark.slow
FEW = 100  # of each kind; `tests/tools/fuzz.py` runs thousands
LEAST = 3  # of them are read, and so reach what lies behind the reader
SEALED = {"resume"}  # every changed bit is noticed


@pytest.fixture(scope="module")
def worker():
    return fuzz.Worker(seed=5)


@pytest.mark.parametrize("kind", fuzz.LOADERS)
def test_mutants_are_read_or_refused(kind, worker):
    outcomes = [worker.outcome(kind, number) for number in range(FEW)]
    assert [each for each in outcomes if each[0] not in fuzz.GOOD] == []
    read = sum(outcome == "read" for outcome, _ in outcomes)
    assert (0 if kind in SEALED else LEAST) <= read < FEW
