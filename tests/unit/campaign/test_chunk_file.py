"""Files of chunks: whole, intact and of this campaign, or not finished."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest

from workbench.campaign.chunk_file import (
    CHUNK_FILES,
    chunk_path,
    hash_path,
    is_finished,
    read_chunk,
    write_chunk,
)
from workbench.campaign.kind import Chunk
from workbench.model.errors import BadInputError

CHUNK = Chunk(3, range(6, 8), seed=1)
FRAME = pd.DataFrame({"sensor": [6, 7], "error": [0.1, float("nan")], "reason": ["", "none"]})


def test_a_chunk_reads_back_equal(tmp_path: Path) -> None:
    write_chunk(tmp_path, CHUNK, "abc", FRAME)
    pd.testing.assert_frame_equal(read_chunk(tmp_path, CHUNK, "abc"), FRAME, check_exact=True)
    assert is_finished(tmp_path, CHUNK, "abc")


@pytest.mark.parametrize("path_of", [chunk_path, hash_path])
@pytest.mark.parametrize("index", [0, 9_999_999])
def test_names_have_the_pattern_by_which_remains_are_found(
    path_of: Callable[[Path, int], Path], index: int
) -> None:
    assert re.fullmatch(CHUNK_FILES, path_of(Path(), index).name)


def test_equal_results_give_equal_files(tmp_path: Path) -> None:
    write_chunk(tmp_path, CHUNK, "abc", FRAME)
    first = chunk_path(tmp_path, 3).read_bytes()
    write_chunk(tmp_path, CHUNK, "abc", FRAME.copy())
    assert chunk_path(tmp_path, 3).read_bytes() == first


def test_sha256sum_checks_the_hash(tmp_path: Path) -> None:
    write_chunk(tmp_path, CHUNK, "abc", FRAME)
    subprocess.run(["sha256sum", "--check", "--quiet", hash_path(tmp_path, 3).name], cwd=tmp_path, check=True)


@pytest.mark.parametrize("place", [0, 100, -1])
def test_a_changed_byte_is_found(tmp_path: Path, place: int) -> None:
    write_chunk(tmp_path, CHUNK, "abc", FRAME)
    content = bytearray(chunk_path(tmp_path, 3).read_bytes())
    content[place] ^= 1
    chunk_path(tmp_path, 3).write_bytes(content)
    assert not is_finished(tmp_path, CHUNK, "abc")
    with pytest.raises(BadInputError, match="damaged"):
        read_chunk(tmp_path, CHUNK, "abc")


@pytest.mark.parametrize("path_of", [chunk_path, hash_path])
def test_a_chunk_without_one_of_its_files_is_not_finished(tmp_path: Path, path_of: object) -> None:
    write_chunk(tmp_path, CHUNK, "abc", FRAME)
    path = chunk_path(tmp_path, 3) if path_of is chunk_path else hash_path(tmp_path, 3)
    path.unlink()
    assert not is_finished(tmp_path, CHUNK, "abc")


def test_a_hash_of_other_contents_makes_no_chunk(tmp_path: Path) -> None:
    write_chunk(tmp_path, CHUNK, "abc", FRAME)
    path = chunk_path(tmp_path, 3)
    path.write_bytes(path.read_bytes()[:100])
    found = subprocess.run(["sha256sum", path.name], cwd=tmp_path, check=True, capture_output=True)
    hash_path(tmp_path, 3).write_bytes(found.stdout)
    assert not is_finished(tmp_path, CHUNK, "abc")
    with pytest.raises(BadInputError, match="expected a Parquet file"):
        read_chunk(tmp_path, CHUNK, "abc")


def test_a_chunk_of_another_campaign_is_not_finished(tmp_path: Path) -> None:
    write_chunk(tmp_path, CHUNK, "abc", FRAME)
    with pytest.raises(BadInputError, match="expected chunk 3 of this campaign"):
        read_chunk(tmp_path, CHUNK, "xyz")
    for path_of in (chunk_path, hash_path):
        path_of(tmp_path, 3).rename(path_of(tmp_path, 4))
    assert not is_finished(tmp_path, Chunk(4, range(8, 10), seed=1), "abc")
