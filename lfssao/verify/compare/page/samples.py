"""Picture of a texel's samples: where each lands in the depth texture, and how it is decided there, as inline SVG."""

from base64 import b64encode
from collections.abc import Sequence
from math import ceil, floor, isfinite

import numpy as np
from markupsafe import Markup

from lfssao.files.pictures import depth_codes, image_png
from lfssao.verify.bounds.bounds import Texture
from lfssao.verify.bounds.explain import Sample, Term

_SIDE, _GAP, _LEFT, _TOP = 220, 64, 8, 22  # pixels: side of a panel, gap between both, and margins
_DOTS = 7  # pixels: radius of a sample's dot
_MOST_TEXELS = 96  # of the window's side: a wider one would be too large a file
_ROOM = 1.08, 0.6  # of the window: a factor and texels beyond the outermost sample, so that its dot is whole


def draw_samples(
    texel: tuple[int, int], depth: Texture, samples: Sequence[Sample] | Sequence[Term], guard: int = 0
) -> Markup:
    """Return SVG of a texel's samples, '' where none lands in the texture.

    texel: (column, row) in the texture without its guard band; depth (H, W) and the samples' places are with it.
    The left panel shows where samples land in depth, light near the viewer. The right one shows image z of each and
    the depth of the surface there, or the least and the largest term that a sample adds.
    """
    landed = sorted((each for each in samples if each.texel is not None), key=lambda each: each.number)
    if not landed:
        return Markup("")
    middle = texel[0] + guard + 0.5, texel[1] + guard + 0.5
    reach = max(max(abs(s.u - middle[0]), abs(s.v - middle[1])) for s in landed)
    half = min(reach * _ROOM[0] + _ROOM[1], _MOST_TEXELS / 2)
    width = 2 * _SIDE + _GAP + 2 * _LEFT
    height = _SIDE + 2 * _TOP
    is_depth = isinstance(landed[0], Sample)
    titles = "samples in depth", "z, and the surface's depth there" if is_depth else "terms, least to largest"
    places = _LEFT, _LEFT + _SIDE + _GAP
    parts = [Markup('<text x="{}" y="15">{}</text>').format(*pair) for pair in zip(places, titles, strict=True)]
    parts += [_window(middle, half, depth, landed), _heights(landed)]
    words = f"Samples of texel {texel}: " + "; ".join(map(str, landed))
    head = '<svg class="samples" role="img" width="{0}" height="{1}" viewBox="0 0 {0} {1}" aria-label="{2}">'
    return Markup(head).format(width, height, words) + Markup("").join(parts) + Markup("</svg>")


def _kind(each: Sample | Term) -> str:
    """Class of a sample: its outcome, or that its term is nothing for sure, something for sure, or undecided."""
    if isinstance(each, Sample):
        return each.outcome
    if not each.is_decided:
        return "undecided"
    return "occluded" if each.most > 0 else "clear"


def _dot(x: float, y: float, each: Sample | Term) -> Markup:
    """A numbered dot with the sample's sentence as its tooltip."""
    circle = Markup('<circle cx="{:.1f}" cy="{:.1f}" r="{}"/>').format(x, y, _DOTS)
    number = Markup('<text x="{:.1f}" y="{:.1f}">{}</text>').format(x, y + 3.5, each.number)
    return Markup('<g class="{}"><title>{}</title>{}{}</g>').format(_kind(each), str(each), circle, number)


def _window(middle: tuple[float, float], half: float, depth: Texture, landed: Sequence[Sample | Term]) -> Markup:
    """Depth about the texel, cut to whole texels, the texel itself as a frame, and the samples' dots."""
    from PIL import Image  # late: only pictures need it

    rows, columns = depth.shape
    scale = _SIDE / (2 * half)
    left = max(floor(middle[0] - half), 0)
    right = min(ceil(middle[0] + half), columns)
    top = max(floor(middle[1] - half), 0)
    bottom = min(ceil(middle[1] + half), rows)
    png = image_png(Image.fromarray(depth_codes(np.asarray(depth[top:bottom, left:right]))[..., 0]))

    def at(u: float, v: float) -> tuple[float, float]:
        return (u - middle[0] + half) * scale, (v - middle[1] + half) * scale

    x, y = at(left, top)
    picture = Markup(
        '<svg x="{}" y="{}" width="{}" height="{}"><image x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}"'
        ' preserveAspectRatio="none" href="data:image/png;base64,{}"/>'
    ).format(_LEFT, _TOP, _SIDE, _SIDE, x, y, (right - left) * scale, (bottom - top) * scale, b64encode(png).decode())
    own = at(middle[0] - 0.5, middle[1] - 0.5)
    frame = Markup('<rect class="own" x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}"/>').format(
        *own, scale, scale
    )
    dots = [_dot(*at(each.u, each.v), each) for each in landed]
    return picture + frame + Markup("").join(dots) + Markup("</svg>")


def _ends(each: Sample | Term) -> tuple[float, float]:
    """Values of the right panel: z and the depth of the surface, or the least and the largest term."""
    if isinstance(each, Term):
        return each.least, each.most
    return each.z, each.z - each.depth_behind


def _heights(landed: Sequence[Sample | Term]) -> Markup:
    """A column a sample: from its z, a dot, to the surface, a bar; farther away is higher."""
    known = [value for each in landed for value in _ends(each) if isfinite(value) and abs(value) < 1e30]
    low, high = (min(known), max(known)) if known else (0.0, 1.0)
    spread = (high - low) or 1.0
    inner = _SIDE - 4 * _DOTS
    panel = Markup('<rect class="panel" x="{}" y="{}" width="{}" height="{}"/>')
    parts = [panel.format(_LEFT + _SIDE + _GAP, _TOP, _SIDE, _SIDE)]

    def at(value: float) -> float:
        inside = min(max(value, low), high)
        return _TOP + 2 * _DOTS + inner * (1 - (inside - low) / spread)

    for value in (low, high):
        tick = '<text class="tick" x="{}" y="{:.1f}">{:.4g}</text>'
        parts.append(Markup(tick).format(_LEFT + _SIDE + _GAP - 3, at(value) + 4, value))
    for k, each in enumerate(landed):
        x = _LEFT + _SIDE + _GAP + _SIDE * (k + 0.5) / len(landed)
        first, other = _ends(each)
        if other > -np.inf:  # a surface is seen there
            line = '<path class="{}" d="M{:.1f} {:.1f}V{:.1f}"/><path class="end" d="M{:.1f} {:.1f}h10"/>'
            parts.append(Markup(line).format(_kind(each), x, at(first), at(other), x - 5, at(other)))
        parts.append(_dot(x, at(first), each))
    return Markup("").join(parts)
