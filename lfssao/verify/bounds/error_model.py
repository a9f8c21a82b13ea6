"""Limits of a renderer's float32 arithmetic: the error models of the oracle, by name.

A model says by how much the result of one operation may differ from the exact result of its operands, relative to
that result. One ulp of an exact result x, 2^e <= abs(x) < 2^(e + 1), is 2^(e - 23), so n ulp are at most n 2^-23 x.

    correctly rounded to nearest            half an ulp   2^-24 x
    correctly rounded, direction not said   one ulp       2^-23 x     (GLSL 4.60 section 4.7.1, Vulkan, WGSL: + - *)
    division                                2.5 ulp                   (the same three, for divisors of normal size)
    inverse square root                     2 ulp; sqrt is inherited from 1 / inversesqrt, 2 + 2.5 ulp
    exp                                     3 + 2 abs(x) ulp
    sin, cos                                2^-11 in [-pi, pi], an absolute error (Vulkan; GLSL says nothing)

All three allow numbers below 2^-126 to be flushed to zero, and a product and a sum to be fused (one rounding less, so
each bound holds all the more). Two of them allow sums to be reordered. A correctly rounded result that is representable
is exact.

A renderer is free to do more, in every model but ``strict``:

- Sums of a matrix row, of the blur and of 1 / N may be added in any order, and a row may be applied to the point and to
  the offset of a sample each, or to their sum.
- A quotient a / b may be a (1 / b).
- Offsets R s of the samples may be made in float64 and rounded, or in float32 of a rounded R and a rounded s.
- k / N may be a quotient, k (1 / N), or the sum of k times 1 / N.
- Weights of the blur may be the table, or the Gaussian recomputed with exp, normalised before or after the sum; the two
  passes may be made of float32 intermediate textures only.
- rgb (1 - ao) may be rgb - rgb ao.
- A perspective camera's window depths, of sample and surface, may be made distances before they are compared.
- A texture that is stored in fewer bits may be read by the next pass, or that has the numbers of before (``stored``).
- Taps of alchemy, sao and hbao, and slices, may be turned by a cosine and a sine, or by an angle; the angles,
  in [-pi, pi], are rounded before and after. Two and their sum are off by 2^-21 to nearest, a sine of 2 ulp by 2^-23.
  Sums of ``angle_sum`` float32, which are large, are the nearest numbers, and sines of them are as good.
- The angle of a cosine, by which slices are weighted, may be off by as much of itself, 4096 ulp (Vulkan). A sine or
  cosine of such an angle, in place of those that are known of directions, is none that is allowed.
- Visibility, 1 - ao, may be merged (by the minimum), blurred and multiplied by, and subtracted from 1 to be written.

It may not change its inputs: the numbers of the mapping and of ``screen_to_world``, each rounded once to
float32, N, and texture look-ups at the floor of a coordinate.
"""

from dataclasses import dataclass

import numpy as np

from lfssao.errors import check_choice
from lfssao.verify.bounds.kernels.images import Errors

ULP = 2.0**-23


@dataclass(frozen=True)
class ErrorModel:
    """How a float32 renderer may round."""

    name: str  # its name in the oracle's functions and on the command line
    title: str  # one line for lists
    # Whether it is correctly rounded to nearest even in the written order, nothing fused: each stage has one right
    # value. The numbers below mean nothing then.
    exact: bool = False
    operation: float = ULP  # relative error of + - *
    quotient: float = 3.5 * ULP * (1 + ULP * 4)  # relative error of a / b, or of a (1 / b) if that is more
    root: float = 4.5 * ULP * (1 + ULP * 8)  # relative error of a square root
    # Relative error of exp(x): the first, plus abs(x) times the second.
    exponential: tuple[float, float] = (3.0 * ULP, 2.0 * ULP)
    # Distances in texels, by which a look-up may miss the coordinate (samplers of fixed precision; 0 for a floor), and
    # from its centre at which a texel's surface may be seen (precision of rays or rasteriser).
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
        """The numbers as kernels take them."""
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
