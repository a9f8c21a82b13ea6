"""Explain the samples of one texel: which texel each sample reads, and its distance to another outcome."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfssao.core.affine import Matrix
from lfssao.optics.view import WorldToImage
from lfssao.verify.bounds.bounds import Texture
from lfssao.verify.bounds.error_model import MODELS, ErrorModel, find_model
from lfssao.verify.bounds.kernels.point_bounds import trace_samples
from lfssao.verify.bounds.kernels.sums import LIMITLESS, OPEN
from lfssao.verify.bounds.ssao import checked_view, sample_points, with_depth_ends

_NEGLIGIBLE = 2.0**-64  # smaller terms come from numbers that may be flushed to zero
OUTCOMES = ("clear", "occluded", "undecided")


@dataclass(frozen=True)
class Sample:
    """One sample of one texel: the texel that it reads, and its outcome."""

    number: int  # from 0
    outcome: str  # 'clear', 'occluded', or 'undecided': rounding decides
    # Image point, texels and image z, in exact arithmetic; undefined outside the mapping's domain.
    u: float
    v: float
    z: float
    texel: tuple[int, int] | None  # (column, row) that it reads; None outside the texture or the domain
    edge_distance: float  # distance, in texels, of the image point from the nearest edge of that texel
    depth_behind: float  # z less the depth of the surface there: positive if occluded; -infinity without a surface
    error_uv: float  # largest error of u or v
    error_z: float  # largest error of z

    def __str__(self) -> str:
        if self.texel is None:
            return f"sample {self.number} is {self.outcome}: it lies outside the texture or the mapping's domain"
        where = f"reads texel {self.texel}, {self.edge_distance:.1e} from its edge (error up to {self.error_uv:.1e})"
        if self.depth_behind == -np.inf:
            return f"sample {self.number} is {self.outcome}: it {where}, which sees no surface"
        side = "behind" if self.depth_behind > 0 else "before"
        depth = f"{abs(self.depth_behind):.1e} {side} its surface (error up to {self.error_z:.1e})"
        return f"sample {self.number} is {self.outcome}: it {where}, and lies {depth}"


@dataclass(frozen=True)
class Term:
    """One sample of one texel: the texel that it reads, and the least and the largest term that it adds."""

    number: int  # from 0
    # Image point, texels, in exact arithmetic; undefined outside the mapping's domain.
    u: float
    v: float
    texel: tuple[int, int] | None  # (column, row) that it reads; None outside the texture or the domain
    edge_distance: float  # distance, in texels, of the image point from the nearest edge of that texel
    error_uv: float  # error of u or v
    least: float
    most: float

    def __str__(self) -> str:
        if self.texel is None and self.most == 0:
            return f"sample {self.number} lies outside the texture or the mapping's domain"
        most = "any number" if self.most >= LIMITLESS else f"{self.most:.4g}"
        adds = f"{self.least:.4g}" if self.is_decided else f"{self.least:.4g} to {most}"
        where = "next to the border" if self.texel is None else f"{self.edge_distance:.1e} from its edge"
        where = f"{where} (error up to {self.error_uv:.1e})"
        read = f"reads texel {self.texel}, " if self.texel else "lies "
        return f"sample {self.number} {read}{where}, and adds {adds}"

    @property
    def is_decided(self) -> bool:
        """Whether rounding hardly changes the term."""
        return self.most - self.least <= max(OPEN * self.most, _NEGLIGIBLE)


def _texel_of(u: float, v: float, in_domain: bool, shape: tuple[int, ...]) -> tuple[tuple[int, int] | None, float]:
    """Column and row of an image point and its distance from the texel's edge; None and infinity outside."""
    if not (in_domain and 0 <= u < shape[1] and 0 <= v < shape[0]):
        return None, np.inf
    column = int(u)
    row = int(v)
    return (column, row), min(u - column, column + 1 - u, v - row, row + 1 - v)


def sorted_terms(trace: NDArray[np.float64], shape: tuple[int, int]) -> list[Term]:
    """The terms of a texel's trace (``points.term_tracer``), the nearest to another outcome first.

    Undecided terms come first; the others are sorted by the distance to the edge in units of the error. ``shape`` is
    the texture's.
    """

    def closeness(term: Term) -> tuple[bool, float]:
        return term.is_decided, term.edge_distance / term.error_uv if term.error_uv > 0 else np.inf

    found = []
    for number, (u, e_u, v, e_v, least, most) in enumerate(trace.tolist()):
        texel, distance = _texel_of(u, v, e_u > -np.inf, shape)
        found.append(Term(number, u, v, texel, distance, max(e_u, e_v), least, most))
    return sorted(found, key=closeness)


def explainer(
    depth: Texture,
    positions: Texture | None,
    world_to_image: WorldToImage,
    samples: NDArray[np.floating[Any]],
    radius: float,
    model: str | ErrorModel = "shader",
    screen_to_world: Matrix | None = None,
    turns: Texture | None = None,
    depth_error: float = 0.0,
) -> Callable[[tuple[int, int]], list[Sample]]:
    """Return a function of (column, row) that lists a texel's samples, the nearest to another outcome first.

    Undecided samples come first. The others are sorted by their distance to the edge or to the surface, whichever is
    smaller in units of the error. A texel without a surface has none. Arguments and errors are those of
    ``ssao.ao_bounds``; an exact model has no errors, so ``nearest`` replaces it. The depths of the whole texture are
    prepared once.
    """
    error_model = find_model(model)
    error_model = MODELS["nearest"] if error_model.exact else error_model
    view = with_depth_ends(
        checked_view(depth, positions, world_to_image, radius, screen_to_world, turns, depth_error), error_model
    )
    offsets = sample_points(samples, radius)

    def explain(texel: tuple[int, int]) -> list[Sample]:
        i, j = texel
        if not depth[j, i] < np.inf:
            return []
        traced = np.empty((len(samples), 9))
        trace_samples(view, offsets, j, i, error_model.errors, traced)
        found = []
        for number, (u, e_u, v, e_v, z, e_z, in_domain, _, outcome) in enumerate(traced.tolist()):
            read, distance = _texel_of(u, v, bool(in_domain), depth.shape)
            depth_behind = np.inf if read is None else z - float(depth[read[1], read[0]])
            outcome_name = OUTCOMES[int(outcome)]
            found.append(Sample(number, outcome_name, u, v, z, read, distance, depth_behind, max(e_u, e_v), e_z))
        return sorted(found, key=_closeness)

    return explain


def _closeness(sample: Sample) -> tuple[bool, float]:
    """A key that sorts undecided samples first, the others by distance to another outcome in units of the error."""
    edge_ratio = sample.edge_distance / sample.error_uv if sample.error_uv > 0 else np.inf
    depth_ratio = abs(sample.depth_behind) / sample.error_z if sample.error_z > 0 else np.inf
    return sample.outcome != "undecided", min(edge_ratio, depth_ratio)
