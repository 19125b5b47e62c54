"""Files of readings of any range sensor."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.support.trial_readings import drawn_levels
from workbench.model.errors import BadInputError
from workbench.trials.any_sensor.readings_file import load_readings
from workbench.trials.reading_frame import COLUMNS, reading_frame


def written(folder: Path, text: str) -> Path:
    path = folder / "r.csv"
    path.write_text(text)
    return path


def test_two_columns_suffice(tmp_path: Path) -> None:
    frame = load_readings(written(tmp_path, "measured_mm,true_mm\n501.5,500\n,500\n-3,0\n"))
    assert tuple(frame.columns) == COLUMNS
    assert frame["error_mm"].tolist() == pytest.approx([1.5, np.nan, -3.0], nan_ok=True)
    assert frame["standoff_mm"].tolist() == [500, 500, 0]
    assert frame["repeat"].tolist() == [0, 1, 2]
    assert frame[["placement", "session"]].to_numpy().tolist() == [["1", "1"]] * 3


def test_placement_repeat_session_and_level_are_read(tmp_path: Path) -> None:
    text = "true_mm,measured_mm,placement,repeat,session,standoff_mm\n502.5,503,3,7,Ann,500\n"
    frame = load_readings(written(tmp_path, text))
    assert frame[["placement", "repeat", "session"]].to_numpy().tolist() == [["3", 7, "Ann"]]
    assert (frame["standoff_mm"][0], frame["error_mm"][0]) == (500, 0.5)


def test_readings_of_a_trial_are_such_a_file(tmp_path: Path) -> None:
    drawn = drawn_levels(1)
    rows = [{str(key): value for key, value in row.items()} for row in drawn.to_dict("records")]
    path = tmp_path / "p.1.csv"
    reading_frame(rows).to_csv(path, index=False)
    frame = load_readings(path)
    assert frame["measured_mm"].tolist() == drawn["measured_mm"].tolist()
    assert frame["placement"].tolist() == drawn["placement"].astype(str).tolist()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("true_mm,measured_mm\n-5,3\n", ["row 2", "true_mm", "-5"]),
        ("", ["empty"]),
        ("true_mm,range\n1,2\n", ["row 1", "measured_mm"]),
        ("true_mm,measured_mm,placment\n1,2,3\n", ["row 1", "placment", "placement"]),
        ("true_mm;measured_mm\n1;2\n", ["row 1", "semicolons"]),
        ("true_mm,measured_mm\n", ["at least one reading"]),
        ("true_mm,measured_mm\n1,\n", ["at least one reading"]),
        ("true_mm,measured_mm\n1,2\nx,nan\n", ["row 3, column true_mm", "row 3, column measured_mm"]),
        ("true_mm,measured_mm\n1,2,3\n", ["row 2"]),
        ("true_mm,measured_mm\n,2\n", ["row 2", "true_mm"]),
        ("true_mm,measured_mm,repeat\n1,2,-1\n1,2,1.5\n", ["row 2, column repeat", "row 3, column repeat"]),
        ("true_mm,measured_mm\n1,1e99\n", ["row 2, column measured_mm"]),
        ('true_mm,measured_mm\n"2,200","2,201"\n', ["2200", "2.200", "row 2, column measured_mm"]),
        ("true_mm,measured_mm\n2,200\n3,300\n", ["ratio"]),
        ("true_mm,measured_mm\n1000,100.2\n3000,299.9\n", ["ratio"]),
    ],
)
def test_mistakes_are_refused_with_row_and_column(tmp_path: Path, text: str, words: list[str]) -> None:
    with pytest.raises(BadInputError) as caught:
        load_readings(written(tmp_path, text))
    assert "r.csv" in str(caught.value)
    assert [word for word in words if word not in str(caught.value)] == []


@pytest.mark.parametrize("content", [b"\x89PNG\r\n\x1a\n\0\0", b"true_mm,measured_mm\n1,\xff\n"])
def test_a_file_that_is_not_text_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "r.csv"
    path.write_bytes(content)
    with pytest.raises(BadInputError):
        load_readings(path)


def test_a_missing_file_and_a_folder_are_refused(tmp_path: Path) -> None:
    for path in (tmp_path / "none.csv", tmp_path):
        with pytest.raises(BadInputError, match=str(path)):
            load_readings(path)
