"""Point sets in the ball and the disk by repulsion (VO section 4.5), from the tables of ``tests/tools``."""

from lfssao.core.arguments import check_whole
from lfssao.errors import InputError, check_choice, shown
from lfssao.samples.sets import SampleSet, read_table

MOST = 64
PROMISES = ("inside", "distinct", "weights", "apart")


def repulsion_table(domain: str, n: int, centre: bool | None = None) -> SampleSet:
    """Return n points, 1 to 64, that repel each other in the unit 'ball' or 'disk', for point or line samples.

    ``centre`` asks for the disk's set with a point held in the centre (default: VO's 5 and 9 lines have one), or the
    one made without; the ball has one set. Weights are the volume of each point's Voronoi cell; in the disk the
    integral over the cell of the ball's extent along z, 2 sqrt(1 - x^2 - y^2). Both sum to the ball's volume, 4/3 pi.
    InputError if there is no such table.

    >>> lfssao.samples.repulsion_table("ball", 12).points.shape
    (12, 3)
    """
    check_choice("domain of repulsion", domain, ("ball", "disk"))
    n = check_whole("number of points", n, 1, MOST)
    if not (centre is None or isinstance(centre, bool)):
        raise InputError(f"centre is {shown(centre)}, it must be True, False or None")
    if domain == "ball" and centre is not None:
        raise InputError("centre: only the disk has sets with and without a point in the centre")
    table = read_table("ball" if domain == "ball" else "disk" if centre is False else "disk-centre")
    first = n * (n - 1) // 2  # the sets of 1, 2, ... points stand one after the other
    rows = table[first : first + n]
    return SampleSet(rows[:, :-1].copy(), rows[:, -1].copy(), domain, "repulsion", 0, PROMISES)
