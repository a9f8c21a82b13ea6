"""Why no more is had, of rows that are less than three times as fast as plain C; the table shows these beside them."""

_MEMORY = (
    "memory: a copy of as many bytes takes as long (column 'copy'); in the cache C's equal too, as gcc makes vectors "
    "of this loop as LLVM does"
)
_CACHE = "memory (column 'copy'); three times as fast as C or more where the textures fit the cache (last table)"
_CALLS = (
    "where the textures are small (last table): checks, tables and starting threads, 0.1 to 0.3 ms, which C has not"
)

# The first that a row's name starts with.
LIMITS: dict[str, str] = {
    "linear z": _MEMORY,
    "positions from z": _CACHE,
    "packing": _CACHE,
    "occlusion of A": _MEMORY,
    "2x2 average": _CACHE,
    "z hierarchy": "memory (column 'copy'); gcc makes vectors of the means too, of all but the harmonic one; where the "
    "textures are small (last table), the calls of its five levels, each as long as C's",
    "multiresolution, halve": "a look-up of depth for each texel: a gather takes as long as the loads it stands for",
    "multiresolution, upsample": "three divisions a texel and coarse texel; background, which C skips, is computed too",
    "multiresolution": "background between surfaces is computed, which C skips; see the other scene",
    "viewing directions": "the divider: three float64 quotients and a root, at most twice as fast in vectors as alone",
    "pyramid of moments": "24 bytes a texel and level, float64; gcc makes vectors of the moments as LLVM does",
    "vo-area": "its pyramid, which has a row of its own",
    "face normals": "memory, three times as fast as C in the cache (last table); and background, which C skips",
    "SAO taps": "a look-up of z for each tap: a gather takes as long as the loads it stands for, which C has from the "
    "cache where the textures are small (last table)",
    "sao": "its passes, which have rows of their own",
    "vo-lines, 5, two radii": "its lines, which have a row of their own",
    "vo-lines": _CALLS,
    "point": _CALLS,
    "hemisphere": _CALLS,
}
