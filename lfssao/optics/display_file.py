"""Displays of all kinds as TOML files: the presets, which are such files themselves, and those of users."""

import tomllib
from collections.abc import Callable, Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, Self, TypeVar, runtime_checkable

from lfssao.core.affine import Matrix
from lfssao.core.elementary import sincospi
from lfssao.errors import InputError, check_choice, check_type, errors_of, no_such
from lfssao.files.whole import read_text
from lfssao.optics.display import Display, Module
from lfssao.optics.view import View, finite_numbers

if TYPE_CHECKING:
    from lfssao.optics.lenslet import LensletDisplay
    from lfssao.optics.quilt import Quilt

KINDS = "modules", "quilt", "lenslet"  # of displays in files

_MISSING = object()

_MOST_BITS = 14_000  # of a whole number; of more Python refuses to write the digits
_PRESETS = resources.files("lfssao.optics").joinpath("presets")
MOST_MODULES = 10_000  # a hundred times the largest display that is published; beyond it the number is a slip


@runtime_checkable
class ViewSet(Protocol):
    """Cameras' views that show a scene together, each by Algorithm 1: a ``Quilt``, or a ``LensletDisplay``'s lenses."""

    KIND: ClassVar[str]
    WORDS: ClassVar[tuple[str, str]]  # for one view, and for several
    TITLE: ClassVar[str]
    __dataclass_fields__: ClassVar[dict[str, Any]]

    @property
    def name(self) -> str:
        """Its name in messages, files and the manifest."""

    @property
    def roi(self) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """Lower and upper corner of the box of physical space that a scene is fitted into, metres."""

    @property
    def screen_width(self) -> float:
        """Width of the screen, metres."""

    @property
    def screen_height(self) -> float:
        """Height of the screen, metres."""

    @property
    def count(self) -> int:
        """How many views there are."""

    @property
    def summary(self) -> str:
        """Its parts in words."""

    @property
    def sizes(self) -> set[tuple[int, int]]:
        """Width and height of its views, texels."""

    def with_resolution(self, width: int, height: int) -> Self:
        """Return the same with textures of another size, texels."""

    def view(self, index: int, physical_from_world: Matrix, guard: int = 0) -> View:
        """Return the view of a number, as of ``Display.view``."""


Views = TypeVar("Views", bound=ViewSet)


def display_names(kind: str = "modules") -> list[str]:
    """Names of the preset displays of a kind: modules, quilt or lenslet. InputError if the kind is none of these.

    >>> "sample-a" in lfssao.display_names(), lfssao.display_names("quilt")
    (True, ['looking-glass-go', 'looking-glass-portrait'])
    """
    check_choice("kind", kind, KINDS)
    files = [file for file in _PRESETS.iterdir() if file.name.endswith(".toml")]
    named = {file.name.removesuffix(".toml"): tomllib.loads(file.read_text(encoding="utf-8")) for file in files}
    return sorted(name for name, values in named.items() if values.get("kind", "modules") == kind)


def display_text(name: str) -> str:
    """Return the TOML file of a preset, with the source of every value, or the word 'assumed', in a comment.

    InputError if there is no preset of that name; the message lists those there are.

    >>> lfssao.display_text("virtual").splitlines()[1]
    'name = "virtual"'
    """
    names = [name for kind in KINDS for name in display_names(kind)]
    if name not in names:
        raise no_such("display", name, [*names, "or FILE.toml"])
    return _PRESETS.joinpath(f"{name}.toml").read_text(encoding="utf-8")


def find_views(name: str | Path | Display | ViewSet) -> Display | ViewSet:
    """Return a display of any kind: a preset by its name, one of a file whose name ends in .toml, or itself.

    InputError if there is none, the file cannot be read, or a value is wrong; the message names the key and the reason.

    >>> lfssao.find_views("looking-glass-go").with_resolution(93, 171).count
    66
    """
    if not isinstance(name, str | Path):
        check_type("display", name, Display | ViewSet)
        return name
    path = Path(name)
    if path.suffix != ".toml":
        return parse_display(display_text(str(name)), f"display {name}")
    return parse_display(read_text(path), str(path))


def find_display(name: str | Path | Display | ViewSet) -> Display:
    """Return a display of modules, as ``find_views`` finds it; InputError for one of another kind too.

    >>> len(lfssao.find_display("sample-a").modules)
    21
    """
    found = find_views(name)
    if isinstance(found, ViewSet):
        raise InputError(f"display {found.name}: it is {found.TITLE}, here a display of modules is needed")
    return found


def parse_display(text: str, origin: str) -> Display | ViewSet:
    """Return a display from the text of its TOML file, of the name ``origin`` in messages.

    Its kind is modules (default), quilt or lenslet.

    InputError if it is no TOML, a key is missing or unknown, or a value is wrong.

    >>> lfssao.parse_display(lfssao.display_text("virtual"), "mine.toml").name
    'virtual'
    """
    check_type("text", text, str)
    root = Table(parse_toml(text, origin))
    with errors_of(origin):
        kind = root.choice("kind", KINDS, "modules")
        if kind != "modules":
            return _quilt(root) if kind == "quilt" else _lenslet(root)
        screen, observer, roi, modules = (root.table(key) for key in ("screen", "observer", "roi", "modules"))
        distance = observer.numbers("distance")
        if not distance > 0:
            raise observer.wrong("distance", f"it is {distance}, the observers must be in front of the screen")
        display = Display(
            name=root.text("name"),
            diffuser=root.text("diffuser", "linear"),
            screen_width=screen.numbers("width"),
            screen_height=screen.numbers("height"),
            screen_curvature=_curvature(screen, ("flat", "convex", "concave")),
            observer_height=observer.numbers("height", default=0.0),
            observer_z=-distance,
            observer_curvature=_curvature(observer, ("line", "arc"), distance),
            roi=(roi.numbers("min", 3), roi.numbers("max", 3)),
            modules=_modules(modules),
        )
        for table in (root, screen, observer, roi, modules):
            table.refuse_rest()
    return display


def _quilt(root: "Table") -> "Quilt":
    from lfssao.optics.quilt import MOST_VIEWS, Quilt  # late: most displays have modules

    numbers = "aspect", "screen_height", "field_of_view", "view_cone"
    counts = {key: root.whole(key, MOST_VIEWS) for key in ("columns", "rows")}
    return _view_set(Quilt, root, numbers, **counts, spacing=root.text("spacing", "ends"))


def _lenslet(root: "Table") -> "LensletDisplay":
    from lfssao.optics.lenslet import LensletDisplay  # late: most displays have modules

    numbers = "panel_width", "panel_height", "lens_pitch", "image_pitch", "gap", "focal_length", "observer_distance"
    return _view_set(LensletDisplay, root, numbers, middle=root.text("middle", "lens"))


def _view_set(kind: Callable[..., Views], root: "Table", numbers: Sequence[str], **more: Any) -> Views:
    """Return views of a display that the root table describes, by what all kinds have, numbers, and ``more``."""
    roi = root.table("roi")
    width, height = root.resolution()
    views = kind(
        name=root.text("name"),
        width=width,
        height=height,
        roi=(roi.numbers("min", 3), roi.numbers("max", 3)),
        **{key: root.numbers(key) for key in numbers},
        **more,
    )
    root.refuse_rest()
    roi.refuse_rest()
    return views


def set_of(values: Mapping[str, Any]) -> "Quilt | LensletDisplay | None":
    """Return the quilt or lenslet display that a manifest's ``values`` describe; None if they describe none.

    Whatever else than an InputError is raised, such as a KeyError, says that they are not what a display has.
    """
    given = next((values[kind] for kind in KINDS if values.get(kind) is not None), None)
    if given is None:
        return None
    from lfssao.optics.lenslet import LensletDisplay  # late: most displays have modules
    from lfssao.optics.quilt import Quilt

    numbers: Any = {**given, "roi": tuple(map(tuple, given["roi"]))}
    return Quilt(**numbers) if values.get(Quilt.KIND) is not None else LensletDisplay(**numbers)


def parse_toml(text: str, origin: str) -> dict[str, Any]:
    """Return the values of a TOML file's text; InputError, with ``origin`` as its name, if it is none."""
    try:
        values = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # of the syntax, numbers of thousands of digits, values too deep
        raise InputError(f"{origin}: it is not a TOML file ({error})") from error
    rest: list[Any] = [values]
    while rest:
        value = rest.pop()
        rest += value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
        if isinstance(value, int) and value.bit_length() > _MOST_BITS:
            raise InputError(f"{origin}: it is not a TOML file (a whole number of thousands of digits)")
    return values


def _curvature(table: "Table", shapes: tuple[str, ...], default_radius: Any = _MISSING) -> float:
    """1 / radius with its sign: 0 for the first shape, positive for the second, negative for the third."""
    shape = table.choice("shape", shapes, shapes[0])
    if shape == shapes[0]:
        return 0.0
    radius = table.numbers("radius", default=default_radius)
    if not radius > 0:
        raise table.wrong("radius", f"it is {radius}, it must be positive")
    return float((1.0 if shape == shapes[1] else -1.0) / radius)


def _modules(table: "Table") -> tuple[Module, ...]:
    layout = table.choice("layout", ("line", "arc", "list"))
    if layout == "list":
        modules = []
        for entry in table.tables("list"):
            place = entry.numbers("x"), entry.numbers("y", default=0.0), entry.numbers("z")
            modules.append(Module(*place, **_optics(entry)))
            entry.refuse_rest()
        return tuple(modules)
    count = table.whole("count", MOST_MODULES)
    y = table.numbers("y", default=0.0)
    optics = _optics(table)
    if layout == "line":
        first, last = table.numbers("x", 2)
        z = table.numbers("z")
        return tuple(Module(_step(first, last, k, count), y, z, **optics) for k in range(count))
    return _arc(table, count, y, optics)


def _arc(table: "Table", count: int, y: float, optics: dict[str, Any]) -> tuple[Module, ...]:
    """Modules on an arc about the vertical axis through (0, center_z); where they have a field of view, facing it."""
    radius = table.numbers("radius")
    centre = table.numbers("center_z", default=0.0)
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


def _optics(table: "Table") -> dict[str, Any]:
    width, height = table.resolution()
    optics = {name: table.numbers(name, default=0.0) for name in ("yaw", "pitch", "roll", "k1", "k2")}
    optics["field_of_view"] = table.numbers("field_of_view", default=None)
    optics["homography"] = table.numbers("homography", 9, default=None)
    return {"width": width, "height": height, **optics}


class Table:
    """A table of a file that knows its path and which of its keys were asked for."""

    def __init__(self, values: dict[str, Any], path: str = "") -> None:
        self._values = values
        self._path = path
        self._known: set[str] = set()

    def wrong(self, key: str, reason: str) -> InputError:
        """The error that says why a key's value is refused."""
        return InputError(f"{self._path}{key}: {reason}")

    def _get(self, key: str, default: Any = _MISSING) -> Any:
        self._known.add(key)
        value = self._values.get(key, default)
        if value is _MISSING:
            raise self.wrong(key, "it is missing")
        return value

    def table(self, key: str) -> "Table":
        """Return a table in the table."""
        value = self._get(key)
        if not isinstance(value, dict):
            raise self.wrong(key, "it must be a table")
        return Table(value, f"{self._path}{key}.")

    def tables(self, key: str) -> list["Table"]:
        """Return an array of tables."""
        value = self._get(key)
        if not isinstance(value, list) or not all(isinstance(entry, dict) for entry in value):
            raise self.wrong(key, "it must be an array of tables")
        return [Table(entry, f"{self._path}{key}[{k}].") for k, entry in enumerate(value)]

    def text(self, key: str, default: Any = _MISSING) -> Any:
        """A text that is not empty, or the default."""
        value = self._get(key, default)
        if value is not default and (not isinstance(value, str) or not value):
            raise self.wrong(key, f"it is {value!r:.60}, it must be a text")
        return value

    def choice(self, key: str, choices: tuple[str, ...], default: Any = _MISSING) -> str:
        """One of some texts."""
        value: str = self.text(key, default)
        with errors_of(f"{self._path}{key}"):
            check_choice(key, value, choices)
        return value

    def whole(self, key: str, most: int) -> int:
        """Return a whole number from 1 to ``most``."""
        value = self._get(key)
        if type(value) is not int or not 1 <= value <= most:
            raise self.wrong(key, f"it is {value!r:.60}, it must be a whole number from 1 to {most}")
        return value

    def numbers(self, key: str, *count: int, default: Any = _MISSING) -> Any:
        """Return a float, or a tuple of ``count`` floats; or the default."""
        value = self._get(key, default)
        if value is default:
            return value
        found = finite_numbers(f"{self._path}{key}", value, *count).tolist()
        return tuple(found) if count else found

    def resolution(self, key: str = "resolution") -> tuple[int, int]:
        """Two whole numbers of texels."""
        width, height = self.numbers(key, 2)
        if width != int(width) or height != int(height):
            raise self.wrong(key, f"it is [{width}, {height}], it must be two whole numbers of texels")
        return int(width), int(height)

    def refuse_rest(self) -> None:
        """Refuse keys that nothing asked for."""
        for key in self._values:
            with errors_of(f"{self._path}{key}"):
                check_choice("key", key, sorted(self._known))
