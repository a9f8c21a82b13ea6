"""Compares mutated files, many in one process of limited memory and time; prints one JSON line for each.

``python hostile_worker.py KIND START STOP REFERENCE FOLDER``: of kind 'mine' or 'reference' an EXR file is mutated, of
kind 'manifest' the JSON file. Mutant number N is the same in every run.
"""

import copy
import json
import random
import re
import resource
import shutil
import struct
import sys
import time
import warnings
from pathlib import Path

import lfssao
from lfssao.errors import InputError

BYTES = 2 * 2**30  # of address space, so of memory
SECONDS = 5

WHOLE = [0, 1, 2, -1, -2, 7, 255, 256, 65535, 65536, 100_000, 2**31 - 1, -(2**31), 2**30, 10**9, 31_623, 8192, -8192]
FIELDS = [
    b"dataWindow\0box2i\0", b"displayWindow\0box2i\0", b"chunkCount\0int\0", b"compression\0compression\0",
    b"channels\0chlist\0", b"lineOrder\0lineOrder\0", b"type\0string\0", b"name\0string\0",
]  # fmt: skip
VALUES = [
    None, True, False, 0, -1, 1, 2, 1e308, -1e308, 1e-320, float("nan"), float("inf"), 2**31, 2**63, 10**400, "", "x",
    "\0", "../../x", "é" * 300, [], {}, [[]], [None], [1], [[1, 2, 3]], {"a": 1}, "display", "matrix", 4096,
]  # fmt: skip


def mutate_exr(data, r):
    """Bytes flipped, cut off, put in, changed in header fields, parts swapped."""
    data, headers = bytearray(data), data.find(b"\0\0\0\0\0\0\0\0")
    headers = min(max(headers, 400), len(data))
    for _ in range(r.choice([1, 1, 1, 2, 4])):
        if len(data) < 16:
            break
        kind, place = r.randrange(8), r.randrange(len(data))
        if kind == 0:
            data[place] ^= 1 << r.randrange(8)
        elif kind == 1:
            del data[place:]
        elif kind == 2:
            data[place:place] = r.randbytes(r.randrange(1, 64))
        elif kind == 3:
            data[r.randrange(min(headers, len(data)))] = r.randrange(256)
        elif kind == 4:
            start = r.randrange(max(1, min(headers, len(data)) - 4))
            data[start : start + 4] = struct.pack("<i", r.choice(WHOLE))
        elif kind == 5:
            field = r.choice(FIELDS)
            starts = [found.start() for found in re.finditer(re.escape(field), data)]
            if starts:
                start = r.choice(starts) + len(field) + r.choice([0, 4, 8, 12, 16])
                data[start : start + 4] = struct.pack("<i", r.choice(WHOLE))
        elif kind == 6:
            first, second = sorted((place, r.randrange(len(data))))
            size = min(r.randrange(1, 600), second - first, len(data) - second)
            part, other = data[first : first + size], data[second : second + size]
            data[first : first + size], data[second : second + size] = other, part
        else:
            data[4 + r.randrange(4)] = r.randrange(256)
    return bytes(data)


def mutate_json(data, r):
    """Half of them as bytes, half as values: replaced, left out, doubled."""
    if r.random() < 0.4:
        return mutate_exr(data, r)
    manifest = json.loads(data)
    for _ in range(r.choice([1, 1, 2, 3])):
        node = manifest
        while True:
            keys = list(node) if isinstance(node, dict) else list(range(len(node)))
            key = r.choice(keys)
            if isinstance(node[key], dict | list) and node[key] and r.random() < 0.85:
                node = node[key]
                continue
            break
        kind = r.randrange(4)
        if kind == 0:
            del node[key]
        elif kind == 1 and isinstance(node, list):
            node.append(node[key])
        else:
            node[key] = copy.deepcopy(r.choice(VALUES))  # later steps may change it
        if not node:
            break
    return json.dumps(manifest).encode()


def mutated(kind, number, data):
    """Mutant number N of a file's bytes."""
    return (mutate_json if kind == "manifest" else mutate_exr)(data, random.Random(f"{kind} {number}"))


def verdict(mine, reference, number=0):
    """Exit code and what is said: of an error the sentence."""
    try:
        # A search takes a second, and hours for all mutants.
        report = lfssao.compare(mine, reference, diagnosis=number % 50 == 0)
    except InputError as error:
        return 4, str(error)
    return report.exit_code, str(report)


def main(kind, start, stop, reference, mine, folder):
    warnings.simplefilter("error")
    sides = {"mine": Path(folder) / "mine", "reference": Path(folder) / "reference"}
    for name, source in (("mine", mine), ("reference", reference)):
        shutil.copytree(source, sides[name])
    target = sides["mine" if kind == "mine" else "reference"]
    target /= "manifest.json" if kind == "manifest" else "module_003.exr"
    data = target.read_bytes()
    verdict(mine, reference)  # what is imported and compiled once is not what is limited
    resource.setrlimit(resource.RLIMIT_AS, (BYTES, BYTES))
    for number in range(int(start), int(stop)):
        target.write_bytes(mutated(kind, number, data))
        begin = time.process_time()
        limit = int(begin) + 4 * SECONDS  # a hang ends the process
        resource.setrlimit(resource.RLIMIT_CPU, (limit, resource.getrlimit(resource.RLIMIT_CPU)[1]))
        code, text = verdict(sides["mine"], sides["reference"], number)
        seconds = time.process_time() - begin
        print(json.dumps({"number": number, "code": code, "seconds": seconds, "text": text}), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
