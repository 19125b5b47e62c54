"""Numbers of certificates: once for each content, never twice."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from workbench.model.errors import BadInputError
from workbench.session.certificate_numbers import REGISTER, AssignedNumber, assign_number


def assigned(
    folder: Path, session: str, content: str = "a", year: int = 2026, prefix: str = ""
) -> AssignedNumber:
    return assign_number(folder, session, content, f"{year}-11-30T08:00:00+0000", prefix)


def test_equal_content_keeps_its_number_and_its_time(tmp_path: Path) -> None:
    first = assigned(tmp_path, "s")
    assert first.number == "2026-0001"
    assert assigned(tmp_path, "s", year=2027) == first
    assert len((tmp_path / REGISTER).read_text().splitlines()) == 1


def test_changed_content_gets_a_new_number_that_names_the_old_one(tmp_path: Path) -> None:
    first, other = assigned(tmp_path, "s"), assigned(tmp_path, "t")
    second = assigned(tmp_path, "s", "b")
    assert [one.number for one in (first, other, second)] == ["2026-0001", "2026-0002", "2026-0003"]
    assert (first.replaces, other.replaces, second.replaces) == ("", "", "2026-0001")
    # Back to the old content: a number that was replaced is not used again.
    assert assigned(tmp_path, "s", "a").number == "2026-0004"


def test_each_year_and_prefix_counts_from_one(tmp_path: Path) -> None:
    found = [
        assigned(tmp_path, "a"),
        assigned(tmp_path, "b", year=2027),
        assigned(tmp_path, "c", prefix="LAB"),
        assigned(tmp_path, "d", prefix="LAB"),
    ]
    assert [one.number for one in found] == ["2026-0001", "2027-0001", "LAB-2026-0001", "LAB-2026-0002"]


def test_programs_at_the_same_time_get_different_numbers(tmp_path: Path) -> None:
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(lambda n: assigned(tmp_path, f"s{n}").number, range(40)))
    assert len(set(found)) == 40


def test_a_damaged_register_assigns_nothing(tmp_path: Path) -> None:
    assigned(tmp_path, "s")
    with (tmp_path / REGISTER).open("a") as file:
        file.write('{"number": 3}\n')
    with pytest.raises(BadInputError, match=f"{REGISTER}:2"):
        assigned(tmp_path, "t")


def test_a_last_line_without_its_end_is_kept_whole(tmp_path: Path) -> None:
    first = assigned(tmp_path, "s")
    (tmp_path / REGISTER).write_text((tmp_path / REGISTER).read_text().rstrip("\n"))
    second = assigned(tmp_path, "t")
    assert (first, second) == (assigned(tmp_path, "s"), assigned(tmp_path, "t"))
    assert len((tmp_path / REGISTER).read_text().splitlines()) == 2


def test_a_folder_that_cannot_be_written_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match=REGISTER):
        assigned(tmp_path / "missing", "s")
