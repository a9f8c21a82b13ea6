"""Numbers of accessors: any component type, stride and offset, sparse ones and integers that stand for fractions."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.scene.gltf.file import File
from lfssao.scene.gltf.item import Item

_DTYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
_INDICES = (5121, 5123, 5125)


def read_numbers(file: File, owner: Item, key: str, kinds: tuple[str, ...], fractions: bool = False) -> Any:
    """Return the numbers that a key names, (count, width) float64; None where there is no such key.

    kinds: types that the accessor may have. Normalised integers become 0 to 1, or -1 to 1; with ``fractions`` all
    integers are, as of colours and weights. InputError if the accessor is broken or of another type.
    """
    found = _read(file, owner, key, kinds)
    if found is None:
        return None
    item, values = found
    if values.dtype.kind == "f":
        numbers = values.astype(np.float64)
        if not np.isfinite(numbers).all():
            element = int(np.argmin(np.isfinite(numbers).all(axis=1)))
            raise item.fault(f"{key}: element {element} is not finite: {numbers[element].tolist()}")
        return numbers
    if not (item.flag("normalized", False) or fractions):
        return values.astype(np.float64)
    if values.dtype.itemsize == 4:
        raise item.fault("normalises 32-bit integers, which glTF does not allow", "normalized")
    return np.maximum(values / float(np.iinfo(values.dtype).max), -1.0)


def read_whole(file: File, owner: Item, key: str, kind: str) -> NDArray[np.int64] | None:
    """Return the unsigned whole numbers that a key names, (count, width); None where there is no such key."""
    found = _read(file, owner, key, (kind,))
    if found is None:
        return None
    item, values = found
    if values.dtype.kind != "u" or item.flag("normalized", False):
        raise item.fault(f"{key} must be unsigned integers")
    return values.astype(np.int64)


def _read(file: File, owner: Item, key: str, kinds: tuple[str, ...]) -> tuple[Item, NDArray[Any]] | None:
    number = file.number(owner, key, "accessors")
    if number is None:
        return None
    item = file.objects("accessors")[number]
    if number not in file.arrays:
        file.arrays[number] = _stored(file, item)
    kind, values = file.arrays[number]
    if kind not in kinds:
        raise item.fault(f"is {kind}, but {key} must be {' or '.join(kinds)}", "type")
    return item, values


def _stored(file: File, item: Item) -> tuple[str, NDArray[Any]]:
    """Type and stored numbers of an accessor."""
    kind = item.text("type")
    code = item.whole("componentType")
    count = item.whole("count", least=1)
    if kind not in _WIDTHS:
        raise item.must("type", f"one of {', '.join(_WIDTHS)}")
    if code not in _DTYPES:
        raise item.must("componentType", f"one of {', '.join(map(str, _DTYPES))}")
    dtype = np.dtype(_DTYPES[code])
    width = _WIDTHS[kind]
    file.claim("its accessors", count * width * 8)
    values = _elements(file, item, item, dtype, width, count)
    sparse = item.item("sparse")
    if sparse is None:
        return kind, np.zeros((count, width), dtype) if values is None else values
    values = np.zeros((count, width), dtype) if values is None else values.copy()
    changed = sparse.whole("count", least=1, most=count)
    places = sparse.item("indices")
    new = sparse.item("values")
    if places is None or new is None:
        raise sparse.must("indices" if places is None else "values", "a JSON object")
    code = places.whole("componentType")
    if code not in _INDICES:
        raise places.must("componentType", f"one of {', '.join(map(str, _INDICES))}")
    rows = _elements(file, places, item, np.dtype(_DTYPES[code]), 1, changed)
    stored = _elements(file, new, item, dtype, width, changed)
    if rows is None or stored is None:
        raise (places if rows is None else new).must("bufferView", "the number of a bufferView")
    rows = rows[:, 0].astype(np.int64)
    if (np.diff(rows) <= 0).any() or rows[-1] >= count:
        raise places.fault(f"must grow from one to the next, below {count}")
    values[rows] = stored
    return kind, values


def _elements(file: File, item: Item, accessor: Item, dtype: Any, width: int, count: int) -> NDArray[Any] | None:
    """Return elements where an object's bufferView and byteOffset say; None where it has no bufferView."""
    found = file.view(item)
    if found is None:
        return None
    view, data = found
    size = dtype.itemsize * width
    offset = item.whole("byteOffset", 0)
    stride = view.whole("byteStride", size, least=size) if item is accessor else size
    end = offset + stride * (count - 1) + size
    if end > len(data):
        raise item.fault(f"ends at byte {end} of {view.place}, which has {len(data)}")
    return np.ndarray((count, width), dtype, data, offset, (stride, dtype.itemsize))
