"""A renderer of depth, positions and occlusion through a light field display, float64, by the textbook's formulas.

Its display may have other numbers than the reference's: that is what is planted. Nothing of lfssao.
"""

import tomllib
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np
from planted_bugs import turns_of
from reference import raycast

TILE = 12  # texels on a side, of the rays that are culled together


@dataclass(frozen=True)
class Lens:
    """A module: its place, the map of the plane z = 0 to texels, distortion."""

    x: float
    y: float
    z: float
    homography: tuple | None
    k1: float
    k2: float


@dataclass(frozen=True)
class Planted:
    """A display of a TOML file whose modules stand on a line, or in a list; and what a renderer may take for it."""

    width: float
    height: float
    observer_height: float
    distance: float
    screen_curvature: float
    observer_curvature: float
    conical: bool
    modules: tuple
    centre: np.ndarray  # of the ROI
    resolution: tuple
    pinhole: bool = False  # the modules' lens in both axes, no observers
    corner: float = 0.0  # texels by which the rays' places are off, along u and v
    scale: float = 1.0  # of the scene, about the ROI's centre
    offset: np.ndarray = field(default_factory=lambda: np.zeros(3))

    @classmethod
    def read(cls, text, resolution):
        """The display of a file's text with textures of another size, calibrated ones included."""
        table = tomllib.loads(text)
        screen = table["screen"]
        observer = table["observer"]
        modules = table["modules"]
        rows = modules.get("list") or on_line(modules)
        scales = [new / old for new, old in zip(resolution, rows[0]["resolution"], strict=True)]
        return cls(
            screen["width"],
            screen["height"],
            observer["height"],
            observer["distance"],
            {"flat": 0, "convex": 1, "concave": -1}[screen["shape"]] / screen.get("radius", 1),
            (observer["shape"] == "arc") / observer.get("radius", 1),
            table.get("diffuser") == "conical",
            tuple(lens_of(row, scales) for row in rows),
            np.mean([table["roi"]["min"], table["roi"]["max"]], axis=0),
            tuple(resolution),
        )

    def with_modules(self, change):
        """The display with another lens in each one's place."""
        return replace(self, modules=tuple(map(change, self.modules)))

    def homography(self, module):
        if module.homography is not None:
            return np.reshape(module.homography, (3, 3))
        (wide, high), w, h = self.resolution, self.width, self.height
        return np.array([[wide / w, 0, wide / 2], [0, -high / h, high / 2], [0, 0, 1]])

    def physical(self, cast_from_world):
        """The reference's map of the world to physical space, and the scene scaled and moved in it."""
        centre = self.centre
        made = self.scale * np.asarray(cast_from_world)
        made[:, 3] += centre - self.scale * centre + self.offset
        return made

    def image(self, index, points):
        """u and v of physical points, (..., 3), and where they are seen."""
        module, (x, y, z) = self.modules[index], np.moveaxis(points, -1, 0)
        m_x = module.x
        m_y = module.y
        m_z = module.z
        y_o = self.observer_height
        z_o = -self.distance
        seen = z < m_z
        s_z = 0.0
        if self.pinhole:
            s_x, s_y = (m + (c - m) * m_z / (m_z - z) for m, c in ((m_x, x), (m_y, y)))
        elif self.screen_curvature == self.observer_curvature == 0:
            s_y = y_o + (y - y_o) * z_o / (z_o - z)
            s_x = m_x + (x - m_x) * m_z / (m_z - z)
            if self.conical:
                kappa = z / z_o * np.hypot(s_y - y_o, z_o) / np.hypot(s_y - m_y, m_z)
                s_x = (x + m_x * kappa) / (1 + kappa)
                seen = seen & (1 + kappa > 0)
            seen = seen & (z > z_o)
        else:
            t_s = on_circle(self.screen_curvature, 0.0, (m_x, m_z), (x, z))
            t_v = on_circle(self.observer_curvature, z_o, (m_x, m_z), (x, z))
            seen = seen & (t_s > 0) & (t_s < t_v) & (t_v > 1)
            s_x = m_x + t_s * (x - m_x)
            s_y = y_o + (y - y_o) * (t_v - t_s) / (t_v - 1)
            s_z = m_z + t_s * (z - m_z)
        plane = m_z / (m_z - s_z)  # central projection from the lens to z = 0
        u, v, w = np.tensordot(
            self.homography(module),
            np.stack([m_x + (s_x - m_x) * plane, m_y + (s_y - m_y) * plane, np.ones_like(x)]),
            axes=1,
        )
        unit = self.resolution[0] / 2
        middle = [size / 2 for size in self.resolution]
        a = (u / w - middle[0]) / unit
        b = (v / w - middle[1]) / unit
        factor = distortion(module, a * a + b * b)
        u = middle[0] + unit * a * factor
        v = middle[1] + unit * b * factor
        return u + self.corner, v + self.corner, seen & (w > 0)

    def rays(self, index):
        """The rays x = ox + dx z, y = oy + dy z of all texels, and their nearest and farthest z: (H, W) each."""
        module, (wide, high) = self.modules[index], self.resolution
        m_x = module.x
        m_y = module.y
        m_z = module.z
        y_o = self.observer_height
        z_o = -self.distance
        v, u = (np.indices((high, wide)) + 0.5) - self.corner
        a = (u - wide / 2) / (wide / 2)
        b = (v - high / 2) / (wide / 2)
        shrunk = undistorted(module, np.hypot(a, b))
        u = wide / 2 + wide / 2 * a * shrunk
        v = high / 2 + wide / 2 * b * shrunk
        x, y, w = np.tensordot(np.linalg.inv(self.homography(module)), np.stack([u, v, np.ones_like(u)]), axes=1)
        p_x = x / w
        p_y = y / w
        far = np.full(u.shape, m_z)
        if self.pinhole:
            return p_x, p_y, (m_x - p_x) / m_z, (m_y - p_y) / m_z, np.full(u.shape, z_o), far
        t_s = on_circle(self.screen_curvature, 0.0, (m_x, m_z), (p_x, 0.0))
        t_v = on_circle(self.observer_curvature, z_o, (m_x, m_z), (p_x, 0.0))
        s_y = m_y + t_s * (p_y - m_y)
        s_z = m_z - t_s * m_z
        v_z = m_z - t_v * m_z
        d_x = (m_x - p_x) / m_z
        d_y = (y_o - s_y) / (v_z - s_z)
        if self.conical:
            d_x = (p_x - m_x) * np.hypot(s_y - y_o, z_o) / np.hypot(s_y - m_y, m_z) / z_o
        return p_x, s_y - d_y * s_z, d_x, d_y, v_z, far


def on_line(modules):
    """The modules of a line as if they were listed."""
    places = np.linspace(*modules["x"], modules["count"])
    return [{**modules, "x": float(x)} for x in places]


def lens_of(row, scales):
    """A module of a file's row, its homography that of resized textures, its last entry 1."""
    h = row.get("homography")
    if h is not None:
        h = np.reshape(h, (3, 3)) * np.array([[scales[0]], [scales[1]], [1.0]])
        h = tuple((h / h[2, 2]).ravel())
    return Lens(row["x"], row.get("y", 0.0), row["z"], h, row.get("k1", 0.0), row.get("k2", 0.0))


def distortion(module, r2):
    return 1 + module.k1 * r2 + module.k2 * r2 * r2


def undistorted(module, radius):
    """Factors on distorted radii that undo the distortion, by Newton's method."""
    r = radius.copy()
    for _ in range(30):
        slope = 1 + 3 * module.k1 * r**2 + 5 * module.k2 * r**4
        r = r - (r * distortion(module, r * r) - radius) / slope
    return np.divide(r, radius, out=np.ones_like(r), where=radius > 0)


def on_circle(curvature, z_0, start, end):
    """t at which start + t (end - start) crosses the circle of that curvature through (0, z_0), XZ (textbook.py)."""
    (x, z), dx, dz = start, end[0] - start[0], end[1] - start[1]
    if curvature == 0:
        return (z_0 - z) / dz + np.zeros(np.shape(dx))
    centre = z_0 + 1 / curvature
    a = dx * dx + dz * dz
    b = 2 * (x * dx + (z - centre) * dz)
    c = x * x + (z - centre) ** 2 - 1 / curvature**2
    return (-b + np.copysign(np.sqrt(b * b - 4 * a * c), curvature)) / (2 * a)


def cast(rays, corners):
    """z of the first hit of each ray, (H, W), infinite where there is none; tiles leave out what all rays pass by."""
    (x_0, y_0, z_0), (x_1, y_1, z_1) = corners.min(axis=1).T, corners.max(axis=1).T
    made = np.full(rays[0].shape, np.inf)
    for j in range(0, made.shape[0], TILE):
        for i in range(0, made.shape[1], TILE):
            tile = slice(j, j + TILE), slice(i, i + TILE)
            own = [ray[tile].ravel() for ray in rays]
            may = np.ones(len(corners), bool)
            for starts, slopes, low, high in ((own[0], own[2], x_0, x_1), (own[1], own[3], y_0, y_1)):
                ways = [slope * z for slope in (slopes.min(), slopes.max()) for z in (z_0, z_1)]
                may &= (starts.min() + np.min(ways, axis=0) <= high) & (starts.max() + np.max(ways, axis=0) >= low)
            if may.any():
                hits = raycast.first_hits(own, corners[may])
                made[tile] = np.where(hits.triangle >= 0, hits.z, np.inf).reshape(made[tile].shape)
    return made


@cache
def boxes(seed=16):
    """A scene, (F, 3, 3): boxes turned any way, all over a box of the ROI's proportions, before a slanted wall."""
    rng = np.random.default_rng(seed)
    made = []
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = np.array([part for a, b, c, d in quads for part in ([a, b, c], [a, c, d])])
    for _ in range(70):
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        made.append((corners * rng.uniform(0.02, 0.07, 3)) @ turn + rng.uniform(-1, 1, 3) * [0.8, 0.44, 0.4])
    turn, _ = np.linalg.qr([[1, 0.05, 0.1], [0, 1, 0.08], [0, 0, 1]])
    made.append(corners * [0.9, 0.54, 0.01] @ turn - [0, 0, 0.4])
    return np.concatenate([points[faces] for points in made])


def write_mesh(path, triangles):
    """Write triangles, (F, 3, 3), as an OBJ file; its path."""
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in triangles.reshape(-1, 3).tolist()]
    lines += [f"f {k} {k + 1} {k + 2}" for k in range(1, len(lines), 3)]
    path.write_text("\n".join(lines) + "\n")
    return path


class DisplayRenderer:
    """Textures of one module of a reference's folder, by a display that may be another."""

    def __init__(self, settings, view, index, triangles, textures):
        self.index, self.triangles, self.textures = index, triangles, textures
        self.axes = np.array(view["cast_from_world"])
        self.radii, self.samples = settings["radii"], np.array(settings["samples"])
        shape = view["height"], view["width"]
        self.turns = turns_of(settings["rotation"], settings["rotation_seed"], *shape).astype(np.float64)

    def __getattr__(self, name):
        return self.textures[name]

    def gbuffer(self, display):
        """Depth and positions, float32."""
        axes = display.physical(self.axes)
        rays = display.rays(self.index)
        z = cast(rays, self.triangles @ axes[:, :3].T + axes[:, 3])
        with np.errstate(invalid="ignore"):
            places = np.stack([rays[0] + rays[2] * z, rays[1] + rays[3] * z, z], axis=-1) - axes[:, 3]
            positions = places @ np.linalg.inv(axes[:, :3]).T
        positions[np.isinf(z)] = np.inf
        return {"depth": z.astype(np.float32), "positions": positions.astype(np.float32)}

    @np.errstate(all="ignore")
    def ao(self, display, depth, positions, layer=1):
        """Algorithm 2 on depth and positions, with the display's mapping, float32."""
        axes, (c, s) = display.physical(self.axes), self.turns[..., None]
        x, y, z = self.radii[layer - 1] * self.samples.T
        offsets = np.stack([c * x - s * y, s * x + c * y, np.broadcast_to(z, (c * x).shape)], axis=-1)
        points = (positions[:, :, None] + offsets) @ axes[:, :3].T + axes[:, 3]
        u, v, seen = display.image(self.index, points)
        wide, high = display.resolution
        inside = seen & (u >= 0) & (u < wide) & (v >= 0) & (v < high)
        i, j = (np.where(inside, np.floor(place), 0).astype(int) for place in (u, v))
        count = np.count_nonzero(inside & (depth[j, i] < points[..., 2]), axis=-1)
        return np.where(np.isfinite(depth), count / len(self.samples), 0).astype(np.float32)
