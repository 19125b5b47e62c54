"""Compilation of loops over pixels. Import it only where a fit runs: numba takes half a second to load."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import cache
from typing import Final, TypeVar, cast

import numba

F = TypeVar("F", bound=Callable[..., object])

# Sums may be reordered, which allows vector instructions. NaN and infinity keep their meaning, because they
# reveal a failed fit.
_FAST: Final = {"reassoc", "contract", "arcp", "nsz"}


def compiled(function: F) -> F:
    """`function` as machine code, kept beside its source between runs.

    Numba compiles it again when that source changes, but not when the source of a function that it calls
    changes. After such a change remove `__pycache__` of this folder. Where no folder can be written, it
    compiles in each run, and warns once.
    """
    try:
        return cast(F, numba.njit(function, cache=True, fastmath=_FAST, error_model="numpy"))
    except RuntimeError as error:
        if "locator" not in str(error):
            raise
    _warn_without_cache()
    return cast(F, numba.njit(function, fastmath=_FAST, error_model="numpy"))


@cache
def _warn_without_cache() -> None:
    warnings.warn(
        "machine code cannot be kept, because neither the program's folder nor the user's cache can be"
        " written: each run compiles for some ten seconds; let NUMBA_CACHE_DIR name a writable folder",
        stacklevel=3,
    )
