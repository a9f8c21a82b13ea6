"""A float32 renderer of what follows the G-buffer, with a knob for each thing that may be wrong; nothing of lfssao."""

from types import SimpleNamespace

import numpy as np
import random_renderer as rr
from reference import dither
from reference.passes import blur_table
from scipy.ndimage import correlate1d

KINDS = ("crossed slits", "matrix", "display")


def arithmetic(seed=None):
    """Rounding to nearest in some order; with a seed as renderers may round at worst."""
    if seed is None:
        return rr.Arithmetic(np.random.default_rng(0), 1, directed=False, quotient=0.5, root=0.5)
    return rr.Arithmetic(np.random.default_rng(seed), 1)


def moved(u=0.0, v=0.0):
    return np.array([[1, 0, u], [0, 1, v]])


STILL = moved()


def turned(samples, degrees):
    c = np.cos(np.radians(degrees))
    s = np.sin(np.radians(degrees))
    return samples @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])


def around(texture, u, v, border):
    """Texels at columns and rows; beyond the border by a mode of ``np.pad``, or a value."""
    height, width = texture.shape
    how = {"mode": border} if isinstance(border, str) else {"constant_values": border}
    far = 2 * max(height, width)
    i, j = (np.nan_to_num(np.clip(np.floor(x), -far, 2 * far - 1)).astype(int) for x in (u, v))
    return np.pad(texture, far, **how)[np.minimum(j, far + height - 1) + far, np.minimum(i, far + width - 1) + far]


def turns_of(rotation, seed, height, width):
    """Cosine and sine of each texel's angle, (2, H, W) float32."""
    angles = np.pi * np.array(dither.angles(rotation, height, width, seed))
    return np.stack([np.cos(angles), np.sin(angles)]).astype(np.float32)


class Renderer:
    """One view's textures by name, and the numbers of its manifest."""

    def __init__(self, settings, view, textures):
        self.radii, self.sigma = settings["radii"], settings["blur_sigma"]
        self.samples, self.options = np.array(settings["samples"]), settings["parameters"]
        self.mapping = KINDS.index(view["world_to_image_kind"]), np.array(view["world_to_image"])
        self.back = None if view["screen_to_world"] is None else np.reshape(view["screen_to_world"], (4, 4))
        self.textures, self.turns, self.light = textures, None, settings.get("light")
        if settings["rotation"] != "none":
            self.turns = turns_of(settings["rotation"], settings["rotation_seed"], *self.depth.shape)
        axes = np.reshape(view["cast_from_world"], (3, 4))
        with np.errstate(invalid="ignore"):
            self.physical = self.seen(self.positions @ axes[:, :3].T + axes[:, 3], np.inf)

    def __getattr__(self, name):
        return self.textures[name]

    @property
    def layers(self):
        return np.stack([self.textures[f"ao_{k + 1}"] for k in range(len(self.radii))])

    @np.errstate(all="ignore")
    def ao(self, layer=2, radius=1.0, image=STILL, border=np.inf, behind=np.less, counts=1.0, divisor=None, seed=None,
           **other):  # fmt: skip
        """Occlusion by Algorithm 2, or by 1 where the view is a camera's; each argument is a knob."""
        own = {name: other.get(name, getattr(self, name)) for name in ("samples", "mapping", "back", "turns")}
        ar = arithmetic(seed)
        samples = own["samples"]
        back = own["back"]
        places = other.get("positions", self.positions)
        u, v, z, valid = rr.image_points(
            ar, self.depth, places, *own["mapping"], samples, radius * self.radii[layer - 1],
            None if back is None else np.ravel(back), own["turns"],
        )  # fmt: skip
        (a, b, c), (d, e, f) = image
        surface = around(other.get("depth", self.depth), a * u + b * v + c, d * u + e * v + f, border)
        count = np.where(valid & behind(surface, z), counts, 0.0).sum(axis=-1)
        made = (
            count[0] / (divisor or len(samples))
            if seed is None
            else rr.fraction(ar, count.astype(int), len(samples))[0]
        )
        return self.seen(made)

    def seen(self, made, background=0.0):
        """A texture with nothing where there is no surface."""
        there = np.isfinite(self.depth).reshape(self.depth.shape + (1,) * (made.ndim - 2))
        return np.where(there, made, background).astype(np.float32)

    def points(self, radius=1.0, seed=None, **wrong):
        """Occlusion by ``point``, or by ``hemisphere`` where there are normals."""
        given = SimpleNamespace(
            view=SimpleNamespace(world_to_image=SimpleNamespace(kind=self.mapping[0], numbers=self.mapping[1])),
            depth=self.depth, turns=wrong.pop("turns", self.turns),
            positions=self.positions, normals=wrong.pop("normals", self.textures.get("normals")),
        )  # fmt: skip
        samples = wrong.pop("samples", self.samples)
        options = self.options | wrong
        return rr.points_behind(arithmetic(seed), given, samples, radius * self.radii[0], options)[0].astype("f4")

    def unprojected(self, u=0.5, v=0.5, depth=None):
        """Positions of crossed slits by depth and texels' centres, or other places in texels."""
        m = self.mapping[1]
        z = (self.depth if depth is None else depth).astype(np.float64)
        j, i = np.indices(z.shape)
        rows = np.stack([(i + u - m[14]) * (m[12] - z), (j + v - m[15]) * (m[13] - z), z], axis=-1)
        return self.seen((rows - m[[3, 7, 11]]) @ np.linalg.inv(m[:12].reshape(3, 4)[:, :3]).T, np.inf)

    def sloped_normals(self):
        """Normals by differences of positions, towards the viewers."""
        ends = [np.pad(self.positions, [(1, 1), (1, 1), (0, 0)], mode="edge").astype(np.float64)] * 4
        left = ends[0][1:-1, :-2]
        right = ends[1][1:-1, 2:]
        above = ends[2][:-2, 1:-1]
        below = ends[3][2:, 1:-1]
        with np.errstate(invalid="ignore"):
            normal = np.cross(below - above, right - left)
            return (normal / np.linalg.norm(normal, axis=-1, keepdims=True)).astype(np.float32)

    def blur(self, sigma=1.0, reach=3.0, total=None, mode="nearest", axes=(1, 0), seed=None, half=False):
        if seed is not None:
            table = blur_table(self.sigma)
            return rr.blur(arithmetic(seed), self.merged, self.sigma, len(table) // 2, table)[0][0].astype("f4")
        sigma *= self.sigma
        k = np.arange(-np.ceil(reach * sigma), np.ceil(reach * sigma) + 1)
        weights = np.exp(-0.5 * (k / sigma) ** 2)
        made = self.merged.astype(np.float64)
        shares = np.ones(self.merged.shape)
        for axis in axes:
            taps = weights / (total or weights.sum())
            rule = mode.removesuffix(" left out")
            made, shares = (correlate1d(t, taps, axis, mode=rule) for t in (made, shares))
            made = made.astype(np.float16).astype(np.float64) if half and axis == axes[0] else made
        return (made / shares if mode.endswith("left out") else made).astype(np.float32)

    def shade(self, image=None, ao=None):
        return (self.color if image is None else image) * (1 - (self.blurred if ao is None else ao))[..., None]

    def lit(self, ao=None, occlude=None, faced=lambda cosine: np.maximum(cosine, 0), sign=1, direct=1.0, ambient=None):
        """The image by the manifest's light; each argument is a knob."""
        direction = np.array(self.light["direction"])
        place = occlude or self.light["occlude"]
        own = self.light["ambient"]
        share = own if ambient is None else ambient
        visible = 1 - (self.blurred if ao is None else ao)
        light = direct * (1 - own) * faced(sign * (self.normals @ (direction / np.linalg.norm(direction))))
        factor = (share + light) * visible if place == "all" else share * visible + light
        return self.color * factor[..., None]
