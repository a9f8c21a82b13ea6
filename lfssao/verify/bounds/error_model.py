"""Limits of a renderer's float32 arithmetic: the error models of the oracle, by name.

A model states the largest relative difference between the result of one operation and the exact result of its
operands. One ulp of an exact result x, 2^e <= abs(x) < 2^(e + 1), is 2^(e - 23), so n ulp are at most n 2^-23 x.

    correctly rounded to nearest            half an ulp   2^-24 x
    correctly rounded in any direction      one ulp       2^-23 x     (GLSL 4.60 section 4.7.1, Vulkan, WGSL: + - *)
    division                                2.5 ulp                   (the same three, for divisors of normal size)
    inverse square root                     2 ulp; sqrt is inherited from 1 / inversesqrt, 2 + 2.5 ulp
    exp                                     3 + 2 abs(x) ulp
    sin, cos                                2^-11 in [-pi, pi], an absolute error (Vulkan; GLSL states none)

All three languages allow numbers below 2^-126 to be flushed to zero, and a product and a sum to be fused: that saves a
rounding, so each bound still holds. Two of them allow sums to be reordered. A correctly rounded result that is
representable is exact.

In every model but ``strict`` a renderer has further freedoms:

- Sums of a matrix row, of the blur and of 1 / N may be added in any order, and a row may be applied to the point and to
  the offset of a sample each, or to their sum.
- A quotient a / b may be a (1 / b).
- Offsets R s of the samples may be computed in float64 and rounded, or in float32 from a rounded R and a rounded s.
- k / N may be a quotient, k (1 / N), or the sum of k times 1 / N.
- Weights of the blur may be the table, or the Gaussian recomputed with exp, normalised before or after the sum. The
  texture between the two passes is float32.
- rgb (1 - ao) may be rgb - rgb ao.
- A perspective camera's window depths, of sample and surface, may be converted to distances before the comparison.
- The next pass may read a texture that is stored in fewer bits, or keep the numbers from before (``stored``).
- Taps of alchemy, sao and hbao, and slices, may be turned by a cosine and a sine, or by an angle. The angles, in
  [-pi, pi], are rounded before and after the sum. With rounding to nearest, two angles and their sum are off by 2^-21,
  and a sine within 2 ulp by 2^-23. The large sums of ``angle_sum`` float32 are rounded to nearest, and so are their
  sines.
- The angle of a cosine, which weights a slice, may have a relative error of 4096 ulp (Vulkan). Its sine or cosine may
  not replace the known sine and cosine of the direction.
- Visibility, 1 - ao, may be merged (by the minimum), blurred and multiplied by, and subtracted from 1 to be written.

A renderer may not change its inputs: the numbers of the mapping and of ``screen_to_world``, each rounded once to
float32, N, and texture look-ups at the floor of a coordinate.
"""

from dataclasses import dataclass

import numpy as np

from lfssao.errors import check_choice
from lfssao.verify.bounds.kernels.images import Errors

ULP = 2.0**-23


@dataclass(frozen=True)
class ErrorModel:
    """The largest errors of a float32 renderer's operations."""

    name: str  # as in the oracle's functions and on the command line
    title: str  # one line for lists
    # Whether results are rounded to nearest even, in the written order, nothing fused: each stage then has one right
    # value, and the numbers below are not used.
    exact: bool = False
    operation: float = ULP  # relative error of + - *
    quotient: float = 3.5 * ULP * (1 + ULP * 4)  # relative error of a / b, or of a (1 / b) if that is more
    root: float = 4.5 * ULP * (1 + ULP * 8)  # relative error of a square root
    # Relative error of exp(x): the first, plus abs(x) times the second.
    exponential: tuple[float, float] = (3.0 * ULP, 2.0 * ULP)
    # Largest errors in texels: of a look-up's coordinate (samplers of fixed precision; 0 for a floor), and of the point
    # of a texel whose surface is seen (precision of rays or rasteriser).
    coordinate: float = 0.0
    centre: float = 2.0**-8
    # Absolute error of sine and cosine, of an angle in [-pi, pi] that a renderer adds to a tap's own and rounds.
    angle: float = 2.0**-11 + 2.0**-19
    smallest: float = 2.0**-126  # numbers below it may be flushed to zero

    @property
    def offset(self) -> float:
        """Relative error of an offset R s: of R and s rounded to nearest, and of their product."""
        return ((1 + 2.0**-24) ** 2 * (1 + self.operation) - 1) * (1 + 2.0**-30)

    @property
    def errors(self) -> Errors:
        """The errors as kernels take them."""
        model = np.array([self.operation, self.quotient, self.root, *self.exponential])
        return Errors(self.operation, self.quotient, self.root, self.offset, self.coordinate, self.angle, model)


_MODELS = (
    ErrorModel("shader", "as GLSL, Vulkan and WGSL demand: + - * within 1 ulp, division 2.5 ulp, fused or not"),
    ErrorModel(
        "sampler", "shader, and textures are read by a nearest sampler with 8 bits below the texel", coordinate=2.0**-8
    ),
    ErrorModel(
        "nearest",
        "+ - * / sqrt rounded to nearest (C, CUDA), fused or not, any order",
        operation=0.5 * ULP,
        quotient=ULP * (1 + ULP),
        root=0.5 * ULP,
        exponential=(2.0 * ULP, 0.0),
        centre=2.0**-12,
        angle=2.0**-20,
    ),
    ErrorModel("strict", "+ - * / sqrt rounded to nearest in the written order: equal bits", exact=True),
)
MODELS = {model.name: model for model in _MODELS}
KIT_MODEL = "shader"  # the model of the bounds in a kit


def find_model(model: str | ErrorModel) -> ErrorModel:
    """The error model of a name, or the model itself; InputError if there is no model of that name."""
    if isinstance(model, ErrorModel):
        return model
    check_choice("error model", model, MODELS)
    return MODELS[model]
