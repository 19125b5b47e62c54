"""Identification of files that are not UTF-8 text, by their first bytes."""

from __future__ import annotations

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
