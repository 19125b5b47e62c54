"""Random numbers by key: the same seed and key give the same numbers, independent of earlier draws."""

from __future__ import annotations

import hashlib

from numpy.random import SFC64, Generator, SeedSequence


def generator(seed: int, *key: str | int) -> Generator:
    """Random generator for a key, which depends on the parts of the key and their order.

    The hash includes the lengths of the parts, so that ("ab", "c") and ("a", "bc") differ. Python's `hash`
    would differ between runs.
    """
    digest = hashlib.sha256(str(seed).encode())
    for part in key:
        data = str(part).encode()
        digest.update(b"%d:" % len(data) + data)
    return Generator(SFC64(SeedSequence(int.from_bytes(digest.digest(), "big"))))
