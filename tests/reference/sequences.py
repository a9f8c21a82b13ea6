"""Sampling methods again, in plain Python and from the definitions where these are not those of the kernels.

Nothing here comes from lfssao. The methods of LF section 6 but Poisson's are in twins.py.
"""

import math
from decimal import Decimal, localcontext

import numpy as np

from reference.twins import (
    algorithm3,
    algorithm4,
    exp,
    philox4x32,
    random_below,
    random_signed,
    random_unit,
    random_word,
    sincospi,
)

RADIUS, SHUFFLE = 2, 3


def root(power, constant):
    """The positive root of x^power = x + constant, to 60 digits, by bisection."""
    with localcontext() as context:
        context.prec = 60
        low, high = Decimal(1), Decimal(2)
        for _ in range(190):
            middle = (low + high) / 2
            low, high = (middle, high) if middle**power < middle + constant else (low, middle)
        return low


def powers_of_inverse(x, count):
    """x^-1, ..., x^-count in units of 2**-64, cut."""
    with localcontext() as context:
        context.prec = 60
        return [int(2**64 / x**k) for k in range(1, count + 1)]


# x^2 = x + 1: the golden ratio.
GOLDEN = powers_of_inverse(root(2, 1), 1)[0]
ROBERTS = {d: powers_of_inverse(root(d + 1, 1), d) for d in (2, 3)}


def unit(word):
    return (word // 2**12 + 0.5) / 2.0**52


def long_word(seed, stream):
    return random_word(seed, stream, 0) * 2**32 + random_word(seed, stream, 1)


def radii(seed, n, columns):
    return [[random_unit(seed, RADIUS, k)] if columns == 3 else [] for k in range(n)]


def fibonacci(n, seed, columns):
    place, turn = unit(long_word(seed, 0)), long_word(seed, 1)
    rest = radii(seed, n, columns)
    return [[2.0 * ((k + place) / n) - 1.0, 2.0 * unit((turn + k * GOLDEN) % 2**64) - 1.0, *rest[k]] for k in range(n)]


def r2(n, seed, columns):
    starts = [long_word(seed, a) for a in range(columns)]
    rows = [[unit((s + k * step) % 2**64) for s, step in zip(starts, ROBERTS[columns], strict=True)] for k in range(n)]
    return [[2.0 * x - 1.0, 2.0 * y - 1.0, *t] for x, y, *t in rows]


def scrambled(digits, base, seed, stream):
    """Each digit moved by a number that depends on the digits before it."""
    moved = []
    for place, digit in enumerate(digits):
        before = int("1" + "".join(map(str, digits[:place])), base)
        moved.append((digit + random_word(seed, stream, before) * base // 2**32) % base)
    return moved


def fraction(digits, base):
    return (int("".join(map(str, digits)), base) + 0.5) / base ** len(digits)


def halton(n, seed, columns):
    def place(k, a):
        base, count = ((2, 32), (3, 20), (5, 13))[a]
        return fraction(scrambled([k // base**i % base for i in range(count)], base, seed, a), base)

    rows = [[place(k, a) for a in range(columns)] for k in range(n)]
    return [[2.0 * x - 1.0, 2.0 * y - 1.0, *t] for x, y, *t in rows]


def direction_numbers(dimension):
    """m_1, m_2, ...: of the radical inverse, and by Sobol's recurrence for x + 1 and x^2 + x + 1."""
    m = [1] * 32 if dimension == 0 else [1] if dimension == 1 else [1, 3]
    while len(m) < 32:
        m.append(2 * m[-1] ^ m[-1] if dimension == 1 else 2 * m[-1] ^ 4 * m[-2] ^ m[-2])
    return m


def sobol_word(index, dimension):
    word = 0
    for k, m in enumerate(direction_numbers(dimension)):
        if index >> k & 1:
            word ^= m << 31 - k
    return word


def sobol(n, seed, columns):
    def place(k, a):
        return fraction(scrambled([int(bit) for bit in f"{sobol_word(k, a):032b}"], 2, seed, a), 2)

    rows = [[place(k, a) for a in range(columns)] for k in range(n)]
    return [[2.0 * x - 1.0, 2.0 * y - 1.0, *t] for x, y, *t in rows]


def bridson(seed, stream, r, most):
    """Bridson's algorithm without his grid: each candidate against all points."""
    points = [(random_signed(seed, stream, 0), random_signed(seed, stream, 1))]
    front = [0]
    dart = 2
    while front and len(points) < most:
        place = random_below(seed, stream, dart, len(front))
        dart += 1
        around = points[front[place]]
        for _ in range(30):
            ring, turn, _, _ = philox4x32((dart, stream, 1, 0), (seed % 2**32, seed >> 32))
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
        other = k + random_below(seed, SHUFFLE, k, len(points) - k)
        points[k], points[other] = points[other], points[k]
    return [[*p, *t] for p, t in zip(points, radii(seed, n, columns), strict=False)]


# Lifts


def to_disk(x, y):
    sine, cosine = sincospi(y)
    r = math.sqrt(0.5 + 0.5 * x)
    return r * cosine, r * sine


def rejection(n, seed, columns):
    inside, k = [], 0
    while len(inside) < n:
        p = [random_signed(seed, a, k) for a in range(columns)]
        total = 0.0
        for x in p:
            total += x * x
        if total <= 1.0:
            inside.append(p)
        k += 1
    return inside


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


def lifted(fill, domain, n, seed, r_min=0.0, r_max=1.0):
    """A set of any domain from a fill of the square."""
    if domain == "square":
        return fill(n, seed, 2)
    if domain == "ball":
        return [algorithm4(*algorithm3(x, y), t, r_min, r_max) for x, y, t in fill(n, seed, 3)]
    return [(algorithm3 if domain == "sphere" else to_disk)(x, y) for x, y in fill(n, seed, 2)]


# Repulsion


def darts(seed, n, d):
    """Darts that keep a distance, which shrinks by a tenth after 64 misses in a row; shrunk by a twentieth."""
    points, apart, dart, missed = [], 4.0, 0, 0
    while len(points) < n:
        place = [random_signed(seed, a, dart) for a in range(d)]
        dart += 1
        if sum((x * x for x in place), 0.0) > 1.0:
            continue
        place = [0.95 * x for x in place]
        if all(sum(((a - b) * (a - b) for a, b in zip(p, place, strict=True)), 0.0) >= apart for p in points):
            points.append(place)
            missed = 0
        elif (missed := missed + 1) == 64:
            missed, apart = 0, apart * 0.9
    return points


GAUSS = np.polynomial.legendre.leggauss(120)


def energy(points, charge, ring=2048):
    """The energy of all charges, the boundary's by summing over many on it: the sphere's over a fine product grid."""
    n, d = points.shape
    total = sum(1 / (3 * math.dist(points[i], points[k]) ** 3) for i in range(n) for k in range(i))
    angle = (np.arange(ring) + 0.5) * (2 * np.pi / ring)
    for p in points:
        if d == 2:
            gap = (p[0] - np.cos(angle)) ** 2 + (p[1] - np.sin(angle)) ** 2
        else:
            z = GAUSS
            r = math.sqrt(np.sum(p**2))
            total += charge * np.sum(z[1] / 2 / (3 * (1 + r * r - 2 * r * z[0]) ** 1.5))
            continue
        total += charge * np.mean(1 / (3 * gap**1.5))
    return total


def voronoi(points, cells):
    """Weights and centroids of the cells, one grid point after the other."""
    n, d = points.shape
    weights, sums = [0.0] * n, [[0.0] * d for _ in range(n)]
    middles = [((2 * k + 1) - cells) / cells for k in range(cells)]
    for z in middles if d == 3 else [0.0]:
        for y in middles:
            for x in middles:
                inside = 1.0 - ((x * x + y * y) + z * z)
                if inside <= 0.0:
                    continue
                share = 1.0 if d == 3 else math.sqrt(inside)
                gaps = []
                for p in points.tolist():
                    gap = (p[0] - x) * (p[0] - x) + (p[1] - y) * (p[1] - y)
                    gaps.append(gap + (p[2] - z) * (p[2] - z) if d == 3 else gap)
                k = gaps.index(min(gaps))
                weights[k] += share
                for a, c in enumerate((x, y, z)[:d]):
                    sums[k][a] += share * c
    total = 0.0
    for weight in weights:
        total += weight
    centroids = [[c / w for c in s] if w > 0 else p for s, w, p in zip(sums, weights, points.tolist(), strict=True)]
    return [weight / total for weight in weights], centroids


# Tiles


def bayer(side):
    """The ordered square built from the one of half the side: four copies, each coarse rank four apart."""
    if side == 1:
        return np.zeros((1, 1), np.int64)
    half = 4 * bayer(side // 2)
    return np.block([[half, half + 2], [half + 3, half + 1]])


def void_and_cluster(seed, height, width):
    """Ulichney's three phases, the third on what is empty, energies summed afresh each time they are looked at."""
    places = [(y, x) for y in range(height) for x in range(width)]

    def near(p, q):
        b, a = ((u - v) % size for u, v, size in zip(p, q, (height, width), strict=True))
        a, b = min(a, width - a), min(b, height - b)
        return int(exp(-(a * a + b * b) / (2.0 * 1.5 * 1.5)) * 2.0**40)

    table = {(p, q): near(p, q) for p in places for q in places}

    def tightest(chosen):
        return max(sorted(chosen), key=lambda p: sum(table[p, q] for q in chosen))

    def emptiest(chosen):
        return min((p for p in places if p not in chosen), key=lambda p: sum(table[p, q] for q in chosen))

    ones, dart = set(), 0
    while len(ones) < max(height * width // 10, 1):
        y, x = divmod(random_below(seed, 0, dart, height * width), width)
        ones.add((y, x))
        dart += 1
    while True:
        ones.remove(cluster := tightest(ones))
        ones.add(void := emptiest(ones))
        if void == cluster:
            break
    ranks, left = {}, set(ones)
    while left:
        left.remove(cluster := tightest(left))
        ranks[cluster] = len(left)
    while len(ones) < len(places) / 2:
        ranks[void := emptiest(ones)] = len(ones)
        ones.add(void)
    zeros = set(places) - ones
    while zeros:
        ranks[cluster := tightest(zeros)] = len(places) - len(zeros)
        zeros.remove(cluster)
    return [[ranks[y, x] for x in range(width)] for y in range(height)]
