"""Why no more is had, of rows that are less than three times as fast as plain C; the table shows these beside them."""

_MEMORY = "memory: a copy of as many bytes takes as long (column 'copy'); gcc makes vectors of these loops as LLVM does"
_CACHE = "memory (column 'copy'); three times as fast as C or more where the textures fit the cache (last table)"

LIMITS: dict[str, str] = {
    "linear z": _MEMORY,
    "positions from z": _CACHE,
    "bilateral keys": _MEMORY,
    "packing": _CACHE,
    "unpacking": _CACHE,
    "occlusion of A": _MEMORY,
    "2x2 average": _CACHE,
    "dual radii, product": _MEMORY,
    "merge, maximum": _CACHE,
    "multiresolution, combine": _MEMORY,
    "z hierarchy": "memory (column 'copy'); gcc makes vectors of the means too, of all but the harmonic one",
    "multiresolution, halve": "a look-up of depth for each texel: a gather takes as long as the loads it stands for",
    "multiresolution, upsample": "three divisions a texel and coarse texel; background, which C skips, is computed too",
    "multiresolution": "background between surfaces is computed, which C skips; see the other scene",
    "viewing directions": "the divider: three float64 quotients and a root, at most twice as fast in vectors as alone",
    "depth along the axis": _CACHE,
    "pyramid of moments": "24 bytes a texel and level, float64; gcc makes vectors of the moments as LLVM does",
    "vo-area": "its pyramid, which has a row of its own, and new memory for it, which C finds ready",
    "face normals": "memory, three times as fast as C in the cache (last table); and background, which C skips",
    "sao": "its passes, which have rows of their own, and new memory for textures, which C finds ready",
    "vo-lines, 5, two radii": "its lines and the product, which have rows of their own",
}
