"""The command line as a person or a script meets it."""

from __future__ import annotations

import errno
import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import pytest

from workbench.cli.main import main
from workbench.cli.stopping import SIGNALS
from workbench.model.calibration import load_calibration
from workbench.model.errors import BadInputError, LaserOffNotConfirmedError, StoppedError
from workbench.session.journal import Journal

ROOT = Path(__file__).parents[3]
WEBCAM = ROOT / "data/webcam-laser-rows.csv"
WEBCAM_RIG = ROOT / "rigs/webcam-laser.yaml"
HEAVY = ("jax", "numpy", "scipy", "cv2", "pandas", "rerun", "optimistix", "serial", "pydantic", "ruamel")


@dataclass(frozen=True)
class Outcome:
    code: int
    out: str
    err: str


Run = Callable[..., Outcome]


@pytest.fixture
def workbench(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    before = {number: signal.getsignal(number) for number in SIGNALS}

    monkeypatch.setattr(os, "_exit", sys.exit)  # a fit ends at once; the tests' own process goes on

    def run(*arguments: object) -> Outcome:
        monkeypatch.setattr(sys, "argv", ["workbench", *map(str, arguments)])
        code = 0
        try:
            main()
        except SystemExit as stop:
            code = stop.code if isinstance(stop.code, int) else 0
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)
        captured = capsys.readouterr()
        return Outcome(code, captured.out, captured.err)

    return run


def refused(outcome: Outcome, code: int, *words: object) -> None:
    assert outcome.code == code
    assert "Traceback" not in outcome.err
    flat = " ".join(outcome.err.split())
    for word in words:
        assert str(word) in flat


def test_help_imports_nothing_heavy() -> None:
    code = (
        "import sys, runpy\n"
        "sys.argv = ['workbench', '--help']\n"
        "from workbench.cli.main import main\n"
        "try: main()\n"
        f"finally: print([m for m in {HEAVY} if m in sys.modules], file=sys.stderr)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.strip() == "[]"
    for command in ("run", "fit", "range", "view"):
        assert command in done.stdout


def test_the_command_is_installed() -> None:
    script = Path(sys.executable).with_name("workbench")
    done = subprocess.run([script, "--help"], capture_output=True, text=True, check=True)
    assert "laser-spot range sensors" in done.stdout


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
    (derived,) = result["derived"]
    assert set(derived) == {"laser", "f_b_px_mm", "f_b_sd", "infinity_px", "infinity_sd"}
    assert derived["laser"] == "1"
    assert (result["observations"], result["rejected"], result["verdict"]) == (9, [], "accepted")
    assert "(f_px) and the baseline cannot be known apart" in " ".join(result["warnings"])
    assert list(result["null_directions"][0]["change"]) == ["f_px", "1.y_mm"]
    assert "largest residual is -1.35 px in v of laser 1 at 300 mm" in " ".join(result["warnings"])
    assert "(f_px) and the baseline cannot be known apart" in " ".join(outcome.err.split())
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


def test_range_from_the_yaml_alone(workbench: Run, tmp_path: Path) -> None:
    calibration = tmp_path / "webcam.yaml"
    workbench("fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", calibration)
    outcome = workbench("range", WEBCAM, "--calibration", calibration, "--json")
    assert outcome.code == 0
    scenes = [json.loads(line) for line in outcome.out.splitlines()]
    assert len(scenes) == 9
    first = scenes[0]
    assert {"scene", "status", "closest_mm", "sigma_mm", "shape", "lasers", "notes"} <= set(first)
    assert (first["scene"], first["status"], first["shape"]) == ("row 2", "done", {"kind": "unknown"})
    (laser,) = first["lasers"]
    assert laser == {
        "id": "1",
        "range_mm": first["closest_mm"],
        "sigma_mm": first["sigma_mm"],
        "interval_mm": first["interval_mm"],
        "u_px": None,
        "v_px": 42.0,
    }
    # By hand: 32478 / (203.61 - 42), and r^2 / 32478 a pixel.
    assert first["closest_mm"] == pytest.approx(32478 / (203.61 - 42), rel=1e-3)
    assert "closest" in outcome.err


def test_without_json_nothing_is_on_stdout(workbench: Run, tmp_path: Path) -> None:
    outcome = workbench("fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", tmp_path / "c.yaml")
    assert outcome.out == ""
    *tables, written = outcome.err.splitlines()
    assert max(len(line) for line in tables) <= 80
    assert written == f"{tmp_path / 'c.yaml'} written"


class TestBadInput:
    """Exit code 2, the place, what was expected, and never a traceback."""

    def test_usage(self, workbench: Run) -> None:
        refused(workbench("fit", WEBCAM), 2, "--output")
        refused(workbench("dance"), 2, "dance")

    def test_missing_files(self, workbench: Run, tmp_path: Path) -> None:
        no = tmp_path / "no.yaml"
        refused(workbench("fit", WEBCAM, "--rig", no, "-o", tmp_path / "c"), 2, no, "no such file")
        fit = workbench("fit", no, "--rig", WEBCAM_RIG, "-o", tmp_path / "c")
        refused(fit, 2, no, "No such file")
        refused(workbench("range", WEBCAM, "--calibration", no), 2, no)
        refused(workbench("run", no, "--rig", WEBCAM_RIG, "--sessions", tmp_path), 2, no)
        refused(
            workbench("view", tmp_path),
            2,
            f"{tmp_path}: expected a session's folder, with session.yaml in it",
        )
        assert list(tmp_path.iterdir()) == []

    def test_a_rig_without_a_driver(self, workbench: Run, tmp_path: Path) -> None:
        procedure = ROOT / "procedures/calibrate-flat.yaml"
        outcome = workbench("run", procedure, "--rig", WEBCAM_RIG, "--sessions", tmp_path)
        refused(outcome, 2, "can be fitted but not run")

    def test_one_procedure_twice(self, workbench: Run, tmp_path: Path) -> None:
        procedure = ROOT / "procedures/calibrate-flat.yaml"
        outcome = workbench("run", procedure, procedure, "--rig", WEBCAM_RIG, "--sessions", tmp_path)
        refused(outcome, 2, "no other procedure of this call has, got calibrate-flat")
        assert list(tmp_path.iterdir()) == []

    def test_a_csv_error_names_row_and_column(self, workbench: Run, tmp_path: Path) -> None:
        captures = tmp_path / "c.csv"
        captures.write_text(WEBCAM.read_text().replace("1,400,0", "1,4oo,0"))
        outcome = workbench("fit", captures, "--rig", WEBCAM_RIG, "-o", tmp_path / "c.yaml")
        refused(outcome, 2, f"{captures}: row 4, column standoff_mm: expected a number, got 4oo")

    @pytest.mark.parametrize("which", [0, 1])
    def test_an_output_that_is_an_input(self, workbench: Run, tmp_path: Path, which: int) -> None:
        made_from = [tmp_path / "captures.csv", tmp_path / "rig.yaml"]
        made_from[0].write_bytes(WEBCAM.read_bytes())
        made_from[1].write_bytes(WEBCAM_RIG.read_bytes())
        before = made_from[which].read_bytes()
        outcome = workbench("fit", made_from[0], "--rig", made_from[1], "-o", made_from[which])
        assert outcome.code == 2
        assert "expected another file than the calibration is made from" in outcome.err.replace("\n", " ")
        assert made_from[which].read_bytes() == before

    def test_an_output_folder_that_is_not_there(self, workbench: Run, tmp_path: Path) -> None:
        outcome = workbench("fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", tmp_path / "no/c.yaml")
        refused(outcome, 2, "cannot be written")

    @pytest.mark.parametrize("fault", ["missing", "truncated", "wrong size", "text"])
    def test_an_image_that_cannot_be_used_is_named(self, workbench: Run, tmp_path: Path, fault: str) -> None:
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

    def test_captures_without_any_spot(self, workbench: Run, tmp_path: Path) -> None:
        (tmp_path / "on.png").write_bytes(cv2.imencode(".png", np.full((480, 640), 9, np.uint8))[1].tobytes())
        captures = tmp_path / "c.csv"
        captures.write_text("laser_id,standoff_mm,repeat,on\n1,500,0,on.png\n")
        outcome = workbench("fit", captures, "--rig", WEBCAM_RIG, "-o", tmp_path / "c.yaml")
        refused(outcome, 2, "no spot is left to fit", "not used: row 2: laser 1 at 500 mm: expected one spot")

    def test_a_rig_of_another_picture_says_what_became_of_the_rows(
        self, workbench: Run, tmp_path: Path
    ) -> None:
        rig = tmp_path / "rig.yaml"
        rig.write_text(WEBCAM_RIG.read_text().replace("height_px: 480", "height_px: 20"))
        outcome = workbench("fit", WEBCAM, "--rig", rig, "-o", tmp_path / "c.yaml")
        refused(
            outcome, 2, "no spot is left", "row 3: laser 1 at 300 mm: v_px: expected -0.5 to 19.5, got 94"
        )


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


def test_compare(workbench: Run, tmp_path: Path) -> None:
    a, b, c = tmp_path / "a.yaml", tmp_path / "b.yaml", tmp_path / "c.csv"
    workbench("fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", a)
    same = workbench("compare", a, a, "--json")
    assert (same.code, json.loads(same.out)["moved"]) == (0, False)
    assert "identical" in same.err
    again = tmp_path / "again.yaml"
    again.write_text(a.read_text().replace("max_relative_range_sd: 0.", "max_relative_range_sd: 0.0"))
    assert "same within uncertainty" in workbench("compare", a, again).err
    header, *rows = WEBCAM.read_text().splitlines()
    split = [row.rsplit(",", 1) for row in rows]
    c.write_text("\n".join([header, *(f"{left},{int(v_px) + 9}" for left, v_px in split)]) + "\n")
    workbench("fit", c, "--rig", WEBCAM_RIG, "-o", b)
    outcome = workbench("compare", a, b, "--json")
    result = json.loads(outcome.out)
    assert result["moved"]
    assert {"cy_px", "1.ty"} <= set(result["explanations"])
    assert "explained by" in outcome.err


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


class TestDesign:
    """Before any data."""

    RIG = ROOT / "rigs/thesis-emulated.yaml"

    def test_the_given_standoffs_are_predicted(self, workbench: Run) -> None:
        outcome = workbench(
            "design", "--rig", self.RIG, "--standoffs", "125, 400,4500", "--repeats", 5, "--json"
        )
        assert outcome.code == 0
        result = json.loads(outcome.out)
        assert result["standoffs_mm"] == [125.0, 400.0, 4500.0]
        assert result["repeats"] == 5
        keys = {"name", "unit", "prior_sd", "sd", "data_share", "determined_by"}
        assert all(set(p) == keys and p["sd"] <= p["prior_sd"] for p in result["parameters"])
        assert {r["laser_id"] for r in result["ranges"]} == {"L1", "L2", "L3", "L4"}
        assert result["worst_relative_sd"] > result["worst_relative_sd_of_calibration"] > 0
        assert any("f_px" in d["change"] for d in result["directions"])
        assert "(f_px) and all baselines cannot be known apart" in " ".join(outcome.err.split())
        assert max(len(line) for line in outcome.err.splitlines()) <= 80

    def test_without_standoffs_some_are_proposed(self, workbench: Run) -> None:
        outcome = workbench("design", "--rig", WEBCAM_RIG, "--count", 4, "--json")
        assert outcome.code == 0
        assert len(json.loads(outcome.out)["standoffs_mm"]) == 4
        assert "proposed standoffs (mm)" in outcome.err

    @pytest.mark.parametrize(
        ("options", "words"),
        [
            (("--standoffs", "125,16o"), "millimetres separated by commas, such as 125,160,210, got '16o'"),
            (("--standoffs", ""), "millimetres separated by commas"),
            (("--standoffs", "nan"), "100 to 5000 mm (bench.reach_mm of the rig file), got nan"),
            (("--standoffs", "50,200"), "100 to 5000 mm (bench.reach_mm of the rig file), got 50"),
            (("--standoffs", "200,300,200"), "every standoff once, got 200 twice"),
            (("--standoffs", "200", "--count", 3), "--standoffs or --count, not both"),
            (("--repeats", 0), "'--repeats': expected a whole number of at least 1, such as 10, got 0"),
            (("--count", 0), "'--count': expected a whole number of at least 1, such as 10, got 0"),
            (("--count", 100), "got 100: so many of the"),
        ],
    )
    def test_bad_options(self, workbench: Run, options: tuple[object, ...], words: str) -> None:
        refused(workbench("design", "--rig", self.RIG, *options), 2, words)

    def test_a_standoff_with_nothing_in_the_picture(self, workbench: Run, tmp_path: Path) -> None:
        rig = tmp_path / "rig.yaml"
        text = self.RIG.read_text().replace(
            "placement_sd_mm: 0.3", "placement_sd_mm: 0.3\n  reach_mm: [5, 5000]"
        )
        rig.write_text(text)
        outcome = workbench("design", "--rig", rig, "--standoffs", "10,500")
        refused(outcome, 2, "standoff 10 mm: expected a laser's spot in the picture, there is none")

    def test_a_reach_that_is_none(self, workbench: Run, tmp_path: Path) -> None:
        rig = tmp_path / "rig.yaml"
        text = self.RIG.read_text().replace(
            "placement_sd_mm: 0.3", "placement_sd_mm: 0.3\n  reach_mm: [900, 100]"
        )
        rig.write_text(text)
        refused(workbench("design", "--rig", rig), 2, "bench.reach_mm", "expected [nearest, farthest] in mm")


SCRIPT = Path(sys.executable).with_name("workbench")


@pytest.mark.parametrize("closed", ["<&-", ">&-", "2>&-", "<&- >&- 2>&-"])
def test_streams_that_are_closed(tmp_path: Path, closed: str) -> None:
    """What is opened next would get a closed one's number: a pipe, a session's journal."""
    done = shell(f"'{SCRIPT}' sessions --sessions '{tmp_path}' {closed}")
    assert (done.returncode, done.stdout) == (0, "")
    assert "Traceback" not in done.stderr
    missing = shell(f"'{SCRIPT}' sessions --sessions '{tmp_path / 'no'}' {closed}")
    assert missing.returncode == 2


def shell(line: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(["sh", "-c", line], capture_output=True, text=True, timeout=60, check=False)


def test_a_signal_at_the_very_end_changes_nothing(tmp_path: Path) -> None:
    """The interpreter's own end gives signals their default back; objects of this module end later."""
    late = """
import os, signal, sys
class Late:
    def __del__(self, kill=os.kill, me=os.getpid(), number=signal.SIGINT, write=os.write):
        write(1, b"late")
        kill(me, number)
late = Late()
from workbench.cli.main import main
main()
"""
    command = [sys.executable, "-c", late, "sessions", "--sessions", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stdout) == (0, "late")


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO])
@pytest.mark.parametrize("name", [None, "calibration.yaml"])
def test_what_cannot_be_written_is_no_defect(
    workbench: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, number: int, name: str | None
) -> None:
    def fail(*_: object) -> None:
        raise OSError(number, os.strerror(number), name)

    monkeypatch.setattr("workbench.cli.sessions.list_sessions", fail)
    what = name or "what is printed, or a file"
    refused(
        workbench("sessions", "--sessions", tmp_path), 5, f"{what}: cannot be written", os.strerror(number)
    )


def test_an_error_that_is_none_of_a_full_disk_is_a_defect(
    workbench: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise OSError(errno.EBADF, "bad")

    monkeypatch.setattr("workbench.cli.sessions.list_sessions", fail)
    outcome = workbench("sessions")
    assert outcome.code == 1
    assert "internal error" in outcome.err
    assert "Traceback" in outcome.err


def test_a_beam_that_may_be_on_is_told_whatever_came_on_top_of_it(
    workbench: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        try:
            raise LaserOffNotConfirmedError("treat the beams as on")
        finally:
            try:
                raise BadInputError("then this")
            finally:
                raise StoppedError("and that")

    monkeypatch.setattr("workbench.cli.sessions.list_sessions", fail)
    refused(workbench("sessions"), 7, "error: treat the beams as on")


def test_output_that_is_lost_is_said(tmp_path: Path) -> None:
    (tmp_path / "s").mkdir()
    (tmp_path / "s/session.yaml").write_text("format: 1\n")
    done = shell(f"'{SCRIPT}' sessions --sessions '{tmp_path}' --json >/dev/full")
    assert (done.returncode, done.stdout) == (5, "")
    assert "cannot be written: No space left" in done.stderr


def test_the_only_session_is_running(workbench: Run, tmp_path: Path) -> None:
    (tmp_path / "s").mkdir()
    (tmp_path / "s/session.yaml").write_text("format: 1\n")
    with Journal(tmp_path / "s"):
        refused(workbench("resume", "--sessions", tmp_path), 2, tmp_path / "s", "is running")


def test_a_fit_whose_result_nobody_reads_ends_as_stopped(tmp_path: Path) -> None:
    """The calibration is on disk; what is left of the output finds its pipe closed, or its disk full."""
    output = tmp_path / "webcam.yaml"
    command: list[str | Path] = [SCRIPT, "fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", output, "--json"]
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True)
    assert (done.returncode, output.is_file()) == (5, True), done.stderr
    assert "cannot be written: No space left" in done.stderr
    assert "Traceback" not in done.stderr


SHORT = """\
format: 1
procedure: p
title: P
steps:
"""
PNG = b"\x89PNG\r\n\x1a\n" + bytes(range(256)) * 2


class TestNastyInput:
    """What a tired or a nasty user gives: told in plain words, exit 2, and nothing is made."""

    @pytest.mark.parametrize("command", ["fit {} -o c.yaml --rig {rig}", "range {} --calibration {cal}"])
    def test_what_is_no_captures_file(self, workbench: Run, tmp_path: Path, command: str) -> None:
        cal, wrong = tmp_path / "cal.yaml", tmp_path / "wrong"
        workbench("fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", cal)
        line = command.format(wrong, rig=WEBCAM_RIG, cal=cal).split()
        wrong.write_bytes(PNG)
        refused(workbench(*line), 2, f"{wrong}: expected a captures file (CSV), got a PNG image")
        wrong.write_bytes(cal.read_bytes())
        refused(workbench(*line), 2, "expected a captures file (CSV), got YAML; its columns are laser_id")

    @pytest.mark.parametrize(
        "line", ["check {}", "plan {} --rig {rig}", "run {} --rig {rig}", "design --rig {}", "doctor {}",
                 "compare {} {}", "range --rig {rig} --calibration {}", "target --pdf a.pdf --rig {}",
                 "lasers off --rig {}"],
    )  # fmt: skip
    def test_a_picture_is_no_yaml(self, workbench: Run, tmp_path: Path, line: str) -> None:
        wrong = tmp_path / "wrong"
        wrong.write_bytes(PNG)
        told = workbench(*line.format(wrong, wrong, rig=ROOT / "rigs/thesis-emulated.yaml").split())
        refused(told, 2, f"{wrong}: expected a YAML file, got a PNG image")

    def test_a_rig_is_no_calibration(self, workbench: Run) -> None:
        outcome = workbench("range", WEBCAM, "--calibration", WEBCAM_RIG)
        refused(outcome, 2, "expected a calibration, with the key laser_ranger; this is a rig")
        assert len(outcome.err.splitlines()) == 1

    def test_every_image_that_is_not_there_is_told(self, workbench: Run, tmp_path: Path) -> None:
        captures = tmp_path / "c.csv"
        captures.write_text("laser_id,standoff_mm,repeat,on,off\n1,200,0,a.png,\n1,300,0,.,b.png\n")
        outcome = workbench("fit", captures, "--rig", WEBCAM_RIG, "-o", tmp_path / "c.yaml")
        refused(outcome, 2, f"{captures}: row 2, column on: expected an image, there is no file")
        assert [line.split(": ")[-2] for line in outcome.err.splitlines()] == [
            "row 2, column on", "row 3, column on", "row 3, column off",
        ]  # fmt: skip

    def test_what_is_no_image_is_called_what_it_is(self, workbench: Run, tmp_path: Path) -> None:
        captures = tmp_path / "c.csv"
        captures.write_text("laser_id,standoff_mm,repeat,on\n1,200,0,c.csv\n")
        outcome = workbench("fit", captures, "--rig", WEBCAM_RIG, "-o", tmp_path / "c.yaml")
        refused(outcome, 2, f"{captures}: row 2: {captures}: expected an image", "it is text, or truncated")

    def test_every_laser_that_there_is_not_is_told(self, workbench: Run, tmp_path: Path) -> None:
        calibration, captures = tmp_path / "c.yaml", tmp_path / "c.csv"
        workbench("fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", calibration)
        captures.write_text("laser_id,standoff_mm,repeat,u_px,v_px\n8,,0,,99\n1,,0,,99\n9,,0,,99\n")
        outcome = workbench("range", captures, "--calibration", calibration)
        refused(outcome, 2, f"{captures}: row 2, column laser_id", f"{captures}: row 4, column laser_id")

    @pytest.mark.parametrize(
        ("line", "says"),
        [
            ("range --rig r --calibration c --readings 0", "a whole number of at least 1, such as 10, got 0"),
            ("range --rig r --calibration c --readings x", "a whole number of at least 1, such as 10, got x"),
            (
                "range --rig r --calibration c --standoff nan",
                "millimetres from 1 to 1e+06, such as 500, got nan",
            ),
            (
                "range --rig r --calibration c --standoff 1e300",
                "millimetres from 1 to 1e+06, such as 500, got 1e300",
            ),
            (
                "fit c.csv -o c.yaml --without-standoff far",
                "millimetres from 0 to 1e+06, such as 500, got far",
            ),
            ("design --rig r --count few", "a whole number of at least 1, such as 10, got few"),
        ],
    )
    def test_numbers_that_are_none(self, workbench: Run, line: str, says: str) -> None:
        outcome = workbench(*line.split())
        refused(outcome, 2, f"expected {says}")
        assert "Input should" not in outcome.err

    def test_folders_that_are_none(self, workbench: Run, tmp_path: Path) -> None:
        file = tmp_path / "f"
        file.write_text("")
        rig, procedure = ROOT / "rigs/thesis-emulated.yaml", ROOT / "procedures/calibrate-flat.yaml"
        refused(
            workbench("view", tmp_path),
            2,
            f"{tmp_path}: expected a session's folder, with session.yaml in it",
        )
        refused(
            workbench("fit", tmp_path, "-o", file), 2, "expected a session's folder, with session.yaml in it"
        )
        refused(workbench("sessions", "--sessions", file), 2, "expected a folder of sessions, this is a file")
        refused(
            workbench("plan", procedure, "--rig", rig, "--sessions", file),
            2,
            f"{file}: expected a folder of sess",
        )

    @pytest.mark.parametrize(
        ("step", "says"),
        [
            ("{step: ask, text: a, number: {unit: C, in: [50, 10]}}", "`in`: expected [lowest, highest]"),
            ("{step: ask, text: a, number: {unit: C, in: [50]}}", "steps[0].number.in[1]: is missing"),
            ("{step: ask, text: a, number: {unit: C, in: [1, 5], usual: 9}}", "`usual`: expected 1 to 5"),
            ("{step: ask, text: a, choices: [b, b]}", "`choices`: expected each once, got b, b"),
            (
                "{step: ask, text: a, choices: [b, Skip]}",
                "expected other words than redo, skip, abort, got skip",
            ),
            ("{step: accuracy_trial, standoffs_mm: [300, 300], readings: 1}", "standoffs_mm must differ"),
            ("{step: capture_grid, standoffs_mm: [300, 300.00000000000006], repeats: 1}", "must differ"),
            (
                "{step: capture_grid, standoffs_mm: [1.0e+300], repeats: 1}",
                "expected at most 1000000, got 1e+300",
            ),
            (f"{{step: warm_up, frames: 1{'0' * 400}}}", "frames: expected at most 1000000, got 1000"),
            ("{step: null}", "steps[0].step: expected one of message, "),
            ("fit", "steps[0]: expected keys and values, got 'fit'"),
            ("{step: message, text: a: b}", "put text with a colon in it in quotes"),
        ],
    )
    def test_steps_that_cannot_be(self, workbench: Run, tmp_path: Path, step: str, says: str) -> None:
        path = tmp_path / "p.yaml"
        path.write_text(f"{SHORT}  - {step}\n")
        rig = ROOT / "rigs/thesis-emulated.yaml"
        refused(workbench("check", path), 2, "p.yaml:5: ", says)
        refused(workbench("plan", path, "--rig", rig), 2, "p.yaml:5: ", says)

    def test_a_rig_of_the_virtual_bench_that_cannot_be(self, workbench: Run, tmp_path: Path) -> None:
        rig = tmp_path / "rig.yaml"
        text = (ROOT / "rigs/thesis-emulated.yaml").read_text()
        rig.write_text(text.replace("seed: 2001", "seed: -1").replace("width_px: 640", "width_px: 9999999"))
        refused(
            workbench("check", rig),
            2,
            "width_px: expected at most 100000",
            "seed: expected at least 0, got -1",
        )

    def test_numbers_that_no_computation_holds(self, workbench: Run, tmp_path: Path) -> None:
        rig, calibration = tmp_path / "rig.yaml", tmp_path / "c.yaml"
        rig.write_text(WEBCAM_RIG.read_text() + "board: {columns: 1" + 400 * "0" + "}\n")
        refused(workbench("check", rig), 2, "board.columns: expected at most 1000, got 1000")
        workbench("fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", calibration)
        text = calibration.read_text()
        assert "image_width: 640" in text
        calibration.write_text(text.replace("image_width: 640", "image_width: 1" + 400 * "0"))
        outcome = workbench("range", WEBCAM, "--calibration", calibration)
        refused(outcome, 2, "image_width: expected at most 100000, got 1000")
