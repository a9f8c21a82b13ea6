"""The zlib stream of a chunk's packed lines, written with strings of bits; nothing here is lfssao's.

Greedy repeats of 4 bytes or more, 2 places or a line back, looked for in windows of 64 bytes.
"""

LONGEST, STORED = 258, 64


def stream(data, far):
    """The whole stream, with its checksum."""
    codes = prefix_codes([8] * 144 + [9] * 112 + [7] * 24 + [8] * 8)
    distances = prefix_codes([5] * 30)
    symbol, extra, bits = distance_symbol(min(far, 32768))
    text = body("010", data, repeats(data, far), codes, (distances[1], distances[symbol] + number(extra, bits)))
    text += codes[256] + "100"
    text += "0" * (-len(text) % 8)
    packed = bytes(int(text[k : k + 8][::-1], 2) for k in range(0, len(text), 8)) + b"\0\0\xff\xff"
    low = (1 + sum(data)) % 65521
    high = (len(data) + sum((len(data) - k) * byte for k, byte in enumerate(data))) % 65521
    return b"\x78\x01" + packed + (high * 65536 + low).to_bytes(4, "big")


def repeats(data, far):
    """(literals, length, whether far) one after the other, the last of length 0."""
    found, start, window = [], 0, 2
    reaches = far <= 32768
    while window + 64 <= len(data):
        lines = reaches and window >= far
        end = window + 64
        for place in range(window, end - 3):
            near, line = run(data, place, 2), run(data, place, far) if lines else 0
            if max(near, line) >= 4:
                break
        else:
            window += 61
            continue
        if place + near >= end:
            line = min(line, end - place)
        length = max(near, line)
        if length > LONGEST and length % LONGEST < 4:
            length -= length % LONGEST
        found.append((place - start, length, line > near))
        start = window = place + length
    return [*found, (len(data) - start, 0, False)]


def run(data, place, distance):
    """How many bytes from a place on are those a distance before."""
    end = place
    while end < len(data) and data[end] == data[end - distance]:
        end += 1
    return end - place


def pieces(length):
    return [LONGEST] * (length // LONGEST) + [length % LONGEST] * (length % LONGEST > 0)


def length_symbol(length):
    """Symbol, what is told behind it, in how many bits (the table of RFC 1951, 3.2.5)."""
    if length == LONGEST:
        return 285, 0, 0
    return among(length, 257, 3, [0] * 8 + [k for k in range(1, 6) for _ in range(4)])


def distance_symbol(distance):
    return among(distance, 0, 1, [0] * 4 + [k for k in range(1, 14) for _ in range(2)])


def among(value, symbol, base, sizes):
    """Which of the symbols from ``symbol`` on, each of which stands for 2**bits values, the first for ``base`` on."""
    for bits in sizes:
        if value < base + 2**bits:
            return symbol, value - base, bits
        symbol, base = symbol + 1, base + 2**bits
    raise AssertionError


def prefix_codes(sizes):
    """Each symbol's code as text; by size, then by symbol, they count up."""
    codes, code, before = [""] * len(sizes), -1, 0
    for size, symbol in sorted((size, symbol) for symbol, size in enumerate(sizes) if size):
        code = (code + 1) << (size - before)
        before = size
        codes[symbol] = f"{code:0{size}b}"
    return codes


def number(value, bits):
    """A plain number, whose lowest bit comes first."""
    return f"{value:0{bits}b}"[::-1] if bits else ""


def body(text, data, found, codes, distances):
    place = 0
    for literals, length, far in found:
        run_of = data[place : place + literals]
        if literals >= STORED:
            text += codes[256]
            for k in range(0, literals, 65535):
                part = run_of[k : k + 65535]
                text += "000"
                text += "0" * (-len(text) % 8) + number(len(part), 16) + number(65535 - len(part), 16)
                text += "".join(number(byte, 8) for byte in part)
            text += "010"
        else:
            text += "".join(codes[byte] for byte in run_of)
        for piece in pieces(length):
            symbol, extra, bits = length_symbol(piece)
            text += codes[symbol] + number(extra, bits) + distances[far]
        place += literals + length
    return text
