"""The picture that an eye on the observer line sees: at each screen point, the modules whose rays reach the eye.

All in float64, evaluated as written; the picture is rounded once to float32.
"""

from typing import Any, NamedTuple

import numpy as np
from numba import prange

from lfssao.core.elementary import exp
from lfssao.core.jit import kernel
from lfssao.optics.kernels.display import apply_homography, circle_crossing, display_module, distort

NEAREST = 0
LINEAR = 1
GAUSSIAN = 2

SIGMA = 1.5  # of the Gaussian, in angular steps of the modules
CUT = 4.0  # sigmas, beyond which a module does not count


class Modules(NamedTuple):
    """The modules of one display and their textures.

    Attributes
    ----------
    numbers : (M, 32) float64
        Each a ``DisplayModule``.
    sizes : (M, 2) int64
        Width and height of each texture.
    starts : (M,) int64
        Row of ``texels`` at which each texture starts, -1 for a module that shows nothing.
    texels : (n, C) float32
        All textures, row by row, finite.
    """

    numbers: Any
    sizes: Any
    starts: Any
    texels: Any


@kernel(inline=True)
def seen_screen_point(curvature, screen, x, y, eye):
    """The crossing of the screen and the line from the eye to (x, y, 0): s_x, s_y, s_z; s_z is NaN beside its area.

    On a flat screen that is (x, y, 0). A curved one is crossed on its side towards the eye, at the crossing of the line
    with the circle that is nearest to z = 0.
    """
    e_x, e_y, e_z = eye
    if curvature == 0.0:
        return x, y, 0.0
    t, discriminant = circle_crossing(curvature, x, 0.0, e_x - x, e_z)
    s_x, s_y = x + t * (e_x - x), y + t * (e_y - y)
    meets = (discriminant >= 0.0) & (t < 1.0)
    inside = (abs(s_x) <= 0.5 * screen[0]) & (abs(s_y) <= 0.5 * screen[1])
    return s_x, s_y, t * e_z if meets & inside else np.nan


@kernel(inline=True)
def ray_sine(d, point, eye):
    """Sine of the angle, seen from above, by which a module's ray through a screen point misses the eye.

    The ray crosses z = e_z at x = s_x + (s_x - m_x) (e_z - s_z) / (s_z - m_z) with the linear diffuser and at
    s_x + (s_x - m_x) h_e / h_m with the conical one. Positive if that is right of the eye; NaN for a module that is not
    behind the point, or whose ray is 90 degrees or more away.
    """
    s_x, s_y, s_z = point
    e_x, _, e_z = eye
    m_x, m_y, m_z, y_o = d.m_x, d.m_y, d.m_z, d.y_o
    forward = e_z - s_z
    ratio = forward / (s_z - m_z)
    if d.conical != 0.0:
        h_m = np.sqrt((s_y - m_y) * (s_y - m_y) + m_z * m_z)
        h_e = np.sqrt((s_y - y_o) * (s_y - y_o) + e_z * e_z)
        ratio = h_e / h_m
    a, b, f2 = (s_x - m_x) * ratio, e_x - s_x, forward * forward
    sine = (b - a) * forward / np.sqrt((a * a + f2) * (b * b + f2))
    return sine if (s_z < m_z) & (a * b + f2 > 0.0) else np.nan


@kernel(inline=True)
def screen_to_texel(d, width, height, point):
    """Image point at which a module shows a screen point, and whether its texture has it: u, v, shown.

    As ``optics.kernels.display.physical_to_image`` of a point on the screen: central projection from the lens onto
    z = 0, homography, radial distortion.
    """
    s_x, s_y, s_z = point
    scale = d.m_z / (d.m_z - s_z)
    x, y = d.m_x + (s_x - d.m_x) * scale, d.m_y + (s_y - d.m_y) * scale
    if s_z == 0.0:
        x, y = s_x, s_y
    u, v, w = apply_homography(d.homography, x, y)
    r2 = 0.0
    if (d.k1 != 0.0) | (d.k2 != 0.0):
        u, v, r2 = distort(d, u, v)
    inside = (u >= 0.0) & (u < width) & (v >= 0.0) & (v < height)
    return u, v, (s_z < d.m_z) & (w > 0.0) & (r2 < d.fold) & inside


@kernel
def row_sines(modules, points, eye, sines):
    """Write the ray_sine of every module at each of a row's screen points; points: (W, 3), sines: (W, M) float64."""
    for k in range(modules.numbers.shape[0]):
        module = display_module(modules.numbers[k])
        for i in range(points.shape[0]):
            sines[i, k] = ray_sine(module, (points[i, 0], points[i, 1], points[i, 2]), eye)


@kernel
def row_steps(sines, sides, steps):
    """Write the modules whose rays pass next to the eye at each of a row's points, and their angular step.

    Parameters
    ----------
    sines : (W, M) float64
        From row_sines.
    sides : (W, 2) int64
        Out: the modules whose rays pass next to the eye on its left (sine <= 0) and on its right, -1 for none.
    steps : (W,) float64
        Out: the difference of their sines; beyond an outermost ray its difference to the next one; infinite where that
        is missing too.
    """
    for i in range(sines.shape[0]):
        l_1, l_2, r_1, r_2, left, right = -np.inf, -np.inf, np.inf, np.inf, -1, -1
        for k in range(sines.shape[1]):
            a = sines[i, k]
            if l_1 < a <= 0.0:
                l_1, l_2, left = a, l_1, k
            elif l_2 < a <= 0.0:
                l_2 = a
            elif 0.0 < a < r_1:
                r_1, r_2, right = a, r_1, k
            elif 0.0 < a < r_2:
                r_2 = a
        sides[i, 0], sides[i, 1] = left, right
        steps[i] = r_1 - l_1
        if left < 0:
            steps[i] = r_2 - r_1 if right >= 0 else np.inf
        elif right < 0:
            steps[i] = l_1 - l_2


@kernel
def row_texels(modules, points, sines, steps, coordinates, shown):
    """Write the image of each of a row's points in every module near the eye: (W, M, 2) float64, and if it is shown."""
    for k in range(modules.numbers.shape[0]):
        module = display_module(modules.numbers[k])
        width, height = float(modules.sizes[k, 0]), float(modules.sizes[k, 1])
        for i in range(points.shape[0]):
            shown[i, k] = False
            if modules.starts[k] < 0 or not abs(sines[i, k]) < CUT * (SIGMA * steps[i]):
                continue
            point = points[i, 0], points[i, 1], points[i, 2]
            coordinates[i, k, 0], coordinates[i, k, 1], shown[i, k] = screen_to_texel(module, width, height, point)


@kernel
def row_weights(sines, sides, steps, shown, blend, weights):
    """Write the weights of the modules at each of a row's points, (W, M) float64; all 0 where none reaches the eye.

    A module reaches an eye up to half a step from its ray. NEAREST: the nearest that shows the point, the left one of
    two. LINEAR: its neighbour on the other side of the eye too, if it shows the point. GAUSSIAN: all that show it, by
    exp(-q^2 / 2), q = sine / (SIGMA step), if abs(q) < CUT.
    """
    for i in range(sines.shape[0]):
        left, right, step = sides[i, 0], sides[i, 1], steps[i]
        weights[i, :] = 0.0
        l_shows, r_shows = left >= 0 and shown[i, left], right >= 0 and shown[i, right]
        l_sine, r_sine = sines[i, left] if l_shows else -np.inf, sines[i, right] if r_shows else np.inf
        nearest = left if -l_sine <= r_sine else right
        if not 2.0 * min(-l_sine, r_sine) <= step or not step < np.inf:
            continue
        if blend == GAUSSIAN:
            for k in range(sines.shape[1]):
                q = sines[i, k] / (SIGMA * step)
                weights[i, k] = exp(-0.5 * (q * q)) if shown[i, k] else 0.0
        elif blend == LINEAR and l_shows and r_shows:
            weights[i, left], weights[i, right] = r_sine / step, -l_sine / step
        else:
            weights[i, nearest] = 1.0


@kernel
def row_blend(modules, weights, coordinates, picture):
    """Write a row of the picture, (W, C) float32: weighted means of the textures, 0 without weights; count the latter.

    A texture is read bilinearly between texels' centres and clamped at its rim.
    """
    texels, dark, channels = modules.texels, 0, picture.shape[1]
    sums = np.empty(channels)
    for i in range(weights.shape[0]):
        sums[:] = 0.0
        total = 0.0
        for k in range(weights.shape[1]):
            weight = weights[i, k]
            if not weight > 0.0:
                continue
            total += weight
            width, height = modules.sizes[k, 0], modules.sizes[k, 1]
            x = min(max(coordinates[i, k, 0] - 0.5, 0.0), width - 1.0)
            y = min(max(coordinates[i, k, 1] - 0.5, 0.0), height - 1.0)
            column, row = int(x), int(y)
            f, g = x - column, y - row
            right = 1 if column + 1 < width else 0
            a = modules.starts[k] + row * width + column
            b = a + width if row + 1 < height else a
            for n in range(channels):
                top = (1.0 - f) * texels[a, n] + f * texels[a + right, n]
                bottom = (1.0 - f) * texels[b, n] + f * texels[b + right, n]
                sums[n] += weight * ((1.0 - g) * top + g * bottom)
        dark += 0 if total > 0.0 else 1
        for n in range(channels):
            picture[i, n] = sums[n] / total if total > 0.0 else 0.0
    return dark


@kernel(parallel=True)
def compose(modules, eye, screen, blend, picture, dark):
    """Write the picture of the screen's rectangle at z = 0 that an eye sees.

    Parameters
    ----------
    modules : Modules
        The modules and their textures.
    eye : three floats
        The eye, on the observer line or arc, metres.
    screen : two floats
        Width and height of the screen, metres.
    blend : int
        NEAREST, LINEAR or GAUSSIAN.
    picture : (H, W, C) float32
        Out: 0 where no module reaches the eye. Pixel (i, j) looks through x = w ((i + 0.5) / W - 0.5),
        y = h (0.5 - (j + 0.5) / H).
    dark : (H,) int64
        Out: how many pixels of each row no module reaches.
    """
    height, width, count = picture.shape[0], picture.shape[1], modules.numbers.shape[0]
    curvature = display_module(modules.numbers[0]).screen_curvature
    for j in prange(height):
        points, sides, steps = np.empty((width, 3)), np.empty((width, 2), np.int64), np.empty(width)
        sines, weights = np.empty((width, count)), np.empty((width, count))
        coordinates, shown = np.empty((width, count, 2)), np.empty((width, count), np.bool_)
        y = screen[1] * (0.5 - (j + 0.5) / height)
        for i in range(width):
            x = screen[0] * ((i + 0.5) / width - 0.5)
            points[i, 0], points[i, 1], points[i, 2] = seen_screen_point(curvature, screen, x, y, eye)
        row_sines(modules, points, eye, sines)
        row_steps(sines, sides, steps)
        row_texels(modules, points, sines, steps, coordinates, shown)
        row_weights(sines, sides, steps, shown, blend, weights)
        dark[j] = row_blend(modules, weights, coordinates, picture[j])
