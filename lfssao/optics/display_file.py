"""Displays as TOML files: the presets, which are such files themselves, and those of users."""

import tomllib
from importlib import resources
from pathlib import Path
from typing import Any

from lfssao.core.elementary import sincospi
from lfssao.errors import InputError
from lfssao.optics.display import Display, Module

_LAYOUTS = ("line", "arc", "list")
_MISSING = object()

MOST_MODULES = 10_000  # a hundred times the largest display that is published; beyond it the number is a slip


def display_names() -> list[str]:
    """Names of the preset displays."""
    files = resources.files("lfssao.optics").joinpath("presets").iterdir()
    return sorted(entry.name.removesuffix(".toml") for entry in files if entry.name.endswith(".toml"))


def display_text(name: str) -> str:
    """The TOML file of a preset, with the source of every value, or the word 'assumed', in a comment.

    InputError if there is no preset of that name; the message lists those there are.
    """
    if name not in display_names():
        raise InputError(f"there is no display '{name}': choose one of {', '.join(display_names())}, or a .toml file")
    return resources.files("lfssao.optics").joinpath("presets", f"{name}.toml").read_text(encoding="utf-8")


def find_display(name: str | Path) -> Display:
    """A display: a preset by its name, or one read from a file whose name ends in .toml.

    InputError if there is none, the file cannot be read, or a value is wrong; the message names the key and the reason.
    """
    path = Path(name)
    if path.suffix != ".toml":
        return parse_display(display_text(str(name)), f"display {name}")
    return parse_display(read_text(path), str(path))


def read_text(path: Path) -> str:
    """The text of a file; InputError if it cannot be read."""
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, ValueError) as error:  # ValueError: not UTF-8, or a name that no file can have
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{path}: it cannot be read ({reason})") from error


def parse_display(text: str, origin: str) -> Display:
    """A display from the text of its TOML file; ``origin`` is the file's name in messages.

    InputError if it is no TOML, a key is missing or unknown, or a value is wrong.
    """
    root = _Table(parse_toml(text, origin), origin, "")
    screen, observer, roi, modules = (root.table(key) for key in ("screen", "observer", "roi", "modules"))
    distance = observer.number("distance")
    if not distance > 0:
        raise observer.wrong("distance", f"it is {distance}, the observers must be in front of the screen")
    try:
        display = Display(
            name=root.text("name"),
            diffuser=root.text("diffuser", "linear"),
            screen_width=screen.number("width"),
            screen_height=screen.number("height"),
            screen_curvature=_curvature(screen, ("flat", "convex", "concave")),
            observer_height=observer.number("height", 0.0),
            observer_z=-distance,
            observer_curvature=_curvature(observer, ("line", "arc"), distance),
            roi=(roi.numbers("min", 3), roi.numbers("max", 3)),
            modules=_modules(modules),
        )
    except InputError as error:
        message = str(error)
        raise InputError(message if message.startswith(origin) else f"{origin}: {message}") from error
    for table in (root, screen, observer, roi, modules):
        table.refuse_rest()
    return display


def parse_toml(text: str, origin: str) -> dict[str, Any]:
    """The values of a TOML file's text; InputError, with ``origin`` as its name, if it is none."""
    try:
        return tomllib.loads(text)
    except ValueError as error:  # TOMLDecodeError is one; so is Python's on numbers of thousands of digits
        raise InputError(f"{origin}: it is not a TOML file ({error})") from error
    except RecursionError as error:
        raise InputError(f"{origin}: it is not a TOML file (its values are nested too deeply)") from error


def _curvature(table: "_Table", shapes: tuple[str, ...], default_radius: float | None = None) -> float:
    """1 / radius with its sign: 0 for the first shape, positive for the second, negative for the third."""
    shape = table.text("shape", shapes[0])
    if shape not in shapes:
        raise table.wrong("shape", f"'{shape}' is not one of {', '.join(shapes)}")
    if shape == shapes[0]:
        return 0.0
    radius = table.number("radius", _MISSING if default_radius is None else default_radius)
    if not radius > 0:
        raise table.wrong("radius", f"it is {radius}, it must be positive")
    sign = 1.0 if shape == shapes[1] else -1.0
    return float(sign / radius)


def _modules(table: "_Table") -> tuple[Module, ...]:
    layout = table.text("layout")
    if layout not in _LAYOUTS:
        raise table.wrong("layout", f"'{layout}' is not one of {', '.join(_LAYOUTS)}")
    if layout == "list":
        modules = []
        for entry in table.tables("list"):
            optics = _optics(entry)
            modules.append(Module(entry.number("x"), entry.number("y", 0.0), entry.number("z"), **optics))
            entry.refuse_rest()
        return tuple(modules)
    count = table.whole("count", MOST_MODULES)
    y, optics = table.number("y", 0.0), _optics(table)
    if layout == "line":
        first, last = table.numbers("x", 2)
        z = table.number("z")
        return tuple(Module(_step(first, last, k, count), y, z, **optics) for k in range(count))
    return _arc(table, count, y, optics)


def _arc(table: "_Table", count: int, y: float, optics: dict[str, Any]) -> tuple[Module, ...]:
    """Modules on an arc about the vertical axis through (0, center_z); where they have a field of view, facing it."""
    radius, centre = table.number("radius"), table.number("center_z", 0.0)
    first, last = table.numbers("angles", 2)
    modules = []
    for k in range(count):
        angle = _step(first, last, k, count)
        sine, cosine = sincospi(angle / 180.0)
        turned = {**optics, "yaw": optics["yaw"] - angle} if optics["field_of_view"] is not None else optics
        modules.append(Module(radius * sine, y, centre + radius * cosine, **turned))
    return tuple(modules)


def _step(first: float, last: float, k: int, count: int) -> float:
    """Place k of ``count`` from first to last, both included; their middle where there is one."""
    if count == 1:
        return 0.5 * first + 0.5 * last
    return (first * (count - 1 - k) + last * k) / (count - 1)


def _optics(table: "_Table") -> dict[str, Any]:
    width, height = table.numbers("resolution", 2)
    if width != int(width) or height != int(height):
        raise table.wrong("resolution", f"it is [{width}, {height}], it must be two whole numbers of texels")
    return {
        "width": int(width),
        "height": int(height),
        "yaw": table.number("yaw", 0.0),
        "pitch": table.number("pitch", 0.0),
        "roll": table.number("roll", 0.0),
        "field_of_view": table.number("field_of_view", None),
        "homography": table.numbers("homography", 9, None),
        "k1": table.number("k1", 0.0),
        "k2": table.number("k2", 0.0),
    }


def _short(value: Any) -> str:
    """A value as a message shows it."""
    text = "a huge number" if isinstance(value, int) and abs(value) >= 10**40 else repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300


class _Table:
    """A table of a TOML file that knows its name and which of its keys were asked for."""

    def __init__(self, values: dict[str, Any], origin: str, path: str) -> None:
        self._values = values
        self._origin = origin
        self._path = path
        self._known: set[str] = set()

    def wrong(self, key: str, reason: str) -> InputError:
        return InputError(f"{self._origin}: {self._path}{key}: {reason}")

    def _get(self, key: str, default: Any = _MISSING) -> Any:
        self._known.add(key)
        if key in self._values:
            return self._values[key]
        if default is _MISSING:
            raise self.wrong(key, "it is missing")
        return default

    def table(self, key: str) -> "_Table":
        value = self._get(key)
        if not isinstance(value, dict):
            raise self.wrong(key, "it must be a table")
        return _Table(value, self._origin, f"{self._path}{key}.")

    def tables(self, key: str) -> list["_Table"]:
        value = self._get(key)
        if not isinstance(value, list) or not all(isinstance(entry, dict) for entry in value):
            raise self.wrong(key, "it must be an array of tables")
        return [_Table(entry, self._origin, f"{self._path}{key}[{k}].") for k, entry in enumerate(value)]

    def text(self, key: str, default: Any = _MISSING) -> str:
        value = self._get(key, default)
        if not isinstance(value, str) or not value:
            raise self.wrong(key, f"it is {_short(value)}, it must be a text")
        return value

    def number(self, key: str, default: Any = _MISSING) -> Any:
        """A number, float; or the default."""
        value = self._get(key, default)
        if value is default and default is not _MISSING:
            return value
        if not _is_number(value):
            raise self.wrong(key, f"it is {_short(value)}, it must be a finite number")
        return float(value)

    def whole(self, key: str, most: int) -> int:
        """A whole number from 1 to ``most``."""
        value = self._get(key)
        if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= most:
            raise self.wrong(key, f"it is {_short(value)}, it must be a whole number from 1 to {most}")
        return value

    def numbers(self, key: str, count: int, default: Any = _MISSING) -> Any:
        """Floats of a list of ``count`` numbers, a tuple; or the default."""
        value = self._get(key, default)
        if value is default and default is not _MISSING:
            return value
        if not isinstance(value, list) or len(value) != count or not all(map(_is_number, value)):
            raise self.wrong(key, f"it is {_short(value)}, it must be a list of {count} finite numbers")
        return tuple(float(v) for v in value)

    def refuse_rest(self) -> None:
        """Refuse keys that nothing asked for."""
        unknown = [key for key in self._values if key not in self._known]
        if unknown:
            known = ", ".join(sorted(self._known))
            raise self.wrong(unknown[0], f"there is no such key, choose from {known}")
