"""The container of a glTF: JSON with its buffers in files, within it or, in a GLB, behind it."""

import base64
import binascii
import json
import re
from collections import Counter
from functools import cached_property
from pathlib import Path
from typing import Any
from urllib.parse import unquote_to_bytes

from lfssao.core.memory import check_available
from lfssao.errors import InputError
from lfssao.scene.assets import Assets
from lfssao.scene.gltf.item import Item

_JSON = 0x4E4F534A
_BINARY = 0x004E4942


class File:
    """A glTF file: its JSON, its buffers and what was decoded of them.

    arrays, looks: accessors and materials that were read, by their numbers. images: those that were decoded.
    """

    def __init__(self, path: Path, data: bytes, assets: Assets) -> None:
        self.name = str(path)
        self.assets = assets
        self.arrays: dict[int, Any] = {}
        self.looks: dict[int, Any] = {}
        self.images: dict[tuple[str, bool], Any] = {}
        self._needed: Counter[str] = Counter()
        self._buffers: dict[int, memoryview] = {}
        text, self._binary = _chunks(self.name, data, assets) if data[:4] == b"glTF" else (data, None)
        try:
            values = json.loads(text.decode("utf-8-sig"))
        except (ValueError, RecursionError) as error:
            raise InputError(f"{path}: its JSON cannot be read ({error!s:.100})") from error
        self.root = Item(self.name, "", values)
        _check_version(self.root)
        self._objects: dict[str, list[Item]] = {}

    def objects(self, kind: str) -> list[Item]:
        """All objects of a kind, as "nodes"."""
        if kind not in self._objects:
            self._objects[kind] = self.root.items(kind)
        return self._objects[kind]

    def number(self, item: Item, key: str, kind: str) -> int | None:
        """Return the number of the object of a kind that a key names; None where there is no key."""
        number = item.whole(key, None)
        if number is not None and number >= len(self.objects(kind)):
            raise item.fault(f"is {number}, but there are {len(self.objects(kind))} {kind}", key)
        return None if number is None else int(number)

    def named(self, item: Item, key: str, kind: str) -> Item | None:
        """Return the object of a kind that a key names; None where there is no key."""
        number = self.number(item, key, kind)
        return None if number is None else self.objects(kind)[number]

    def claim(self, what: str, size: int, meant: bool = False) -> None:
        """Refuse what takes, with what was claimed for it before, more bytes of memory than there are.

        Refused is also what takes more than such a file can mean, but for copies, which are many for few bytes.
        """
        self._needed[what] += size
        if meant:
            check_available(f"{self.name}: {what}", self._needed[what])
        else:
            self.assets.check(what, self._needed[what])

    def view(self, item: Item) -> tuple[Item, memoryview] | None:
        """Return the bufferView that an object names, and its bytes; None where it names none."""
        view = self.named(item, "bufferView", "bufferViews")
        if view is None:
            return None
        number = self.number(view, "buffer", "buffers")
        if number is None:
            raise view.must("buffer", "the number of a buffer")
        start = view.whole("byteOffset", 0)
        length = view.whole("byteLength", least=1)
        buffer = self._buffer(number, view)
        if start + length > len(buffer):
            raise view.fault(f"ends at byte {start + length} of buffers[{number}], which has {len(buffer)}")
        return view, buffer[start : start + length]

    def _buffer(self, number: int, view: Item) -> memoryview:
        if number not in self._buffers:
            item = self.objects("buffers")[number]
            length = item.whole("byteLength", least=1)
            uri = item.text("uri", None)
            if uri is None and (number or self._binary is None):
                packed = [name for name in view.values.get("extensions", {}) if name.endswith("_meshopt_compression")]
                reason = f"its data are compressed by {packed[0]}, which is not read" if packed else "it has no data"
                raise item.fault(reason)
            data = self._binary if uri is None else self.content(item)
            assert data is not None
            if len(data) < length:
                raise item.fault(f"is {length}, but its data have {len(data)} bytes", "byteLength")
            self._buffers[number] = memoryview(data)[:length]
        return self._buffers[number]

    def content(self, item: Item) -> bytes:
        """Content of the file that an object's uri names, or of the uri itself."""
        uri = item.text("uri")
        if not uri.startswith("data:"):
            try:
                return self.assets.read(uri)
            except FileNotFoundError as error:
                raise item.fault(f"names '{uri:.60}', which is not there", "uri") from error
        head, comma, body = uri.partition(",")
        try:
            if not comma:
                raise ValueError("it has no comma")
            return base64.b64decode(body, validate=True) if head.endswith(";base64") else unquote_to_bytes(body)
        except (ValueError, binascii.Error) as error:
            raise item.fault(f"is data that cannot be decoded ({error})", "uri") from error

    @cached_property
    def extensions(self) -> tuple[list[str], list[str]]:
        """Names of the extensions that the file uses, and of those that it requires."""
        found = []
        for key in ("extensionsUsed", "extensionsRequired"):
            names = self.root.array(key)
            if not all(isinstance(name, str) for name in names):
                raise self.root.must(key, "names of extensions")
            found.append(names)
        return found[0], found[1]


def _chunks(name: str, data: bytes, assets: Assets) -> tuple[bytes, bytes | None]:
    """Return the JSON and the binary chunk of a GLB."""
    version, length = (int.from_bytes(data[start : start + 4], "little") for start in (4, 8))
    if len(data) < 12 or length > len(data):
        raise InputError(f"{name}: it ends too early: its header declares {length} bytes, there are {len(data)}")
    if version != 2:
        raise InputError(f"{name}: it is a GLB of version {version}, that of glTF {version}.0; only 2.0 is read")
    if length < len(data):
        assets.note(f"{len(data) - length} bytes after its end are left out")
    chunks: dict[int, bytes] = {}
    start = 12
    while start + 8 <= length:
        size, kind = (int.from_bytes(data[at : at + 4], "little") for at in (start, start + 4))
        if start + 8 + size > length:
            raise InputError(
                f"{name}: a chunk at byte {start} declares {size} bytes, of which {length - start - 8} are there"
            )
        if not chunks and kind != _JSON:
            raise InputError(f"{name}: its first chunk is of type {kind:#010x}, it must be JSON")
        chunks.setdefault(kind, data[start + 8 : start + 8 + size])
        start += 8 + size
    if not chunks:
        raise InputError(f"{name}: it is a GLB without a JSON chunk")
    return chunks[_JSON], chunks.get(_BINARY)


def _check_version(root: Item) -> None:
    """Refuse all but glTF 2.0."""
    asset = root.item("asset")
    if asset is None:
        raise root.fault("it is no glTF 2.0: asset.version is missing")
    for key, text in (("version", asset.text("version")), ("minVersion", asset.text("minVersion", "2.0"))):
        found = re.fullmatch(r"([0-9]{1,9})\.([0-9]{1,9})", text)
        if found is None:
            raise asset.must(key, "a version such as 2.0")
        if int(found[1]) != 2 or (key == "minVersion" and int(found[2]) > 0):
            raise InputError(f"{root.file}: it is glTF {text} (asset.{key}), only 2.0 is read")
