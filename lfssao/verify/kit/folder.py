"""A kit as a folder: JSON and little-endian .npy files, and EXR files of the same textures; written and read back."""

import hashlib
import json
import os
import re
import shutil
import uuid
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from lfssao import __version__
from lfssao.errors import InputError, check_type
from lfssao.files.exr import Part, write_exr
from lfssao.files.npy import read_npy, write_npy
from lfssao.files.whole import check_file, check_folder, read_json
from lfssao.rendering.manifest import digest
from lfssao.verify.bounds.bounds import Bounds
from lfssao.verify.case import Array, Arrays, Case
from lfssao.verify.kit.specification import specification

FORMAT = 3
_INDEX = "kit.json"
_DTYPES = ("float32", "float64", "int32", "int64", "uint32")

# The fields of a case that the index repeats.
_HEAD = {"name": str, "stage": str, "title": str}

_CHANNELS = {
    "depth": ("Z",),
    "positions": ("P.X", "P.Y", "P.Z"),
    "normals": ("N.X", "N.Y", "N.Z"),
    "directions": ("directions.X", "directions.Y", "directions.Z"),
    "image": ("R", "G", "B"),
    "shaded": ("R", "G", "B"),
}
_OCCLUSIONS = ("occlusion", "layers", "merged", "source", "horizontal", "blurred")


def write_kit(folder: str | Path, cases: Iterable[Case]) -> None:
    """Write a kit, its cases one after the other, into a temporary folder next to it, which is then renamed.

    The folder may exist if it is empty or holds a kit, which is replaced. InputError if it holds something else or
    cannot be written.

    >>> lfssao.testing.write_kit(Path("kit"), [lfssao.testing.make_case("frame")])
    """
    check_type("folder", folder, str | Path)
    folder = Path(folder)
    target = Path(os.path.abspath(folder))
    check_target(folder)
    try:
        with _replacing(target) as part:
            index = [write_case(part / "cases" / case.name, case) for case in cases]
            for name, text in specification().items():
                (part / name).write_bytes(text.encode())
            (part / _INDEX).write_bytes(to_json({"format": FORMAT, "lfssao": __version__, "cases": index}))
    except OSError as error:
        raise InputError(f"{folder}: the kit cannot be written ({error.strerror or error})") from error


def check_target(folder: Path) -> None:
    """Refuse a folder that holds something that is not a kit, or cannot be made."""
    check_folder(folder)
    if folder.is_dir() and any(folder.iterdir()) and not (folder / _INDEX).is_file():
        raise InputError(f"{folder}: the folder is not empty, and what it holds is not a kit")


@contextmanager
def _replacing(target: Path) -> Iterator[Path]:
    """A temporary folder that takes the target's place if the block succeeds, and goes if it does not."""
    target.parent.mkdir(parents=True, exist_ok=True)
    part = target.with_name(f".{target.name}.{uuid.uuid4().hex}.part")
    old = part.with_suffix(".old")
    part.mkdir()
    try:
        yield part
        if target.exists():
            target.rename(old)
        part.rename(target)
    finally:
        shutil.rmtree(part, ignore_errors=True)
        shutil.rmtree(old, ignore_errors=True)


def write_case(folder: Path, case: Case) -> dict[str, Any]:
    """Write one case into a new folder; return its entry of the index."""
    folder.mkdir(parents=True)
    text = to_json(describe_case(case))
    (folder / "case.json").write_bytes(text)
    for name, array in arrays_of(case).items():
        write_npy(folder / f"{name}.npy", np.asarray(array, array.dtype.newbyteorder("<"), order="C"))
    for file, arrays in (("inputs.exr", case.inputs), ("outputs.exr", case.outputs)):
        parts = _parts(arrays)
        if parts:
            write_exr(folder / file, parts)
    head = {key: getattr(case, key) for key in _HEAD}
    return {**head, "folder": f"cases/{case.name}", "sha256": hashlib.sha256(text).hexdigest()}


def describe_case(case: Case) -> dict[str, Any]:
    """The contents of case.json; with the digests of all arrays they fix every bit of the case."""
    described = {
        name: {"file": f"{name}.npy", "dtype": array.dtype.name, "shape": list(array.shape), "sha256": digest(array)}
        for name, array in arrays_of(case).items()
    }
    return {
        "format": FORMAT,
        **{key: getattr(case, key) for key in _HEAD},
        "parameters": dict(case.parameters),
        "inputs": {name: described[name] for name in case.inputs},
        "outputs": {name: described[name] for name in case.outputs},
        "bounds": {
            name: {side: described[f"{name}_{side}"] for side in ("lower", "upper")} for name in sorted(case.bounds)
        },
    }


def arrays_of(case: Case) -> dict[str, Array]:
    """All arrays of a case by the names of their files."""
    arrays = {**case.inputs, **case.outputs}
    for name, bounds in case.bounds.items():
        arrays |= {f"{name}_lower": bounds.lower, f"{name}_upper": bounds.upper}
    return arrays


def to_json(value: Any) -> bytes:
    """JSON in one form only: numbers as the shortest decimals that read back as the same binary64, ASCII."""
    text = json.dumps(value, indent=1, allow_nan=False)
    text = re.sub(r"\[[^][{}]+\]", lambda found: " ".join(found[0].split()), text)  # lists of numbers: one line each
    return (text.replace("[ ", "[").replace(" ]", "]") + "\n").encode("ascii")


def _parts(arrays: Arrays) -> list[Part]:
    """The textures among some arrays as parts of an EXR file."""
    parts = []
    for name, array in arrays.items():
        if name in _CHANNELS and array.ndim == (2 if name == "depth" else 3):
            parts.append(Part(name, _CHANNELS[name], array.reshape(*array.shape[:2], -1)))
        elif name in _OCCLUSIONS or name.startswith("ao_"):
            layers = {name: array} if array.ndim == 2 else {f"{name}_{k}": layer for k, layer in enumerate(array, 1)}
            parts += [Part(part, (f"{part}.AO",), layer[..., None]) for part, layer in layers.items()]
    return parts


def read_index(folder: Path) -> list[dict[str, Any]]:
    """The entries of a kit's cases: name, stage, title and folder.

    InputError if it is no kit, or one of a newer format.
    """
    path = folder / _INDEX
    cases = _read_json(path).get("cases")
    keys = _HEAD | {"folder": str, "sha256": str}
    if not isinstance(cases, list) or not all(_has(case, keys) for case in cases):
        raise InputError(f"{path}: its list of cases is malformed")
    return cases


def read_kit(folder: Path) -> Iterator[Case]:
    """All cases of a kit, one after the other; errors as of read_index and read_case."""
    for entry in read_index(folder):
        yield read_case(folder / entry["folder"])


def read_case(folder: Path) -> Case:
    """One case from its folder, every array checked against its digest.

    InputError if a file is missing or is not what it should be, or of a newer format.
    """
    path = folder / "case.json"
    described = _read_json(path)
    keys = _HEAD | dict.fromkeys(("parameters", "inputs", "outputs", "bounds"), dict)
    if not _has(described, keys):
        raise InputError(f"{path}: one of {', '.join(keys)} is missing or of the wrong type")
    inputs, outputs = (
        {name: _read_array(folder, name, entry) for name, entry in described[group].items()}
        for group in ("inputs", "outputs")
    )
    if not outputs:
        raise InputError(f"{path}: it has no outputs")
    bounds = {}
    for name, pair in described["bounds"].items():
        if not _has(pair, {"lower": dict, "upper": dict}):
            raise InputError(f"{path}: bounds need a lower and an upper array")
        lower, upper = (_read_array(folder, name, pair[side]) for side in ("lower", "upper"))
        if name not in outputs or not lower.shape == upper.shape == outputs[name].shape:
            raise InputError(f"{path}: the bounds of {name} are not of the shape of an output of that name")
        bounds[name] = Bounds(lower, upper)
    head = {key: described[key] for key in _HEAD}
    return Case(**head, parameters=described["parameters"], inputs=inputs, outputs=outputs, bounds=bounds)


def _has(entry: Any, keys: Mapping[str, type]) -> bool:
    return isinstance(entry, dict) and all(isinstance(entry.get(key), kind) for key, kind in keys.items())


def _read_json(path: Path) -> dict[str, Any]:
    """A JSON file of this format."""
    check_file(path, "; 'lfssao kit' writes it")
    value: dict[str, Any] = read_json(path)
    found = value.get("format") if isinstance(value, dict) else None
    if type(found) is not int or found < 1:
        raise InputError(f"{path}: it is no file of a kit: its format is {found!r}")
    if found > FORMAT:
        raise InputError(f"{path}: the kit is of format {found}, and this version of lfssao reads up to {FORMAT}")
    return value


def _read_array(folder: Path, name: str, entry: Any) -> Array:
    """An array of a case, checked before memory is taken for it."""
    if not _has(entry, {"file": str, "dtype": str, "shape": list, "sha256": str}):
        raise InputError(f"{folder / 'case.json'}: the description of {name} is malformed")
    path = folder / entry["file"]
    if path.parent != folder or entry["dtype"] not in _DTYPES:
        raise InputError(f"{folder / 'case.json'}: the file or dtype of {name} is malformed")
    array = np.asarray(read_npy(path), order="C")
    found = array.dtype.name, str([*array.shape]), digest(array)
    if found != (entry["dtype"], str(entry["shape"]), entry["sha256"]):
        raise InputError(f"{path}: it is not what case.json describes")
    return array
