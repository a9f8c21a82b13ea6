"""Views of every kind, scenes on them in which rounding matters, and renderers that round."""

import itertools

import numpy as np
import random_renderer as rr
from hypothesis import reject
from hypothesis import strategies as st

from lfssao import Camera, Display, Module, builtin_scene, find_display, fit_roi, module_views
from lfssao.ao.textures import Buffers
from lfssao.errors import InputError
from lfssao.optics.camera import linear_view
from lfssao.optics.kernels import display as display_kernels
from lfssao.verify.bounds.error_model import ErrorModel

ROI = ((-0.4, -0.3, -0.25), (0.4, 0.3, 0.25))
WORLD_BOX = np.array([[-1.0, -2.0, -3.0], [4.0, 2.0, 1.0]])


def drawn_view(draw, height, width):
    """A view of any kind: a module of any display, or a camera."""
    kind = draw(st.sampled_from(["slits", "slits", "camera", "conical", "curved", "optics"]))
    if kind == "camera":
        eye = tuple(draw(st.floats(2, 6)) * draw(st.sampled_from([-1, 1])) for _ in range(3))
        projection = draw(st.sampled_from(["perspective", "orthographic"]))
        extent = draw(st.floats(0.5, 4))
        return Camera(projection, eye, (0.0, 0.1, 0.2), (0.0, 1.0, 0.0), extent, 1.0, 20.0).view(width, height)
    m_x, m_y, y_o = (draw(st.floats(-0.5, 0.5)) for _ in range(3))
    extra = {}
    optics = {}
    if kind == "conical":
        extra["diffuser"] = "conical"
    elif kind == "curved":
        extra = {"screen_curvature": draw(st.sampled_from([0.5, -0.5, 0.0])), "observer_curvature": 0.4}
    elif kind == "optics":
        optics = {"k1": draw(st.floats(-0.05, 0.05)), "k2": 0.01, "field_of_view": 80.0, "yaw": 5.0, "pitch": 3.0}
    module = Module(m_x, m_y, draw(st.floats(0.9, 2)), width, height, **optics)
    try:
        display = Display("drawn", 1.0, 0.75, y_o, draw(st.floats(-3, -1.5)), (module,), ROI, **extra)
    except InputError:  # the ray of its middle misses a strongly curved screen
        reject()
    return display.view(0, fit_roi(WORLD_BOX, display.roi))


def world_points(view, u, v, z):
    """World points that land on image points (u, v) at image depth z, float64."""
    if view.screen_to_world is not None:
        homogeneous = np.stack([u, v, z, np.ones_like(u)], axis=-1) @ view.screen_to_world.T
        return homogeneous[..., :3] / homogeneous[..., 3:]
    m = view.world_to_image.numbers
    if view.world_to_image.kind == rr.CROSSED_SLITS:
        rows = np.stack([(u - m[14]) * (m[12] - z), (v - m[15]) * (m[13] - z), z], axis=-1)
        return (rows - m[[3, 7, 11]]) @ np.linalg.inv(m[:12].reshape(3, 4)[:, :3]).T
    lines = np.empty((u.size, 6))
    display_kernels.trace_texels(m[12:], u.ravel(), v.ravel(), lines)
    o_x, o_y, d_x, d_y = lines[:, :4].T.reshape(4, *u.shape)
    physical = np.stack([o_x + d_x * z, o_y + d_y * z, z, np.ones_like(z)], axis=-1)
    return physical @ view.world_from_cast.T


def critical_scene(rng, view, n, radius, moved=None, levels=None):
    """Depth, positions and samples: the point of each texel less one of its offsets is next to a decision.

    ``moved(samples, number)``: the offsets of the samples numbered, one a texel, in units of the radius; they are the
    samples themselves by default. With it there are always positions. ``levels``: image depths of the surfaces.
    """
    shape = view.height, view.width
    camera = view.screen_to_world is not None
    if levels is None:
        levels = rng.uniform(0.3, 0.7, 4) if camera else rng.uniform(-0.2, 0.2, 4)
    depth = rng.choice(levels, shape).astype(np.float32)
    depth[rng.random(shape) < 0.1] = np.inf
    samples = rng.uniform(-1, 1, (n, 3))
    u = rng.uniform(0.5, view.width - 0.5, shape)
    v = rng.uniform(0.5, view.height - 0.5, shape)
    u, v = (np.where(rng.random(shape) < 0.5, np.round(c), c) for c in (u, v))
    j = np.minimum(v.astype(int), shape[0] - 1)
    i = np.minimum(u.astype(int), shape[1] - 1)
    surface = np.where(np.isfinite(depth[j, i]), depth[j, i], levels[0])
    z = np.where(rng.random(shape) < 0.5, surface, rng.uniform(levels.min(), levels.max(), shape))
    jitter = 1 + rng.uniform(-3e-7, 3e-7, (3, *shape))
    target = world_points(view, u * jitter[0], v * jitter[1], z * jitter[2])
    if (
        moved is None and camera and rng.random() < 0.5
    ):  # Algorithm 1 makes the points from depth: offsets are placed for some texels
        here = world_points(view, *(np.mgrid[: shape[0], : shape[1]][::-1] + 0.5), np.where(depth < 9, depth, 0.5))
        offsets = (target - here).reshape(-1, 3)[rng.choice(depth.size, n)]
        return depth, None, offsets / radius
    number = rng.integers(0, n, shape)
    positions = target - radius * (samples[number] if moved is None else moved(samples, number))
    positions[~np.isfinite(depth)] = np.inf
    return depth, positions.astype(np.float32), samples


def random_turns(rng, shape):
    """Cosine and sine of random angles, (2, H, W) float32."""
    angles = rng.uniform(0, 2 * np.pi, shape)
    return np.stack([np.cos(angles), np.sin(angles)]).astype(np.float32)


def turned(offsets, turns):
    """Offsets (H, W, 3) turned about z."""
    (c, s), (x, y, z) = turns.astype(np.float64), np.moveaxis(offsets, -1, 0)
    return np.stack([c * x - s * y, s * x + c * y, z], axis=-1)


def arithmetic(model, rng, renderers):
    if model == "nearest":
        return rr.Arithmetic(rng, renderers, directed=False, quotient=0.5, root=0.5)
    return rr.Arithmetic(rng, renderers)


def probed_ends(model, rng, make, found):
    """The least and the largest texture of probes of a model, ``make(arithmetic)``.

    Probes know nothing of decisions that may fall either way: there the ends are those of the bounds found.
    """
    seed = rng.integers(2**32)
    count = 6
    for _ in range(2):
        probe = rr.Probe(np.random.default_rng(seed), count + 1, model)
        made = make(probe)
        count = probe.operations
    off = made - made[0]
    jumps = np.where(np.abs(off) > 2.0**-8, off, 0.0)  # to the other axes, say: one of them, not their sum
    size = np.abs(off - jumps).sum(axis=0) * (1 - 2.0**-9)  # it is made to first order, and of finite steps
    ends = np.clip([made[0] + jumps.min(axis=0) - size, made[0] + jumps.max(axis=0) + size], 0, 1)
    return np.where(found.undecided > 0, [found.lower, found.upper], ends)


def hold_renderers(model, rng, make, found):
    """Hold bounds found against 40 renderers of a named model, or probes of another, and count what is in doubt.

    Returns how many terms are undecided, and in how many texels renderers differ.
    """
    named = isinstance(model, str)
    made = make(arithmetic(model, rng, 40)) if named else probed_ends(model, rng, make, found)
    assert_inside(made, found, "occlusion")
    return int(found.undecided.sum()), int((made.max(0) - made.min(0) > 1e-3).sum())


def probed(kind):
    """An error model of one kind of error that is large beside the others, which are those of float32."""
    small = dict.fromkeys(("operation", "quotient", "root", "angle"), 2.0**-23)
    return ErrorModel(kind, "", **(small | {kind: 2.0**-16 if kind == "operation" else 2.0**-13}))


def hold_probes(check, most=100):
    """Hold bounds against the probes of each kind of error; sums of many samples against those of operations."""
    mesh = builtin_scene("statue")
    kinds = ("operation", "quotient", "root", "angle")
    for kind, n, seed in [*itertools.product(kinds, (1, 12), range(2)), ("operation", most, 1)]:
        size = (8, 6) if n < 12 else (4, 3)
        module = module_views(mesh, find_display("sample-a").with_resolution(*size), range(4, 5))[0]
        for view in (module, Camera.looking_at(mesh.bounds).view(*size)):
            check((view, np.random.default_rng(seed), probed(kind), 0.25, n, seed == 1))


def assert_inside(values, bound, name):
    low = bound.lower.astype(np.float64)
    high = bound.upper.astype(np.float64)
    outside = ~((values >= low) & (values <= high))
    assert not outside.any(), f"{name}: {np.count_nonzero(outside)} values outside"


def unit(vectors):
    x, y, z = np.moveaxis(vectors, -1, 0)
    return vectors / np.sqrt(x * x + y * y + z * z)[..., None]


def seen_along(view, depth, positions, normals=None, turns=None, ways=None):
    """Buffers whose texels look in directions of their own."""
    made = Buffers(view, depth, positions, normals, turns)
    vars(made)["directions"] = ways
    return made


def in_distances(shown):
    """Buffers of a perspective camera with distances along its axis as depth, and the reversed depth they are of."""
    near, far = shown.view.lens[4:6]
    reverse = np.where(shown.depth < np.inf, 1 - shown.depth.astype(float), 0.0).astype(np.float32).astype(float)
    z = np.where(shown.depth < np.inf, near * far / (near + reverse * (far - near)), np.inf)
    made = Buffers(linear_view(shown.view), z.astype(np.float32), shown.positions, shown.normals, shown.turns)
    vars(made)["reversed"] = reverse
    return made


@st.composite
def drawn_problems(draw):
    height, width = draw(st.sampled_from([(3, 4), (1, 11), (4, 4)]))
    view = drawn_view(draw, height, width)
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    model = draw(st.sampled_from(["shader", "shader", "nearest"]))
    turning = draw(st.booleans())
    radius = float(draw(st.sampled_from([0.01, 0.3, 1.0])))
    return view, rng, model, radius, draw(st.sampled_from([1, 3, 12, 33, 1, 3, 12, 33, 100])), turning
