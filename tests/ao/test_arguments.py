"""Arguments of the passes from Python that mean nothing: each is refused in a sentence that names it."""

import numpy as np
import pytest
from refusals import is_refused

import lfssao
from lfssao import Buffers, GBuffer

VIEW = lfssao.Camera("orthographic", (0.0, 0.0, 5.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 2.0, 1.0, 9.0).view(4, 3)
DEPTH = np.full((3, 4), 0.5, np.float32)
PLACES = np.zeros((3, 4, 3), np.float32)
UP = np.zeros((3, 4, 3), np.float32) + np.float32([0, 0, 1])
TURNS = np.ones((2, 3, 4), np.float32)
BALL = np.array([[0.0, 0.0, 0.5], [0.0, 0.0, -0.5]])
DISK = np.array([[0.5, 0.0], [0.0, 0.5]])
EYE = np.eye(4)
MAPPING = VIEW.world_to_image
OCCLUDERS = lfssao.Occluders("corner")
FINE = {"depth": DEPTH, "positions": PLACES, "normals": UP, "turns": TURNS}


def with_nan(texture):
    return np.where(np.arange(texture.size).reshape(texture.shape) == 5, np.float32(np.nan), texture)


def masked(texture):
    return np.ma.array(texture, mask=np.arange(texture.size).reshape(texture.shape) == 5)


def estimate(name, *samples, radius=0.1, **more):
    return lfssao.estimate(name, Buffers(VIEW, DEPTH, PLACES, UP), radius, *samples, **more)


def rays(radius=0.1, **more):
    return lfssao.ray_cast_occlusion(OCCLUDERS, Buffers(VIEW, DEPTH, PLACES, UP), radius, **more)


NO_NUMBERS = [np.nan, -1, 1e400, "0.1", None, True, [0.1], 1j]
NO_WEIGHTS = [
    ("heavy", "weights is 'heavy', expected numbers"), ([1.0], "weights must be 2 finite"), (1.0, "weights must be 2"),
    ([1.0, np.nan], "weights must be 2 finite"), ([0.0, 0.0], "not all 0"), ([2.0, -1.0], "positive or 0"),
    (np.ma.array([1.0, 2.0], mask=[True, False]), "weights is a masked array"), ([[1.0, 2.0]], "weights must be 2"),
]  # fmt: skip
NO_SAMPLES = [
    ("many", "samples is 'many'"), (None, "samples is None"), ([[1.0, 2.0, 3.0], [1.0]], "samples is"),
    (masked(np.ones((3, 3))), "samples is a masked array"), (np.ones((2, 3), bool), "expected numbers"),
]  # fmt: skip
NO_ROUNDS = [8, (8,), (8, 4), (2.5, 8), (np.nan, 8), ("2", "8"), (1, 8), (2, 1e9)]

WRONG = [
    # A NaN in a texture, and a mask
    *((lambda n=n: Buffers(VIEW, **{**FINE, n: with_nan(FINE[n])}), f"{n} is NaN at") for n in FINE),
    *((lambda n=n: Buffers(VIEW, **{**FINE, n: masked(FINE[n])}), f"{n} is a masked array") for n in FINE),
    (lambda: Buffers.of(GBuffer(with_nan(DEPTH), PLACES, None, DEPTH), VIEW), r"depth is NaN at \[1, 1\]"),
    (lambda: Buffers.of(GBuffer(masked(DEPTH), PLACES, None, DEPTH), VIEW), "depth is a masked array"),
    (lambda: Buffers("front", DEPTH, PLACES), "view is of type str"),
    *((lambda a=a: lfssao.algorithm2(*a, MAPPING, BALL, 0.1), words) for a, words in [
        ((with_nan(DEPTH), PLACES), "depth is NaN"), ((DEPTH, with_nan(PLACES)), "positions is NaN"),
        ((masked(DEPTH), PLACES), "depth is a masked"), ((DEPTH, masked(PLACES)), "positions is a masked"),
    ]),
    *((lambda bad=bad: lfssao.algorithm2(DEPTH, PLACES, MAPPING, BALL, 0.1, bad), words) for bad, words in [
        (with_nan(TURNS), "turns is NaN"), (masked(TURNS), "turns is a masked"), ("hash", "turns is of str"),
    ]),
    *((lambda bad=bad: lfssao.algorithm1(bad, EYE, EYE, BALL, 0.1), "depth is") for bad in (
        with_nan(DEPTH), masked(DEPTH), None,
    )),
    (lambda: lfssao.algorithm1(DEPTH, EYE, EYE, BALL, 0.1, with_nan(TURNS)), "turns is NaN"),
    *((lambda bad=bad: lfssao.algorithm1(DEPTH, bad, EYE, BALL, 0.1), "screen_to_world is") for bad in (
        np.nan * EYE, masked(EYE), "identity", None, [[1, 2], [3]], EYE[:3],
    )),
    *((lambda bad=bad: lfssao.algorithm1(DEPTH, EYE, bad, BALL, 0.1), "world_to_screen is") for bad in (
        np.nan * EYE, masked(EYE), "identity",
    )),
    *((lambda bad=bad: lfssao.merge([DEPTH, bad]), words) for bad, words in [
        (with_nan(DEPTH), r"layer 1 is NaN at \[1, 1\]"), (masked(DEPTH), "layer 1 is a masked"),
        (None, "layer 1 is of"),
    ]),
    (lambda: lfssao.merge(masked(np.stack([DEPTH, DEPTH]))), "layer 0 is a masked"),
    (lambda: lfssao.merge(5), "layers is of type int"),
    (lambda: lfssao.merge([[[0.5], [0.5, 0.5]]]), "layer 0 is of list"),
    (lambda: lfssao.blur(with_nan(DEPTH), 1.0), "occlusion is NaN"),
    (lambda: lfssao.blur(masked(DEPTH), 0), "occlusion is a masked"),
    *((lambda bad=bad: lfssao.blur(DEPTH, bad), "blur is .*, it must be a sigma") for bad in NO_NUMBERS),
    (lambda: lfssao.shade(PLACES, with_nan(DEPTH)), "occlusion is NaN"),
    (lambda: lfssao.shade(PLACES, masked(DEPTH)), "occlusion is a masked"),
    (lambda: lfssao.shade(with_nan(PLACES), DEPTH), r"rgb is NaN at \[0, 1, 2\]"),
    (lambda: lfssao.shade(masked(PLACES), DEPTH), "rgb is a masked"),
    # Numbers
    *((lambda r=r: lfssao.algorithm2(DEPTH, PLACES, MAPPING, BALL, r), "radius is .*, it must be") for r in NO_NUMBERS),
    *((lambda r=r: estimate("sao", radius=r), "radius is .*, it must be") for r in NO_NUMBERS),
    *((lambda bad=bad: rays(radius=bad), "radius is .*, it must be") for bad in NO_NUMBERS if bad != 1e400),
    *((lambda bad=bad: rays(tolerance=bad), "tolerance .* must be at least 0") for bad in NO_NUMBERS if bad != 1e400),
    *((lambda bad=bad: rays(offset=bad), "offset .* must be at least 0") for bad in NO_NUMBERS),
    *((lambda bad=bad: rays(rounds=bad), "rounds is") for bad in NO_ROUNDS),
    *((lambda bad=bad: rays(strata=bad), "strata is") for bad in (np.nan, 0, 257, 1.5, "8", True)),
    *((lambda bad=bad: rays(seed=bad), r"seed is .* 2\*\*64 - 1") for bad in (np.nan, -1, 0.5, 2**64, "0", True)),
    (lambda: rays(weighting=["cosine"]), "there is no weighting"),
    # Samples and weights
    *((lambda bad=bad: lfssao.algorithm2(DEPTH, PLACES, MAPPING, bad, 0.1), words) for bad, words in NO_SAMPLES),
    *((lambda bad=bad: lfssao.algorithm1(DEPTH, EYE, EYE, bad, 0.1), words) for bad, words in NO_SAMPLES),
    *((lambda bad=bad: estimate("lf", bad), words) for bad, words in NO_SAMPLES if bad is not None),
    *((lambda bad=bad: estimate("vo-points", BALL, bad), words) for bad, words in NO_WEIGHTS),
    *((lambda bad=bad: estimate("vo-lines", DISK, bad), words) for bad, words in NO_WEIGHTS),
    *((lambda bad=bad: estimate("lf", BALL, bad), words) for bad, words in NO_WEIGHTS),
    (lambda: estimate("vo-points", None, [1.0, 2.0]), "weights are given, and no samples"),
    (lambda: estimate("sao", None, "heavy"), "weights are given, and no samples"),
    (lambda: estimate(["lf"]), "there is no estimator"),
    (lambda: estimate("lf", units=np.zeros(2)), "units is"),
    (lambda: Buffers(VIEW, DEPTH, PLACES).turned(["hash"]), "there is no rotation"),
    (lambda: Buffers(VIEW, DEPTH, PLACES).turned("hash", 0.5), "rotation_seed is 0.5"),
]  # fmt: skip


@pytest.mark.parametrize(("call", "words"), WRONG, ids=[words for _, words in WRONG])
def test_what_means_nothing_is_refused(call, words):
    assert is_refused(call, words)


def test_what_is_right_in_another_type_is_taken():
    """NumPy's numbers, arrays without dimensions, lists, and masked arrays of which nothing is masked."""
    right = lfssao.algorithm2(DEPTH, PLACES, MAPPING, BALL, 0.5).texture
    bare = np.ma.array(DEPTH)
    for depth, samples, radius in (
        (bare, BALL.tolist(), np.float32(0.5)), (DEPTH, np.ma.array(BALL), np.array(0.5)), (DEPTH, 1.0 * BALL, 0.5),
    ):  # fmt: skip
        assert np.array_equal(lfssao.algorithm2(depth, PLACES, MAPPING, samples, radius).texture, right)
    for one in (1, np.int64(1), np.array(1)):
        assert np.array_equal(lfssao.blur(DEPTH, one), lfssao.blur(DEPTH, 1.0))
    whole = lfssao.algorithm2(DEPTH, PLACES, MAPPING, BALL, 1).texture
    assert np.array_equal(lfssao.algorithm2(DEPTH, PLACES, MAPPING, BALL.astype(np.float32), 1.0).texture, whole)
    weights = estimate("vo-points", BALL, [1, 0]).texture
    assert np.array_equal(estimate("vo-points", BALL, np.array([3.0, 0.0])).texture, weights)
    deep = np.where(np.arange(12).reshape(3, 4) == 5, np.float32(np.inf), DEPTH)  # background is no NaN
    assert lfssao.algorithm1(deep, EYE, EYE, BALL, 0.1).texture[1, 1] == 0
    assert rays(rounds=(np.int64(2), np.int64(2)), strata=np.int32(2), seed=np.uint64(2**64 - 1)).rays.max() <= 8
