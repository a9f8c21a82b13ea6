"""The picture that an eye on the observer line sees: at each screen point, the modules whose rays reach the eye.

All in float64, evaluated as written; the picture is rounded once to float32.
"""

from typing import Any, NamedTuple

import numpy as np

from lfssao.core.elementary import exp
from lfssao.core.jit import formula, kernel
from lfssao.optics.kernels.display import circle_crossing, display_module, screen_to_image

NEAREST = 0
LINEAR = 1
GAUSSIAN = 2

SIGMA = 1.5  # of the Gaussian, in angular steps of the modules
CUT = 4.0  # sigmas, beyond which a module does not count
MOST_COLUMNS = 2**62


class Modules(NamedTuple):
    """The modules of one display and their textures."""

    numbers: Any  # (M, 32) float64, each a ``DisplayModule``
    sizes: Any  # (M, 2) int64: width and height of each texture
    starts: Any  # (M,) int64: row of ``texels`` at which each texture starts, -1 for a module that shows nothing
    columns: Any  # (M, 2) int64: the columns of each texture that ``texels`` has, from the first to before the second
    texels: Any  # (n, C) float32: all textures, row by row, finite


@formula
def seen_screen_point(curvature, screen, x, y, eye):
    """The crossing of the screen and the line from the eye to (x, y, 0): s_x, s_y, s_z; s_z is NaN outside its area.

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


@formula
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


@kernel
def adjacent(sines):
    """The modules whose rays pass next to the eye on its left (sine <= 0) and right, -1 for none; their angular step.

    The step is the difference of their sines; beyond an outermost ray its difference to the next one; infinite where
    that is missing too.
    """
    l_1, l_2, r_1, r_2, left, right = -np.inf, -np.inf, np.inf, np.inf, -1, -1
    for k in range(sines.shape[0]):
        a = sines[k]
        if l_1 < a <= 0.0:
            l_1, l_2, left = a, l_1, k
        elif l_2 < a <= 0.0:
            l_2 = a
        elif 0.0 < a < r_1:
            r_1, r_2, right = a, r_1, k
        elif 0.0 < a < r_2:
            r_2 = a
    if left >= 0 and right >= 0:
        return left, right, r_1 - l_1
    if left >= 0:
        return left, right, l_1 - l_2
    return left, right, r_2 - r_1 if right >= 0 else np.inf


@kernel
def weigh(modules, point, sines, blend, places, weights):
    """Write each module's weight at a screen point, all 0 where none reaches the eye, and its image point: (M, 2).

    A module reaches an eye up to half a step from its ray. NEAREST: the nearest that shows the point, the left one of
    two. LINEAR: its neighbour on the other side of the eye too, if it shows the point. GAUSSIAN: all that show it, by
    exp(-q^2 / 2), q = sine / (SIGMA step), if abs(q) < CUT.
    """
    left, right, step = adjacent(sines)
    l_shows, r_shows = False, False
    for k in range(sines.shape[0]):
        weights[k] = 0.0
        near = abs(sines[k]) < CUT * (SIGMA * step) if blend == GAUSSIAN else (k == left) | (k == right)
        if modules.starts[k] < 0 or not near:
            continue
        module, width, height = display_module(modules.numbers[k]), modules.sizes[k, 0], modules.sizes[k, 1]
        u, v, shown, formed = screen_to_image(module, point[0], point[1], point[2])
        shows = shown & formed & (u >= 0.0) & (u < width) & (v >= 0.0) & (v < height)
        places[k, 0], places[k, 1] = u, v
        l_shows, r_shows = l_shows | (shows & (k == left)), r_shows | (shows & (k == right))
        if shows and blend == GAUSSIAN:
            q = sines[k] / (SIGMA * step)
            weights[k] = exp(-0.5 * (q * q))
    l_sine, r_sine = sines[left] if l_shows else -np.inf, sines[right] if r_shows else np.inf
    if not 2.0 * min(-l_sine, r_sine) <= step or not step < np.inf:
        weights[:] = 0.0
    elif blend == LINEAR and l_shows and r_shows:
        weights[left], weights[right] = r_sine / step, -l_sine / step
    elif blend != GAUSSIAN:
        weights[left if -l_sine <= r_sine else right] = 1.0


@kernel
def mean_texel(modules, places, weights, pixel, seen):
    """Write the mean of textures, read bilinearly, at image points, (C,), 0 for no weights; whether there are any.

    ``seen``, (M, 2), is widened to the columns that are read, from the first to before the second.
    """
    texels = modules.texels
    sums, total = np.zeros(pixel.shape[0]), 0.0
    for k in range(weights.shape[0]):
        weight = weights[k]
        if not weight > 0.0:
            continue
        total += weight
        width, height = modules.sizes[k, 0], modules.sizes[k, 1]
        x = min(max(places[k, 0] - 0.5, 0.0), width - 1.0)
        y = min(max(places[k, 1] - 0.5, 0.0), height - 1.0)
        column, row = int(x), int(y)
        f, g = x - column, y - row
        right = 1 if column + 1 < width else 0
        seen[k, 0], seen[k, 1] = min(seen[k, 0], column), max(seen[k, 1], column + right + 1)
        held = modules.columns[k, 1] - modules.columns[k, 0]
        a = modules.starts[k] + row * held + column - modules.columns[k, 0]
        b = a + held if row + 1 < height else a
        for n in range(pixel.shape[0]):
            top = (1.0 - f) * texels[a, n] + f * texels[a + right, n]
            bottom = (1.0 - f) * texels[b, n] + f * texels[b + right, n]
            sums[n] += weight * ((1.0 - g) * top + g * bottom)
    for n in range(pixel.shape[0]):
        pixel[n] = sums[n] / total if total > 0.0 else 0.0
    return total > 0.0


@kernel(rows="picture")
def compose(begin, stop, modules, eye, screen, blend, picture, dark, seen):
    """Write the picture of the screen's rectangle at z = 0 that an eye sees: (H, W, C) float32, 0 where it is dark.

    Pixel (i, j) looks through x = w ((i + 0.5) / W - 0.5), y = h (0.5 - (j + 0.5) / H), (w, h) the screen in metres;
    ``eye`` is (x, y, z) on the observer line or arc. ``dark``, (H,) int64, becomes how many pixels of each row no
    module reaches; ``seen``, (H, M, 2) int64, the columns of each module's texture that each row reads, from the first
    to before the second. A picture without channels reads no texels.
    """
    height, width, count = picture.shape[0], picture.shape[1], modules.numbers.shape[0]
    curvature = display_module(modules.numbers[0]).screen_curvature
    for j in range(begin, stop):
        sines, places, weights = np.empty((count, width)), np.empty((count, 2)), np.empty(count)
        y = screen[1] * (0.5 - (j + 0.5) / height)
        dark[j], seen[j, :, 0], seen[j, :, 1] = 0, MOST_COLUMNS, 0
        for k in range(count):  # pixels inside become vectors: 3/4 of a photograph's time, 80 modules
            module = display_module(modules.numbers[k])
            for i in range(width):
                x = screen[0] * ((i + 0.5) / width - 0.5)
                sines[k, i] = ray_sine(module, seen_screen_point(curvature, screen, x, y, eye), eye)
        for i in range(width):
            x = screen[0] * ((i + 0.5) / width - 0.5)
            point = seen_screen_point(curvature, screen, x, y, eye)
            weigh(modules, point, sines[:, i], blend, places, weights)
            dark[j] += 0 if mean_texel(modules, places, weights, picture[j, i], seen[j]) else 1
