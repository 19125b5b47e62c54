"""The calibration's YAML against the readers it is written for."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import yaml as pyyaml
from hypothesis import given
from hypothesis import strategies as st
from ruamel.yaml import YAML

from workbench.calibration.yaml_text import yaml_text

WORDS = st.text(st.characters(exclude_categories=["Cs"]), max_size=12)
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
