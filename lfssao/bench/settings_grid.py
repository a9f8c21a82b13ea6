"""What a run of the work-precision bench measures: sizes, samplers and sample sets."""

from collections.abc import Iterator
from dataclasses import dataclass

from lfssao.estimators.estimator import Estimator, FloatArray, Value
from lfssao.samples.registry import METHODS, sample_set

# One estimator takes a disk's points as taps whose radii are in equal steps, not as points that fill it evenly.
_TAPS = ("alchemy",)

# Estimators whose samples are no point set of the disk: boxes that stand for areas. They run with their defaults.
_BOXES = ("vo-area", "vo-area-normal")

# Sizes of the tap sets that other estimators make themselves, by the parameters that set them.
_OWN_COUNTS: dict[str, tuple[dict[str, Value], ...]] = {
    "sao": tuple({"taps": n, "turns": 0} for n in (1, 4, 16, 64, 256)),
    "sao-equation-1": tuple({"taps": n, "turns": 0} for n in (1, 4, 16, 64, 256)),
    "hbao": tuple({"directions": n, "steps": n} for n in (1, 2, 4, 16, 32)),
}


@dataclass(frozen=True)
class Plan:
    """Sizes of a run.

    Attributes
    ----------
    width, height : int
        Texture, texels.
    counts : tuple of int
        Numbers of samples.
    radii : tuple of tuple of float
        Sets of radii, shares of the scene's diagonal.
    dtypes : tuple of str
        Arithmetic.
    blurs : tuple of float
        Sigmas, texels.
    samplers : tuple of str or None
        Which; None: all of the domain.
    reference_samplers : tuple of str
        What references are made by; a sampler is never compared with a reference of its own, and two others are left.
    reference_dtype : str
        Arithmetic of the references; float32 moves them by less than 1e-5.
    reference_count : int
        Samples of each reference, a power of two: float32 then adds equal weights without rounding.
    twice : tuple of str
        Estimators whose references have twice as many, as they err least with the most samples: an error is told from
        a reference's where it is ten times that.
    seeds : int
        Sets that a sampling error is over, of up to ``FEW`` samples; one of more.
    repeats : int
        Warm runs of each time.
    timed : int
        Up to so many samples each sampler has a time of its own, which the points' order can change; beyond it
        ``TIMED_FOR_ALL`` is timed for all.
    own_counts : bool
        Whether estimators that make their own taps are measured with other numbers of them than their default.
    """

    width: int
    height: int
    counts: tuple[int, ...]
    radii: tuple[tuple[float, ...], ...]
    dtypes: tuple[str, ...]
    blurs: tuple[float, ...]
    samplers: tuple[str, ...] | None
    reference_samplers: tuple[str, ...]
    reference_dtype: str
    reference_count: int
    twice: tuple[str, ...]
    seeds: int
    repeats: int
    timed: int
    own_counts: bool

    @property
    def shares(self) -> tuple[float, ...]:
        """Each radius once."""
        return tuple(sorted({share for radii in self.radii for share in radii}))

    def references_of(self, estimator: str) -> int:
        """How many samples each of an estimator's references has."""
        return self.reference_count * (2 if estimator in self.twice else 1)


FEW = 256

TIMED_FOR_ALL = "random"

FULL = Plan(
    256, 192, (1, 4, 16, 64, 256, 1024, 4096), ((0.02,), (0.01, 0.02, 0.035)), ("float32", "float64"), (0.0, 1.0),
    None, ("sobol", "halton", "fibonacci"), "float32", 262_144,
    ("vo-points", "vo-points-normal"), 4, 20, 256, True,
)  # fmt: skip
QUICK = Plan(
    256, 192, (4, 16, 64), ((0.02,),), ("float32",), (0.0, 1.0), ("random", "latin", "poisson"), ("sobol", "halton"),
    "float32", 65_536, (), 4, 20, 64, False,
)  # fmt: skip


def takes_samples(estimator: Estimator) -> bool:
    """Whether its number of samples is varied; others are one point with their defaults."""
    return estimator.dimensions > 0 and estimator.name not in _BOXES


def samplers_of(estimator: Estimator, plan: Plan) -> tuple[str, ...]:
    """Samplers that an estimator is measured with: those whose sets tend to the same integral.

    Repulsion's points are not even without their weights, which few estimators read; the spiral's are taps.
    """
    left_out = set() if estimator.name in _TAPS else {"spiral"}
    if estimator.default_samples()[1] is None:
        left_out.add("repulsion")
    names = [name for name in METHODS[_domain(estimator)] if name not in left_out]
    return tuple(name for name in names if plan.samplers is None or name in plan.samplers)


def counts_of(estimator: Estimator, sampler: str, plan: Plan) -> Iterator[int]:
    """The counts that a sampler has sets of."""
    most = METHODS[_domain(estimator)][sampler].most
    return (n for n in plan.counts if most is None or n <= most)


def own_counts_of(estimator: Estimator, plan: Plan) -> list[tuple[int | None, dict[str, Value]]]:
    """Numbers of taps of an estimator that makes its own, and the parameters that set them; None and none: default."""
    others = _OWN_COUNTS.get(estimator.name, ()) if plan.own_counts else ()
    return [(None, {}), *((_taps(parameters), parameters) for parameters in others)]


def _taps(parameters: dict[str, Value]) -> int:
    return int(parameters["taps"]) if "taps" in parameters else int(parameters["directions"]) * int(parameters["steps"])


def samples_for(
    estimator: Estimator, sampler: str, n: int, seed: int
) -> tuple[FloatArray, FloatArray | None]:  # fmt: skip
    """Points and weights of one set, for LF's estimators in LF's shell, as ``make_samples`` fills it."""
    domain = _domain(estimator)
    shell = {"r_min": 0.8, "r_max": 1.0} if estimator.sampling is not None else {}
    made = sample_set(domain, sampler, n, seed, **shell)
    if estimator.name in _TAPS and sampler != "spiral":
        return made.points * (made.points**2).sum(axis=1, keepdims=True) ** 0.5, None
    return made.points, made.weights


def _domain(estimator: Estimator) -> str:
    return "ball" if estimator.dimensions == 3 else "disk"
