"""Sample sets as files: tables that a shader or another program loads, and the reading of them back."""

import json
import re
import tempfile
from collections.abc import Callable
from importlib.resources import files
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from lfssao.errors import InputError, check_choice
from lfssao.files.npy import read_npy
from lfssao.files.whole import read_json, read_text
from lfssao.samples.sets import FloatArray, SampleSet

_SHADERS = (".glsl", ".frag", ".hlsl", ".h")
_NUMBER = r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?[fF]?"
_NUMBERS = rf"{_NUMBER}(?:\s*,\s*{_NUMBER})*"
_VECTOR = rf"(?:\w*\s*\(|\{{)\s*{_NUMBERS}\s*[)}}]"  # vec3(x, y, z), float3(x, y, z) or {x, y, z}
_ITEMS = rf"(?P<vectors>{_VECTOR}(?:\s*,\s*{_VECTOR})*)|(?P<numbers>{_NUMBERS})"
_ARRAY = re.compile(rf"(?P<name>\w+)\s*\[\w*\]\s*=\s*(?:\w+\s*\[\w*\]\s*\(|\{{)\s*(?:{_ITEMS})\s*,?\s*[)}}]\s*;")
_COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
_AXES = {"square": ("xi_1", "xi_2"), "disk": ("x", "y"), "sphere": ("x", "y", "z"), "ball": ("x", "y", "z")}


def _table(samples: SampleSet) -> FloatArray:
    """Return coordinates and, if the set has them, weights: (n, d) or (n, d + 1)."""
    return samples.points if samples.weights is None else np.column_stack([samples.points, samples.weights])


def to_csv(samples: SampleSet) -> bytes:
    """CSV: a line of names and a line for each point; every number reads back to the same bits."""
    names = [*_AXES[samples.domain], *([] if samples.weights is None else ["weight"])]
    lines = [",".join(map(repr, row)) for row in _table(samples).tolist()]
    return "\n".join([",".join(names), *lines, ""]).encode()


def to_json(samples: SampleSet) -> bytes:
    """JSON: an object with the fields of the set; weights are null where all weigh the same."""
    facts = {
        "domain": samples.domain,
        "method": samples.method,
        "seed": samples.seed,
        "promises": list(samples.promises),
        "points": samples.points.tolist(),
        "weights": None if samples.weights is None else samples.weights.tolist(),
    }
    return (json.dumps(facts, indent=1) + "\n").encode()


def to_glsl(samples: SampleSet) -> bytes:
    """GLSL: constant arrays SAMPLES and, if the set has weights, WEIGHTS, rounded once to float32."""
    n, d = samples.points.shape
    rows = ",\n".join(f"    vec{d}({', '.join(map(_literal, row))})" for row in samples.points.tolist())
    text = f"// {samples.method}, {samples.domain}, seed {samples.seed}\nconst int SAMPLE_COUNT = {n};\n"
    text += f"const vec{d} SAMPLES[{n}] = vec{d}[{n}](\n{rows}\n);\n"
    if samples.weights is not None:
        weights = ",\n".join(f"    {_literal(w)}" for w in samples.weights.tolist())
        text += f"const float WEIGHTS[{n}] = float[{n}](\n{weights}\n);\n"
    return text.encode()


def to_glsl_function(samples: SampleSet) -> bytes:
    """Return GLSL that computes a point from its number, without a table; InputError for all but 'owen-burley'.

    ``sample_cell`` returns the words of the coordinates on (0, 1), in units of 2^-32, of up to three columns.
    ``sample_point`` returns xi_1 and xi_2 of LF's square, exact in float32: the words' first 23 bits and a half.
    """
    if (samples.method, samples.domain) != ("owen-burley", "square"):
        raise InputError(
            f"glsl-function is of owen-burley on the square, not of {samples.method} on the {samples.domain}"
        )
    from lfssao.samples.kernels import burley  # late: of this method alone

    keys = ", ".join(f"0x{burley.key_of(np.uint64(samples.seed), column):08x}u" for column in range(4))
    text = (files(__package__) / "owen_burley.glsl").read_text("utf-8")
    return text.replace("$KEYS", keys).replace("$SEED", str(samples.seed)).encode()


def _literal(number: float) -> str:
    """Return the shortest float32 literal that GLSL reads back to the same bits."""
    return str(np.format_float_scientific(np.float32(number), trim="0"))


def to_npy(samples: SampleSet) -> bytes:
    """NumPy's format: (n, d) float64; weights, if the set has them, as a last column."""
    stream = BytesIO()
    np.save(stream, _table(samples))
    return stream.getvalue()


FORMATS: dict[str, Callable[[SampleSet], bytes]] = {
    "csv": to_csv,
    "json": to_json,
    "glsl": to_glsl,
    "glsl-function": to_glsl_function,
    "npy": to_npy,
}


def read_points(path: Path) -> tuple[FloatArray, FloatArray | None, str | None]:
    """Read one set of points, (n, d), as ``read_sets`` does; InputError if there are several."""
    sets, weights, domain = read_sets(path)
    if len(sets) > 1:
        raise InputError(f"{path}: it holds {len(sets)} sets of points, expected one")
    return sets[0], weights, domain


def read_sets(path: Path) -> tuple[FloatArray, FloatArray | None, str | None]:
    """Read sets of points (seeds, n, d), weights (n,) or None, and the domain, if it is named, from a file.

    .csv, .txt, .dat: two or three columns, as of ``np.savetxt``, and one called 'weight' if the first line has names;
    .json: an object with 'points', the list of points itself, or the manifest of a render; .npy; .glsl, .frag, .hlsl,
    .h: a shader's text with one array of vectors, and one of numbers called weights if it has them. Points are (n, d),
    one set, or (seeds, n, d) in .json and .npy. InputError if the file cannot be read, or does not hold points.
    """
    readers: dict[str, Callable[[Path], Any]] = dict.fromkeys((".csv", ".txt", ".dat"), _read_text)
    readers |= {".json": _read_json, ".npy": lambda path: (read_npy(path).astype(np.float64), None, None)}
    readers |= dict.fromkeys(_SHADERS, _read_shader)
    check_choice("format of points", path.suffix.lower(), readers)
    points, weights, domain = readers[path.suffix.lower()](path)
    if points.ndim not in (2, 3) or points.shape[-1] not in (2, 3) or points.size == 0:
        wanted = "expected (n, 2) or (n, 3) with n at least 1, or (seeds, n, 2) or (seeds, n, 3)"
        raise InputError(f"{path}: its points have shape {points.shape}, {wanted}")
    if not np.isfinite(points).all() or not (weights is None or np.isfinite(weights).all()):
        raise InputError(f"{path}: a number is not finite")
    return points if points.ndim == 3 else points[None], weights, domain


def read_stream(data: bytes) -> tuple[FloatArray, FloatArray | None, str | None]:
    """``read_sets`` of the bytes of a file without a name, whose format they show."""
    ending = ".csv"
    if data.startswith(b"\x93NUMPY"):
        ending = ".npy"
    elif data.lstrip()[:1] in (b"{", b"["):
        ending = ".json"
    elif b"(" in data or b"{" in data:
        ending = ".glsl"
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"points{ending}"
        path.write_bytes(data)
        try:
            return read_sets(path)
        except InputError as error:
            raise InputError(str(error).replace(str(path), f"standard input, read as {ending}")) from None


def _read_text(path: Path) -> tuple[FloatArray, FloatArray | None, None]:
    lines = [line for line in read_text(path).splitlines() if line.strip() and not line.startswith("#")]
    between = next((mark for mark in ";,\t" if lines and mark in lines[0]), None)  # else spaces
    names: list[str] = []
    if lines and not re.match(r"\s*[+-]?(\.?[0-9]|inf|nan)", lines[0], re.IGNORECASE):
        names = [name.strip(' "').lower() for name in lines.pop(0).split(between)]
    try:
        table = np.loadtxt(lines, delimiter=between, ndmin=2) if lines else np.empty((0, len(names)))
    except ValueError as error:
        raise InputError(f"{path}: it is no table of numbers ({str(error).partition(';')[0]})") from error
    if names and table.shape[1] != len(names):
        raise InputError(f"{path}: it names {len(names)} columns and has {table.shape[1]}")
    if "weight" not in names:
        return table, None, None
    column = names.index("weight")
    return np.delete(table, column, axis=1), table[:, column], None


def _read_json(path: Path) -> tuple[FloatArray, FloatArray | None, str | None]:
    data = read_json(path)
    facts = data if isinstance(data, dict) else {"points": data}
    settings = facts.get("settings")
    if isinstance(settings, dict) and "points" not in facts:  # of a manifest
        facts = {"points": settings.get("samples"), "weights": settings.get("weights")}
    if "points" not in facts:
        raise InputError(f"{path}: it has no 'points'")
    domain = facts.get("domain")
    if domain is not None:
        check_choice(f"domain (in {path})", str(domain), _AXES)
    weights = facts.get("weights")
    points = _numbers(path, "points", facts["points"])
    return points, None if weights is None else _numbers(path, "weights", weights), domain


def _read_shader(path: Path) -> tuple[FloatArray, FloatArray | None, None]:
    arrays = list(_ARRAY.finditer(_COMMENT.sub(" ", read_text(path))))
    vectors = [found for found in arrays if found["vectors"]]
    weights = [_list(found["numbers"]) for found in arrays if found["numbers"] and "weight" in found["name"].lower()]
    if len(vectors) != 1 or len(weights) > 1:
        found = f"it has {len(vectors)} arrays of vectors and {len(weights)} of weights that are plain numbers"
        raise InputError(f"{path}: {found}, expected one of vectors and at most one of weights")
    rows = [_list(row) for row in re.findall(_NUMBERS + r"(?=\s*[)}])", vectors[0]["vectors"])]
    points = _numbers(path, vectors[0]["name"], rows)
    return points, _numbers(path, "weights", weights[0]) if weights else None, None


def _list(text: str) -> list[float]:
    return [float(number.strip().rstrip("fF")) for number in text.split(",")]


def _numbers(path: Path, key: str, value: Any) -> FloatArray:
    try:
        return np.array(value, np.float64)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{path}: its '{key}' are not a table of numbers") from None
