"""Changes of the numbers of a display file, a quilt or a camera.

A changed display gives another view. Depth, positions and occlusion of a wrong renderer are those of that view, so a
change with the same value is tried on all of them, and in all modules.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import atan, degrees, hypot, pi, radians, tan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.core.affine import Matrix, transform_points
from lfssao.errors import InputError
from lfssao.gbuffer.caster import RayCaster
from lfssao.optics.camera import with_lens
from lfssao.optics.display import Display, Module
from lfssao.optics.kernels.projection import CROSSED_SLITS, MATRIX
from lfssao.optics.kernels.rays import write_lines
from lfssao.optics.quilt import SPACINGS, Quilt
from lfssao.optics.view import DIFFUSERS, View, WorldToImage
from lfssao.verify.bounds.bounds import FloatArray
from lfssao.verify.diagnosis.change import Axis, Change, literal

_PARALLEL = 1e-6  # difference of axes of parallel cameras
CORNERS = "texel corners in place of centres"


@dataclass(frozen=True, eq=False)
class Sight:
    """The rays and the mapping of a renderer's view, with the display, quilt or camera behind them."""

    view: View
    display: Display | None = None  # the view's display with this module alone; None for a camera
    middle: float = 0.5  # coordinate of a ray inside its texel, along u and v
    pinhole: bool = False  # whether rays meet in the lens in both axes
    quilt: tuple[Quilt, int, Matrix] | None = None  # of a camera's view: quilt, number, and world -> physical

    def __post_init__(self) -> None:
        if self.pinhole and self.view.rays.kind != CROSSED_SLITS:
            raise InputError("a pinhole has aligned texels and no distortion")

    @property
    def mapping(self) -> WorldToImage:
        """The mapping world -> image. A pinhole has image z 1 / (lens z - z), increasing with z (``to_image_z``)."""
        view = self.view
        if not self.pinhole:
            return view.world_to_image
        m_x, m_z, _, _, u_scale, u_0, v_scale, v_0 = view.lens.tolist()
        x, y, z = np.array(view.cast_from_world, np.float64)
        denominator = np.array([0.0, 0.0, 0.0, m_z]) - z
        right = np.array([0.0, 0.0, 0.0, m_x])
        up = np.array([0.0, 0.0, 0.0, self.module.y])
        u = (u_0 + u_scale * m_x) * denominator + u_scale * m_z * (x - right)
        v = (v_0 + v_scale * self.module.y) * denominator + v_scale * m_z * (y - up)
        return WorldToImage(MATRIX, np.concatenate([u, v, [0.0, 0.0, 0.0, 1.0], denominator]))

    @property
    def screen(self) -> Display:
        """The display of the view, which is not a camera's."""
        assert self.display is not None
        return self.display

    @property
    def module(self) -> Module:
        """The display's only module."""
        return self.screen.modules[0]

    def to_image_z(self, depth: NDArray[Any]) -> NDArray[Any]:
        """Image z of depths, +infinity without a surface."""
        if not self.pinhole:
            return depth  # a linear camera's depth is image z already
        with np.errstate(all="ignore"):
            return np.where(np.isfinite(depth), 1 / (self.view.lens[1] - depth.astype(np.float64)), np.inf)

    def from_image_z(self, image_z: FloatArray) -> FloatArray:
        """Depth of image z, the inverse of ``View.image_z``."""
        perspective = self.view.linear and not self.view.lens[6]
        return np.asarray(-1 / image_z) if perspective else image_z

    def lines(self, columns: NDArray[Any], rows: NDArray[Any]) -> FloatArray:
        """Rays of texels as lines in world space, (K, 8) (``lfssao.optics.kernels.rays.write_lines``)."""
        view = self.view
        lens = self.view.lens
        lines = np.empty((len(columns), 8))
        if self.pinhole:
            lens = lens.copy()
            lens[2:4] = self.module.y, lens[1]
        u = columns + self.middle
        v = rows + self.middle
        write_lines(replace(view, lens=lens).rays, np.ravel(view.world_from_cast), u, v, lines)
        if self.pinhole:
            lines[:, 6] = view.lens[3]
        return lines

    def points(self, columns: NDArray[Any], rows: NDArray[Any], depth: FloatArray) -> FloatArray:
        """World points, (K, 3), of texels at a depth."""
        lines = self.lines(columns, rows)
        z = self.view.cast_z(np.asarray(depth, np.float64))
        return np.asarray(lines[:, :3] + z[:, None] * (lines[:, 3:6] - lines[:, :3]))

    def cast(self, caster: RayCaster, cast_from_world: Matrix, columns: NDArray[Any], rows: NDArray[Any]) -> FloatArray:
        """Depths, (K,), of texels' rays into a mesh; its caster is in another sight's cast space."""
        lines = self.lines(columns, rows)
        for k in (0, 3):
            lines[:, k : k + 3] = transform_points(cast_from_world, lines[:, k : k + 3])
        return self.view.depth_at(caster.first_depths(lines))

    def with_display(self, display: Display, cast: Matrix | None = None) -> "Sight":
        """The sight with another display, or another map to physical space."""
        view = self.view
        made = display.view(0, view.cast_from_world if cast is None else cast, view.guard)
        return replace(self, view=replace(made, name=view.name), display=display)

    def with_module(self, **changes: Any) -> "Sight":
        """The sight with other numbers of the module."""
        return self.with_display(replace(self.screen, modules=(replace(self.module, **changes),)))

    def with_quilt(self, **changes: Any) -> "Sight":
        """The sight with other numbers of the quilt."""
        assert self.quilt is not None
        quilt, index, physical_from_world = self.quilt
        made = replace(quilt, **changes).view(index, physical_from_world, self.view.guard)
        return replace(self, view=replace(made, name=self.view.name))

    def with_screen(self, **changes: Any) -> "Sight":
        """The sight with other numbers of screen, observers or diffuser."""
        return self.with_display(replace(self.screen, **changes))


def sight_of(view: View, display: Display | Quilt | None, index: int | None) -> Sight:
    """The sight of a view: of module ``index``, of slits without a display, of a quilt's view, or of a camera.

    The display's region of interest is left out, as changed displays need not contain it; ``display`` may have any
    resolution.
    """
    if isinstance(display, Quilt):
        return Sight(view, quilt=_quilt_of_view(view, display, index or 0))
    if view.screen_to_world is not None or (display is None and view.rays.kind != CROSSED_SLITS):
        return Sight(view)
    width = view.width - 2 * view.guard
    height = view.height - 2 * view.guard
    tiny = ((-1e-9, -1e-9, -1e-9), (1e-9, 1e-9, 1e-9))
    if display is None or index is None:
        m_x, m_z, y_o, z_o, u_scale, _, v_scale, _ = view.lens.tolist()
        module = Module(m_x, 0.0, m_z, width, height)
        return Sight(view, Display("slits", width / u_scale, -height / v_scale, y_o, z_o, (module,), tiny))
    display = display.with_resolution(width, height)
    return Sight(view, replace(display, modules=(display.modules[index],), roi=tiny))


def _quilt_of_view(view: View, quilt: Quilt, index: int) -> tuple[Quilt, int, Matrix] | None:
    """The quilt in the view's resolution, the view's number and world -> physical; None if it is not the quilt's view.

    The near plane's distance gives the number of scene units in a metre (``Quilt.view``).
    """
    try:
        quilt = quilt.with_resolution(view.width - 2 * view.guard, view.height - 2 * view.guard)
        units = view.lens[4] / quilt.view(index, np.eye(3, 4)).lens[4]
        physical = np.array(view.cast_from_world, np.float64) / units
        physical[:, 3] += quilt.eye_x(index), 0.0, -quilt.distance
        remade = quilt.view(index, physical, view.guard)
    except InputError:
        return None
    alike = np.allclose(remade.lens, view.lens, rtol=1e-6) and np.allclose(remade.cast_from_world, view.cast_from_world)
    return (quilt, index, physical) if alike else None


def view_changes(sight: Sight, centre: FloatArray | None, others: Mapping[str, Sight]) -> list[Change]:
    """Changes of a sight: numbers of its display or camera, and those of ``others``, by name.

    A scene is scaled about ``centre``, (3,) metres, the centre of the region of interest. ``Problem.with_sight``
    returns the changed problem; a display that cannot exist gives none.
    """
    changes = [_sight_change(f"the mapping of {name}", lambda _, other=other: other) for name, other in others.items()]
    if sight.display is not None:
        changes += _display_changes(sight, sight.display)
        if centre is not None:
            changes += _placement_changes(centre)
    elif sight.quilt is not None:
        changes += [*_quilt_changes(sight.quilt[0]), *_camera_changes(sight)]
    elif sight.view.screen_to_world is not None:
        changes += [*_camera_changes(sight), *_separation_changes(sight, list(others.values()))]
    changes.append(_sight_change(CORNERS, lambda s: replace(s, middle=0.0)))
    return changes


def _sight_change(kind: str, make: Callable[..., Sight], *axes: Axis, words: str = "") -> Change:
    """A change of the sight, with a value for each axis."""

    def apply(problem: Any, values: tuple[float, ...]) -> Any:
        try:
            return problem.with_sight(make(problem.sight, *values))
        except InputError:
            return None

    return Change(kind, apply, words or literal(kind), axes, shared=True)


_FACTOR = Axis(1e-5, 0.7, factor=True, number=14)
_METRES = Axis(2e-6, 0.5, number=14)
_DEGREES = Axis(1e-4, 20.0)
_UNITS = Axis(1e-6, 1.0)


def _factor_change(kind: str, make: Callable[[Sight, float], Sight]) -> Change:
    return _sight_change(kind, make, _FACTOR, words=f"{kind} x {{}}")


def _offset_change(kind: str, make: Callable[[Sight, float], Sight], axis: Axis = _METRES, unit: str = " m") -> Change:
    return _sight_change(kind, make, axis, words=f"{kind} {{}}{unit}")


def _display_changes(sight: Sight, display: Display) -> Iterator[Change]:
    """Yield changes of the display's numbers that the view depends on."""
    module = display.modules[0]
    aligned = module.homography is None and module.field_of_view is None
    yield _factor_change("observer distance", lambda s, f: s.with_screen(observer_z=s.screen.observer_z * f))
    yield _offset_change("observer height", lambda s, h: s.with_screen(observer_height=s.screen.observer_height + h))
    yield _offset_change("lens x", lambda s, d: s.with_module(x=s.module.x + d))
    if display.diffuser == "conical" or display.screen_curvature or not aligned:  # otherwise it has no effect
        yield _offset_change("lens y", lambda s, d: s.with_module(y=s.module.y + d))
    yield _factor_change("lens z", lambda s, f: s.with_module(z=s.module.z * f))
    if aligned:
        yield _factor_change("screen width", lambda s, f: s.with_screen(screen_width=s.screen.screen_width * f))
        yield _factor_change("screen height", lambda s, f: s.with_screen(screen_height=s.screen.screen_height * f))
    for name, noun in (("screen_curvature", "screen radius"), ("observer_curvature", "observer radius")):
        if getattr(display, name):
            yield _factor_change(noun, partial(_with_radius, name))
            yield _sight_change(f"no {noun}", lambda s, name=name: s.with_screen(**{name: 0.0}))
            yield _sight_change(f"{noun} with the other sign", partial(_with_radius, name, factor=-1.0))
    if not (display.screen_curvature or display.observer_curvature):
        (other,) = (diffuser for diffuser in DIFFUSERS if diffuser != display.diffuser)
        kind = f"diffuser '{other}' in place of '{display.diffuser}'"
        yield _sight_change(kind, lambda s: s.with_screen(diffuser=other))
    if module.field_of_view is not None:
        yield _factor_change("field of view", _with_field_of_view)
        for name in ("yaw", "pitch", "roll"):
            yield _offset_change(name, partial(_with_module_offset, name), _DEGREES, " degrees")
    for k in range(8) if module.homography is not None else ():
        yield _offset_change(f"homography[{k}]", partial(_with_homography_entry, k), _entry_axis(k, display), "")
    for name in ("k1", "k2"):
        yield _offset_change(name, partial(_with_module_offset, name), _UNITS, "")
    if aligned:
        yield _sight_change("a pinhole in both axes", _as_pinhole)


def _as_pinhole(sight: Sight) -> Sight:
    """The sight with rays that meet in the lens, whatever the screen's shape, its diffuser and the observers are."""
    flat = sight.with_screen(screen_curvature=0.0, observer_curvature=0.0, diffuser="linear")
    return replace(flat, pinhole=True)


def _with_module_offset(name: str, sight: Sight, offset: float) -> Sight:
    return sight.with_module(**{name: getattr(sight.module, name) + offset})


def _with_field_of_view(sight: Sight, factor: float) -> Sight:
    """The sight with its field of view times a factor."""
    return sight.with_module(field_of_view=(sight.module.field_of_view or 0.0) * factor)


def _with_radius(name: str, sight: Sight, factor: float) -> Sight:
    """The sight with a radius times a factor."""
    return sight.with_screen(**{name: getattr(sight.screen, name) / factor})


def _entry_axis(k: int, display: Display) -> Axis:
    """Sizes of entry k that move the screen's edge by a millionth to a fifth of the texture."""
    module = display.modules[0]
    texels = (module.width, module.height, 1.0)[k // 3]
    metres = (display.screen_width / 2, display.screen_height / 2, 1.0)[k % 3]
    return Axis(1e-6 * texels / metres, 0.2 * texels / metres)


def _with_homography_entry(k: int, sight: Sight, offset: float) -> Sight:
    """The sight with another entry k of its homography, whose last entry becomes 1."""
    homography = sight.module.homography
    assert homography is not None
    numbers = [h / homography[8] for h in homography]
    numbers[k] += offset
    return sight.with_module(homography=tuple(numbers))


def _placement_changes(centre: FloatArray) -> Iterator[Change]:
    """Yield changes of the scene's placement in physical space, by the region of interest."""

    def with_placement(factor: float, shift: FloatArray, sight: Sight) -> Sight:
        cast = np.array(sight.view.cast_from_world, np.float64)
        cast[:, 3] = centre + factor * (cast[:, 3] - centre) + shift
        cast[:, :3] *= factor
        return sight.with_display(sight.screen, cast)

    yield _factor_change("ROI scale", lambda s, f: with_placement(f, np.zeros(3), s))
    for axis, direction in zip("xyz", np.eye(3), strict=True):
        yield _offset_change(
            f"ROI offset in {axis}", partial(lambda direction, s, d: with_placement(1.0, d * direction, s), direction)
        )


def _quilt_changes(quilt: Quilt) -> Iterator[Change]:
    """Yield changes of the eyes' positions, of the window that all views have, and of their shear."""
    half = tan(radians(quilt.field_of_view) / 2)
    yield _factor_change("view cone", lambda s, f: s.with_quilt(view_cone=f * quilt.view_cone))
    nearer = "eyes' distance from the screen"
    yield _factor_change(nearer, lambda s, f: s.with_quilt(field_of_view=2 * degrees(atan(half / f))))
    height = quilt.screen_height
    yield _factor_change("screen height", lambda s, f: s.with_quilt(screen_height=f * height))
    yield _factor_change("screen aspect", lambda s, f: s.with_quilt(aspect=f * quilt.aspect))
    larger = "screen size from the same eyes"
    yield _factor_change(
        larger, lambda s, f: s.with_quilt(screen_height=f * height, field_of_view=2 * degrees(atan(half * f)))
    )
    (other,) = (spacing for spacing in SPACINGS if spacing != quilt.spacing)
    yield _sight_change(f"spacing '{other}' in place of '{quilt.spacing}'", lambda s: s.with_quilt(spacing=other))
    yield _sight_change("views turned to the screen's middle in place of sheared", partial(_unsheared, turned=True))
    yield _sight_change("views without shear", partial(_unsheared, turned=False))


def _unsheared(sight: Sight, turned: bool) -> Sight:
    """A quilt's view without shear: turned to the screen's middle, or straight ahead."""
    assert sight.quilt is not None
    quilt, index, _ = sight.quilt
    lens = sight.view.lens.copy()
    cast = np.array(sight.view.cast_from_world, np.float64)
    lens[2] = sight.view.width / 2
    if turned:
        x = quilt.eye_x(index)
        z = quilt.distance
        cosine = z / hypot(x, z)
        sine = x / hypot(x, z)
        cast = np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]]) @ cast
    return replace(sight, view=with_lens(sight.view, lens, cast))


def _separation_changes(sight: Sight, others: Sequence[Sight]) -> Iterator[Change]:
    """Yield the separation of parallel cameras, such as two eyes; their windows still meet in the same plane."""
    views = [sight.view, *(other.view for other in others)]
    turns = [view.cast_from_world[:, :3] for view in views]
    if len(views) < 2 or any(view.lens.shape != sight.view.lens.shape for view in views):
        return
    lenses, casts = (np.array([getattr(v, name) for v in views]) for name in ("lens", "cast_from_world"))
    parallel = np.allclose(turns, turns[0], rtol=0, atol=_PARALLEL) and np.allclose(
        lenses[:, [0, 1, 6]], lenses[0, [0, 1, 6]]
    )
    lens = lenses.mean(axis=0)
    cast = casts.mean(axis=0)

    def with_separation(s: Sight, f: float) -> Sight:
        numbers = s.view.lens.copy()
        axes = np.array(s.view.cast_from_world, np.float64)
        numbers[2:4] = lens[2:4] + f * (numbers[2:4] - lens[2:4])
        axes[:, 3] = cast[:, 3] + f * (axes[:, 3] - cast[:, 3])
        return replace(s, view=with_lens(s.view, numbers, axes))

    if parallel and not np.array_equal(sight.view.cast_from_world, cast):
        yield _factor_change("separation of the views", with_separation)


def _camera_changes(sight: Sight) -> Iterator[Change]:
    """Yield changes of a camera's numbers: focal lengths, position and planes."""

    def with_factors(factors: Mapping[int, float], s: Sight) -> Sight:
        numbers = s.view.lens.copy()
        for k, factor in factors.items():
            numbers[k] *= factor
        if not 0 < numbers[4] < numbers[5]:
            raise InputError("the planes are not in order")
        return replace(s, view=with_lens(s.view, numbers, s.view.cast_from_world))

    def with_eye(direction: FloatArray, s: Sight, d: float) -> Sight:
        cast = np.array(s.view.cast_from_world, np.float64)
        cast[:, 3] -= d * (cast[:, :3] @ direction)
        return replace(s, view=with_lens(s.view, s.view.lens, cast))

    def with_angle(s: Sight, f: float) -> Sight:
        view = s.view
        half = (view.height - 2 * view.guard) / 2
        wide = f * atan(half / view.lens[1])
        if not wide < pi / 2:
            raise InputError("the field of view is beyond 180 degrees")
        zoom = half / tan(wide) / view.lens[1]
        return with_factors({0: zoom, 1: zoom}, s)

    if sight.view.lens[6]:  # orthographic
        yield _factor_change("extent", lambda s, f: with_factors({0: 1 / f, 1: 1 / f}, s))
    else:
        yield _factor_change("field of view", with_angle)
    yield _factor_change("aspect", lambda s, f: with_factors({0: f}, s))
    size = float(sight.view.lens[5] - sight.view.lens[4])
    for axis, direction in zip("xyz", np.eye(3), strict=True):
        yield _offset_change(f"eye {axis}", partial(with_eye, direction), Axis(1e-6 * size, 0.5 * size), "")
    yield _factor_change("near plane", lambda s, f: with_factors({4: f}, s))
    yield _factor_change("far plane", lambda s, f: with_factors({5: f}, s))
