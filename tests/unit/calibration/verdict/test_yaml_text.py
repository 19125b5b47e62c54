"""The calibration's YAML against the readers it is written for."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import yaml as pyyaml
from hypothesis import given
from hypothesis import strategies as st
from ruamel.yaml import YAML

from workbench.calibration.verdict.yaml_text import LONGEST_BYTES, plain, yaml_text

WORDS = st.text(st.characters(exclude_categories=["Cs"]), max_size=12).map(plain)
NUMBERS = st.floats(allow_nan=False, allow_infinity=False)
SCALARS = st.one_of(WORDS, NUMBERS, st.integers(-(2**40), 2**40), st.booleans(), st.none())
KEYS = st.from_regex(r"[a-z][a-z_]{0,8}", fullmatch=True).filter(
    lambda key: key not in {"null", "true", "false", "yes", "no", "on", "off", "y", "n"}
)
LEAVES = SCALARS | st.lists(NUMBERS) | st.lists(WORDS)
DOCUMENTS = st.recursive(
    st.dictionaries(KEYS, LEAVES, min_size=1),
    lambda inner: st.dictionaries(KEYS, LEAVES | inner | st.lists(inner), min_size=1),
    max_leaves=6,
)


@given(DOCUMENTS)
def test_other_readers_read_what_was_written(document: dict[str, Any]) -> None:
    text = yaml_text(document)
    for read in (pyyaml.safe_load(text), YAML(typ="safe", pure=True).load(text)):
        assert read == document
        assert repr(read) == repr(document)  # 1 is not 1.0, nor is it true


def test_sentences_have_a_line_each_and_words_share_one() -> None:
    text = yaml_text({"notes": ["a long sentence", "another one"], "names": ["k1", "k2"]})
    lines = [line.strip() for line in text.splitlines()]
    assert '- "a long sentence"' in lines
    assert '- "another one"' in lines
    assert 'names: ["k1", "k2"]' in lines


def test_numbers_that_python_writes_without_a_point() -> None:
    """PyYAML reads 1e-05 as a string."""
    text = yaml_text({"sd": 1e-05, "data": [5e-324, 1e16, 1e22, -2e-07, 0.0, -0.0]})
    assert "sd: 1.0e-05" in text
    assert "[5.0e-324, 1.0e+16, 1.0e+22, -2.0e-07, 0.0, -0.0]" in text


def test_opencv_reads_nothing_as_nothing_and_what_follows(tmp_path: Path) -> None:
    path = tmp_path / "file.yaml"
    terms: list[dict[str, Any]] = [
        {"name": "1 k2", "shift": None, "p": 1e-05},
        {"name": 'k"1" - é: #', "shift": 0.5, "p": 1.0},
    ]
    path.write_text(yaml_text({"terms": terms, "notes": ["a: b # c", "0"], "none": [], "last": "2026"}))
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    read = storage.getNode("terms")
    assert [read.at(i).getNode("name").string() for i in range(2)] == [term["name"] for term in terms]
    assert [read.at(i).getNode("p").real() for i in range(2)] == [1e-05, 1.0]
    assert read.at(1).getNode("shift").real() == 0.5
    assert storage.getNode("notes").at(0).string() == "a: b # c"
    assert (storage.getNode("none").size(), storage.getNode("last").string()) == (0, "2026")
    storage.release()


def read_by_opencv(folder: Path, text: str) -> str:
    """A string, in a file that goes on after it."""
    path = folder / "file.yaml"
    path.write_text(
        yaml_text({"text": text, "list": [text + " a", "0"], "items": [{"a": text}], "last": "whole"})
    )
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    read = storage.getNode("text").string()
    assert storage.getNode("items").at(0).getNode("a").string() == read
    assert (storage.getNode("list").size(), storage.getNode("last").string()) == (2, "whole")
    storage.release()
    assert pyyaml.safe_load(path.read_text())["text"] == read
    return str(read)


@pytest.mark.parametrize("character", ["a", "é", "😀", '"', "\\", "\n"])
def test_a_string_that_is_too_long_for_opencv_is_cut(tmp_path: Path, character: str) -> None:
    """It would read nothing of the whole file: a reason or a command line of 4.8 kB."""
    just = character * (LONGEST_BYTES // len(character.encode()))
    assert read_by_opencv(tmp_path, just) == just
    for longer in (just + character, just + "x" * 4, 20 * just):
        read = read_by_opencv(tmp_path, longer)
        assert read.endswith("…")
        assert longer.startswith(read[:-1])
        assert LONGEST_BYTES - 6 < len(read.encode()) <= LONGEST_BYTES


def test_control_characters_are_spaces(tmp_path: Path) -> None:
    """OpenCV reads their codes as digits, or drops them. The others it reads as they are."""
    for number in [*range(0xA0), 0xA0, 0xFF, 0x2028, 0x2029, 0xD800, 0xFEFF, 0xFFFD, 0xFFFE, 0x1F600]:
        kept = chr(number) in "\t\n\r" or chr(number).isprintable() or number == 0xA0
        assert read_by_opencv(tmp_path, f"a{chr(number)}b") == (f"a{chr(number)}b" if kept else "a b"), number


@pytest.mark.parametrize("number", [np.nan, np.inf, -np.inf, np.float64("nan")])
def test_a_number_that_is_none_is_not_written(number: float) -> None:
    with pytest.raises(ValueError, match=r"expected a finite number, got -?(nan|inf)"):
        yaml_text({"data": [1.0, number]})


def test_numpy_s_floats_are_floats() -> None:
    assert yaml_text({"sd": np.float64(1e-05), "data": (np.float64(0.1),)}).endswith(
        "sd: 1.0e-05\ndata: [0.1]\n"
    )
