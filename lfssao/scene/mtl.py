"""Materials of OBJ files."""

import re
from dataclasses import dataclass, field

import numpy as np

from lfssao.scene.mesh import FloatArray

_SWITCHES = {"blendu", "blendv", "cc", "clamp"}
_VECTORS = {"o", "s", "t"}  # of one to three numbers
_WORDS = {"bm": 1, "boost": 1, "imfchan": 1, "mm": 2, "texres": 1, "type": 1}
_HARMLESS = {"blendu", "blendv", "bm", "boost", "texres", "type"}  # no colour is another, at most a little sharper


@dataclass
class Material:
    """A material: Kd, sRGB; an image with options; and sentences about parts of it that are left out.

    scale, offset: texture coordinates of the image are those of the file times scale plus offset, (2,) each. clamp:
    whether the image is not repeated.
    """

    color: FloatArray | None = None
    image: str | None = None
    scale: FloatArray = field(default_factory=lambda: np.ones(2))
    offset: FloatArray = field(default_factory=lambda: np.zeros(2))
    clamp: bool = False
    notes: list[str] = field(default_factory=list)


def read_materials(text: str) -> dict[str, Material]:
    """Return the materials of an MTL file by name; ValueError with the line of a number that is none."""
    found: dict[str, Material] = {}
    material = Material()
    for number, line in enumerate(text.split("\n"), 1):
        key, _, rest = line.strip().replace("\t", " ").partition(" ")
        rest, words = rest.strip(), rest.partition("#")[0].split()
        if not words:
            continue
        try:
            match key.lower():
                case "newmtl":
                    material = found[rest] = Material()
                case "kd":
                    _take_color(material, words)
                case "map_kd":
                    _take_image(material, rest)
                case "d" | "tr" if 0 < float(words[-1]) < 1 or (key == "d" and float(words[-1]) == 0):
                    material.notes.append(f"{key} {words[-1]} is left out: it is taken for opaque")
                case "map_d":
                    material.notes.append("map_d is left out: it is taken for opaque")
        except ValueError:
            raise ValueError(f"line {number}: '{line.strip():.60}' is no line of a material file") from None
    for name in list(found):  # comments behind names
        found.setdefault(name.partition("#")[0].strip(), found[name])
    return found


def _take_color(material: Material, words: list[str]) -> None:
    """Kd; of one number, it is that of all colours."""
    if words[0] in ("spectral", "xyz"):
        material.notes.append(f"Kd {words[0]} is left out: it is white")
        return
    values = np.array([float(word) for word in words])
    if len(values) not in (1, 3, 4):
        raise ValueError("no colour")
    material.color = np.repeat(values, 3) if len(values) == 1 else values[:3]


def _take_image(material: Material, rest: str) -> None:
    """The name of an image, which may have blanks, behind its options."""
    number = re.compile(r"([-+.\deE]+)\s+(?=\S)")
    while found := re.match(r"-(\w+)\s+", rest):
        option = found[1].lower()
        if option not in _SWITCHES | _VECTORS | _WORDS.keys():
            break
        rest = rest[found.end() :]
        values: list[str] = []
        if option in _VECTORS:
            while len(values) < 3 and (word := number.match(rest)):
                values.append(word[1])
                rest = rest[word.end() :]
        else:
            values = rest.split(None, _WORDS.get(option, 1))
            rest = values.pop() if len(values) > _WORDS.get(option, 1) else ""
        if not values or not rest:
            raise ValueError("an option without its values")
        _take_option(material, option, values)
    material.image = rest


def _take_option(material: Material, option: str, values: list[str]) -> None:
    if option in ("o", "s"):
        vector = material.offset if option == "o" else material.scale
        vector[: len(values)] = [float(value) for value in values[:2]]
    elif option == "clamp":
        material.clamp = values[0].lower() == "on"
    elif option not in _HARMLESS and values not in (["off"], ["0"] * len(values), ["0", "1"]):
        material.notes.append(f"map_Kd's option -{option} {' '.join(values)} is left out")
