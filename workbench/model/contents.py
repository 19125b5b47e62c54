"""Contents of files from a user: bounded reading, identification by the first bytes, control characters."""

from __future__ import annotations

import hashlib
import os
import re
import stat
from pathlib import Path

from workbench.model.errors import BadInputError

BEGINNINGS = {
    b"\x89PNG": "a PNG image",
    b"\xff\xd8\xff": "a JPEG image",
    b"GIF8": "a GIF image",
    b"BM": "a BMP image",
    b"II*\0": "a TIFF image",
    b"MM\0*": "a TIFF image",
    b"%PDF": "a PDF document",
    b"PK\x03\x04": "a zip archive or a spreadsheet (.xlsx, .ods)",
    b"\xd0\xcf\x11\xe0": "an Excel or Word document (.xls, .doc)",
    b"\x1f\x8b": "a compressed file (gzip)",
    b"\x93NUMPY": "a NumPy array",
    b"RRF": "a Rerun recording",
    b"\x7fELF": "a program",
    b"\xff\xfe": "text in UTF-16",
    b"\xfe\xff": "text in UTF-16",
}
TEXT = {"text in UTF-16"}
"""Kinds that are text in another encoding."""

CONTROL = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f"  # C0 but for tab and newline, DEL, C1
    "\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069"  # direction of text, line separators
    "\ud800-\udfff]"  # half of a character: cannot be written
)
"""Characters that change how a terminal or a page shows the text around them."""
JSON_ESCAPE = re.compile(r"\\(?:u[0-9a-fA-F]{4}|.)")
JSON_SHORT = {r"\b": "\b", r"\f": "\f", r"\r": "\r"}


def printable(text: str) -> str:
    """Text with its control characters shown as escapes in hexadecimal; tabs and newlines stay."""
    return CONTROL.sub(lambda found: found[0].encode("unicode_escape").decode("ascii"), text)


def printable_json(text: str) -> str:
    """JSON text with the control characters of its strings shown as escapes, also where JSON escapes them."""
    return CONTROL.sub(_shown_in_json, JSON_ESCAPE.sub(_shown_in_json, text)) if _may_change(text) else text


def _may_change(text: str) -> bool:
    return "\\" in text or CONTROL.search(text) is not None


def _shown_in_json(found: re.Match[str]) -> str:
    escape = found[0]
    character = chr(int(escape[2:], 16)) if escape.startswith("\\u") else JSON_SHORT.get(escape, escape)
    # Halves of a character stay: JSON writes a character beyond 16 bits as two of them.
    if len(character) != 1 or "\ud800" <= character <= "\udfff" or not CONTROL.match(character):
        return escape
    return "\\" + character.encode("unicode_escape").decode("ascii")


def file_sha256(path: Path) -> str:
    """SHA-256 of a file of any size, in hexadecimal digits; raises `OSError`."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def read_file(path: Path, expected: str, most_bytes: int) -> bytes:
    """Bytes of a file from a user.

    Args:
        path: file.
        expected: content, for messages, such as "a YAML file".
        most_bytes: largest size.

    Raises:
        BadInputError: there is no such file, it cannot be read, is larger, or is a folder, a pipe or a
            device: these could block, or never end.
    """
    try:
        mode = path.stat().st_mode
        if stat.S_ISDIR(mode):
            raise BadInputError(f"{path}: expected {expected}, got a folder; name a file in it")
        if not stat.S_ISREG(mode):
            raise BadInputError(f"{path}: expected {expected}, got a pipe, socket or device; name a file")
        # Not blocked by a pipe that has taken the file's place since.
        with os.fdopen(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb") as file:
            content = file.read(most_bytes + 1)
    except FileNotFoundError:
        raise BadInputError(f"{path}: no such file; expected {expected}") from None
    except (OSError, ValueError) as error:
        raise BadInputError(f"{path}: expected {expected}: {getattr(error, 'strerror', error)}") from None
    if len(content) > most_bytes:
        raise BadInputError(
            f"{path}: expected {expected} of at most {most_bytes / 2**20:g} MiB, it is larger"
        )
    return content


def not_text(content: bytes) -> str | None:
    """Kind of a file's `content` and a remedy, for messages; None for text in UTF-8."""
    foreign = _first_foreign(content)
    if foreign is None and b"\0" not in content:
        return None
    kind = next((name for start, name in BEGINNINGS.items() if content.startswith(start)), None)
    if kind is not None and kind not in TEXT:
        return kind
    if kind is not None:
        return f"{kind}; save it as UTF-8"
    if foreign is None or any(byte < 32 and byte not in b"\t\n\r\f" for byte in content):
        return "binary data"
    line = content[:foreign].count(b"\n") + 1
    return f"text in another encoding (line {line}); save it as UTF-8"


def _first_foreign(content: bytes) -> int | None:
    """Index of the first byte that is not UTF-8; None without one."""
    try:
        content.decode("utf-8")
    except UnicodeDecodeError as error:
        return error.start
    return None
