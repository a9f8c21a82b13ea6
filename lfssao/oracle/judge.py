"""Which stage of a renderer went wrong first.

Each stage is judged on the renderer's own textures of the stages before it, where it has them whole. So an error is
named once, where it began: the blur of a wrong merge is right if it is the blur of that merge. Where it has not, depth,
positions and color are the reference's, and any occlusion within its bounds will do.

    depth       the ranges of ``lfssao.oracle.depth``
    positions   must land on their texels' centres, at the depth of the depth texture
    color       ``depth.color_bounds``
    ao_1 ...    ``bounds.ao_bounds`` of depth and positions; of other estimators ``points.point_bounds``
    merged      ``bounds.merge_bounds`` of ao_1 ...
    blurred     ``bounds.blur_bounds`` of merged; with a guard band, which merged lacks, of the bounds from depth on
    shaded      ``bounds.shade_bounds`` of color and blurred

Depth and color want the mesh. Where there is none they are judged by the reference's textures alone, color by the
texels around, and as many texels as ``depth.stray_limit`` says may leave these bounds.
"""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import partial
from itertools import product

import numpy as np
from numpy.typing import NDArray

from lfssao.errors import InputError
from lfssao.kernels import outcomes
from lfssao.matrix import Matrix
from lfssao.oracle import bounds as stages
from lfssao.oracle.bounds import Bounds, FloatArray, SampleScene, Texture
from lfssao.oracle.depth import ROUNDINGS, SLOPES, DepthBounds, depth_bounds_of, stray_limit
from lfssao.oracle.error_model import ErrorModel, find_model
from lfssao.oracle.points import Estimate
from lfssao.rendering import Settings, Textures
from lfssao.view import WorldToImage

SAME, INSIDE, OUTSIDE, MISSING, SHAPE = "same", "inside", "outside", "missing", "shape"


@dataclass(frozen=True, eq=False)
class Stages:
    """The textures of one view that some renderer made, float32; None where it has none.

    Attributes
    ----------
    depth : (H, W)
        Image z, +infinity where there is no surface, guard band included.
    positions : (H, W, 3)
        World coordinates, +infinity where there is no surface, guard band included.
    color : (H, W, 3)
        What AO is multiplied into, linear, guard band cut off.
    ao : tuple of (H, W)
        Occlusion, one texture a radius, guard band cut off, as of all that follow.
    merged, blurred : (H, W)
        Maximum over the radii; after the blur.
    shaded : (H, W, 3)
        color (1 - blurred).
    normals : (H, W, 3)
        World space, guard band included. They are read for the occlusion of estimators that read them, and not judged.
    """

    depth: Texture | None = None
    positions: Texture | None = None
    color: Texture | None = None
    ao: tuple[Texture | None, ...] = ()
    merged: Texture | None = None
    blurred: Texture | None = None
    shaded: Texture | None = None
    normals: Texture | None = None

    @classmethod
    def of(cls, textures: Textures) -> "Stages":
        """The textures that ``lfssao.render`` made."""
        gbuffer = textures.gbuffer
        return cls(
            gbuffer.depth, gbuffer.positions, textures.image, textures.ao, textures.merged, textures.blurred,
            textures.shaded, gbuffer.normals,
        )  # fmt: skip

    def named(self) -> dict[str, Texture | None]:
        """The textures that are judged by the names of their stages, in order."""
        ao = {f"ao_{k}": texture for k, texture in enumerate(self.ao, start=1)}
        head = {"depth": self.depth, "positions": self.positions, "color": self.color}
        return {**head, **ao, "merged": self.merged, "blurred": self.blurred, "shaded": self.shaded}


@dataclass(frozen=True, eq=False)
class Case:
    """What a renderer is held to in one view.

    Attributes
    ----------
    world_to_image : WorldToImage
        The mapping, guard band included.
    screen_to_world : (4, 4) or None
        A camera's inverse mapping: Algorithm 1.
    samples : (n, 3) or None
        Offsets in the unit ball. None where AO is another estimator's than LF's.
    radii : tuple of float
        World units.
    sigma : float
        Of the blur, texels.
    reference : Stages
        The right textures, of this program.
    guard : int
        Texels on each side that depth and positions have and the others have not.
    depth : DepthBounds or None
        From the mesh (``depth.depth_bounds``); None: from the reference's depth.
    color : Bounds or None
        From the mesh (``depth.color_bounds``), guard band cut off; None: from the reference's color.
    estimate : Estimate or None
        The other estimator. Where neither it nor samples are given or no bounds of it are known, AO must have the
        reference's bits.
    """

    world_to_image: WorldToImage
    screen_to_world: Matrix | None
    samples: FloatArray | None
    radii: tuple[float, ...]
    sigma: float
    reference: Stages
    guard: int = 0
    depth: DepthBounds | None = None
    color: Bounds | None = None
    estimate: Estimate | None = None

    @classmethod
    def of(
        cls, textures: Textures, settings: Settings, depth: DepthBounds | None = None, color: Bounds | None = None
    ) -> "Case":
        """The case of a view that ``lfssao.render`` rendered."""
        view = textures.view
        samples = settings.samples if settings.estimator == "lf" and not settings.neighbours else None
        estimate = None
        if settings.estimator != "lf":
            estimate = Estimate(
                settings.estimator, settings.samples, settings.weights, settings.parameters, view.cast_from_world
            )
        return cls(
            view.world_to_image, view.screen_to_world, samples, settings.radii, settings.blur,
            Stages.of(textures), view.guard, depth, color, estimate,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class StageVerdict:
    """What became of one stage.

    Attributes
    ----------
    name : str
        The stage.
    verdict : str
        'same' (the reference's bits), 'inside' its bounds, 'outside' them, 'missing', or of another 'shape'.
    wrong : bool array or None
        Which texels are outside, (H, W); None where there is nothing to compare. Without a mesh a few of depth and
        color may be (``depth.stray_limit``).
    bounds : Bounds, DepthBounds or None
        What they were compared with; None for positions.
    """

    name: str
    verdict: str
    wrong: NDArray[np.bool_] | None = None
    bounds: Bounds | DepthBounds | None = None

    @property
    def accepted(self) -> bool:
        """Whether the stage is right."""
        return self.verdict in (SAME, INSIDE)


@dataclass(frozen=True, eq=False)
class Verdict:
    """What became of all stages.

    Attributes
    ----------
    stages : tuple of StageVerdict
        In the order of the passes.
    """

    stages: tuple[StageVerdict, ...]

    @property
    def first(self) -> str | None:
        """Name of the first stage that is not accepted; None if all are."""
        return next((stage.name for stage in self.stages if not stage.accepted), None)


def judge(mine: Stages, case: Case, model: str | ErrorModel = "shader", only: Collection[str] | None = None) -> Verdict:
    """Judge all stages that the reference has.

    Parameters
    ----------
    mine : Stages
        A renderer's textures.
    case : Case
        Parameters and reference.
    model : str or ErrorModel
        What float32 arithmetic may do.
    only : collection of str, optional
        Judge these stages and leave the others out.

    Returns
    -------
    Verdict

    Raises
    ------
    InputError
        If there is no such model or the case's parameters are wrong.
    """
    return _Judge(mine, case, find_model(model)).run(only)


class _Judge:
    """One judgement: the textures in use, mine where whole, else the reference's."""

    def __init__(self, mine: Stages, case: Case, model: ErrorModel) -> None:
        self._case, self._model, self._mine_normals = case, model, mine.normals
        self._mine, self._reference = mine.named(), case.reference.named()
        self._given = {
            name: texture if _whole(texture, self._reference[name]) else self._reference[name]
            for name, texture in ((name, self._mine.get(name)) for name in self._reference)
        }
        self._own = {name for name, texture in self._mine.items() if _whole(texture, self._reference.get(name))}
        self._ao_bounds: dict[int, Bounds | None] = {}

    def run(self, only: Collection[str] | None) -> Verdict:
        tests: dict[str, Callable[[Texture], tuple[NDArray[np.bool_], Bounds | DepthBounds | None]]] = {
            "depth": self._depth, "positions": self._positions, "color": self._color,
            "merged": self._merged, "blurred": self._blurred, "shaded": self._shaded,
        }  # fmt: skip
        made = []
        for name, reference in self._reference.items():
            if reference is None or (only is not None and name not in only):
                continue
            texture = self._mine.get(name)
            if texture is None:
                made.append(StageVerdict(name, MISSING))
            elif texture.shape != reference.shape or texture.dtype != np.float32:
                made.append(StageVerdict(name, SHAPE))
            else:
                wrong, allowed = tests[name](texture) if name in tests else self._ao(name, texture)
                if np.count_nonzero(wrong) > self._strays(name):
                    verdict = OUTSIDE
                else:
                    verdict = SAME if same_bits(texture, reference) else INSIDE
                made.append(StageVerdict(name, verdict, wrong, allowed))
        return Verdict(tuple(made))

    def _strays(self, name: str) -> int:
        """How many texels of a stage may be outside."""
        from_mesh = {"depth": self._case.depth, "color": self._case.color}
        if name not in from_mesh or from_mesh[name] is not None or self._model.exact:
            return 0
        return stray_limit(self._right("depth"), self._model)

    def _texture(self, name: str) -> Texture:
        texture = self._given[name]
        if texture is None:
            raise InputError(f"the reference has no {name}, which a later stage is judged on")
        return texture

    def _right(self, name: str) -> Texture:
        texture = self._reference[name]
        assert texture is not None  # run() judges what the reference has
        return texture

    def _depth(self, texture: Texture) -> tuple[NDArray[np.bool_], DepthBounds]:
        reference = self._right("depth")
        allowed = self._case.depth if self._case.depth is not None else depth_bounds_of(reference, self._model)
        return allowed.outside(texture), allowed

    def _positions(self, texture: Texture) -> tuple[NDArray[np.bool_], None]:
        reference = self._right("positions")
        if self._model.exact:
            return np.any(texture != reference, axis=-1), None
        return positions_outside(texture, self._texture("depth"), self._case, self._model), None

    def _color(self, texture: Texture) -> tuple[NDArray[np.bool_], Bounds]:
        reference = self._right("color")
        allowed = self._case.color
        if allowed is None:
            allowed = stages.exactly(reference) if self._model.exact else _around(reference, self._model)
        return _any_channel(allowed.outside(texture)), allowed

    def _ao(self, name: str, texture: Texture) -> tuple[NDArray[np.bool_], Bounds]:
        allowed = self._ao_allowed(name)
        return allowed.outside(texture), allowed

    def _ao_allowed(self, name: str) -> Bounds:
        allowed = self._allowed(int(name.removeprefix("ao_")) - 1)
        return stages.exactly(self._right(name)) if allowed is None else allowed.crop(self._case.guard)

    def _input(self, name: str, allowed: Callable[[], Bounds]) -> Bounds:
        """What the next stage is made of: the renderer's own texture, or all that its bounds allow."""
        return stages.exactly(self._texture(name)) if name in self._own else allowed()

    def _allowed(self, k: int) -> Bounds | None:
        """Bounds of the k-th radius, guard band included; None where none are known."""
        if k not in self._ao_bounds:
            self._ao_bounds[k] = self._counted(self._case.radii[k])
        return self._ao_bounds[k]

    def _counted(self, radius: float) -> Bounds | None:
        case, depth, positions = self._case, self._texture("depth"), self._given["positions"]
        if case.samples is not None:
            given = depth, positions, case.world_to_image, case.samples, radius
            return stages.ao_bounds(*given, self._model, case.screen_to_world)
        if case.estimate is None or positions is None or self._model.exact:
            return None
        mine, right = self._mine_normals, case.reference.normals
        normals = mine if _whole(mine, right) else right
        return case.estimate.bounds(depth, positions, normals, case.world_to_image, radius, self._model)

    def _merged(self, texture: Texture) -> tuple[NDArray[np.bool_], Bounds]:
        allowed = self._merged_allowed()
        return allowed.outside(texture), allowed

    def _merged_allowed(self) -> Bounds:
        names = [name for name in self._given if name.startswith("ao_")]
        return stages.merge_bounds([self._input(name, partial(self._ao_allowed, name)) for name in names])

    def _blurred(self, texture: Texture) -> tuple[NDArray[np.bool_], Bounds]:
        allowed = self._blurred_allowed()
        return allowed.outside(texture), allowed

    def _blurred_allowed(self) -> Bounds:
        case = self._case
        if case.guard == 0:
            return stages.blur_bounds(self._input("merged", self._merged_allowed), case.sigma, self._model)
        layers = [allowed for k in range(len(case.radii)) if (allowed := self._allowed(k)) is not None]
        if len(layers) < len(case.radii):
            return stages.exactly(self._right("blurred"))
        return stages.blur_bounds(stages.merge_bounds(layers), case.sigma, self._model).crop(case.guard)

    def _shaded(self, texture: Texture) -> tuple[NDArray[np.bool_], Bounds]:
        blurred = self._input("blurred", self._blurred_allowed)
        allowed = stages.shade_bounds(self._texture("color"), blurred, self._model)
        return _any_channel(allowed.outside(texture)), allowed


def same_bits(a: Texture, b: Texture) -> bool:
    """Whether two float32 textures of one shape have the same bits."""
    return bool(np.array_equal(np.ascontiguousarray(a).view(np.int32), np.ascontiguousarray(b).view(np.int32)))


def _whole(texture: Texture | None, reference: Texture | None) -> bool:
    """Whether a texture can be the input of the next stage."""
    if texture is None or reference is None or texture.shape != reference.shape or texture.dtype != np.float32:
        return False
    return not bool(np.isnan(texture).any())


def _any_channel(wrong: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which texels are wrong in a channel."""
    found: NDArray[np.bool_] = np.logical_or.reduce(wrong, axis=-1)
    return found


def positions_outside(positions: Texture, depth: Texture, case: Case, model: ErrorModel) -> NDArray[np.bool_]:
    """Where a positions texture does not show the point of its texel's ray at the depth texture's depth, (H, W).

    A position is mapped into the image. Each coordinate may be off by ROUNDINGS operations on numbers of the size of
    the largest in the texture, the texel's centre by ``model.centre``, and depth by ROUNDINGS operations.

    Parameters
    ----------
    positions : (H, W, 3) float32
        World coordinates, +infinity where there is no surface.
    depth : (H, W) float32
        Image z.
    case : Case
        Its mapping is used.
    model : ErrorModel
        Not an exact one.
    """
    scene = SampleScene.of(depth, positions, case.world_to_image, np.zeros((1, 3)), 0.0, model, None)
    *_, kind, numbers, errors = scene.arguments
    surface = depth < np.inf
    allowance = np.full(positions.shape, ROUNDINGS * model.operation * _largest(positions))
    image, doubt, sure = np.empty(positions.shape), np.empty(positions.shape), np.empty(depth.shape, np.bool_)
    with np.errstate(invalid="ignore"):  # of a NaN that signals
        exact = np.ascontiguousarray(positions, np.float64)
    outcomes.map_positions(exact, allowance, kind, numbers, errors, image, doubt, sure)
    height, width = depth.shape
    centre = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    room = ROUNDINGS * model.operation * _largest(depth)
    with np.errstate(invalid="ignore"):  # where there is no surface
        far = [~(np.abs(image[..., 2] - depth) <= doubt[..., 2] + room)]
        far += [~(np.abs(image[..., k] - centre[k]) <= doubt[..., k] + model.centre) for k in range(2)]
    beside = np.any(positions != np.inf, axis=-1)
    wrong: NDArray[np.bool_] = (surface & np.logical_or.reduce(far)) | (~surface & beside)
    return wrong


def _largest(texture: Texture) -> float:
    """The largest size of a finite number in a texture."""
    return float(np.max(np.abs(texture), where=np.isfinite(texture), initial=0.0))


def _around(color: Texture, model: ErrorModel) -> Bounds:
    """Least and largest colour of each texel and its eight neighbours, and what it may change beside the centre.

    That is ``SLOPES`` times ``model.centre`` of their span, and ROUNDINGS operations.
    """
    height, width, _ = color.shape
    padded = np.pad(color.astype(np.float64), ((1, 1), (1, 1), (0, 0)), mode="edge")
    shifted = [padded[j : j + height, i : i + width] for j, i in product(range(3), repeat=2)]
    low, high = np.min(shifted, axis=0), np.max(shifted, axis=0)
    room = ROUNDINGS * model.operation * np.maximum(np.abs(low), np.abs(high)) + SLOPES * model.centre * (high - low)
    return Bounds(stages.up_to_single(low - room), stages.down_to_single(high + room))
