"""Files that a mesh file names, and the memory that a mesh file makes its reader take."""

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from lfssao.core.memory import check_expansion
from lfssao.errors import InputError
from lfssao.files.whole import check_file

_NOT_IMAGES = (".mtl", ".bin")
Decoded = TypeVar("Decoded")


class Assets:
    """Gives a mesh file what it names; remembers what it could not give, refuses what takes too much memory.

    given: the texture that takes the place of those that the file names. trimesh asks it as its resolver.
    """

    def __init__(self, path: Path, given: NDArray[np.float32] | None = None) -> None:
        self._path = path
        self.given = given
        self._notes: list[str] = []
        self._missing: dict[str, str] = {}
        self._held = path.stat().st_size  # bytes of the file and of those that it names
        self._textures = 0  # bytes of memory

    def get(self, name: str) -> bytes:
        """Content of a file that the mesh file names. trimesh goes on without it silently."""
        ending = Path(name.strip()).suffix.lower()
        try:
            data = self.read(name)
        except FileNotFoundError:
            self._missing[name] = "is not there"
            raise
        except Exception as error:
            self._missing[name] = f"cannot be read ({reason_of(Path(name), error)})"
            raise
        if ending not in _NOT_IMAGES:
            self.try_image(name, data)
        return data

    __getitem__ = get

    def has(self, name: str) -> bool:
        """Whether there is a file that the mesh file names."""
        return self._place(name) is not None

    def read(self, name: str) -> bytes:
        """Content of a file that the mesh file names; FileNotFoundError or InputError if it cannot be read."""
        file = self._place(name)
        if file is None:
            raise FileNotFoundError(f"there is no '{name}' in its folder")
        check_file(file)
        data = file.read_bytes()
        self._held += len(data)
        return data

    def _place(self, name: str) -> Path | None:
        name = name.strip().replace("\\", "/")  # paths from Windows
        folder = self._path.absolute().parent.resolve()
        for candidate in (name, unquote(name), name.lstrip("/"), Path(name).name):  # a path of another machine, too
            file = (folder / candidate).resolve()
            if file.is_relative_to(folder) and file.exists() and not file.is_dir():
                return file
        return None

    def image(self, name: str, data: bytes | None, decode: Callable[[Any], Decoded]) -> Decoded:
        """Return an image that the mesh file names, or of these bytes, as ``decode`` makes it of Pillow's.

        InputError if it cannot be read, or if images take too much memory together.
        """
        try:
            with Image.open(io.BytesIO(self.read(name) if data is None else data)) as image:
                check_expansion("its texels", bytes_of(image), self._held)
                self.check_texture(image)
                return decode(image)
        except FileNotFoundError:
            problem = "is not there"
        except Exception as error:  # each of Pillow's readers has errors of its own
            problem = f"cannot be read ({reason_of(Path(name), error)})"
        raise InputError(f"{self._path}: it names the image '{name}', which {problem}")

    def try_image(self, name: str, data: bytes) -> None:
        """Remember an image that cannot be read."""
        try:
            with Image.open(io.BytesIO(data)) as image:
                check_expansion("its texels", bytes_of(image), self._held)
                image.load()
        except Exception as error:  # each of Pillow's readers has errors of its own
            self._missing[name] = f"cannot be read ({reason_of(Path(name), error)})"

    def check_images(self) -> None:
        """Refuse a mesh that names an image which is missing or broken, if none is given in its place."""
        if self.given is not None:
            return
        for name, problem in self._missing.items():
            if Path(name.strip()).suffix.lower() not in _NOT_IMAGES:
                raise InputError(f"{self._path}: it names the image '{name}', which {problem}")

    def check_texture(self, image: Any) -> None:
        """Refuse a mesh whose textures, with this one, take too much memory together."""
        self._textures += bytes_of(image)
        self.check("its textures", self._textures)

    def check(self, what: str, needed: float) -> None:
        """Refuse a mesh with a part that needs too many bytes of memory."""
        check_expansion(f"{self._path}: {what}", needed, self._held)

    def note(self, sentence: str) -> None:
        """Remember a sentence, if it is not empty, about a part of the file that is left out."""
        if sentence:
            self._notes.append(sentence)

    def notes(self) -> list[str]:
        """Sentences about all that is left out, each once: material files that are missing, and others."""
        missing = [
            f"it names '{name}', which {problem}: its materials are left out"
            for name, problem in self._missing.items()
            if name.strip().lower().endswith(".mtl")
        ]
        return list(dict.fromkeys([*missing, *self._notes]))


def bytes_of(image: Any) -> int:
    """Memory that an image of Pillow takes until it is a texture: by its reader, as codes, and as float32."""
    return 28 * int(image.width) * int(image.height)


def reason_of(path: Path, error: Exception) -> str:
    """Return the reason why reading failed, in words that do not need the libraries' source."""
    reason = " ".join(str(error).split())[:200] or type(error).__name__
    if isinstance(error, OSError) and error.strerror:
        reason = error.strerror
    elif isinstance(error, UnicodeDecodeError) or getattr(error, "name", None) == "charset_normalizer":
        # charset_normalizer is what trimesh asks to guess an encoding
        reason = f"its content is not what files ending in {path.suffix} hold"
    elif isinstance(error, ImportError):
        reason = f"no reader for it is installed: {reason}"
    elif isinstance(error, MemoryError):
        reason = "there is not enough memory"
    elif type(error).__name__ == "UnidentifiedImageError":
        reason = "it is of no known format"
    return reason
