"""The captures file: rows, and errors by row and column."""

from __future__ import annotations

import contextlib
from math import isnan
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from workbench.model.captures import CaptureRow, check_images, errors_name_file, load_captures
from workbench.model.errors import BadInputError

HEADER = "laser_id,standoff_mm,repeat,u_px,v_px"


def load(tmp_path: Path, text: str) -> tuple[CaptureRow, ...]:
    path = tmp_path / "c.csv"
    path.write_text(text)
    return load_captures(path)


@pytest.mark.parametrize(
    ("written", "meant"),
    [("2,200", "2200 or 2.200"), ("2 200", "2200"), ("1,5", "1.5"), ("12,345,678", "12345678")],
)
def test_a_number_with_a_comma_or_a_space_is_refused_with_its_meanings(
    tmp_path: Path, written: str, meant: str
) -> None:
    path = tmp_path / "c.csv"
    path.write_text(f'laser_id,standoff_mm,repeat,v_px\nL1,"{written}",0,120\n')
    with pytest.raises(BadInputError, match=f"row 2, column standoff_mm: .* {meant}, got '{written}'"):
        load_captures(path)


def test_positions(tmp_path: Path) -> None:
    path = tmp_path / "c.csv"
    path.write_text(f"\ufeff{HEADER}\n1,200,0,,42\nL2,300.5,1,17.25,\n", encoding="utf-8")
    first, second = load_captures(path)
    assert (first.row, first.laser_id, first.standoff_mm, first.v_px) == (2, "1", 200.0, 42.0)
    assert isnan(first.u_px)
    assert (second.row, second.repeat, second.u_px) == (3, 1, 17.25)
    assert isnan(second.v_px)


def test_rows_pasted_twice_are_refused_with_both_lines(tmp_path: Path) -> None:
    rows = "L1,200,0,10.5,42\nL1,200,1,10.5,42\nL2,200,0,,42\n"
    with pytest.raises(BadInputError, match=r"c.csv: row 5 repeats row 2 .*2 more") as error:
        load(tmp_path, f"{HEADER}\n{rows}{rows}")
    assert len(str(error.value).splitlines()) == 1


def test_captures_that_differ_in_their_repeat_alone_are_read(tmp_path: Path) -> None:
    assert len(load(tmp_path, f"{HEADER}\nL1,200,0,,42\nL1,200,1,,42\n")) == 2


def test_images_are_relative_to_the_file(tmp_path: Path) -> None:
    path = tmp_path / "c.csv"
    path.write_text("laser_id,standoff_mm,repeat,on,off,scene\nall,,0,a/on.png,,s1\n")
    (row,) = load_captures(path)
    assert (row.on, row.off, row.scene) == (tmp_path / "a/on.png", None, "s1")
    assert isnan(row.standoff_mm)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", ["empty", "laser_id, standoff_mm, repeat"]),
        (HEADER.replace(",", ";") + "\n1;200;0;;42\n", ["row 1", "got semicolons (;)"]),
        (HEADER.replace(",", "\t") + "\n", ["row 1", "got tabs"]),
        ("laser_id,standoff_mm,u_px\n", ["row 1", "missing: repeat"]),
        (f"{HEADER},colour\n", ["row 1", "no such column: colour"]),
        (f"{HEADER},u_px\n", ["row 1", "u_px"]),
        ("laser_id,standoff_mm,repeat\n", ["row 1", "on", "u_px"]),
        (f"{HEADER}\n", ["none"]),
        (f"{HEADER}\n1,5OO,0,,42\n", ["row 2, column standoff_mm", "5OO"]),
        (f"{HEADER}\n1,200,0,,42\n1,-3,0,,42\n", ["row 3, column standoff_mm", "0.001 to 1000000", "-3"]),
        (f"{HEADER}\n1,200,0,,inf\n", ["row 2, column v_px", "finite"]),
        (f"{HEADER}\n1,200,x,,42\n", ["row 2, column repeat", "'x'"]),
        (f"{HEADER}\n,200,0,,42\n", ["row 2, column laser_id"]),
        (f"{HEADER}\n1,200,0,,\n", ["row 2, column on", "neither"]),
        (f"{HEADER}\nall,200,0,,42\n", ["row 2, column laser_id", "got all"]),
        (f"{HEADER}\n1,200,0\n", ["row 2"]),
        (f"{HEADER}\n1,200,0,,42,9\n", ["row 2"]),
        (f"{HEADER},u_sd_px\n1,200,0,1,42,0\n", ["row 2, column u_sd_px", "1e-06 to 1000000"]),
        (f"{HEADER}\n1,1e308,0,,42\n", ["row 2, column standoff_mm", "0.001 to 1000000"]),
        (f"{HEADER}\n1,200,{'9' * 5000},,42\n", ["row 2, column repeat", "whole number"]),
        ("laser_id,standoff_mm,repeat,on\n1,2,0,a\0b\n", ["c.csv"]),
        (f"{HEADER}\n\n\n1,x,0,,42\n", ["row 4, column standoff_mm"]),
        (f"{HEADER},tilt_deg\n1,200,0,1,42,90\n", ["row 2, column tilt_deg", "less than 90"]),
    ],
)
def test_errors_name_row_and_column(tmp_path: Path, text: str, words: list[str]) -> None:
    with pytest.raises(BadInputError) as caught:
        load(tmp_path, text)
    for word in [*words, "c.csv"]:
        assert word in str(caught.value)


def test_every_wrong_row_is_listed(tmp_path: Path) -> None:
    with pytest.raises(BadInputError) as caught:
        load(tmp_path, f"{HEADER}\n1,a,0,,42\n1,200,0,,42\n1,200,b,,42\n")
    assert ["row 2" in line or "row 4" in line for line in str(caught.value).splitlines()] == [True, True]


def test_no_file(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match=r"nowhere\.csv"):
        load_captures(tmp_path / "nowhere.csv")


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(body=st.binary(max_size=200))
def test_any_bytes_are_read_or_refused_by_name(tmp_path: Path, body: bytes) -> None:
    path = tmp_path / "c.csv"
    path.write_bytes(HEADER.encode() + b"\n" + body)
    with contextlib.suppress(BadInputError):
        assert load_captures(path)


def test_a_missing_captures_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match=r"captures\.csv"):
        load_captures(tmp_path / "captures.csv")


def test_the_unit_of_an_exposure(tmp_path: Path) -> None:
    (row,) = load(tmp_path, f"{HEADER},exposure,exposure_unit\n1,200,0,,42,224.0,us\n")
    assert (row.exposure, row.exposure_unit) == (224.0, "us")
    (row,) = load(tmp_path, f"{HEADER},exposure\n1,200,0,,42,8\n")
    assert (row.exposure, row.exposure_unit) == (8.0, "")


@pytest.mark.parametrize(
    ("content", "what"),
    [
        (b"\x89PNG\r\n\x1a\n\0\0", "got a PNG image"),
        (b"PK\x03\x04\x14\0\x9d", r"got a zip archive or a spreadsheet"),
        (
            b"laser_id,standoff_mm,repeat\nL\xfc,1,0\n",
            "got text in another encoding .line 2.; save it as UTF-8",
        ),
        (b"format: 1\nrig: r\n", "got a rig"),
        (b"%YAML 1.2\n---\nimage_width: 640\n", "got YAML"),
    ],
)
def test_a_file_of_another_kind_is_called_what_it_is(content: bytes, what: str, tmp_path: Path) -> None:
    path = tmp_path / "c.csv"
    path.write_bytes(content)
    with pytest.raises(BadInputError, match=rf"c\.csv: .*{what}"):
        load_captures(path)


def test_a_mistyped_column_is_reported_with_the_nearest_name_first(tmp_path: Path) -> None:
    path = tmp_path / "c.csv"
    path.write_text("laser_id,standoff_mm,repeat,u_pix\n")
    with pytest.raises(BadInputError, match=r"row 1: .*u_pix.* u_px, "):
        load_captures(path)


def test_images_that_are_not_there_are_listed_by_row_and_column(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_bytes(b"")
    rows = load(
        tmp_path,
        "laser_id,standoff_mm,repeat,on,off\nL1,1,0,a.png,\nL1,1,1,b.png,a.png\nL1,1,2,a.png,c.png\n",
    )
    with pytest.raises(BadInputError) as caught:
        check_images(tmp_path / "c.csv", rows)
    first, second = str(caught.value).splitlines()
    for line, words in ((first, ("row 3", "column on", "b.png")), (second, ("row 4", "column off", "c.png"))):
        assert all(word in line for word in words)
    check_images(tmp_path / "c.csv", rows[:1])


def test_errors_of_rows_name_their_file_in_every_line(tmp_path: Path) -> None:
    path = tmp_path / "c.csv"
    with pytest.raises(BadInputError) as caught, errors_name_file(path):
        raise BadInputError("row 2: x\nrow 3: y")
    assert str(caught.value).splitlines() == [f"{path}: row 2: x", f"{path}: row 3: y"]
