"""Hash chain of a journal: each line ends with the hash of the file up to there.

A line is `{"n":...,"time_ns":...,"event":{...},"chain":"<hash>"}`, where the hash is the SHA-256 of all bytes
of the file before `,"chain"` of this line. Lines of versions without it precede the first such line, whose
hash covers them.
"""

from __future__ import annotations

import hashlib
import re

CHAIN = re.compile(rb',"chain":"([0-9a-f]{64})"\}')
CHAIN_BYTES = len(b',"chain":""}') + 64


class ChainBrokenError(ValueError):
    """A line, or one before it, has changed since it was written."""


class Chain:
    """Running hash over the lines of one journal."""

    def __init__(self) -> None:
        self._sum = hashlib.sha256()
        self._begun = False

    def sealed(self, record: bytes) -> bytes:
        """Line of a new record, which is a JSON object: with its hash, without a newline."""
        body = record.removesuffix(b"}")
        total = self._sum.copy()
        total.update(body)
        return b'%b,"chain":"%b"}' % (body, total.hexdigest().encode())

    def add(self, line: bytes) -> None:
        """Continue after a line of the file, given without its newline.

        Raises:
            ChainBrokenError: the hash of the line is that of other bytes, or it has none although one before
                it has.
        """
        record, chain = split(line)
        if self._begun and not chain:
            raise ChainBrokenError("it has no hash (chain)")
        if chain and self.sealed(record) != line:
            raise ChainBrokenError("its hash (chain) is that of other bytes")
        self._begun = self._begun or bool(chain)
        self._extend(line)

    def add_own(self, line: bytes) -> None:
        """Continue after a line of `sealed`, which has been written and need not be checked."""
        self._begun = True
        self._extend(line)

    def _extend(self, line: bytes) -> None:
        self._sum.update(line)
        self._sum.update(b"\n")


def split(line: bytes) -> tuple[bytes, str]:
    """Record and hash of a line; an empty hash for a line of a version without."""
    found = CHAIN.fullmatch(line[-CHAIN_BYTES:])
    if found is None:
        return line, ""
    return line[:-CHAIN_BYTES] + b"}", found[1].decode()
