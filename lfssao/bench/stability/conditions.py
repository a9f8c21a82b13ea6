"""The conditions under which every estimator is run, and what is stated of float32 there."""

from dataclasses import replace
from functools import partial
from itertools import chain, product

import numpy as np

from lfssao.ao.estimators.estimator import Value
from lfssao.ao.textures import Buffers
from lfssao.bench.stability.estimators import VIEWS, on, seen
from lfssao.bench.stability.table import Inputs, Stated
from lfssao.optics.camera import PROJECTIONS

# RMS errors of occlusion up to which a sentence excuses flipped texels.
FEW = 2.0**-7, "rounding moves a sample past a texel's edge or a surface"
_BOX = "a box as wide as the root of the look-up's rounding, over R, crosses the tangent plane"
_SMALL = "the ball is smaller than the rounding of the surface's points"
_AT_A_POINT = dict.fromkeys(("lf", "point", "hemisphere", "vo-area", "vo-area-normal"), (0.75, _SMALL))
_EDGE_ON = dict.fromkeys(("sao", "sao-equation-1"), (0.25, "a face normal that is edge-on turns either way"))

CONDITIONS: dict[str, tuple[str, Stated]] = {
    "balls": ("R of 2^4 texels to 1", {"": FEW}),
    "balls below a texel": ("R of 2^-2 and 2^-4 texels", {"": FEW, "vo-area-normal": (2.0**-5, _BOX)}),
    "balls of rounding": ("R of 2^-8 and 2^-12 texels", {"": (0.125, _SMALL), "vo-area-normal": (0.5, _BOX)}),
    "R to infinity": ("its products overflow", {"": (0.25, "R times the mapping leaves the range of float32")}),
    "R to 0": ("the ball is a point on the surface", {"": FEW, **_AT_A_POINT}),
    "epsilon": ("to 0: a division by v . v alone", {"": FEW}),
    "passes": ("bilateral weights, packed bytes, harmonic and other means of depth", {"": FEW}),
    "normals": ("edge-on as at silhouettes, turned away, none or short", {"": FEW}),
    "texels' corners": ("points on them, over a chessboard of depths", {"": (0.25, "rounding picks a texel")}),
    "coplanar": ("a plane at one depth, two layers, doubled surfaces an ulp apart", {"": FEW}),
    "not finite": ("NaN and infinity in a seventh of the texels, and in all", {"": FEW, **_EDGE_ON}),
    "sizes": ("textures of one texel, row or column, and 10^4 wide", {"": FEW}),
}


def conditions() -> Inputs:
    """Inputs of all of them: the name, a text, and a function that runs an estimator by name."""
    for kind in VIEWS:
        for name, text, run in chain(_radii(kind), _parameters(kind), _textures(kind)):
            yield name, f"{kind}, {text}", run


def _radii(kind: str) -> Inputs:
    powers = {"balls": (4, 2, 0), "balls below a texel": (-2, -4), "balls of rounding": (-8, -12)}
    for name, power in ((ball, power) for ball in powers for power in powers[ball]):
        yield name, f"R = 2^{power} texels", on(kind, 2.0**power)
    for radius in (1e3, 1e18, 1e30, 1e38):
        yield "R to infinity", f"R = {radius:g}", on(kind, radius=radius)
    for radius in (1e-30, 5e-324, 0.0):
        yield "R to 0", f"R = {radius:g}", on(kind, radius=radius)


def _parameters(kind: str) -> Inputs:
    for power, epsilon in product((2, -12), (1e-30, 0.0)):
        text, guards = f"R = 2^{power} texels, beta = 0, epsilon = {epsilon:g}", {"epsilon": epsilon, "beta": 0.0}
        yield "epsilon", text, on(kind, 2.0**power, parameters=guards)
    passes: dict[str, tuple[Value, ...]] = {
        "sharpness": (0.0, 1e9), "gauss": (1e-3, 1e2), "packed": (False,), "z_min": (1e-6, 1e12),
        "mip": ("arithmetic", "harmonic", "min", "max"),
    }  # fmt: skip
    for option, value in ((name, value) for name in passes for value in passes[name]):
        yield "passes", f"{option} = {value}", on(kind, 16.0, parameters={option: value})
    relief = 0.99 if kind in PROJECTIONS else 2.4  # to both ends of the depths there are
    for mip in ("rotated", "harmonic"):
        text = f"depths of the whole range, mip = {mip}"
        yield "passes", text, on(kind, 16.0, relief=relief, parameters={"mip": mip})


def _textures(kind: str) -> Inputs:
    yield "normals", "edge-on", on(kind, 4.0, changed=_edge_on)
    for scale in (-1.0, 0.0, 1e-30):
        scaled = partial(lambda k, t: replace(t, normals=k * np.asarray(t.normals)), scale)
        yield "normals", f"{scale:g} n", on(kind, 4.0, changed=scaled)
    for power in (2, -12):
        board = on(kind, 2.0**power, changed=partial(_at_corners, kind), surface="a chessboard", relief=0.05)
        yield "texels' corners", f"R = 2^{power} texels", board
    for surface in ("a plane", "two layers", "planes an ulp apart"):
        yield "coplanar", surface, on(kind, 4.0, surface=surface)
    for name, wrong, every in product(("depth", "positions", "normals"), (np.nan, np.inf, -np.inf), (7, 1)):
        text = f"{name} {wrong}, one in {every}"
        yield "not finite", text, on(kind, 4.0, changed=partial(_spoilt, name, wrong, every))
    for size in ((1, 1), (9, 1), (1, 9), (10_000, 2)):
        yield "sizes", "{} x {}".format(*size), on(kind, 4.0, size=size)


def _edge_on(textures: Buffers) -> Buffers:
    edge = np.cross(textures.directions, np.asarray(textures.normals))
    return replace(textures, normals=edge / np.maximum(np.sqrt((edge * edge).sum(axis=2)), 1e-9)[..., None])


def _at_corners(kind: str, textures: Buffers) -> Buffers:
    """Positions of a plane in the texels' upper left corners, where there are some."""
    flat = seen(kind, "a plane", 0.05).positions.copy()
    flat[1:, 1:] = (flat[1:, 1:] + flat[:-1, 1:] + flat[1:, :-1] + flat[:-1, :-1]) / 4
    return replace(textures, positions=flat)


def _spoilt(name: str, wrong: float, every: int, textures: Buffers) -> Buffers:
    texture = getattr(textures, name).copy()
    texture.reshape(textures.depth.size, -1)[every // 2 :: every] = wrong
    return replace(textures, **{name: texture})
