"""Arguments of sample sets, rotations and checks that mean nothing: each is refused in a sentence that names it."""

import numpy as np
import pytest
from refusals import is_refused

import lfssao
from lfssao import samples as sets
from lfssao.testing import check_promise, check_sampler

SQUARE = np.array([[-0.5, 0.5], [0.5, -0.5]])
MASKED = np.ma.array(SQUARE, mask=SQUARE > 0)
F32 = np.dtype(np.float32)
NO_COUNTS = [np.nan, 0, -1, 1.5, 8.0, "8", None, True, [8], 1e30]
NO_SEEDS = [np.nan, -1, 0.5, 1.0, "0", None, True, 2**64]
NO_NUMBERS = [np.nan, -1, "0.5", None, 1j, [0.5], True]


def latin(n, seed):
    return lfssao.make_samples("latin", n, seed)


def promised(points=SQUARE, **more):
    return check_promise("latin", points, "square", **more)


WRONG = [
    *((lambda n=n: lfssao.make_samples("latin", n), "latin: the number of samples is") for n in NO_COUNTS),
    *((lambda n=n: lfssao.square_points("jittered", n), "jittered: the number of samples is") for n in NO_COUNTS),
    *((lambda s=s: lfssao.make_samples("latin", 8, s), r"the seed is .* 2\*\*64 - 1") for s in NO_SEEDS),
    *((lambda r=r: lfssao.make_samples(r_min=r), "r_min and r_max are") for r in NO_NUMBERS),
    *((lambda r=r: lfssao.make_samples(r_max=r), "r_min and r_max are") for r in (*NO_NUMBERS, np.inf)),
    (lambda: lfssao.make_samples(["latin"]), "there is no sampling of the ball"),
    (lambda: sets.sample_set(["ball"], "latin", 8), "there is no domain"),
    (lambda: sets.find_method("ball", None), "there is no sampling of the ball"),
    *((lambda t=t: sets.sample_set("disk", "spiral", 9, turns=t), "turns is") for t in (np.nan, 0, 2.0, "2", True)),
    *((lambda n=n: sets.best_turns(n), "the number of taps is") for n in NO_COUNTS),
    *((lambda n=n: sets.spiral_discrepancy(n, 2), "the number of taps is") for n in NO_COUNTS if n != 1e30),
    *((lambda t=t: sets.spiral_discrepancy(9, t), "the number of turns is") for t in (np.nan, -1, 2.0, "2", None)),
    *((lambda n=n: sets.repulsion_table("disk", n), "number of points is") for n in (*NO_COUNTS, 65)),
    *((lambda c=c: sets.repulsion_table("disk", 5, c), "centre is") for c in ("yes", 1, np.nan)),
    *((lambda h=h: sets.texel_angles("hash", h, 4), "height is") for h in NO_COUNTS),
    *((lambda w=w: sets.texel_angles("hash", 4, w), "width is") for w in NO_COUNTS),
    *((lambda s=s: sets.texel_angles("hash", 4, 4, s), "rotation_seed is") for s in NO_SEEDS),
    (lambda: sets.texel_angles(["hash"], 4, 4), "there is no rotation"),
    *((lambda s=s: sets.texel_turns("hash", 4, 4, s, F32), "rotation_seed is") for s in NO_SEEDS),
    *((lambda d=d: sets.texel_turns("hash", 4, 4, 0, d), "dtype is") for d in (None, int, "x", np.float16)),
    *((lambda d=d: sets.angle_turns(np.zeros((2, 2)), d), "dtype is") for d in (None, int, "x", np.float16)),
    *((lambda a=a: sets.angle_turns(a, F32), "rotation") for a in (MASKED, np.nan * SQUARE, "hash", None, [[0.0]])),
    # Promises
    *((lambda p=p: promised(p), words) for p, words in [
        (MASKED, "points is a masked array"), ("points", "points is 'points'"), (5, "points of the square have shape"),
        (None, "points is None"), ([[0.5, 0.5], [0.5]], "points is"), ([], "points of the square have shape"),
    ]),
    *((lambda w=w: promised(weights=w), words) for w, words in [
        ("heavy", "weights is"), ([1.0, np.nan], "a weight is not finite"), ([1.0], "2 points and weights"),
        (np.ma.array([1.0, 2.0], mask=[True, False]), "weights is a masked"), (1.0, "2 points and weights"),
    ]),
    (lambda: promised([SQUARE, SQUARE], weights=[np.ones(2)]), "there are 2 sets of points"),
    (lambda: promised([SQUARE, SQUARE], weights=1.0), "there are 2 sets of points"),
    *((lambda r=r: check_promise("inside", [[0.0, 0, 0.9]], "ball", r_min=r), "r_min and") for r in NO_NUMBERS),
    *((lambda t=t: promised(tolerance=t), "tolerance is") for t in NO_NUMBERS),
    *((lambda a=a: promised(alarm=a), "alarm is") for a in (*NO_NUMBERS, 0, 1)),
    *((lambda b=b: promised(bounds=b), "bounds is") for b in (1.0, (0, 1, 2), None, "01")),
    *((lambda b=b: promised(bounds=b), "the range is") for b in ((1, 0), (np.nan, 1), ("0", "1"))),
    *((lambda n=n: check_sampler(latin, n, 4), "n is") for n in NO_COUNTS),
    *((lambda s=s: check_sampler(latin, 8, s), "seeds is") for s in (np.nan, 0, -1, 1.5, None, True)),
    (lambda: check_promise(["latin"], SQUARE, "square"), "there is no promise"),
]  # fmt: skip


@pytest.mark.parametrize(("call", "words"), WRONG, ids=[words for _, words in WRONG])
def test_what_means_nothing_is_refused(call, words):
    assert is_refused(call, words)


def test_what_is_right_in_another_type_is_taken():
    right = lfssao.make_samples("latin", 8, 1, 0.5, 1.0)
    for whole in (np.int64, np.uint8, np.array):
        assert np.array_equal(lfssao.make_samples("latin", whole(8), whole(1), np.float32(0.5), 1), right)
        assert sets.best_turns(whole(9)) == 2
        assert np.array_equal(sets.texel_angles("hash", whole(3), whole(2)), sets.texel_angles("hash", 3, 2))
    assert np.array_equal(sets.texel_turns("hash", 3, 2, 0, np.float32), sets.texel_turns("hash", 3, 2, 0, F32))
    assert promised(SQUARE.tolist())[0].holds
    assert promised([SQUARE, SQUARE], weights=[np.ones(2), [1, 1]])[0].holds
    assert check_sampler(latin, np.int64(8), [0, 1], "inside", r_min=0.8)[0].holds
