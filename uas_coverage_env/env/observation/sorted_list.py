"""A short list of what is nearest, kept in order, for kernels."""

from uas_coverage_env.compiled.kernels import inlined_kernel


@inlined_kernel
def insert(index, away, found, which, distance):
    """Put one into a list in the order of distance, then of index, if it is among the first.

    Args:
        index: (K,) the list; written.
        away: (K,) their distances; written.
        found: Length of the list so far.
        which: Index of the one.
        distance: Its distance.

    Returns:
        Length of the list.
    """
    at = found
    if found == away.shape[0]:
        at -= 1
        if distance > away[at] or (distance == away[at] and which > index[at]):
            return found
    else:
        found += 1
    while at > 0 and (
        away[at - 1] > distance or (away[at - 1] == distance and index[at - 1] > which)
    ):
        away[at] = away[at - 1]
        index[at] = index[at - 1]
        at -= 1
    away[at] = distance
    index[at] = which
    return found
