"""Hash chain of a journal."""

from __future__ import annotations

import hashlib

import pytest

from workbench.session.chain import Chain, ChainBrokenError, split

RECORDS = [b'{"n":%d,"event":{"value":%d}}' % (n, 10 * n) for n in range(4)]


def chained(records: list[bytes], chain: Chain) -> list[bytes]:
    """Lines of the records."""
    lines = []
    for record in records:
        lines.append(chain.sealed(record))
        chain.add(lines[-1])
    return lines


def checked(lines: list[bytes]) -> int:
    """Number of lines before the first one that is refused."""
    chain = Chain()
    for number, line in enumerate(lines):
        try:
            chain.add(line)
        except ChainBrokenError:
            return number
    return len(lines)


def test_the_hash_is_that_of_the_file_up_to_its_key() -> None:
    lines = chained(RECORDS, Chain())
    content = b"\n".join(lines)
    for record, line in zip(RECORDS, lines, strict=True):
        before = content[: content.index(line) + line.index(b',"chain"')]
        assert split(line) == (record, hashlib.sha256(before).hexdigest())


def test_each_changed_byte_is_found_at_its_line() -> None:
    lines = chained(RECORDS, Chain())
    for at in range(len(lines[2])):
        edited = bytearray(lines[2])
        edited[at] ^= 1
        assert checked([*lines[:2], bytes(edited), lines[3]]) == 2


def test_a_line_that_is_missing_exchanged_or_without_hash_is_found() -> None:
    a, b, c, d = chained(RECORDS, Chain())
    assert checked([a, c, d]) == 1
    assert checked([a, c, b, d]) == 1
    assert checked([a, b, RECORDS[2], d]) == 2
    assert checked([a, b, c, d]) == 4


def test_lines_of_older_versions_are_accepted_and_covered_by_the_first_hash() -> None:
    old, new = RECORDS[:2], RECORDS[2:]
    assert checked(RECORDS) == len(RECORDS)
    chain = Chain()
    for line in old:
        chain.add(line)
    lines = chained(new, chain)
    assert checked([*old, *lines]) == 4
    assert checked([old[0].replace(b"0", b"7"), old[1], *lines]) == 2


@pytest.mark.parametrize("line", [b"", b"{}", b'{"event":{"chain":"%b"}}' % (b"0" * 64)])
def test_only_the_last_key_of_a_line_is_its_hash(line: bytes) -> None:
    assert split(line) == (line, "")
