"""Changes of the taps of SAO's spiral that its estimators have no option for."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from lfssao.ao.estimators.sao.estimator import SaoOptions, tap_angles
from lfssao.ao.estimators.sao.sampling import Sao
from lfssao.core.elementary import PI, sincospi
from lfssao.verify.diagnosis.change import Change, plain


def tap_changes(problem: Any) -> Iterator[Change]:
    """Yield changes of the taps, for an estimator with a spiral of taps."""
    options = problem.estimator.options(**problem.options)
    if not isinstance(options, SaoOptions):
        return
    for words, half in (("(i + 1) / n", 0.5), ("i / n", -0.5)):
        yield _tap_change(
            f"taps at {words} of the radius in place of (i + 1/2) / n", partial(_shifted_taps, options, half)
        )
    yield _tap_change("the last tap left out, sum divided as before", partial(_selected_taps, slice(None, -1)))
    yield _tap_change("the first tap left out, sum divided as before", partial(_selected_taps, slice(1, None)))
    if options.angle_sum == "float32":
        yield _tap_change("samples turned the other way", _turned_back)


def _tap_change(kind: str, change: Callable[[Sao], Sao]) -> Change:
    """A change of the estimator's numbers; it has another name, so that it has no bounds."""

    def apply(problem: Any) -> Any:
        own = problem.estimator
        return problem.changed(estimator=replace(own, name=f"{own.name}, {kind}", run=partial(own.run, change=change)))

    return plain(kind, apply)


def _shifted_taps(options: SaoOptions, taps: float, numbers: Sao) -> Sao:
    """Taps shifted along the spiral by ``taps`` of the distance to the next tap."""
    first, second = tap_angles(options)[:2] if options.taps > 1 else (0.0, 0.0)
    angles = tap_angles(options) + taps * (second - first)
    points = np.array([(*sincospi(angle / PI)[::-1], 0.0) for angle in angles.tolist()])
    points[:, 2] = numbers.points[:, 2] + taps / options.taps
    shifted = None if numbers.angles is None else angles
    return numbers._replace(points=points.astype(numbers.points.dtype), angles=shifted)


def _selected_taps(kept: slice, numbers: Sao) -> Sao:
    """Some of the taps."""
    angles = None if numbers.angles is None else np.ascontiguousarray(numbers.angles[kept])
    return numbers._replace(points=np.ascontiguousarray(numbers.points[kept]), angles=angles)


def _turned_back(numbers: Sao) -> Sao:
    """Taps with hashes subtracted from their angles: angles subtracted from hashes, with sines of the other sign."""
    return numbers._replace(angles=-numbers.angles, up=not numbers.up)
