"""Settings that a run of the work-precision bench measures: sizes, samplers and sample sets."""

from dataclasses import dataclass

from lfssao.ao.estimators.estimator import Estimator, FloatArray, Value
from lfssao.samples.methods import METHODS
from lfssao.samples.registry import sample_set

Variant = tuple[str | None, int | None]  # sampler and number of samples, None where the estimator makes its own
# Points and weights, None where the estimator makes its own; and its parameters.
Inputs = tuple[tuple[FloatArray | None, FloatArray | None], dict[str, Value]]

SCENES = ("gallery", "statue", "corner")

# Estimators that take a disk's points as taps whose radii are in equal steps, not as points that fill it evenly.
_TAPS = ("alchemy",)

# Estimators whose samples are boxes that stand for areas, no point set of the disk. They run with their defaults.
_BOXES = ("vo-area",)

# The same for estimators by slices, whose two sides have steps each.
_SLICES: dict[int | None, dict[str, Value]] = {4 * n * n: {"slices": n, "steps": 2 * n} for n in (1, 2, 8)}

# Parameters that set the number of taps of estimators that make their own.
_OWN_COUNTS: dict[str, dict[int | None, dict[str, Value]]] = {
    "sao": {n: {"taps": n, "turns": 0} for n in (1, 4, 16, 64, 256)},
    "sao-equation-1": {n: {"taps": n, "turns": 0} for n in (1, 4, 16, 64, 256)},
    "hbao": {n * n: {"directions": n, "steps": n} for n in (1, 2, 4, 16, 32)},
    "gtao": _SLICES,
    "visibility-bitmask": _SLICES,
}


@dataclass(frozen=True)
class Grid:
    """Sizes of a run."""

    width: int = 256  # texture, texels
    height: int = 192
    counts: tuple[int, ...] = (1, 4, 8, 16, 64, 256)  # numbers of samples
    # Sets of radii, fractions of the scene's diagonal; the textures of a set are merged
    radii: tuple[tuple[float, ...], ...] = ((0.02,), (0.08,), (0.02, 0.08))
    blurs: tuple[float, ...] = (0.0, 1.0)  # sigmas, texels
    samplers: tuple[str, ...] | None = None  # samplers; None: all of the domain
    # Samplers of the references. A sampler is never compared with a reference of its own; two others must be left
    reference_samplers: tuple[str, ...] = ("sobol", "halton", "fibonacci")
    # Samples of each reference, a power of two: float32 then adds equal weights without rounding
    reference_count: int = 32_768
    seeds: int = 5  # sets that errors are over
    spread: float = 0.03  # times are repeated until the three least are within this fraction
    most: int = 60  # runs of each time
    # Whether estimators that make their own taps are measured with other numbers of taps than their default
    own_counts: bool = True

    @property
    def each_radius(self) -> tuple[float, ...]:
        """Each radius once."""
        return tuple(sorted({radius for radii in self.radii for radius in radii}))


FULL = Grid()
QUICK = Grid(
    width=128,
    height=96,
    counts=(4, 16, 64),
    radii=((0.02,),),
    samplers=("random", "latin", "poisson"),
    reference_samplers=("sobol", "halton"),
    reference_count=16_384,
    seeds=2,
    most=20,
    own_counts=False,
)


def takes_samples(estimator: Estimator) -> bool:
    """Whether the number of samples is varied; other estimators run with their defaults."""
    return estimator.dimensions > 0 and estimator.name not in _BOXES


def samplers_of(estimator: Estimator, grid: Grid) -> tuple[str, ...]:
    """Return samplers whose sets tend to the integral of the estimator's own set.

    Repulsion's points are not even without their weights, which few estimators read; the spiral's are taps.
    """
    left_out = set() if estimator.name in _TAPS else {"spiral"}
    if estimator.default_samples()[1] is None:
        left_out.add("repulsion")
    names = [name for name in METHODS[_domain(estimator)] if name not in left_out]
    return tuple(name for name in names if grid.samplers is None or name in grid.samplers)


def counts_of(estimator: Estimator, sampler: str, grid: Grid) -> list[int]:
    """Return counts for which a sampler has sets."""
    most = METHODS[_domain(estimator)][sampler].most
    return [n for n in grid.counts if most is None or n <= most]


def inputs_of(estimator: Estimator, grid: Grid, seed: int) -> dict[Variant, Inputs]:
    """The inputs of all that is measured of an estimator, of one seed; None is its own default number of taps."""
    if not takes_samples(estimator):
        counts = {None: {}, **(_OWN_COUNTS.get(estimator.name, {}) if grid.own_counts else {})}
        return {(None, n): ((None, None), parameters) for n, parameters in counts.items()}
    return {
        (sampler, n): (samples_for(estimator, sampler, n, seed), {})
        for sampler in samplers_of(estimator, grid)
        for n in counts_of(estimator, sampler, grid)
    }


def samples_for(estimator: Estimator, sampler: str, n: int, seed: int) -> tuple[FloatArray, FloatArray | None]:
    """Return points and weights of one set; those of LF's estimators fill the shell of ``make_samples``."""
    domain = _domain(estimator)
    shell = {"r_min": 0.8, "r_max": 1.0} if estimator.sampling is not None else {}
    samples = sample_set(domain, sampler, n, seed, **shell)
    if estimator.name in _TAPS and sampler != "spiral":
        return samples.points * (samples.points**2).sum(axis=1, keepdims=True) ** 0.5, None
    return samples.points, samples.weights


def _domain(estimator: Estimator) -> str:
    return "ball" if estimator.dimensions == 3 else "disk"
