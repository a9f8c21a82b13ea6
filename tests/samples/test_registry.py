"""Every sampling method: the reference, its promises on many sets, the shells, prefixes; and what is refused."""

import itertools
import math

import numpy as np
import pytest
from bits import bits
from hypothesis import given, settings
from hypothesis import strategies as st
from reference import samples as specification
from reference import sequences as reference
from scipy.stats import qmc

from lfssao.errors import InputError
from lfssao.samples import METHODS, make_samples, sample_set, square_points
from lfssao.samples.kernels import ball, square
from lfssao.testing import check_promise
from lfssao.testing import radii as drawn_radii

EVERY = [(domain, name) for domain, methods in METHODS.items() for name in methods]
every_method = pytest.mark.parametrize(("domain", "name"), EVERY)
seeds = st.one_of(st.integers(0, 2**64 - 1), st.sampled_from([0, 1, 2**32, 2**63, 2**64 - 1]))
counts = st.one_of(st.integers(1, 64), st.integers(1, 4096), st.sampled_from([1, 2, 31, 64, 97, 256, 4096]))


shells = st.tuples(
    st.one_of(st.floats(0, 1), st.sampled_from([0.0, 0.8, 1.0, 1 - 2.0**-52, 1 - 2.0**-51, 1 - 2.0**-48])),
    st.one_of(drawn_radii(), st.sampled_from([5e-324, 1e-310, 1.7e308])),
).map(lambda pair: (pair[0] * pair[1], pair[1]))


def number(data, domain, name, counts=counts):
    n = data.draw(counts)
    most = METHODS[domain][name].most
    return n if most is None else (n - 1) % most + 1


# The reference


def test_every_method_has_a_reference_or_a_table_or_is_a_spiral():
    assert {name for _, name in EVERY} == {*reference.FILLS, "rejection", "repulsion", "spiral"}


@pytest.mark.parametrize(("domain", "name"), [pair for pair in EVERY if pair[1] not in ("repulsion", "spiral")])
@settings(max_examples=12)
@given(n=st.one_of(st.integers(1, 12), st.integers(13, 40)), seed=seeds)
def test_methods_equal_the_reference(domain, name, n, seed):
    points = sample_set(domain, name, n, seed).points
    np.testing.assert_array_equal(bits(points), bits(reference.point_set(domain, name, n, seed)))


@pytest.mark.parametrize("name", ["sobol", "rejection", "random", "jittered", "latin"])
@settings(max_examples=20)
@given(n=st.integers(1, 12), seed=seeds, shell=shells)
def test_shells_equal_the_reference(name, n, seed, shell):
    np.testing.assert_array_equal(
        bits(make_samples(name, n, seed, *shell)), bits(reference.point_set("ball", name, n, seed, *shell))
    )


@given(xi1=st.floats(-1, 1), xi2=st.floats(-1, 1), t=st.floats(0, 1), shell=shells)
def test_algorithms_3_and_4_equal_the_reference(xi1, xi2, t, shell):
    point = ball.algorithm3(xi1, xi2)
    np.testing.assert_array_equal(bits(point), bits(specification.algorithm3(xi1, xi2)))
    np.testing.assert_array_equal(
        bits(ball.algorithm4(*point, t, *shell)), bits(specification.algorithm4(*point, t, *shell))
    )


def test_no_point_lies_inside_the_shell():
    """Its inner radius' cube and the cube's root are rounded: some points would."""
    inner = np.linspace(0.01, 1, 100).tolist()
    assert min(ball.algorithm4(0.0, 0.0, 1.0, 0.0, r, 1.0)[2] - r for r in inner) == 0


def test_the_short_calls_are_sample_sets():
    np.testing.assert_array_equal(square_points("jittered", 6, 3), sample_set("square", "jittered", 6, 3).points)
    np.testing.assert_array_equal(make_samples(), sample_set("ball", "latin", 8, 0, r_min=0.8, r_max=1.0).points)


def test_the_spiral_is_equations_6_and_7():
    points = sample_set("disk", "spiral", 9, turns=7).points
    for i, (x, y) in enumerate(points.tolist()):
        alpha = (i + 0.5) / 9
        assert (x, y) == pytest.approx(
            (alpha * math.cos(2 * math.pi * 7 * alpha), alpha * math.sin(2 * math.pi * 7 * alpha)), abs=1e-13
        )


def test_sequences_are_those_of_scipy_before_they_are_scrambled():
    halton = [[reference.fraction(reference.halton_digits(k, a), (2, 3, 5)[a]) for a in range(3)] for k in range(500)]
    np.testing.assert_allclose(halton, qmc.Halton(3, scramble=False).random(500), atol=5e-10)
    ours = np.array([[reference.sobol_word(k, a) / 2**32 for a in range(3)] for k in range(512)])
    theirs = qmc.Sobol(3, scramble=False).random(512)  # in Gray code's order: the same set
    np.testing.assert_array_equal(ours[np.lexsort(ours.T)], theirs[np.lexsort(theirs.T)])


@given(index=st.integers(0, 2**32 - 1), dimension=st.integers(0, 2))
def test_sobol_words_equal_the_reference(index, dimension):
    assert square.sobol_word(index, dimension) == reference.sobol_word(index, dimension)


# Promises


def assert_kept(made):
    for promise in set(made.promises) - {"unbiased"}:  # unbiased are many sets: below
        findings = check_promise(promise, made.points, made.domain, made.weights, tolerance=2e-15)
        assert all(finding.holds for finding in findings), (promise, findings)


@every_method
@settings(max_examples=15)
@given(data=st.data(), seed=seeds)
def test_every_set_keeps_its_methods_promises(domain, name, data, seed):
    made = sample_set(domain, name, number(data, domain, name), seed)
    assert made.points.dtype == np.float64
    assert made.promises == METHODS[domain][name].promises
    assert (made.weights is not None) == (name == "repulsion") == ("weights" in made.promises)
    assert_kept(made)


SETS = 4000


@pytest.mark.parametrize("n", [1, 7])
@pytest.mark.parametrize(("domain", "name"), [e for e in EVERY if "unbiased" in METHODS[e[0]][e[1]].promises])
def test_one_point_of_each_of_many_sets_is_uniform(domain, name, n):
    """The point's number is drawn, too: each of 'latin' is uniform in a row of its own. False alarms: 1e-6 each."""
    findings = check_promise("unbiased", [sample_set(domain, name, n, seed).points for seed in range(SETS)], domain)
    assert all(finding.holds for finding in findings), findings


def test_poissons_sets_are_denser_at_the_poles_and_promise_nothing_there():
    """Points near the ends of xi_1 have neighbours on one side only: one of seven is there too often."""
    points = np.array([sample_set("square", "poisson", 7, seed).points[seed % 7] for seed in range(SETS)])
    assert not check_promise("unbiased", points, "square")[0].holds
    assert "unbiased" not in METHODS["square"]["poisson"].promises


@pytest.mark.parametrize(("domain", "name"), [e for e in EVERY if METHODS[e[0]][e[1]].prefix])
@given(n=st.integers(1, 80), more=st.integers(1, 80), seed=seeds)
@settings(max_examples=15)
def test_sequences_begin_with_their_shorter_selves(domain, name, n, more, seed):
    long, short = (sample_set(domain, name, count, seed).points for count in (n + more, n))
    np.testing.assert_array_equal(bits(long[:n]), bits(short))


def test_the_other_methods_do_not():
    for domain, name in EVERY:
        if not METHODS[domain][name].prefix:
            assert not np.array_equal(sample_set(domain, name, 9, 1).points[:8], sample_set(domain, name, 8, 1).points)


@every_method
def test_seeds_matter_where_the_method_says_so(domain, name):
    sets = [sample_set(domain, name, 8, seed).points for seed in (0, 1, 2**32, 2**63)]
    for a, b in itertools.combinations(sets, 2):
        assert np.any(a != b) == METHODS[domain][name].seeded


# Shells


@pytest.mark.parametrize("name", METHODS["ball"])
@settings(max_examples=25)
@given(data=st.data(), seed=seeds, shell=shells.filter(lambda shell: shell[1] >= 1e-30))
def test_every_method_fills_every_shell(name, data, seed, shell):
    r_min, r_max = shell
    n = number(data, "ball", name, st.integers(1, 60))
    points = sample_set("ball", name, n, seed, r_min=r_min, r_max=r_max).points
    findings = check_promise("inside", points, "ball", r_min=r_min, r_max=r_max, tolerance=2e-15)
    assert all(finding.holds for finding in findings), findings


def test_shells_of_tables_keep_volumes():
    """The fraction of the volume below each point's radius is the same in the ball and in the shell."""
    whole, shell = (sample_set("ball", "repulsion", 64, r_min=r).points for r in (0.0, 0.8))
    before, after = (np.sqrt(np.sum(p**2, axis=1)) for p in (whole, shell))
    np.testing.assert_allclose((after**3 - 0.8**3) / (1 - 0.8**3), before**3, atol=1e-14)
    np.testing.assert_allclose(shell / after[:, None], whole / before[:, None], atol=1e-14)


@pytest.mark.parametrize(("arguments", "options", "words"), [
    (("ball", "latn", 8), {}, "did you mean 'latin'"),
    (("bal", "latin", 8), {}, "did you mean 'ball'"),
    (("square", "rejection", 8), {}, "choose one of random"),
    (("square", "spiral", 8), {}, "of the square"),
    (("ball", "latin", 0), {}, "a whole number from 1 to"),
    (("ball", "latin", 2.0), {}, "whole number"),
    (("ball", "latin", True), {}, "whole number"),
    (("ball", "latin", 8, -1), {}, "seed"),
    (("ball", "latin", 8, 2**64), {}, "seed"),
    (("ball", "latin", 8), {"rmin": 0.5}, "did you mean 'r_min'"),
    (("ball", "latin", 8), {"r_min": 0.9, "r_max": 0.8}, "r_min <= r_max"),
    (("ball", "latin", 8), {"r_min": -0.1}, "r_min <= r_max"),
    (("ball", "latin", 8), {"r_max": math.nan}, "r_min <= r_max"),
    (("ball", "latin", 8), {"r_min": math.nan}, "r_min <= r_max"),
    (("ball", "latin", 8), {"r_max": math.inf}, "r_min <= r_max"),
    (("ball", "latin", 8), {"r_max": "1"}, "r_min and r_max are 0.0 and '1'"),
    (("disk", "spiral", 8), {"turns": 0}, "turns"),
    (("disk", "repulsion", 8), {"centre": 1}, "centre"),
])  # fmt: skip
def test_what_is_refused(arguments, options, words):
    with pytest.raises(InputError, match=words):
        sample_set(*arguments, **options)
