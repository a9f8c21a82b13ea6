"""The virtual viewer, pixel by pixel in Python's floats, in the order of operations that the kernels document."""

from math import isnan, nan, sqrt

import numpy as np

from reference.elementary import exp
from reference.mapping import crossing, screen_to_texel, texel_at

NEAREST, LINEAR, GAUSSIAN = 0, 1, 2


def screen_point(curvature, screen, x, y, eye):
    """The screen point that an eye sees through (x, y, 0), or None."""
    if curvature == 0:
        return x, y, 0.0
    e_x, e_y, e_z = eye
    dx, dz = e_x - x, e_z
    t, discriminant = crossing(curvature, x, 0.0, dx, dz)
    t = float(t)
    s_x, s_y = x + t * dx, y + t * (e_y - y)
    if discriminant < 0 or t >= 1 or abs(s_x) > 0.5 * screen[0] or abs(s_y) > 0.5 * screen[1]:
        return None
    return s_x, s_y, t * e_z


def sine(d, s, eye):
    """Sine of the angle from the eye to a module's ray through s, or NaN."""
    (s_x, s_y, s_z), (e_x, _, e_z) = s, eye
    if s_z >= d[2]:
        return nan
    forward = e_z - s_z
    if d[7]:
        h_m = sqrt((s_y - d[1]) * (s_y - d[1]) + d[2] * d[2])
        h_e = sqrt((s_y - d[3]) * (s_y - d[3]) + e_z * e_z)
        ratio = h_e / h_m
    else:
        ratio = forward / (s_z - d[2])
    a, b, f2 = (s_x - d[0]) * ratio, e_x - s_x, forward * forward
    if not a * b + f2 > 0:
        return nan
    return (b - a) * forward / sqrt((a * a + f2) * (b * b + f2))


def texel(d, shape, s):
    """Image point at which a module shows s, or None."""
    u, v, status = screen_to_texel(d, *s)
    return None if texel_at(shape, (u, v, None, status)) is None else (u, v)


def neighbours(sines):
    """Modules left and right of the eye and the angular step; None for none."""
    left = sorted((k for k, a in enumerate(sines) if a <= 0), key=lambda k: -sines[k])
    right = sorted((k for k, a in enumerate(sines) if a > 0), key=lambda k: sines[k])
    if left and right:
        return left[0], right[0], sines[right[0]] - sines[left[0]]
    if len(left) > 1:
        return left[0], None, sines[left[0]] - sines[left[1]]
    if len(right) > 1:
        return None, right[0], sines[right[1]] - sines[right[0]]
    return None, None, None


def weigh(sines, places, blend):
    """Weight of each module that counts, by its number."""
    left, right, step = neighbours(sines)
    seen = [k for k in (left, right) if k is not None and places[k] is not None]
    if not seen:
        return {}
    nearest = min(seen, key=lambda k: abs(sines[k]))
    if 2 * abs(sines[nearest]) > step:
        return {}
    if blend == GAUSSIAN:
        sigma = 1.5 * step
        q = {k: a / sigma for k, a in enumerate(sines) if places[k] is not None and abs(a) < 4.0 * sigma}
        return {k: exp(-0.5 * (n * n)) for k, n in q.items()}
    if blend == LINEAR and len(seen) == 2:
        return {left: sines[right] / step, right: -sines[left] / step}
    return {nearest: 1.0}


def bilinear(texture, u, v):
    """Channels of a texture, (H, W, C), at an image point."""
    height, width, _ = texture.shape
    x, y = min(max(u - 0.5, 0.0), width - 1.0), min(max(v - 0.5, 0.0), height - 1.0)
    i, j = int(x), int(y)
    f, g = x - i, y - j
    i2, j2 = min(i + 1, width - 1), min(j + 1, height - 1)
    corners = (texture[j, i], texture[j, i2], texture[j2, i], texture[j2, i2])
    out = []
    for a, b, c, d in zip(*(corner.tolist() for corner in corners), strict=True):
        top, bottom = (1.0 - f) * a + f * b, (1.0 - f) * c + f * d
        out.append((1.0 - g) * top + g * bottom)
    return out


def seen_by(numbers, textures, eye, screen, width, height):
    """For each pixel, row by row, the sine and the image point of each module, or None; whatever the blend.

    numbers: (M, 32); textures: (H, W, C) float32 or None for each module; eye, screen: 3 and 2 floats.
    """
    numbers, pixels = [row.tolist() for row in numbers], []
    for j in range(height):
        for i in range(width):
            x, y = screen[0] * ((i + 0.5) / width - 0.5), screen[1] * (0.5 - (j + 0.5) / height)
            s = screen_point(numbers[0][5], screen, x, y, eye)
            if s is None:
                pixels.append(None)
                continue
            sines = [sine(d, s, eye) for d in numbers]
            places = [
                None if t is None or isnan(a) else texel(d, t.shape, s)
                for d, t, a in zip(numbers, textures, sines, strict=True)
            ]
            pixels.append((sines, places))
    return pixels


def compose(pixels, textures, blend, width, height):
    """The picture, (H, W, C) float32, of what ``seen_by`` gives, and how many of its pixels no module reaches."""
    channels = next(t.shape[2] for t in textures if t is not None)
    picture, dark = np.zeros((height * width, channels), np.float32), 0
    for number, pixel in enumerate(pixels):
        weights = {} if pixel is None else weigh(*pixel, blend)
        total = 0.0
        sums = [0.0] * channels
        for k in sorted(weights):
            if weights[k] > 0:
                total += weights[k]
                colour = bilinear(textures[k], *pixel[1][k])
                sums = [a + weights[k] * b for a, b in zip(sums, colour, strict=True)]
        dark += total == 0
        for n in range(channels):
            picture[number, n] = np.float32(sums[n] / total) if total > 0 else 0.0
    return picture.reshape(height, width, channels), dark
