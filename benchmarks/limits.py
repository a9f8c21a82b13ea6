"""Why no more is had, of rows that are less than three times as fast as plain C; the table shows these beside them."""

_MEMORY = "memory: a copy of as many bytes takes as long (column 'copy'), in C too"
_INTERLEAVED = "memory for the most part (column 'copy'); the rest is taking threes apart or together"

LIMITS: dict[str, str] = {
    "linear z": _MEMORY,
    "positions from z": _INTERLEAVED,
    "bilateral keys": _MEMORY,
    "packing": _INTERLEAVED,
    "unpacking": _INTERLEAVED,
    "occlusion of A": _MEMORY,
    "2x2 average": _MEMORY,
    "dual radii, product": _MEMORY,
    "merge, maximum": _MEMORY,
    "multiresolution, combine": _MEMORY,
    "z hierarchy": "memory, as the column 'copy' shows; gcc makes vectors of the means too",
    "multiresolution, halve": "a look-up of depth for each texel: a gather takes as long as the loads it stands for",
    "multiresolution, upsample": "three divisions a texel and coarse texel; background, which C skips, is computed too",
    "multiresolution": "background between surfaces is computed, which C skips; see the other scene",
    "pyramid of moments": "24 bytes a texel and level, float64; gcc makes vectors of the moments as LLVM does",
    "vo-area": "its pyramid, which has a row of its own",
    "SAO rotations": "64-bit integers and a polynomial in float64, in vectors in neither; once for a size of textures",
    "face normals": "six divisions and a root a texel, in both; taking threes apart; background, which C skips",
    "sao": "its passes, which have rows of their own",
    "vo-lines, 5, two radii": "its lines and the product, which have rows of their own",
}
