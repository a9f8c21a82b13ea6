"""Values of a glTF's JSON, each checked as it is read: messages name the key, as accessors[3].count."""

from math import inf, isfinite
from typing import Any

from lfssao.core.arguments import as_number, as_whole
from lfssao.errors import InputError, shown

_NEEDED: Any = object()


class Item:
    """A JSON object, its file and where in the file it stands."""

    __slots__ = ("file", "place", "values")

    def __init__(self, file: str, place: str, values: Any) -> None:
        if not isinstance(values, dict):
            raise InputError(f"{file}: {place or 'its content'} is {shown(values)}, it must be a JSON object")
        self.file = file
        self.place = place
        self.values: dict[str, Any] = values

    def fault(self, words: str, key: str = "") -> InputError:
        """Return the error that this object, or a value of it, is wrong."""
        place = f"{self._under(key)} " if key else f"{self.place}: " if self.place else ""
        return InputError(f"{self.file}: {place}{words}")

    def _under(self, key: str) -> str:
        return f"{self.place}.{key}" if self.place else key

    def must(self, key: str, kind: str) -> InputError:
        """Return the error that a value is missing, or not what it must be."""
        if key not in self.values:
            return self.fault(f"is missing, it must be {kind}", key)
        return self.fault(f"is {shown(self.values[key])}, it must be {kind}", key)

    def whole(self, key: str, default: Any = _NEEDED, least: int = 0, most: int = 2**53) -> Any:
        """Return a whole number from ``least`` to ``most``; ``default`` where there is none."""
        if key not in self.values and default is not _NEEDED:
            return default
        number = as_whole(self.values.get(key))
        if number is None or not least <= number <= most:
            limits = f"of at least {least}" if most == 2**53 else f"from {least} to {most}"
            raise self.must(key, f"a whole number {limits}")
        return number

    def numbers(self, key: str, length: int | None, default: Any = _NEEDED) -> Any:
        """Finite numbers, ``length`` of them; ``default`` where there are none."""
        if key not in self.values and default is not _NEEDED:
            return default
        given: Any = self.values.get(key)
        whole = isinstance(given, list) and length in (None, len(given))
        if not whole or not {*map(type, given)} <= {int, float}:
            raise self.must(key, "numbers" if length is None else f"{length} numbers")
        try:
            found = [*map(float, given)]
        except OverflowError:
            found = [inf]
        if not all(map(isfinite, found)):
            raise self.fault(f"is {shown(given)}, which is not finite", key)
        return found

    def number(self, key: str, default: float) -> float:
        """Return a finite number."""
        found = as_number(self.values.get(key, default))
        if not isfinite(found):
            raise self.must(key, "a finite number")
        return found

    def text(self, key: str, default: Any = _NEEDED) -> Any:
        """Text; ``default`` where there is none."""
        found = self.values.get(key, default)
        if found is _NEEDED or (found is not default and not isinstance(found, str)):
            raise self.must(key, "text")
        return found

    def flag(self, key: str, default: bool) -> bool:
        """True or false."""
        found = self.values.get(key, default)
        if not isinstance(found, bool):
            raise self.must(key, "true or false")
        return found

    def item(self, key: str) -> "Item | None":
        """Return the JSON object under a key; None where there is none."""
        if key not in self.values:
            return None
        return Item(self.file, self._under(key), self.values[key])

    def items(self, key: str) -> "list[Item]":
        """Return the JSON objects of an array; none where there is no array."""
        place = self._under(key)
        return [Item(self.file, f"{place}[{n}]", each) for n, each in enumerate(self.array(key))]

    def array(self, key: str) -> list[Any]:
        """Return the values of an array; none where there is no array."""
        found = self.values.get(key, [])
        if not isinstance(found, list):
            raise self.must(key, "a JSON array")
        return found

    def extension(self, name: str) -> "Item | None":
        """Return the JSON object that an extension adds to this one; None where it adds none."""
        found = self.item("extensions")
        return None if found is None else found.item(name)
