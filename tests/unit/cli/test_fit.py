"""`workbench fit`."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.support.command_line import Run, refused
from tests.support.reference_session import copied
from tests.support.rigs import World
from workbench.calibration.verdict.tables import derived_table
from workbench.cli.fit import _rejected_json
from workbench.model.calibration import load_calibration
from workbench.model.event import SessionFinished
from workbench.model.fit_event import Rejected
from workbench.model.fit_tables import parameter_table
from workbench.model.rig import load_rig
from workbench.session.journal import Journal
from workbench.session.manifest import load_manifest

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
    detailed = workbench("fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", output, "--json", "--details")
    assert json.loads(detailed.out) == result
    assert of_f["words"] in " ".join(detailed.err.split())
    assert of_f["words"] not in " ".join(outcome.err.split())
    assert any("-1.35 px in v of laser 1 at 300 mm" in text for text in result["warnings"])
    assert load_calibration(output).laser_ranger.provenance.command.startswith("workbench fit")


def test_rejected_rows_are_listed_with_their_reasons(workbench: Run, tmp_path: Path) -> None:
    captures = tmp_path / "c.csv"
    captures.write_text(WEBCAM.read_text() + "1,,0,,150\n2,500,0,,140\n")
    outcome = workbench("fit", captures, "--rig", WEBCAM_RIG, "-o", tmp_path / "c.yaml", "--json")
    rejected = json.loads(outcome.out)["rejected"]
    assert [r["row"] for r in rejected] == [11, 12]
    assert "standoff_mm" in rejected[0]["reason"]
    assert "got 2" in rejected[1]["reason"]


@pytest.mark.long_cases
@pytest.mark.parametrize(
    "spelt",
    [
        lambda text: text.replace(",", ", "),
        lambda text: text + ",,,,\n,,,,\n\n",
        lambda text: text.replace(",0,", ",0.0,"),
        lambda text: text.replace("1,200,", '1,"200",'),
        lambda text: "sep=,\r\n" + text.replace("\n", "\r\n"),
    ],
)
def test_tables_as_spreadsheets_write_them_give_the_same_fit(
    workbench: Run, tmp_path: Path, spelt: Callable[[str], str]
) -> None:
    results = []
    for name, text in (("plain", WEBCAM.read_text()), ("spelt", spelt(WEBCAM.read_text()))):
        (tmp_path / f"{name}.csv").write_text(text)
        output = tmp_path / f"{name}.yaml"
        outcome = workbench("fit", tmp_path / f"{name}.csv", "--rig", WEBCAM_RIG, "-o", output, "--json")
        results.append(json.loads(outcome.out)["parameters"])
    assert results[0] == results[1]


def test_a_thousands_separator_is_refused_with_its_row(workbench: Run, tmp_path: Path) -> None:
    captures = tmp_path / "c.csv"
    captures.write_text(WEBCAM.read_text() + '1,"1,300",0,,200\n')
    outcome = workbench("fit", captures, "--rig", WEBCAM_RIG, "-o", tmp_path / "c.yaml")
    refused(outcome, 2, "row 11, column standoff_mm", "1,300")


def test_a_laser_id_with_a_leading_zero_is_a_text_in_quotes(workbench: Run, tmp_path: Path) -> None:
    rig, captures = tmp_path / "rig.yaml", tmp_path / "c.csv"
    captures.write_text(WEBCAM.read_text().replace("\n1,", "\n01,"))
    text = WEBCAM_RIG.read_text()
    (line,) = (line for line in text.splitlines() if "id:" in line)
    number = text.splitlines().index(line) + 1
    rig.write_text(text.replace(line, "  - id: 01"))
    refused(workbench("check", rig), 2, f"rig.yaml:{number}: lasers[0].id")
    rig.write_text(text.replace(line, '  - id: "01"'))
    assert workbench("check", rig).code == 0
    outcome = workbench("fit", captures, "--rig", rig, "-o", tmp_path / "c.yaml", "--json")
    result = json.loads(outcome.out)
    assert (outcome.code, result["observations"], result["rejected"]) == (0, 9, [])


@pytest.mark.parametrize("seed", [1, 2])
def test_placements_that_scatter_more_than_stated_enlarge_the_deviations(
    workbench: Run, tmp_path: Path, seed: int
) -> None:
    """Three times the stated error at 11 placements: the scale's own deviation is a quarter."""
    path = ROOT / "rigs/thesis-emulated.yaml"
    rig = load_rig(path)
    bench = rig.bench.model_copy(update={"placement_sd_mm": 3 * rig.bench.placement_sd_mm})
    rows = World(rig.model_copy(update={"bench": bench}), seed).observations(repeats=3)
    lines = (f"{s.laser_id},{s.standoff_mm:g},{s.repeat},{s.u_px:.4f},{s.v_px:.4f}" for s in rows)
    (tmp_path / "c.csv").write_text("\n".join(["laser_id,standoff_mm,repeat,u_px,v_px", *lines, ""]))
    outcome = workbench("fit", tmp_path / "c.csv", "--rig", path, "-o", tmp_path / "c.yaml", "--json")
    assert outcome.code == 0
    assert 1.75 < load_calibration(tmp_path / "c.yaml").laser_ranger.fit.placement_scale < 5.0
    z = [one["score"] for one in json.loads(outcome.out)["left_out"]]
    assert 0.5 < np.sqrt(np.mean(np.square(z))) < 1.6


def test_a_refused_calibration_is_reported_and_not_written(workbench: Run, tmp_path: Path) -> None:
    captures = tmp_path / "c.csv"
    captures.write_text("".join(WEBCAM.read_text().splitlines(keepends=True)[:3]))
    output = tmp_path / "c.yaml"
    output.write_text("as it was\n")
    outcome = workbench("fit", captures, "--rig", WEBCAM_RIG, "-o", output, "--json")
    refused(outcome, 3, "2 standoffs", output)
    first, *others = outcome.err.split("\n\n")[-1].strip().splitlines()
    assert first.startswith("REFUSED ")
    assert [line for line in others if line.startswith("do: ")]
    assert json.loads(outcome.out)["verdict"] == "refused"
    assert output.read_text() == "as it was\n"


def test_the_verdict_is_on_standard_error(workbench: Run, tmp_path: Path) -> None:
    outcome = workbench("fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", tmp_path / "c.yaml")
    assert outcome.out == ""
    *_, written = outcome.err.splitlines()
    assert written.endswith(f"{tmp_path / 'c.yaml'} written")


def test_details_are_on_standard_output(workbench: Run, tmp_path: Path) -> None:
    outcome = workbench("fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", tmp_path / "c.yaml", "--details")
    assert outcome.err.strip().startswith("ACCEPTED ")
    lines = outcome.out.strip().splitlines()
    assert lines[0].startswith("Parameters")
    assert max(len(line) for line in lines) <= 80


class TestAnotherModel:
    """Fits without a standoff or a parameter, and acceptance of a refused calibration."""

    def test_an_excluded_standoff_is_listed(self, workbench: Run, tmp_path: Path) -> None:
        output = tmp_path / "c.yaml"
        outcome = workbench(
            "fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", output, "--json", "--without-standoff", 300
        )
        result = json.loads(outcome.out)
        assert [rejected["row"] for rejected in result["rejected"]] == [3]
        # Row 3 has the largest residual of the nine: the rest agree better.
        assert result["rms_px"] < 0.4
        assert load_calibration(output).laser_ranger.fit.observations == 8

    def test_an_unknown_standoff_is_refused(self, workbench: Run, tmp_path: Path) -> None:
        arguments = ("fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", tmp_path / "c", "--without-standoff", 1234)
        there = {row.split(",")[1] for row in WEBCAM.read_text().splitlines()[1:]}
        refused(
            workbench(*arguments), 2, "--without-standoff", "1234 mm", ", ".join(sorted(there, key=float))
        )

    def test_a_fixed_parameter_keeps_its_value(self, workbench: Run, tmp_path: Path) -> None:
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
        assert "2 standoffs" in summary.reasons[0]
        assert workbench("range", WEBCAM, "--calibration", output).code == 0
        output.write_text(output.read_text().replace("only to try the ranger", ""))
        refused(workbench("range", WEBCAM, "--calibration", output), 2, "laser_ranger.fit.verdict")

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
        refused(workbench(*fit, "--accept", " "), 2, "--accept")
        refused(workbench("repair", tmp_path, "--reason", "TEXT"), 2, "--reason")
        refused(workbench("resume", tmp_path, "--accept-changes", ""), 2, "--accept-changes")

    def test_a_captures_file_needs_a_rig(self, workbench: Run, tmp_path: Path) -> None:
        refused(workbench("fit", WEBCAM, "-o", tmp_path / "c"), 2, "--rig")


def test_a_file_of_a_session_is_not_written_over(workbench: Run, tmp_path: Path) -> None:
    (tmp_path / "session.yaml").write_text("format: 1\n")
    kept = tmp_path / "calibration.yaml"
    kept.write_text("as it was")
    refused(workbench("fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", kept), 2, "--output", kept, tmp_path)
    frame = tmp_path / "frames" / "a.png"
    frame.parent.mkdir()
    frame.write_text("a frame")
    refused(workbench("fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", frame), 2, "--output", frame, tmp_path)
    assert (kept.read_text(), frame.read_text()) == ("as it was", "a frame")
    assert workbench("fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", tmp_path / "refit.yaml").code == 0


def test_a_source_that_is_not_there_is_named(workbench: Run, tmp_path: Path) -> None:
    outcome = workbench("fit", tmp_path / "nope", "-o", tmp_path / "c.yaml")
    refused(outcome, 2, tmp_path / "nope")


def test_names_are_printed_as_they_are(workbench: Run, tmp_path: Path) -> None:
    """Brackets are markup for rich."""
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
    refused(outcome, 2, f"{captures}: row 4, column standoff_mm: ")


@pytest.mark.parametrize("which", [0, 1])
def test_an_output_that_is_an_input(workbench: Run, tmp_path: Path, which: int) -> None:
    made_from = [tmp_path / "captures.csv", tmp_path / "rig.yaml"]
    made_from[0].write_bytes(WEBCAM.read_bytes())
    made_from[1].write_bytes(WEBCAM_RIG.read_bytes())
    before = made_from[which].read_bytes()
    outcome = workbench("fit", made_from[0], "--rig", made_from[1], "-o", made_from[which])
    assert outcome.code == 2
    assert f"--output {made_from[which]}" in outcome.err
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
    refused(outcome, 2, captures, "row 2: laser 1 at 500 mm: ")


def test_a_rig_with_another_picture_size_gives_the_cause_for_each_row(workbench: Run, tmp_path: Path) -> None:
    rig = tmp_path / "rig.yaml"
    text = WEBCAM_RIG.read_text().replace("height_px: 480", "height_px: 20")
    rig.write_text(text.replace("value: 239.5", "value: 9.5"))
    outcome = workbench("fit", WEBCAM, "--rig", rig, "-o", tmp_path / "c.yaml")
    refused(outcome, 2, WEBCAM, "row 3: laser 1 at 300 mm: v_px: ", "got 94")


def test_every_missing_image_is_reported(workbench: Run, tmp_path: Path) -> None:
    captures = tmp_path / "c.csv"
    captures.write_text("laser_id,standoff_mm,repeat,on,off\n1,200,0,a.png,\n1,300,0,.,b.png\n")
    outcome = workbench("fit", captures, "--rig", WEBCAM_RIG, "-o", tmp_path / "c.yaml")
    assert outcome.code == 2
    assert [line.removeprefix("error: ").split(": ")[:2] for line in outcome.err.splitlines()] == [
        [str(captures), f"row {row}, column {column}"] for row, column in ((2, "on"), (3, "on"), (3, "off"))
    ]


def test_a_file_that_is_no_image_is_named_with_its_kind(workbench: Run, tmp_path: Path) -> None:
    captures = tmp_path / "c.csv"
    captures.write_text("laser_id,standoff_mm,repeat,on\n1,200,0,c.csv\n")
    outcome = workbench("fit", captures, "--rig", WEBCAM_RIG, "-o", tmp_path / "c.yaml")
    refused(outcome, 2, f"{captures}: row 2: {captures}: ", "text")


def test_a_rejected_capture_of_a_recording_has_its_frame_instead_of_a_row() -> None:
    of_frame, of_row = Rejected("frames/p/L1/00-on.png", "no spot"), Rejected("row 12", "no spot")
    assert _rejected_json(of_frame) == {"source": "frames/p/L1/00-on.png", "reason": "no spot"}
    assert _rejected_json(of_row) == {"row": 12, "reason": "no spot"}


def test_a_public_table_of_a_laser_line_gives_its_author_s_numbers(workbench: Run, tmp_path: Path) -> None:
    rows, rig = ROOT / "data/laser-line-rows.csv", ROOT / "rigs/laser-line.yaml"
    outcome = workbench("fit", rows, "--rig", rig, "-o", tmp_path / "line.yaml", "--json")
    # Whole-pixel rows give the farthest range, 2450 mm, to 14 %: the limits refuse it.
    refused(outcome, 3, "relative standard deviation of ranges")
    (derived,) = json.loads(outcome.out)["derived"]
    # data/README.md: the plain fit of row = A + B / distance, and the author's fit of angles.
    assert derived["f_b_px_mm"] == pytest.approx(6780, abs=20)
    assert derived["f_b_sd"] == pytest.approx(80, rel=0.4)
    assert derived["infinity_px"] == pytest.approx(118.44, abs=0.1)
    assert abs(derived["f_b_px_mm"] - 22.5 / 0.0032974349) < 2 * derived["f_b_sd"]


def test_a_session_is_fitted_as_recorded_only(workbench: Run, tmp_path: Path) -> None:
    """An edited captures file, or a journal with an edited line, is refused; the file by itself is free."""
    session, out = copied(tmp_path, frames=True), tmp_path / "c.yaml"
    assert workbench("fit", session, "-o", out).code == 0
    table = session / "captures.csv"
    table.write_text(table.read_text().replace(",150.0,", ",150.5,"))
    refused(workbench("fit", session, "-o", tmp_path / "a.yaml"), 2, "captures.csv: row 2", "standoff_mm")
    rig = tmp_path / "rig.yaml"
    rig.write_text(load_manifest(session).rig.text)
    assert workbench("fit", table, "--rig", rig, "-o", tmp_path / "b.yaml").code in {0, 3}
    journal, _ = Journal.reopen(session)
    with journal:
        journal.append(SessionFinished(exit_code=0, message="first"))
        journal.append(SessionFinished(exit_code=0, message="second"))
    path = session / "journal.jsonl"
    path.write_text(path.read_text().replace('"message":"first"', '"message":"other"'))
    lines = path.read_text().count("\n")
    refused(workbench("fit", session, "-o", tmp_path / "d.yaml"), 2, f"journal.jsonl:{lines - 1}")
    assert not (tmp_path / "d.yaml").exists()
