"""Sampling methods that section 6 does not have, from their definitions where these are not those of the kernels."""

import math
from decimal import Decimal, localcontext

from reference.elementary import in_order, sincospi
from reference.philox import below, key_of, philox4x32, signed, unit, word
from reference.samples import RADIUS, SHUFFLE, algorithm3, algorithm4, square


def powers_of_inverse(power, count):
    """x^-1, ..., x^-count in units of 2**-64, cut, x being the root above 1 of x^power = x + 1."""
    with localcontext() as context:
        context.prec = 60
        x = Decimal(2)
        for _ in range(150):
            x = (1 + x) ** (1 / Decimal(power))
        return [int(2**64 / x**k) for k in range(1, count + 1)]


GOLDEN = powers_of_inverse(2, 1)[0]
ROBERTS = {d: powers_of_inverse(d + 1, d) for d in (2, 3)}


def unit_of(number):
    """The first 52 of 64 bits."""
    return (number // 2**12 + 0.5) / 2.0**52


def long_word(seed, stream):
    return word(seed, stream, 0) * 2**32 + word(seed, stream, 1)


def stretched(rows):
    """The first two columns from (0, 1) to (-1, 1)."""
    return [[2.0 * x - 1.0, 2.0 * y - 1.0, *t] for x, y, *t in rows]


def fibonacci(n, seed, columns):
    place, turn = unit_of(long_word(seed, 0)), long_word(seed, 1)
    return stretched([(k + place) / n, unit_of((turn + k * GOLDEN) % 2**64)] for k in range(n))


def r2(n, seed, columns):
    lattice = [(long_word(seed, a), step) for a, step in enumerate(ROBERTS[columns])]
    return stretched([unit_of((start + k * step) % 2**64) for start, step in lattice] for k in range(n))


def scrambled(digits, base, seed, stream):
    """Each digit moved by a number that depends on the digits before it."""
    moved = []
    for place, digit in enumerate(digits):
        before = int("1" + "".join(map(str, digits[:place])), base)
        moved.append((digit + word(seed, stream, before) * base // 2**32) % base)
    return moved


def fraction(digits, base):
    return (int("".join(map(str, digits)), base) + 0.5) / base ** len(digits)


def halton_digits(index, dimension):
    """The lowest first."""
    base, count = ((2, 32), (3, 20), (5, 13))[dimension]
    return [index // base**i % base for i in range(count)]


def halton(n, seed, columns):
    def place(k, a):
        return fraction(scrambled(halton_digits(k, a), base := (2, 3, 5)[a], seed, a), base)

    return stretched([place(k, a) for a in range(columns)] for k in range(n))


def direction_numbers(dimension):
    """m_1, m_2, ...: of the radical inverse, and by Sobol's recurrence for x + 1 and x^2 + x + 1."""
    m = [1] * 32 if dimension == 0 else [1] if dimension == 1 else [1, 3]
    while len(m) < 32:
        m.append(2 * m[-1] ^ m[-1] if dimension == 1 else 2 * m[-1] ^ 4 * m[-2] ^ m[-2])
    return m


def sobol_word(index, dimension):
    made = 0
    for k, m in enumerate(direction_numbers(dimension)):
        if index >> k & 1:
            made ^= m << 31 - k
    return made


def sobol(n, seed, columns):
    def place(k, a):
        return fraction(scrambled([int(bit) for bit in f"{sobol_word(k, a):032b}"], 2, seed, a), 2)

    return stretched([place(k, a) for a in range(columns)] for k in range(n))


def bridson(seed, stream, r, most):
    """Bridson's algorithm without his grid: each candidate against all points."""
    points = [(signed(seed, stream, 0), signed(seed, stream, 1))]
    front = [0]
    dart = 2
    while front and len(points) < most:
        place = below(seed, stream, dart, len(front))
        dart += 1
        around = points[front[place]]
        for _ in range(30):
            ring, turn, _, _ = philox4x32((dart, stream, 1, 0), key_of(seed))
            dart += 1
            away = r * math.sqrt(1.0 + 3.0 * ((ring + 0.5) / 2.0**32))
            sine, cosine = sincospi((turn + 0.5) / 2.0**31)
            x, y = around[0] + away * cosine, around[1] + away * sine
            y = y - 2.0 * math.floor((y + 1.0) * 0.5)
            if abs(x) <= 1.0 and abs(y) <= 1.0 and all(wrapped_square(x, y, *p) >= r * r for p in points):
                front.append(len(points))
                points.append((x, y))
                break
        else:
            front[place] = front[-1]
            front.pop()
    return points


def wrapped_square(x, y, a, b):
    across = min(abs(b - y), 2.0 - abs(b - y))
    return (a - x) * (a - x) + across * across


def poisson(n, seed, columns):
    r = 0.73 * math.sqrt(8.0 / (math.sqrt(3.0) * n))
    stream = 8
    while len(points := bridson(seed, stream, r, n + n // 4 + 8)) < n:
        r = r * min(math.sqrt(len(points) / n), 0.99)
        stream += 1
    for k in range(n):
        other = k + below(seed, SHUFFLE, k, len(points) - k)
        points[k], points[other] = points[other], points[k]
    return points[:n]


def rejection(n, seed, columns):
    inside, k = [], 0
    while len(inside) < n:
        p = [signed(seed, a, k) for a in range(columns)]
        if in_order(x * x for x in p) <= 1.0:
            inside.append(p)
        k += 1
    return inside


def finalized(x):
    """MurmurHash3's last steps on 32 bits."""
    for shift, factor in ((16, 0x85EBCA6B), (13, 0xC2B2AE35)):
        x = (x ^ x >> shift) * factor % 2**32
    return x ^ x >> 16


def burley_key(seed, column):
    high, low = divmod(seed, 2**32)
    return finalized(((low ^ finalized(high)) + (column + 1) * 0x9E3779B9) % 2**32)


def nested_flips(x, key):
    """Laine and Karras's hash by Burley's constants, on the bits in reverse order."""
    x = (int(f"{x:032b}"[::-1], 2) + key) % 2**32
    for factor in (0x6C50B47C, 0xB82F1E52, 0xC7AFE638, 0x8D22F6E6):
        x ^= x * factor % 2**32
    return int(f"{x:032b}"[::-1], 2)


def owen_burley(n, seed, columns):
    """Burley 2020, listing 4: indices are shuffled, then each coordinate is scrambled, by keys of their own."""
    rows = []
    for k in range(n):
        index = nested_flips(k, burley_key(seed, 3))
        words = [nested_flips(sobol_word(index, a), burley_key(seed, a)) for a in range(columns)]
        rows.append([(word + 0.5) / 2**32 for word in words])
    return stretched(rows)


# The first n points by n, seed and columns; a third column is of methods that have a third dimension of their own.
FILLS = {
    "fibonacci": fibonacci, "r2": r2, "halton": halton, "sobol": sobol, "poisson": poisson,
    "owen-burley": owen_burley,
    **{name: lambda n, seed, columns, name=name: square(name, n, seed) for name in ("random", "jittered", "latin")},
}  # fmt: skip


# Lifts


def to_disk(x, y):
    sine, cosine = sincospi(y)
    r = math.sqrt(0.5 + 0.5 * x)
    return r * cosine, r * sine


def length(x, y, z):
    return math.sqrt((x * x + y * y) + z * z)


def to_sphere(x, y, z):
    r = length(x, y, z)
    return x / r, y / r, z / r


def to_shell(x, y, z, r_min, r_max):
    if r_min == 0.0:
        return r_max * x, r_max * y, r_max * z
    r = length(x, y, z)
    if r == 0.0:
        return algorithm4(0.0, 0.0, 1.0, 0.0, r_min, r_max)
    return algorithm4(x / r, y / r, z / r, min(r * r * r, 1.0), r_min, r_max)


def point_set(domain, method, n, seed, r_min=0.0, r_max=1.0):
    """The points of any of these methods in any domain."""
    if method == "rejection":
        points = rejection(n, seed, 2 if domain == "disk" else 3)
        if domain == "disk":
            return points
        return [to_sphere(*p) if domain == "sphere" else to_shell(*p, r_min, r_max) for p in points]
    points = FILLS[method](n, seed, 3 if domain == "ball" else 2)
    if domain == "ball":
        numbers = [(x, y, *(t or [unit(seed, RADIUS, k)])) for k, (x, y, *t) in enumerate(points)]
        return [algorithm4(*algorithm3(x, y), t, r_min, r_max) for x, y, t in numbers]
    return [{"square": lambda *p: p, "sphere": algorithm3, "disk": to_disk}[domain](x, y) for x, y in points]
