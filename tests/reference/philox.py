"""Random words: section 5 of the specification (Salmon et al. 2011, section 3.3 and table 2)."""


def philox4x32(counter, key):
    c0, c1, c2, c3 = counter
    k0, k1 = key
    for _ in range(10):
        p, q = 0xD2511F53 * c0, 0xCD9E8D57 * c2
        c0, c1, c2, c3 = (q >> 32) ^ c1 ^ k0, q & 0xFFFFFFFF, (p >> 32) ^ c3 ^ k1, p & 0xFFFFFFFF
        k0, k1 = (k0 + 0x9E3779B9) % 2**32, (k1 + 0xBB67AE85) % 2**32
    return c0, c1, c2, c3


def key_of(seed):
    return seed % 2**32, seed // 2**32


def word(seed, stream, index):
    return philox4x32((index, stream, 0, 0), key_of(seed))[0]


def signed(seed, stream, index):
    return (word(seed, stream, index) + 0.5) / 2147483648 - 1


def unit(seed, stream, index):
    return (word(seed, stream, index) + 0.5) / 4294967296


def below(seed, stream, index, n):
    return (word(seed, stream, index) * n) >> 32
