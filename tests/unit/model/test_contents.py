"""Files that are no text, told by their first bytes."""

from __future__ import annotations

import gzip
import io
import json
import os
import zipfile
from pathlib import Path

import cv2
import numpy as np
import pytest

from workbench.model.contents import BEGINNINGS, not_text, printable, printable_json, read_file
from workbench.model.errors import BadInputError


@pytest.mark.parametrize(
    "text", ["", "a: 1\n", "\ufeffid,row\r\n1,2\r\n", "Bär\tµm ✓\f", "BM and PK, in a text"]
)
def test_text_in_utf_8_is_text(text: str) -> None:
    assert not_text(text.encode("utf-8")) is None


def png() -> bytes:
    return bytes(cv2.imencode(".png", np.zeros((3, 4), np.uint8))[1])


def archive() -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as file:
        file.writestr("xl/workbook.xml", "\xff" * 40)
    return buffer.getvalue()


def array() -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, np.ones(3))
    return buffer.getvalue()


@pytest.mark.parametrize(
    ("content", "start"),
    [
        (png(), b"\x89PNG"),
        (bytes(cv2.imencode(".jpg", np.zeros((8, 8), np.uint8))[1]), b"\xff\xd8\xff"),
        (bytes(cv2.imencode(".bmp", np.zeros((8, 8), np.uint8))[1]), b"BM"),
        (bytes(cv2.imencode(".tiff", np.zeros((8, 8), np.uint8))[1]), b"II*\0"),
        (archive(), b"PK\x03\x04"),
        (gzip.compress(b"a" * 100, mtime=0), b"\x1f\x8b"),
        (array(), b"\x93NUMPY"),
    ],
)
def test_real_files_are_called_what_they_are(content: bytes, start: bytes) -> None:
    assert content.startswith(start)
    assert not_text(content) == BEGINNINGS[start]


@pytest.mark.parametrize("encoding", ["utf-16", "latin-1", "cp1252"])
def test_text_in_another_encoding_is_told_apart_from_binary_data(encoding: str) -> None:
    words = not_text("standoff: 1\nwho: Jürgen\n".encode(encoding))
    assert words is not None
    assert "UTF-8" in words
    assert ("line 2" in words) == (encoding != "utf-16")
    binary = not_text(b"\x00\x01\x02\x03")
    assert binary is not None
    assert "UTF-8" not in binary


@pytest.mark.parametrize("content", [b"a: 1\nb: 2\0\n", b"\0", b"a\x01\xff"])
def test_a_zero_or_control_byte_is_no_text(content: bytes) -> None:
    assert not_text(content) == "binary data"


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("plain, é 測 😀\ttab\n", "plain, é 測 😀\ttab\n"),
        ("\x1b]0;title\a", "\\x1b]0;title\\x07"),
        ("\x9b31m \x7f \r", "\\x9b31m \\x7f \\r"),
        ("a\u202eb\u2066", "a\\u202eb\\u2066"),
        ("\ud800", "\\ud800"),
    ],
)
def test_control_characters_are_shown(text: str, shown: str) -> None:
    assert printable(text) == shown


@pytest.mark.parametrize("ascii_only", [True, False])
def test_control_characters_in_json_are_shown_and_the_rest_stays(ascii_only: bool) -> None:
    text = '\x1b[2J é 😀 \\ \\u001b "quoted" \n\t \x9b\u202e \b'
    shown = '\\x1b[2J é 😀 \\ \\u001b "quoted" \n\t \\x9b\\u202e \\x08'
    assert json.loads(printable_json(json.dumps([text], ensure_ascii=ascii_only))) == [shown]


def test_a_file_up_to_its_largest_size_is_read(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"123")
    assert read_file(tmp_path / "a", "three bytes", 3) == b"123"
    with pytest.raises(BadInputError, match="three bytes"):
        read_file(tmp_path / "a", "three bytes", 2)


def test_what_is_no_file_is_refused_and_does_not_block(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "loop").symlink_to("loop")
    for path in (
        tmp_path,
        tmp_path / "pipe",
        tmp_path / "loop",
        tmp_path / "missing",
        tmp_path / ("x" * 300),
        tmp_path / "nul\0",
        Path("/dev/zero"),
    ):
        with pytest.raises(BadInputError, match="expected a file"):
            read_file(path, "a file", 10)
