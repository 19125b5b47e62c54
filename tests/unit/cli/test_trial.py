"""`workbench trial`."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tests.support.command_line import Run, refused
from tests.support.trial_readings import autoregressive, drawn_levels
from workbench.cli.main import TrialKind
from workbench.trials.any_sensor.analysis import KINDS, analyse
from workbench.trials.any_sensor.readings_file import load_readings

ROOT = Path(__file__).parents[3]
USED = ["true_mm", "measured_mm", "placement", "repeat", "session"]


@pytest.fixture
def readings(tmp_path: Path) -> Path:
    path = tmp_path / "readings.csv"
    drawn_levels(1, shape=(2, 4, 3), sds=(0.4, 0.3, 0.2))[USED].to_csv(path, index=False)
    return path


def test_the_command_knows_every_kind() -> None:
    assert [kind.value for kind in TrialKind] == list(KINDS)


@pytest.mark.parametrize("kind", KINDS)
def test_json_has_the_rows_of_the_table(workbench: Run, readings: Path, kind: str) -> None:
    outcome = workbench("trial", kind, readings, "--json")
    result = json.loads(outcome.out)
    assert outcome.code == 0
    assert result["rows"] == analyse(kind, load_readings(readings)).table.records()
    assert (result["kind"], result["readings"], result["missing"], result["clipped"]) == (kind, 72, 0, [])
    assert result["autocorrelation"]["lag1"] == 0


def test_the_table_is_standard_output(workbench: Run, readings: Path) -> None:
    outcome = workbench("trial", "repeatability", readings)
    assert (outcome.code, outcome.err) == (0, "")
    assert all(word in outcome.out for word in ("s_r", "s_R", "1000"))


def test_clipped_and_missing_readings_are_noted(workbench: Run, tmp_path: Path) -> None:
    path = tmp_path / "clipped.csv"
    frame = drawn_levels(1)
    frame = frame.assign(measured_mm=frame["measured_mm"].clip(upper=999.5))
    frame.loc[0, "measured_mm"] = None
    frame[USED].to_csv(path, index=False)
    outcome = workbench("trial", "accuracy", path, "--json")
    (level,) = json.loads(outcome.out)["clipped"]
    assert (level["standoff_mm"], level["limit_mm"]) == (1000, 999.5)
    assert json.loads(outcome.out)["missing"] == 1
    assert "999.5 mm" in outcome.err


def test_wrong_values_end_with_2_row_and_column(workbench: Run, tmp_path: Path) -> None:
    path = tmp_path / "wrong.csv"
    path.write_text("true_mm,measured_mm\n500,501\n500,far\n")
    refused(workbench("trial", "accuracy", path), 2, "wrong.csv", "row 3", "column measured_mm")


def test_an_unknown_kind_ends_with_2(workbench: Run, readings: Path) -> None:
    assert workbench("trial", "precision", readings).code == 2


def test_each_file_is_a_session(workbench: Run, readings: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.csv"
    drawn_levels(2, shape=(1, 4, 3))[USED].to_csv(other, index=False)
    outcome = workbench("trial", "repeatability", readings, other, "--json")
    assert [row["sessions"] for row in json.loads(outcome.out)["rows"]] == [3, 3, 3]
    assert all(row["session_sd_mm"] is not None for row in json.loads(outcome.out)["rows"])
    assert json.loads(outcome.out)["readings"] == 72 + 36
    for arguments in (("repeatability", readings, readings), ("gauge-rr", readings, other)):
        assert workbench("trial", *arguments).code == 2


def test_readings_in_metres_have_a_note(workbench: Run, tmp_path: Path) -> None:
    for name, factor, noted in (("mm", 1.0, False), ("m", 1e-3, True)):
        path = tmp_path / f"{name}.csv"
        frame = drawn_levels(1, (20.0, 4500.0))
        frame[["true_mm", "measured_mm"]] *= factor
        frame[USED].to_csv(path, index=False)
        outcome = workbench("trial", "accuracy", path)
        assert outcome.code == 0
        assert ("true_mm" in outcome.out) == noted


def test_intervals_are_not_called_wider_where_none_is_printed(workbench: Run, tmp_path: Path) -> None:
    path = tmp_path / "dependent.csv"
    series = autoregressive(np.random.default_rng(1), 0.9, (1, 200))[0]
    rows = [f"500,{500 + error:.4f}" for error in series]
    path.write_text("\n".join(["true_mm,measured_mm", *rows]))
    for kind, widened in (("linearity", False), ("gauge-rr", False), ("repeatability", True)):
        outcome = workbench("trial", kind, path)
        assert "autocorrelated" in outcome.out
        assert ("widened" in " ".join(outcome.out.split())) == widened


def test_a_public_table_of_an_ultrasonic_sensor_gives_its_author_s_numbers(workbench: Run) -> None:
    path = ROOT / "data/hc-sr04-readings.csv"
    accuracy = json.loads(workbench("trial", "accuracy", path, "--json").out)["rows"]
    assert [row["mean_error_mm"] for row in accuracy] == [12.0, 10.0, 18.0, 21.0, 34.0]
    (line,) = json.loads(workbench("trial", "linearity", path, "--json").out)["rows"]
    # The author's line is of the true range by the measured one, rounded to three digits.
    assert 1 / line["slope"] == pytest.approx(0.975, abs=0.002)
    assert -line["intercept_mm"] / line["slope"] == pytest.approx(-6.86, abs=0.5)
