"""Memory that the passes of a view need."""

from lfssao.core.memory import check_available
from lfssao.errors import InputError

_MOST_TEXELS = 2**31 - 1  # kernels count texels in int32


def check_memory(width: int, height: int, radius_count: int, texel_bytes: int) -> None:
    """Refuse (InputError) a texture, its guard band included, that is too large for int32 numbers or for memory."""
    texels = width * height
    if texels > _MOST_TEXELS:
        raise InputError(f"resolution {width}x{height}: a texture has at most {_MOST_TEXELS} texels")
    passes = f"resolution {width}x{height}: the passes of one texture and {radius_count} radii"
    check_available(passes, needed_memory(texels, radius_count, texel_bytes))


def needed_memory(texels: int, radius_count: int, texel_bytes: int) -> int:
    """Bytes that one view takes, from its ray cast to its file; ``texel_bytes`` is the estimator's."""
    # Peaks, measured at 12 and 48 million texels with 5 and with 40 radii: shading and writing take 108 bytes a texel,
    # the estimate of the last radius 40 and the estimator's own, next to the textures of the other radii.
    return texels * (4 * radius_count + max(108, 40 + texel_bytes))
