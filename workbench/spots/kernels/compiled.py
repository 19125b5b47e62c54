"""How loops over pixels are compiled. Import it only where a fit runs: numba takes half a second to load."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, TypeVar, cast

import numba

F = TypeVar("F", bound=Callable[..., object])

# Sums may be taken in any order, which is what lets them use the whole width of a register; nan and infinity
# keep their meaning, for they tell a fit that has failed.
_FAST: Final = {"reassoc", "contract", "arcp", "nsz"}


def compiled(function: F) -> F:
    """`function` as machine code, kept beside its source between runs.

    It is renewed when that source changes, but not when another file does that it calls: whoever changes one
    of these files removes `__pycache__`.
    """
    return cast(F, numba.njit(function, cache=True, fastmath=_FAST, error_model="numpy"))
