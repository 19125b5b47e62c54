"""Compilation of loops over pixels. Import it only where a fit runs: numba takes half a second to load."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, TypeVar, cast

import numba

F = TypeVar("F", bound=Callable[..., object])

# Sums may be reordered, which allows vector instructions. NaN and infinity keep their meaning, because they
# reveal a failed fit.
_FAST: Final = {"reassoc", "contract", "arcp", "nsz"}


def compiled(function: F) -> F:
    """`function` as machine code, kept beside its source between runs.

    Numba compiles it again when that source changes, but not when the source of a function that it calls
    changes. After such a change remove `__pycache__` of this folder.
    """
    return cast(F, numba.njit(function, cache=True, fastmath=_FAST, error_model="numpy"))
