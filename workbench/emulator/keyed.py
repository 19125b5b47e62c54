"""Random numbers by name: the same seed and key give the same numbers, whatever was drawn before."""

from __future__ import annotations

import hashlib

from numpy.random import SFC64, Generator, SeedSequence


def generator(seed: int, *key: str | int) -> Generator:
    """A generator that belongs to `key` alone; each part of the key counts, and so does their order.

    The key is hashed with its parts' lengths, so that ("ab", "c") and ("a", "bc") differ; Python's own
    `hash` would change from run to run.
    """
    digest = hashlib.sha256(str(seed).encode())
    for part in key:
        data = str(part).encode()
        digest.update(b"%d:" % len(data) + data)
    return Generator(SFC64(SeedSequence(int.from_bytes(digest.digest(), "big"))))
