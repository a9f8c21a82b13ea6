"""Bent normals: the mean of the directions that are open, by estimators that march along slices.

The bent normal at a point with the normal n is the unit vector of B, the integral of V(omega) W(omega) omega over the
half space above it: V is 1 for open directions and 0 for hidden ones, W the estimator's weight, cos(theta) or 1. The
formulas of the estimator (``slices``) sum its components along the world's axes, one after the other.

Exact answers of rays with constant falloff (``ground_truth``): the tangent of the angle from n, away from what hides;
S(c) = (arccos c - c sqrt(1 - c^2)) / pi:

==============================================  ==========================================  ==========================
surface, from P                                 cosine                                      uniform
==============================================  ==========================================  ==========================
plane, convex crease, top of a step             0                                           0
face of a right-angle crease, c R to the other  4 (1 - c^2)^(3/2) / (pi (2 - c) (1 + c)^2)  (1 - c^2) / (2 - 2 S(c))
floor before a wall up to the angle a, R = inf  sin^2 a / (pi - a + sin a cos a)            tan(a / 2)
==============================================  ==========================================  ==========================

``gtao`` has them where the view is parallel and sees the whole surface within R, of many slices and steps.
"""

import numpy as np

from lfssao.ao.estimators.estimator import Estimator, Value
from lfssao.ao.estimators.registry import check_bent, find_estimator, options_at
from lfssao.ao.formulas import float_view, words_of
from lfssao.ao.kernels.folds import fold_steps
from lfssao.ao.ssao import run_kernel
from lfssao.ao.textures import Buffers, Texture
from lfssao.core.affine import unit_vectors
from lfssao.core.distinct import distinct
from lfssao.errors import InputError


def bent_normals(
    name: str | Estimator, buffers: Buffers, radius: float, units: Value = "radii", **parameters: Value
) -> Texture:
    """Return the bent normals of one view, in world space, by the estimator of a name.

    Parameters
    ----------
    name : str or Estimator
        An estimator that has them, gtao or visibility-bitmask, or one of one's own.
    buffers : Buffers
        The view's textures; their dtype is the arithmetic's. Slices turn by their ``turns``.
    radius : float
        R, world units.
    units : str
        'radii', or 'world' for options that are lengths, defaults too, in world units.
    parameters : numbers or str
        The estimator's options by name, in place of their defaults. The power of the visibility changes nothing.

    Returns
    -------
    Texture
        Unit vectors (H, W, 3) in depth's dtype; 0 where there is no surface, no direction is open or R is 0.

    Raises
    ------
    InputError
        If the estimator has none, its formulas have no steps or no axis, or as ``estimate`` does.

    Examples
    --------
    >>> display = lfssao.find_display("virtual").with_resolution(64, 48)
    >>> textures = lfssao.render("corner", display, lfssao.Settings((0.1,), normals="geometric"))[0]
    >>> buffers = lfssao.Buffers.of(textures.gbuffer, textures.view)
    >>> lfssao.bent_normals("gtao", buffers, radius=0.1).shape
    (48, 64, 3)
    """
    estimator = name if isinstance(name, Estimator) else find_estimator(name)
    check_bent(estimator)
    assert estimator.formulas is not None  # those that have them are formulas
    (options,) = options_at(estimator, buffers, (radius,), units, parameters)
    made = estimator.formulas(buffers, radius, None, None, options)
    for field in ("steps", "axis"):
        if field not in made._fields:
            raise InputError(f"estimator {estimator.name}: its formulas have no field '{field}' for bent normals")
    formulas = distinct(made)
    view = float_view(buffers, words_of(formulas), options)
    axes = (formulas._replace(axis=axis) for axis in range(3))
    sums = [run_kernel(fold_steps, buffers.depth, view, each).texture for each in axes]
    return unit_vectors(np.stack(sums, axis=-1))
