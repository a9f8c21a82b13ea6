"""hypothesis strategies for lfssao's arguments, with keyword-only options; InputError for invalid limits and names."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

from lfssao.ao.textures import Buffers
from lfssao.core.arguments import as_number, check_whole
from lfssao.errors import InputError, check_choice, check_type, shown
from lfssao.optics.camera import PROJECTIONS, Camera
from lfssao.optics.display import Display, Module
from lfssao.samples.methods import METHODS
from lfssao.samples.registry import MOST, sample_set
from lfssao.samples.sets import SampleSet

_SCREENS = ("flat", "convex", "concave", "conical")
_ROI = ((-0.2, -0.15, -0.2), (0.2, 0.15, 0.2))


def _check_names(argument: str, names: Any, choices: Sequence[str]) -> None:
    """Refuse all but a list of at least one of the choices."""
    if not isinstance(names, tuple | list) or len(names) == 0:
        raise InputError(f"{argument} is {shown(names)}, it must be a list of some of {', '.join(choices)}")
    for name in names:
        check_choice(argument, name, choices)


def radii(*, least: float = 0.0, most: float = 1e30, zero: bool = True) -> SearchStrategy[float]:
    """Radii of the sampling ball: everyday ones, and the smallest and largest that are allowed.

    They lie between ``least`` and ``most``; with ``zero``, 0 is drawn, too.

    >>> strategy = lfssao.testing.radii(most=10.0)  # for @given(radius=strategy)
    """
    if not (0 <= as_number(least) <= as_number(most) <= 1e30 and most >= 1e-30):
        wanted = "they must be 0 <= least <= most, most from 1e-30 to 1e30"
        raise InputError(f"least and most are {shown(least)} and {shown(most)}, {wanted}")
    lowest = max(least, 1e-30)
    ordinary = st.floats(max(lowest, 1e-3), min(most, 1e3)) if lowest <= 1e3 and most >= 1e-3 else st.nothing()
    special = [lowest, most] + ([0.0] if zero and least <= 0 else [])
    return st.one_of(ordinary, st.floats(lowest, most), st.sampled_from(special))


def sample_sets(
    *, domain: str | None = None, methods: tuple[str, ...] | None = None, least: int = 1, most: int = 256
) -> SearchStrategy[SampleSet]:
    """Sample sets by any method, number and seed.

    The domain is 'square', 'sphere', 'ball' or 'disk', any by default. Methods are names, all of the domain by default.
    ``least`` and ``most`` limit the number of points; repulsion has at most 64.

    >>> strategy = lfssao.testing.sample_sets(domain="ball", most=64)  # for @given(samples=strategy)
    """
    if domain is not None:
        check_choice("domain", domain, METHODS)
    domains = [domain] if domain is not None else sorted(METHODS)
    if methods is not None:
        _check_names(
            "methods",
            methods,
            list(dict.fromkeys(name for each in domains for name in METHODS[each])),
        )
        domains = [each for each in domains if not METHODS[each].keys().isdisjoint(methods)]
    check_whole("most", most, check_whole("least", least, 1, MOST), MOST)
    return _sample_sets(domains, methods, least, most)


@st.composite
def _sample_sets(draw: DrawFn, domains: list[str], methods: tuple[str, ...] | None, least: int, most: int) -> SampleSet:
    domain = draw(st.sampled_from(domains))
    names = [name for name in METHODS[domain] if methods is None or name in methods]
    method = METHODS[domain][draw(st.sampled_from(names))]
    largest = most if method.most is None else min(most, method.most)
    n = draw(st.integers(min(least, largest), largest))
    seed = draw(st.integers(0, 2**64 - 1))
    return sample_set(domain, method.name, n, seed)


def cameras(*, projections: tuple[str, ...] = PROJECTIONS, distance: float = 10.0) -> SearchStrategy[Camera]:
    """Cameras that look at a point near the origin of world space, upright or tilted.

    Projections are 'perspective' and 'orthographic'. Cameras are 0.2 to 1 ``distance`` away, world units, at most 64
    degrees above or below. Relative to that, their view is 0.1 to 1.5 high, the near plane 0.01 to 0.5 and the far
    plane 1.5 to 10 away.

    >>> strategy = lfssao.testing.cameras(projections=("perspective",))  # for @given(camera=strategy)
    """
    _check_names("projections", projections, PROJECTIONS)
    if not 1e-20 <= as_number(distance) <= 1e20:
        raise InputError(f"distance is {shown(distance)}, it must be a number from 1e-20 to 1e20")
    return _cameras(projections, distance)


@st.composite
def _cameras(draw: DrawFn, projections: tuple[str, ...], distance: float) -> Camera:
    away = distance * draw(st.floats(0.2, 1))
    z = draw(st.floats(-0.9, 0.9))
    turn = draw(st.floats(0, 6.28))
    r = (1 - z * z) ** 0.5
    target = tuple(draw(st.floats(-0.1, 0.1)) * distance for _ in range(3))
    direction = (r * float(np.cos(turn)), z, r * float(np.sin(turn)))
    eye = tuple(t + away * d for t, d in zip(target, direction, strict=True))
    up = (draw(st.floats(-0.2, 0.2)), 1.0, draw(st.floats(-0.2, 0.2)))
    extent = away * draw(st.floats(0.1, 1.5))
    near = away * draw(st.floats(0.01, 0.5))
    far = away * draw(st.floats(1.5, 10))
    return Camera(draw(st.sampled_from(projections)), eye, target, up, extent, near, far)  # type: ignore[arg-type]


def displays(*, screens: tuple[str, ...] = _SCREENS, modules: int = 3, texels: int = 64) -> SearchStrategy[Display]:
    """Displays of one or a few modules, aligned to the screen or turned, the observers on a line or an arc.

    Screens are 'flat', 'convex', 'concave', and 'conical' for a flat one with the conical diffuser, 0.5 to 1.6 m wide
    and 0.3 to 1 m high, their radius 1.5 to 5 widths. Observers are 1.5 to 4 m before them, modules 0.6 to 1.5 m
    behind, none more than 0.3 m above or below the middle. ``modules`` and ``texels``, a side of a module's texture,
    are the most.

    >>> strategy = lfssao.testing.displays(screens=("flat",), texels=16)  # for @given(display=strategy)
    """
    _check_names("screens", screens, _SCREENS)
    check_whole("modules", modules, 1, 1000)
    check_whole("texels", texels, 1, 4096)
    return _displays(screens, modules, texels)


@st.composite
def _displays(draw: DrawFn, screens: tuple[str, ...], modules: int, texels: int) -> Display:
    screen = draw(st.sampled_from(screens))
    width = draw(st.floats(0.5, 1.6))
    height = draw(st.floats(0.3, 1.0))
    z_o = -draw(st.floats(1.5, 4))
    y_o = draw(st.floats(-0.3, 0.3))
    curvature = {"convex": 1, "concave": -1}.get(screen, 0) / (width * draw(st.floats(1.5, 5)))
    arc = draw(st.sampled_from([0.0, 0.5])) / -z_o if screen != "conical" else 0.0
    count = draw(st.integers(1, modules))
    lenses = []
    for k in range(count):
        x = 0.3 * ((2 * k + 1) / count - 1) + draw(st.floats(-0.1, 0.1))
        y = draw(st.floats(-0.2, 0.2))
        z = draw(st.floats(0.6, 1.5))
        size = draw(st.integers(1, texels)), draw(st.integers(1, texels))
        pose: dict[str, Any] = {}
        if draw(st.booleans()):
            pose = {
                "yaw": float(np.degrees(np.arctan2(-x, z))),
                "pitch": float(np.degrees(np.arctan2(-y, z))),
                "roll": draw(st.floats(-5, 5)),
                "field_of_view": draw(st.floats(20, 90)),
            }
        lenses.append(Module(x, y, z, *size, **pose))
    diffuser = "conical" if screen == "conical" else "linear"
    return Display("drawn", width, height, y_o, z_o, tuple(lenses), _ROI, diffuser, curvature, arc)


def gbuffers(
    *, dtype: Any = np.float32, most: int = 24, normals: bool = True, views: SearchStrategy[Any] | None = None
) -> SearchStrategy[Buffers]:
    """Textures of a view of a few texels: any depth, positions and normals, and texels without a surface.

    The textures agree on the texels without a surface, but need not show any scene. ``dtype`` is float32 or float64,
    ``most`` the largest number of texels of a side. ``normals`` adds a normals texture. ``views`` is a strategy of
    views, by default of cameras and single modules.

    >>> strategy = lfssao.testing.gbuffers(most=16)  # for @given(buffers=strategy)
    """
    if dtype not in ("float32", "float64", np.float32, np.float64):
        raise InputError(f"dtype is {shown(dtype)}, it must be float32 or float64")
    check_whole("most", most, 1, 4096)
    check_type("normals", normals, bool)
    check_type("views", views, SearchStrategy | None)
    return _gbuffers(dtype, most, normals, views)


@st.composite
def _gbuffers(draw: DrawFn, dtype: Any, most: int, normals: bool, views: SearchStrategy[Any] | None) -> Buffers:
    if views is None:
        side = st.integers(1, most)
        half = np.array([[0.5, 0, 0, 0], [0, 0.5, 0, 0], [0, 0, -0.5, 0]])
        modules = displays(modules=1, texels=most).map(lambda display: display.view(0, half))
        views = st.builds(Camera.view, cameras(), side, side) | modules
    view = draw(views)
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    shape = view.height, view.width
    low, high = draw(st.sampled_from([(-0.3, 0.3), (0.0, 1.0), (-1e-3, 1e-3), (-1e6, 1e6)]))
    depth = rng.uniform(low, high, shape).astype(dtype)
    positions = rng.uniform(-1, 1, (*shape, 3)).astype(dtype)
    directions = rng.normal(size=(*shape, 3))
    directions /= np.sqrt(np.sum(directions**2, axis=-1, keepdims=True))
    empty = rng.random(shape) < draw(st.sampled_from([0.0, 0.2, 1.0]))
    depth[empty] = np.inf
    positions[empty] = np.inf
    directions[empty] = 0
    return Buffers(view, depth, positions, directions.astype(dtype) if normals else None)
