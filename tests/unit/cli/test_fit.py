"""`workbench fit`."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.support.command_line import Run, refused
from workbench.calibration.verdict.tables import derived_table
from workbench.model.calibration import load_calibration
from workbench.model.fit_tables import parameter_table

ROOT = Path(__file__).parents[3]
WEBCAM = ROOT / "data/webcam-laser-rows.csv"
WEBCAM_RIG = ROOT / "rigs/webcam-laser.yaml"


def test_fit_prints_one_object_and_writes_the_calibration(workbench: Run, tmp_path: Path) -> None:
    output = tmp_path / "webcam.yaml"
    outcome = workbench("fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", output, "--json")
    assert outcome.code == 0
    result = json.loads(outcome.out)
    assert list(result) == [
        "parameters",
        "derived",
        "rms_px",
        "observations",
        "rejected",
        "warnings",
        "null_directions",
        "verdict",
        "reasons",
        "faults",
        "left_out",
        "residual_tests",
        "terms",
    ]
    assert set(result["parameters"][0]) >= {"name", "unit", "value", "sd", "prior_sd", "data_share"}
    parameter_keys = {column.key for column in parameter_table(()).columns}
    assert set(result["parameters"][0]) <= parameter_keys, "the tables' names"
    (derived,) = result["derived"]
    assert set(derived) == {"laser", "f_b_px_mm", "f_b_sd", "infinity_px", "infinity_sd"}
    assert set(derived) == {column.key for column in derived_table(()).columns}
    assert derived["laser"] == "1"
    assert (result["observations"], result["rejected"], result["verdict"]) == (9, [], "accepted")
    of_f = result["null_directions"][0]
    assert list(of_f["change"]) == ["f_px", "1.y_mm"]
    assert of_f["words"] in " ".join(result["warnings"])
    assert of_f["words"] in " ".join(outcome.err.split())
    assert any("-1.35 px in v of laser 1 at 300 mm" in text for text in result["warnings"])
    assert load_calibration(output).laser_ranger.provenance.command.startswith("workbench fit")


def test_rejected_rows_are_listed_with_their_reasons(workbench: Run, tmp_path: Path) -> None:
    captures = tmp_path / "c.csv"
    captures.write_text(WEBCAM.read_text() + "1,,0,,150\n2,500,0,,140\n")
    outcome = workbench("fit", captures, "--rig", WEBCAM_RIG, "-o", tmp_path / "c.yaml", "--json")
    rejected = json.loads(outcome.out)["rejected"]
    assert [r["row"] for r in rejected] == [11, 12]
    assert "standoff_mm is empty" in rejected[0]["reason"]
    assert "expected one of 1 (rig webcam-laser), got 2" in rejected[1]["reason"]


def test_a_fit_that_fails_a_limit_is_said_and_not_written(workbench: Run, tmp_path: Path) -> None:
    captures = tmp_path / "c.csv"
    captures.write_text("".join(WEBCAM.read_text().splitlines(keepends=True)[:3]))
    output = tmp_path / "c.yaml"
    output.write_text("as it was\n")
    outcome = workbench("fit", captures, "--rig", WEBCAM_RIG, "-o", output, "--json")
    refused(outcome, 3, "seen at 2 standoffs, expected at least 3", "is not written")
    assert outcome.err.splitlines()[-1].startswith("do: ")  # what is seen last
    assert json.loads(outcome.out)["verdict"] == "refused"
    assert output.read_text() == "as it was\n"


def test_without_json_nothing_is_on_stdout(workbench: Run, tmp_path: Path) -> None:
    outcome = workbench("fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", tmp_path / "c.yaml")
    assert outcome.out == ""
    *tables, written = outcome.err.splitlines()
    assert max(len(line) for line in tables) <= 80
    assert written == f"{tmp_path / 'c.yaml'} written"


class TestAnotherModel:
    """Refitting with something left out, and keeping what a limit refuses."""

    def test_a_standoff_left_out_is_listed(self, workbench: Run, tmp_path: Path) -> None:
        output = tmp_path / "c.yaml"
        outcome = workbench(
            "fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", output, "--json", "--without-standoff", 300
        )
        result = json.loads(outcome.out)
        assert result["rejected"] == [{"row": 3, "reason": "left out: standoff 300 mm"}]
        # Row 3 has the largest residual of the nine: the rest agree better.
        assert result["rms_px"] < 0.4
        assert load_calibration(output).laser_ranger.fit.observations == 8

    def test_a_standoff_that_is_not_there(self, workbench: Run, tmp_path: Path) -> None:
        arguments = ("fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", tmp_path / "c", "--without-standoff", 1234)
        refused(workbench(*arguments), 2, "no row has the standoff 1234 mm")

    def test_a_parameter_held(self, workbench: Run, tmp_path: Path) -> None:
        arguments = ("fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", tmp_path / "c", "--json", "--fix", "f_px")
        result = json.loads(workbench(*arguments).out)
        f_px = result["parameters"][0]
        assert (f_px["name"], f_px["value"], f_px["sd"]) == ("f_px", 650.0, 0.0)
        # With the focal length known the data do give the baseline: 32478 / 650 = 50 mm.
        baseline = next(p for p in result["parameters"] if p["name"] == "1.y_mm")
        assert baseline["value"] == pytest.approx(-32478 / 650, rel=1e-3)
        assert baseline["data_share"] > 0.99

    def test_a_refused_calibration_kept_with_a_reason(self, workbench: Run, tmp_path: Path) -> None:
        captures, output = tmp_path / "c.csv", tmp_path / "c.yaml"
        captures.write_text("".join(WEBCAM.read_text().splitlines(keepends=True)[:3]))
        arguments = ("fit", captures, "--rig", WEBCAM_RIG, "-o", output)
        refused(workbench(*arguments), 3)
        assert workbench(*arguments, "--accept", "only to try the ranger").code == 0
        summary = load_calibration(output).laser_ranger.fit
        assert (summary.verdict, summary.accepted_because) == ("refused", "only to try the ranger")
        assert "seen at 2 standoffs" in summary.reasons[0]
        assert workbench("range", WEBCAM, "--calibration", output).code == 0
        output.write_text(output.read_text().replace("only to try the ranger", ""))
        refused(
            workbench("range", WEBCAM, "--calibration", output), 2, "refused because laser 1 was seen at 2"
        )

    def test_opencv_reads_a_calibration_kept_with_a_long_reason(self, workbench: Run, tmp_path: Path) -> None:
        """Its limit is 4095 bytes for any string, and the command holds the reason too."""
        output, reason = tmp_path / "c.yaml", "only to try the ranger " * 200
        captures = tmp_path / "c.csv"
        captures.write_text("".join(WEBCAM.read_text().splitlines(keepends=True)[:3]))
        arguments = ("fit", captures, "--rig", WEBCAM_RIG, "-o", output, "--accept", reason)
        assert workbench(*arguments).code == 0
        storage = cv2.FileStorage(str(output), cv2.FILE_STORAGE_READ)
        kept = storage.getNode("laser_ranger").getNode("fit").getNode("accepted_because").string()
        assert reason.startswith(kept.removesuffix("…"))
        assert storage.getNode("camera_matrix").mat()[2, 2] == 1.0
        storage.release()
        assert load_calibration(output).laser_ranger.fit.accepted_because == kept

    def test_a_blank_reason_is_none(self, workbench: Run, tmp_path: Path) -> None:
        fit = ("fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", tmp_path / "c")
        refused(workbench(*fit, "--accept", " "), 2, "expected a reason")
        refused(workbench("resume", tmp_path, "--accept-changes", ""), 2, "expected a reason")

    def test_a_captures_file_needs_a_rig(self, workbench: Run, tmp_path: Path) -> None:
        refused(workbench("fit", WEBCAM, "-o", tmp_path / "c"), 2, "needs --rig")


def test_a_file_of_a_session_is_not_written_over(workbench: Run, tmp_path: Path) -> None:
    (tmp_path / "session.yaml").write_text("format: 1\n")
    kept = tmp_path / "calibration.yaml"
    kept.write_text("as it was")
    refused(workbench("fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", kept), 2, "belongs to the session", tmp_path)
    frame = tmp_path / "frames" / "a.png"
    frame.parent.mkdir()
    frame.write_text("a frame")
    refused(workbench("fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", frame), 2, "belongs to the session", tmp_path)
    assert (kept.read_text(), frame.read_text()) == ("as it was", "a frame")
    assert workbench("fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", tmp_path / "refit.yaml").code == 0


def test_a_source_that_is_not_there_is_named(workbench: Run, tmp_path: Path) -> None:
    outcome = workbench("fit", tmp_path / "nope", "-o", tmp_path / "c.yaml")
    refused(outcome, 2, "nope: expected a session's folder or a captures file, there is none")


def test_names_are_printed_as_they_are(workbench: Run, tmp_path: Path) -> None:
    """Brackets are how rich is told of colours."""
    for folder in ("[red]", "["):  # the second ends as a closing tag does, [/a]
        output = tmp_path / folder / "a].yaml"
        output.parent.mkdir()
        outcome = workbench("fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", output)
        assert outcome.code == 0
        assert f"{output} written" in outcome.err


def test_a_csv_error_names_row_and_column(workbench: Run, tmp_path: Path) -> None:
    captures = tmp_path / "c.csv"
    captures.write_text(WEBCAM.read_text().replace("1,400,0", "1,4oo,0"))
    outcome = workbench("fit", captures, "--rig", WEBCAM_RIG, "-o", tmp_path / "c.yaml")
    refused(outcome, 2, f"{captures}: row 4, column standoff_mm: expected a number")


@pytest.mark.parametrize("which", [0, 1])
def test_an_output_that_is_an_input(workbench: Run, tmp_path: Path, which: int) -> None:
    made_from = [tmp_path / "captures.csv", tmp_path / "rig.yaml"]
    made_from[0].write_bytes(WEBCAM.read_bytes())
    made_from[1].write_bytes(WEBCAM_RIG.read_bytes())
    before = made_from[which].read_bytes()
    outcome = workbench("fit", made_from[0], "--rig", made_from[1], "-o", made_from[which])
    assert outcome.code == 2
    assert "expected another file than the calibration is made from" in outcome.err.replace("\n", " ")
    assert made_from[which].read_bytes() == before


def test_an_output_folder_that_is_not_there(workbench: Run, tmp_path: Path) -> None:
    outcome = workbench("fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", tmp_path / "no/c.yaml")
    refused(outcome, 2, "cannot be written")


@pytest.mark.parametrize("fault", ["missing", "truncated", "wrong size", "text"])
def test_an_image_that_cannot_be_used_is_named(workbench: Run, tmp_path: Path, fault: str) -> None:
    image = np.random.default_rng(0).integers(0, 20, (480, 640), dtype=np.uint8)
    content = cv2.imencode(".png", image if fault != "wrong size" else image[:100])[1].tobytes()
    on = tmp_path / "on.png"
    if fault == "truncated":
        content = content[: len(content) // 2]
    if fault == "text":
        content = b"not a picture"
    if fault != "missing":
        on.write_bytes(content)
    captures = tmp_path / "c.csv"
    captures.write_text("laser_id,standoff_mm,repeat,on,off\n1,500,0,on.png,\n")
    outcome = workbench("fit", captures, "--rig", WEBCAM_RIG, "-o", tmp_path / "c.yaml")
    refused(outcome, 2, on, "expected an image" if fault != "truncated" else "truncated")
    assert not (tmp_path / "c.yaml").exists()


def test_captures_without_any_spot(workbench: Run, tmp_path: Path) -> None:
    (tmp_path / "on.png").write_bytes(cv2.imencode(".png", np.full((480, 640), 9, np.uint8))[1].tobytes())
    captures = tmp_path / "c.csv"
    captures.write_text("laser_id,standoff_mm,repeat,on\n1,500,0,on.png\n")
    outcome = workbench("fit", captures, "--rig", WEBCAM_RIG, "-o", tmp_path / "c.yaml")
    refused(outcome, 2, "no spot is left to fit", "not used: row 2: laser 1 at 500 mm: expected one spot")


def test_a_rig_of_another_picture_says_what_became_of_the_rows(workbench: Run, tmp_path: Path) -> None:
    rig = tmp_path / "rig.yaml"
    rig.write_text(WEBCAM_RIG.read_text().replace("height_px: 480", "height_px: 20"))
    outcome = workbench("fit", WEBCAM, "--rig", rig, "-o", tmp_path / "c.yaml")
    refused(outcome, 2, "no spot is left", "row 3: laser 1 at 300 mm: v_px: expected -0.5 to 19.5, got 94")


def test_every_image_that_is_not_there_is_told(workbench: Run, tmp_path: Path) -> None:
    captures = tmp_path / "c.csv"
    captures.write_text("laser_id,standoff_mm,repeat,on,off\n1,200,0,a.png,\n1,300,0,.,b.png\n")
    outcome = workbench("fit", captures, "--rig", WEBCAM_RIG, "-o", tmp_path / "c.yaml")
    refused(outcome, 2, f"{captures}: row 2, column on: expected an image, there is no file")
    assert [line.split(": ")[-2] for line in outcome.err.splitlines()] == [
        "row 2, column on", "row 3, column on", "row 3, column off",
    ]  # fmt: skip


def test_what_is_no_image_is_called_what_it_is(workbench: Run, tmp_path: Path) -> None:
    captures = tmp_path / "c.csv"
    captures.write_text("laser_id,standoff_mm,repeat,on\n1,200,0,c.csv\n")
    outcome = workbench("fit", captures, "--rig", WEBCAM_RIG, "-o", tmp_path / "c.yaml")
    refused(outcome, 2, f"{captures}: row 2: {captures}: expected an image", "it is text, or truncated")
