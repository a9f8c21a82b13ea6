"""Even shares for threads: each gets a contiguous run of a ``prange``."""

from lfssao.kernels.jit import kernel

# Rows that a thread takes at once, with one set of scratch arrays: enough that starting costs nothing, few enough that
# they divide evenly among threads.
ROWS_A_BLOCK = 8

_STRIDE = 1_000_003  # prime, so that it divides no number of rows below it


@kernel(inline=True)
def spread(k, n):
    """The k-th of 0 .. n - 1 in an order in which any run of k has numbers from everywhere; n below a million.

    A picture's empty rows lie together, at its top say: taken in order, one thread would get all of them.
    """
    return (k * _STRIDE) % n
