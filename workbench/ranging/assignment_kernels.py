"""Compiled enumeration of assignments. Imported only inside functions, because numba takes long to load."""

from __future__ import annotations

import numpy as np

from workbench.model.arrays import BoolArray, IndexArray
from workbench.spots.kernels.compiled import compiled


@compiled
def assignments(possible: BoolArray, most: int) -> IndexArray:
    """(K, spots) laser of each spot, for every injective assignment of possible pairs (lasers, spots).

    In lexicographic order, by depth-first search; the search ends after `most` + 1 assignments.
    """
    lasers, spots = possible.shape
    found = np.empty((most + 1, spots), np.intp)
    chosen, used = np.full(spots, -1, np.intp), np.zeros(lasers, np.bool_)
    count = spot = 0
    while spot >= 0 and count <= most:
        if spot == spots:
            found[count] = chosen
            count += 1
            spot -= 1
            continue
        laser = chosen[spot]
        if laser >= 0:
            used[laser] = False
        laser += 1
        while laser < lasers and (used[laser] or not possible[laser, spot]):
            laser += 1
        if laser == lasers:
            chosen[spot] = -1
            spot -= 1
        else:
            chosen[spot] = laser
            used[laser] = True
            spot += 1
    return found[:count]
