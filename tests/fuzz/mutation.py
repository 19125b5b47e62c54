"""Mutations of good inputs: of bytes at random, of text and of the values of a document by hypothesis."""

from __future__ import annotations

import io
import json
import random
from collections.abc import Sequence
from copy import deepcopy
from typing import Any

from hypothesis import strategies as st
from ruamel.yaml import YAML

TOKENS = (
    b"\0", b"\x1b[2J", b"\r", b"\n", b"\t", b"\xff\xfe", b"\xef\xbb\xbf", b"\xe2\x80\xae", b"\xed\xa0\x80",
    b"", b",", b",,,,", b";", b'"', b'""', b"'", b": ", b"- ", b"? ", b"&a ", b"*a", b"!!bool ", b"!!omap ",
    b"[", b"]", b"{", b"}", b"|", b">", b"%", b"@", b"#", b"---\n", b"...\n", b"<<: ", b"{{", b"sep=;\n",
    b"-1", b"0", b"-0", b"1e999", b"1e308", b"1e-308", b"-1e308", b"nan", b"inf", b"-inf", b".nan", b".inf",
    b"1,5", b"1_0", b"0x10", b"0o7", b"01", b"1" * 400, b"9" * 20, b"NaN", b"null", b"true", b"yes", b"~",
    b"x" * 300, b"\xc3\xa4", b"2026-11-23", b"12:30:45", b"../../etc/passwd", b"/dev/zero", b" ", b"   ",
)  # fmt: skip
"""Texts that parsers have stumbled over."""
VALUES: tuple[Any, ...] = (
    None, True, False, -1, 0, 1, -0.0, 0.5, 1e-308, 1e308, -1e308, 10**400, float("nan"), float("inf"), 2**63,
    "", " ", "ä/ö", "1 W", "2,5", "x" * 300, "\x1b[31m", "\u202e", "../..", "/dev/zero", "all", "board",
    [], [None], [[]], [1] * 30, [-1, -1], {}, {"a": 1}, {"value": 1, "sd": -1}, {"value": [], "sd": "x"},
)  # fmt: skip
"""Values that schemas have stumbled over."""
MOST_EDITS = 4
Path = tuple[str | int, ...]


def mutate_bytes(seeds: Sequence[bytes], rng: random.Random) -> bytes:
    """One of the seeds with up to MOST_EDITS edits of its bytes, lines or numbers."""
    content = rng.choice(seeds)
    for _ in range(rng.randint(1, MOST_EDITS)):
        content = rng.choice(_EDITS)(content, rng)
    return content


def edited_texts(seed: bytes) -> st.SearchStrategy[bytes]:
    """Texts with some of their parts replaced by TOKENS or by arbitrary characters."""
    part = st.tuples(
        st.integers(0, len(seed)),
        st.integers(0, 12),
        st.one_of(st.sampled_from(TOKENS), st.text(max_size=6).map(lambda s: s.encode("utf-8", "replace"))),
    )
    return st.lists(part, min_size=1, max_size=MOST_EDITS).map(lambda parts: _replaced(seed, parts))


def edited_documents(seed: bytes) -> st.SearchStrategy[bytes]:
    """YAML documents, and lines of JSON, with some of their values replaced, removed or repeated."""
    documents = _documents(seed)
    places = [(n, path) for n, document in enumerate(documents) for path in _paths(document)]
    ways = st.sampled_from(("set", "remove", "add"))
    edit = st.tuples(st.sampled_from(places), st.sampled_from(VALUES), ways)
    edits = st.lists(edit, min_size=1, max_size=MOST_EDITS)
    return edits.map(lambda chosen: _edited(documents, chosen))


def _replaced(seed: bytes, parts: Sequence[tuple[int, int, bytes]]) -> bytes:
    for start, length, instead in parts:
        seed = seed[:start] + instead + seed[start + length :]
    return seed


def _documents(seed: bytes) -> list[Any]:
    if seed.startswith(b"{"):
        return [json.loads(line) for line in seed.splitlines()]
    return [YAML(typ="safe", pure=True).load(io.BytesIO(seed))]


def _paths(value: Any, path: Path = ()) -> list[Path]:
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [path, *(found for key, one in inner for found in _paths(one, (*path, key)))]


def _edited(documents: Sequence[Any], edits: Sequence[tuple[tuple[int, Path], Any, str]]) -> bytes:
    changed = json.loads(json.dumps(documents, default=str))
    for (number, path), shared, how in edits:
        value = deepcopy(shared)  # a later edit may change what this one inserts
        *above, last = (number, *path)
        place = changed
        try:
            for key in above:
                place = place[key]
            if how == "remove":
                del place[last]
            elif how == "add" and isinstance(place, dict):
                place["x" if not isinstance(value, str) else value] = value
            else:
                place[last] = value
        except (KeyError, IndexError, TypeError):
            continue  # an earlier edit has removed this place
    return "\n".join(json.dumps(one) for one in changed).encode("utf-8", "surrogatepass") + b"\n"


def _flip(content: bytes, rng: random.Random) -> bytes:
    if not content:
        return content
    at = rng.randrange(len(content))
    return content[:at] + bytes([content[at] ^ (1 << rng.randrange(8))]) + content[at + 1 :]


def _token(content: bytes, rng: random.Random) -> bytes:
    at = rng.randint(0, len(content))
    return content[:at] + rng.choice(TOKENS) + content[at + rng.randint(0, 3) :]


def _cut(content: bytes, rng: random.Random) -> bytes:
    start = rng.randint(0, len(content))
    return content[:start] + content[start + rng.randint(1, max(1, len(content) // 3)) :]


def _end(content: bytes, rng: random.Random) -> bytes:
    return content[: rng.randint(0, len(content))]


def _lines(content: bytes, rng: random.Random) -> bytes:
    """Lines exchanged, repeated or removed."""
    lines = content.splitlines(keepends=True)
    if len(lines) < 2:
        return content
    a, b = rng.randrange(len(lines)), rng.randrange(len(lines))
    how = rng.randrange(3)
    if how == 0:
        lines[a], lines[b] = lines[b], lines[a]
    elif how == 1:
        lines.insert(a, lines[b])
    else:
        del lines[a]
    return b"".join(lines)


def _number(content: bytes, rng: random.Random) -> bytes:
    """A number replaced by another text."""
    digits = [n for n, byte in enumerate(content) if 48 <= byte <= 57 and not content[n - 1 : n].isdigit()]
    if not digits:
        return content
    start = rng.choice(digits)
    stop = start
    while stop < len(content) and content[stop : stop + 1] in b"0123456789.":
        stop += 1
    return content[:start] + rng.choice(TOKENS) + content[stop:]


def _random(content: bytes, rng: random.Random) -> bytes:
    at = rng.randint(0, len(content))
    return content[:at] + rng.randbytes(rng.randint(1, 8)) + content[at:]


_EDITS = (_flip, _flip, _token, _token, _cut, _end, _lines, _lines, _number, _number, _random)
