"""What an eye on the observer line sees on the screen: at each screen point, the modules whose rays reach the eye.

Modules' numbers are those of ``lfssao.kernels.display``. All in float64, evaluated as written; the picture is rounded
once to float32.
"""

import numpy as np
from numba import prange

from lfssao.kernels.display import VALID, circle_crossing, physical_to_image
from lfssao.kernels.elementary import exp
from lfssao.kernels.jit import kernel

NEAREST = 0
LINEAR = 1
GAUSSIAN = 2

SIGMA = 1.5  # of the Gaussian, in angular steps of the modules
CUT = 4.0  # sigmas, beyond which a module does not count


@kernel(inline=True)
def seen_screen_point(curvature, half_width, half_height, x, y, e_x, e_y, e_z):
    """Where the line from the eye to (x, y, 0) meets the screen: s_x, s_y, s_z and whether it does, on its area.

    On a flat screen that is (x, y, 0). On a curved one: the crossing of the line with the circle that lies nearest
    to z = 0, which is its side towards the eye.
    """
    if curvature == 0.0:
        return x, y, 0.0, True
    t, discriminant = circle_crossing(curvature, x, 0.0, e_x - x, e_z)
    s_x, s_y, s_z = x + t * (e_x - x), y + t * (e_y - y), t * e_z
    on_screen = discriminant >= 0.0 and t < 1.0 and -half_width <= s_x <= half_width
    return s_x, s_y, s_z, on_screen and -half_height <= s_y <= half_height


@kernel(inline=True)
def ray_sine(conical, m_x, m_y, m_z, y_o, s_x, s_y, s_z, e_x, e_z):
    """By how much a module's ray through a screen point misses the eye: sine of the angle, seen from above.

    The ray crosses z = e_z at x = s_x + (s_x - m_x) (e_z - s_z) / (s_z - m_z) with the linear diffuser and at
    s_x + (s_x - m_x) h_e / h_m with the conical one. Positive where that is right of the eye; NaN for a module that
    is not behind the point, or whose ray is 90 degrees or more away.
    """
    forward = e_z - s_z
    if conical != 0.0:
        h_m = np.sqrt((s_y - m_y) * (s_y - m_y) + m_z * m_z)
        h_e = np.sqrt((s_y - y_o) * (s_y - y_o) + e_z * e_z)
        a = (s_x - m_x) * (h_e / h_m)
    else:
        a = (s_x - m_x) * (forward / (s_z - m_z))
    b = e_x - s_x
    f2 = forward * forward
    if not s_z < m_z or not a * b + f2 > 0.0:
        return np.nan
    return (b - a) * forward / np.sqrt((a * a + f2) * (b * b + f2))


@kernel(inline=True)
def pair_weights(blend, a_left, a_right, step, left_shows, right_shows):
    """Weights of the two modules whose rays pass next to the eye, left and right of it; (0, 0) where none reaches it.

    A module reaches an eye up to half an angular step from its ray. ``linear`` joins the two where both show the
    screen point; else the nearer one that shows it counts alone, the left one of two equally near.
    """
    if blend == LINEAR and left_shows and right_shows:
        return a_right / step, -a_left / step
    left, right = left_shows and -2.0 * a_left <= step, right_shows and 2.0 * a_right <= step
    if left and not (right and a_right < -a_left):
        return 1.0, 0.0
    return 0.0, 1.0 if right else 0.0


@kernel(inline=True)
def add_texel(sums, texels, start, width, height, u, v, weight):
    """Add weight times a texture, bilinear at (u, v) between texels' centres and clamped at its rim, to ``sums``."""
    x = min(max(u - 0.5, 0.0), width - 1.0)
    y = min(max(v - 0.5, 0.0), height - 1.0)
    i, j = int(x), int(y)
    f, g = x - i, y - j
    right, below = min(i + 1, width - 1), min(j + 1, height - 1)
    a, b = start + j * width + i, start + j * width + right
    c, d = start + below * width + i, start + below * width + right
    for n in range(sums.shape[0]):
        top = (1.0 - f) * texels[a, n] + f * texels[b, n]
        bottom = (1.0 - f) * texels[c, n] + f * texels[d, n]
        sums[n] += weight * ((1.0 - g) * top + g * bottom)


@kernel(inline=True)
def add_module(numbers, sizes, starts, texels, k, s_x, s_y, s_z, weight, sums):
    """Add weight times what module k shows at a screen point; whether it shows anything there."""
    if starts[k] < 0:
        return False
    u, v, answer = physical_to_image(numbers[k], s_x, s_y, s_z)
    if answer != VALID or not (0.0 <= u < sizes[k, 0] and 0.0 <= v < sizes[k, 1]):
        return False
    if weight > 0.0:
        add_texel(sums, texels, starts[k], sizes[k, 0], sizes[k, 1], u, v, weight)
    return True


@kernel(inline=True)
def module_sine(numbers, k, s_x, s_y, s_z, e_x, e_z):
    """The ray_sine of module k."""
    m = numbers[k, 0], numbers[k, 1], numbers[k, 2]
    return ray_sine(numbers[k, 7], m[0], m[1], m[2], numbers[k, 3], s_x, s_y, s_z, e_x, e_z)


@kernel(inline=True)
def nearest_rays(numbers, s_x, s_y, s_z, e_x, e_z):
    """The modules whose rays pass next to the eye, on its left and on its right.

    Returns
    -------
    left, right : int
        Their numbers, -1 where there is none.
    a_left, a_right : float
        Their sines, <= 0 and > 0; infinite where there is none.
    step : float
        The modules' angular step here, as a difference of sines: between the two, or beyond an outermost ray from it
        to the next one; infinite where that is missing too.
    """
    l_1, l_2, r_1, r_2, left, right = -np.inf, -np.inf, np.inf, np.inf, -1, -1
    for k in range(numbers.shape[0]):
        a = module_sine(numbers, k, s_x, s_y, s_z, e_x, e_z)
        if l_1 < a <= 0.0:
            l_1, l_2, left = a, l_1, k
        elif l_2 < a <= 0.0:
            l_2 = a
        elif 0.0 < a < r_1:
            r_1, r_2, right = a, r_1, k
        elif 0.0 < a < r_2:
            r_2 = a
    if left < 0 and right < 0:
        return left, right, l_1, r_1, np.inf
    step = r_2 - r_1 if left < 0 else (l_1 - l_2 if right < 0 else r_1 - l_1)
    return left, right, l_1, r_1, step


@kernel(inline=True)
def add_gaussian(numbers, sizes, starts, texels, s_x, s_y, s_z, e_x, e_z, step, sums):
    """Add all modules by exp(-q^2 / 2), q their sine in units of SIGMA steps, if abs(q) < CUT; the sum of weights."""
    total, sigma = 0.0, SIGMA * step
    for k in range(numbers.shape[0]):
        q = module_sine(numbers, k, s_x, s_y, s_z, e_x, e_z) / sigma
        if -CUT < q < CUT:
            weight = exp(-0.5 * (q * q))
            if add_module(numbers, sizes, starts, texels, k, s_x, s_y, s_z, weight, sums):
                total += weight
    return total


@kernel
def add_pixel(numbers, sizes, starts, texels, s_x, s_y, s_z, e_x, e_z, blend, sums):
    """Add what the eye sees at a screen point to ``sums``, (C,) float64; the sum of the weights, 0 for nothing."""
    left, right, a_left, a_right, step = nearest_rays(numbers, s_x, s_y, s_z, e_x, e_z)
    if not 0.0 < step < np.inf:
        return 0.0
    l_shows = left >= 0 and add_module(numbers, sizes, starts, texels, left, s_x, s_y, s_z, 0.0, sums)
    r_shows = right >= 0 and add_module(numbers, sizes, starts, texels, right, s_x, s_y, s_z, 0.0, sums)
    w_left, w_right = pair_weights(blend, a_left, a_right, step, l_shows, r_shows)
    if not w_left + w_right > 0.0:
        return 0.0
    if blend == GAUSSIAN:
        return add_gaussian(numbers, sizes, starts, texels, s_x, s_y, s_z, e_x, e_z, step, sums)
    if w_left > 0.0:
        add_module(numbers, sizes, starts, texels, left, s_x, s_y, s_z, w_left, sums)
    if w_right > 0.0:
        add_module(numbers, sizes, starts, texels, right, s_x, s_y, s_z, w_right, sums)
    return 1.0


@kernel(parallel=True)
def compose(numbers, sizes, starts, texels, eye, screen, blend, picture, dark):
    """The picture of the screen's rectangle at z = 0 that an eye sees.

    Parameters
    ----------
    numbers : (M, 32) float64
        The modules of one display.
    sizes : (M, 2) int64
        Width and height of each module's texture.
    starts : (M,) int64
        Row of ``texels`` at which each module's texture starts, -1 for a module that shows nothing.
    texels : (n, C) float32
        All textures, row by row, finite.
    eye : (3,) float64
        The eye, on the observer line or arc, metres.
    screen : (2,) float64
        Width and height of the screen, metres.
    blend : int
        NEAREST, LINEAR or GAUSSIAN.
    picture : (H, W, C) float32
        Out: 0 where no module reaches the eye. Pixel (i, j) looks through x = w ((i + 0.5) / W - 0.5),
        y = h (0.5 - (j + 0.5) / H).
    dark : (H,) int64
        Out: how many pixels of each row no module reaches.
    """
    height, width, channels = picture.shape
    w, h, e_x, e_y, e_z = screen[0], screen[1], eye[0], eye[1], eye[2]
    for j in prange(height):
        sums = np.empty(channels)
        y = h * (0.5 - (j + 0.5) / height)
        dark[j] = 0
        for i in range(width):
            sums[:] = 0.0
            x = w * ((i + 0.5) / width - 0.5)
            s_x, s_y, s_z, seen = seen_screen_point(numbers[0, 5], 0.5 * w, 0.5 * h, x, y, e_x, e_y, e_z)
            total = 0.0
            if seen:
                total = add_pixel(numbers, sizes, starts, texels, s_x, s_y, s_z, e_x, e_z, blend, sums)
            for n in range(channels):
                picture[j, i, n] = sums[n] / total if total > 0.0 else 0.0
            if not total > 0.0:
                dark[j] += 1
