"""Judge a renderer's textures, each by what the renderer itself made before it.

An error is named once, at the stage where it began: the blur of a wrong merge is right if it is the blur of that merge.
Where a renderer wrote no texture of a stage, or one with NaN, depth, positions and colour are the reference's, and any
occlusion within its bounds will do.

    depth       ``depth.depth_bounds``
    positions   ``depth.PositionBounds`` of the depth texture
    color       ``depth.color_bounds``
    ao_1 ...    ``bounds.ao_bounds`` of depth and positions; of other estimators ``points.point_bounds``
    merged      ``bounds.merge_bounds`` of ao_1 ...
    blurred     ``bounds.blur_bounds`` of merged; with a guard band, which merged lacks, of the bounds from depth on
    shaded      ``bounds.shade_bounds`` of color and blurred

Bounds of depth and colour come from the mesh. Without it the reference's textures stand in for it, and as many texels
as ``depth.stray_limit`` says may leave these bounds.
"""

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np

from lfssao.verify.bounds.bounds import Bounds, exactly
from lfssao.verify.bounds.depth import PositionBounds, color_bounds_of, depth_bounds_of
from lfssao.verify.bounds.error_model import ErrorModel, find_model
from lfssao.verify.bounds.points import BOUNDED, Surfaces, point_bounds
from lfssao.verify.bounds.post import blur_bounds, merge_bounds, shade_bounds
from lfssao.verify.bounds.ssao import ao_bounds
from lfssao.verify.case import VIEW, Array, Arrays, Case, Parameters, described_mapping
from lfssao.verify.verdict import Judged, Planes, Verdict, equal_bits, equal_values

# What a texture of a name is held to, None where nothing but its values is known to be right.
Rules = Callable[[str], Bounds | PositionBounds | None]


def occlusion_bounds(parameters: Parameters, inputs: Arrays, radius: float, model: ErrorModel) -> Bounds | None:
    """Bounds of one radius' occlusion, guard band included; None where none are known.

    Parameters
    ----------
    parameters : mapping
        The estimator, LF's where none is named, and what it reads.
    inputs : mapping of arrays
        Textures and samples.
    radius : float
        R, world units.
    model : ErrorModel
        What float32 arithmetic may do.
    """
    mapping, name = described_mapping(parameters), parameters.get("estimator", "lf")
    depth, positions = inputs.get("depth"), inputs.get("positions")
    back = parameters.get("screen_to_world")
    if depth is None or (positions is None and back is None):
        return None
    if name == "lf":
        back = None if back is None else np.array(back)
        return ao_bounds(depth, positions, mapping, inputs["samples"], radius, model, back)
    if name not in BOUNDED or model.exact or positions is None:
        return None
    axes, options = np.array(parameters["view"]["cast_from_world"]), parameters["options"]
    surfaces = Surfaces(depth, positions, mapping, axes, inputs.get("normals"), inputs.get("directions"))
    return point_bounds(name, surfaces, radius, inputs.get("points"), inputs.get("weights"), options, model)


class Frame:
    """Bounds of the textures of a view, each from those before it.

    Parameters
    ----------
    parameters : mapping
        ``radii``, ``sigma``, ``guard`` and what occlusion is made with.
    inputs : mapping of arrays
        Depth, positions, normals and samples, the guard band included.
    image : (H, W, 3) float32 or None
        What AO is multiplied into, the guard band cut off.
    model : ErrorModel
        What float32 arithmetic may do.
    own : mapping of arrays
        Later textures that a renderer made: what follows is made of them.
    right : mapping of arrays
        The reference's textures, for those whose bounds are not known.
    """

    def __init__(
        self,
        parameters: Parameters,
        inputs: Arrays,
        image: Array | None,
        model: ErrorModel,
        own: Arrays | None = None,
        right: Arrays | None = None,
    ) -> None:
        self._parameters, self._inputs, self._image, self._model = parameters, inputs, image, model
        self._own, self._right = own or {}, right or {}
        self._guard = int(parameters["guard"])
        self._layers: dict[int, Bounds | None] = {}

    def _layer(self, k: int) -> Bounds | None:
        """Occlusion of the k-th radius, guard band included."""
        if k not in self._layers:
            radius = self._parameters["radii"][k]
            self._layers[k] = occlusion_bounds(self._parameters, self._inputs, radius, self._model)
        return self._layers[k]

    def ao(self, k: int) -> Bounds | None:
        """Occlusion of the k-th radius."""
        layer = self._layer(k)
        return None if layer is None else layer.crop(self._guard)

    def merged(self) -> Bounds | None:
        """The maximum over the radii."""
        layers = [self._made(f"ao_{k + 1}", partial(self.ao, k)) for k in range(len(self._parameters["radii"]))]
        known = [layer for layer in layers if layer is not None]
        return merge_bounds(known) if len(known) == len(layers) else None

    def blurred(self) -> Bounds | None:
        """The blur of the merged texture, or with a guard band of the layers that include it."""
        sigma = self._parameters["sigma"]
        if self._guard == 0:
            merged = self._made("merged", self.merged)
            return None if merged is None else blur_bounds(merged, sigma, self._model)
        layers = [self._layer(k) for k in range(len(self._parameters["radii"]))]
        known = [layer for layer in layers if layer is not None]
        if len(known) < len(layers):
            return exactly(self._right["blurred"]) if "blurred" in self._right else None
        return blur_bounds(merge_bounds(known), sigma, self._model).crop(self._guard)

    def shaded(self) -> Bounds | None:
        """The image times 1 - blurred."""
        blurred = self._made("blurred", self.blurred)
        if blurred is None or self._image is None:
            return None
        return shade_bounds(self._image, blurred, self._model)

    def _made(self, name: str, bounds: Callable[[], Bounds | None]) -> Bounds | None:
        """What the next stage is made of: the renderer's own texture, or all that its bounds allow."""
        if name in self._own:
            return exactly(self._own[name])
        found = bounds()
        return exactly(self._right[name]) if found is None and name in self._right else found


def view_rules(
    case: Case, mine: Arrays, model: ErrorModel, from_mesh: Callable[[], Mapping[str, Bounds]] | None = None
) -> Rules:
    """What the textures of a view are held to.

    Parameters
    ----------
    case : Case
        The view.
    mine : mapping of arrays
        The textures that a renderer made of it, by stage.
    model : ErrorModel
        What float32 arithmetic may do.
    from_mesh : callable, optional
        Makes bounds of depth and colour, asked once one of them is judged; by default the case's.
    """
    right, guard = case.outputs, int(case.parameters["guard"])
    own = {name: array for name, array in mine.items() if _is_whole(array, right.get(name))}
    given = {**case.inputs, **right, **own}
    image = given.get("color")
    # The picture of a mesh without colour is white.
    if image is None and "depth" in given and not case.parameters.get("colored", False):
        image = np.repeat(np.isfinite(given["depth"]).astype(np.float32)[..., None], 3, axis=2)
    frame = Frame(case.parameters, given, None if image is None else without_guard(image, guard), model, own, right)

    def mesh(name: str, otherwise: Callable[[], Bounds]) -> Bounds:
        found = (case.bounds if from_mesh is None else from_mesh()).get(name)
        return otherwise() if found is None else found

    def positions() -> Bounds | PositionBounds | None:
        if model.exact:
            return exactly(right["positions"])
        return PositionBounds(described_mapping(case.parameters), given["depth"], model) if "depth" in given else None

    rules: dict[str, Callable[[], Bounds | PositionBounds | None]] = {
        "depth": lambda: mesh("depth", lambda: depth_bounds_of(right["depth"], model)),
        "positions": positions,
        "color": lambda: mesh("color", lambda: color_bounds_of(right["color"], right.get("depth"), model)),
        **{f"ao_{k + 1}": partial(frame.ao, k) for k in range(len(case.parameters["radii"]))},
        "merged": frame.merged,
        "blurred": frame.blurred,
        "shaded": frame.shaded,
    }
    return lambda name: rules[name]() if name in rules else None


def judge(mine: Arrays, case: Case, model: str | ErrorModel = "shader") -> dict[str, Judged]:
    """Judge all outputs of a case, steps on the way before the one that they lead to.

    Parameters
    ----------
    mine : mapping of arrays
        What a renderer made, by the names of the outputs.
    case : Case
        What is right.
    model : str or ErrorModel
        What float32 arithmetic may do in a view; the bounds of a case of the kit are made.

    Returns
    -------
    dict of Judged
        MISSING where the renderer made no such output, MISMATCH where it is of another shape or type.

    Raises
    ------
    InputError
        If there is no such model, or the case's parameters are wrong.
    """
    is_view = case.stage == VIEW
    rules = view_rules(case, mine, find_model(model)) if is_view else case.bounds.get
    main, *steps = case.outputs
    names = case.outputs if is_view else (*steps, main)
    return {name: _judge_output(name, mine, case, rules) for name in names}


def _judge_output(name: str, mine: Arrays, case: Case, rules: Rules) -> Judged:
    if name not in mine:
        return Judged(Verdict.MISSING)
    array, right = mine[name], case.outputs[name]
    if (array.shape, array.dtype) != (right.shape, right.dtype):
        detail = f"it is {array.shape} of {array.dtype}, expected {right.shape} of {right.dtype}"
        return Judged(Verdict.MISMATCH, detail)
    if case.stage == VIEW and array.ndim == 3:  # verdicts are of texels, not of numbers
        return judge_planes(tuple(np.moveaxis(array, -1, 0)), tuple(np.moveaxis(right, -1, 0)), partial(rules, name))
    return judge_planes((array,), (right,), partial(rules, name))


def judge_planes(mine: Planes, right: Planes, ask: Callable[[], Bounds | PositionBounds | None]) -> Judged:
    """Judge one texture: equal bits are right; others by bounds or, where none are known, by values.

    Parameters
    ----------
    mine, right : tuples of arrays
        Channels of the renderer's texture and of the reference's, of the same types and size.
    ask : callable
        What the texture is held to; called where bits differ.
    """
    pairs = list(zip(mine, right, strict=True))
    differing = ~np.logical_and.reduce([equal_bits(a, b) for a, b in pairs])
    if not differing.any():
        return Judged(Verdict.EQUAL_BITS, "", differing, differing)
    allowed = ask()
    if allowed is None:
        outside = ~np.logical_and.reduce([equal_values(a, b) for a, b in pairs])
        return Judged(Verdict.DIFFERENT if outside.any() else Verdict.EQUAL_VALUES, "", differing, outside)
    outside = allowed.outside(mine[0] if len(mine) == 1 else np.stack(mine, axis=-1))
    if outside.ndim > differing.ndim:
        outside = outside.any(axis=-1)
    inside = np.count_nonzero(outside) <= allowed.strays
    bounds = allowed if isinstance(allowed, Bounds) else None
    return Judged(Verdict.INSIDE if inside else Verdict.OUTSIDE, "", differing, outside, bounds)


def _is_whole(texture: Array, reference: Array | None) -> bool:
    """Whether a texture can be what a later stage is made of."""
    if reference is None or texture.shape != reference.shape or texture.dtype != np.float32:
        return False
    return not bool(np.isnan(texture).any())


def without_guard(texture: Array, guard: int) -> Array:
    """A texture without its guard band."""
    return texture if guard == 0 else np.ascontiguousarray(texture[guard:-guard, guard:-guard])
