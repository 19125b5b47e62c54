"""What `workbench range` says of captures and calibrations that it cannot use: exit 2 and what to do."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.support.rigs import PROVENANCE, World, thesis_rig
from workbench.calibration.estimation.fit import fit
from workbench.calibration.verdict.export import calibrate, write_calibration
from workbench.cli.main import main
from workbench.cli.stopping import SIGNALS
from workbench.model.acceptance import Acceptance

Refused = Callable[..., str]
HEADER = "laser_id,standoff_mm,repeat,on,off\n"


@pytest.fixture(scope="module")
def calibration(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("bad") / "calibration.yaml"
    rig = thesis_rig()
    write_calibration(path, calibrate(fit(rig, World(rig, 1).observations()), Acceptance(), PROVENANCE)[0])
    return path


@pytest.fixture
def refused(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Iterator[Refused]:
    """Run `workbench range` and return what it says, having ended with exit code 2 and no reading."""
    before = {number: signal.getsignal(number) for number in SIGNALS}

    def run(captures: Path, calibration: Path) -> str:
        command = ["workbench", "range", str(captures), "--calibration", str(calibration), "--json"]
        monkeypatch.setattr(sys, "argv", command)
        with pytest.raises(SystemExit) as stop:
            main()
        said = capsys.readouterr()
        assert stop.value.code == 2, said.err
        assert said.out == ""
        assert "Traceback" not in said.err
        return " ".join(said.err.split())

    yield run
    for number, handler in before.items():
        signal.signal(number, handler)


def frame(path: Path, width: int = 640, height: int = 480) -> Path:
    cv2.imwrite(str(path), np.full((height, width), 9, np.uint8))
    return path


def table(folder: Path, *rows: str) -> Path:
    path = folder / "captures.csv"
    path.write_text(HEADER + "".join(f"{row}\n" for row in rows))
    return path


def test_an_empty_folder(refused: Refused, calibration: Path, tmp_path: Path) -> None:
    said = refused(tmp_path, calibration)
    assert f"{tmp_path}: expected a captures file, or a session folder with trial-captures.csv" in said


def test_captures_without_a_row(refused: Refused, calibration: Path, tmp_path: Path) -> None:
    assert "expected at least one row below the header, got none" in refused(table(tmp_path), calibration)


def test_one_frame_instead_of_captures(refused: Refused, calibration: Path, tmp_path: Path) -> None:
    said = refused(frame(tmp_path / "on.png"), calibration)
    assert "on.png: expected a captures file (CSV), got a PNG image" in said


def test_one_frame_of_a_pair(refused: Refused, calibration: Path, tmp_path: Path) -> None:
    frame(tmp_path / "on.png")
    said = refused(table(tmp_path, "all,,0,on.png,off.png"), calibration)
    assert "row 2" in said
    assert "row 2, column off: no such file" in said


def test_frames_of_another_size(refused: Refused, calibration: Path, tmp_path: Path) -> None:
    for name in ("on.png", "off.png"):
        frame(tmp_path / name, 320, 240)
    said = refused(table(tmp_path, "all,,0,on.png,off.png"), calibration)
    assert "on.png: expected an image of 640 x 480 pixels, got 320 x 240" in said


def test_frames_of_two_sizes(refused: Refused, calibration: Path, tmp_path: Path) -> None:
    frame(tmp_path / "on.png")
    frame(tmp_path / "off.png", 640, 481)
    said = refused(table(tmp_path, "all,,0,on.png,off.png"), calibration)
    assert "off.png: expected an image of 640 x 480 pixels, got 640 x 481" in said


def test_the_calibration_of_another_rig(refused: Refused, calibration: Path, tmp_path: Path) -> None:
    frame(tmp_path / "on.png")
    said = refused(table(tmp_path, "V1,,0,on.png,"), calibration)
    assert "expected all or one of the calibration's lasers (L1, L2, L3, L4), got V1" in said


@pytest.mark.parametrize("share", [0.2, 0.5, 0.9])
def test_a_truncated_calibration(refused: Refused, calibration: Path, tmp_path: Path, share: float) -> None:
    frame(tmp_path / "on.png")
    content = calibration.read_bytes()
    cut = tmp_path / "cut.yaml"
    cut.write_bytes(content[: int(share * len(content))])
    assert "cut.yaml" in refused(table(tmp_path, "all,,0,on.png,"), cut)


def test_a_covariance_that_is_not_positive(refused: Refused, calibration: Path, tmp_path: Path) -> None:
    frame(tmp_path / "on.png")
    text = calibration.read_text()
    head, tail = text.split("covariance:", 1)
    begins = tail.index("[") + 1
    variance = tail[begins : tail.index(",", begins)].strip()
    assert float(variance) > 0  # of f_px, the first
    wrong = tmp_path / "wrong.yaml"
    wrong.write_text(f"{head}covariance:{tail.replace(variance, f'-{variance}', 1)}")
    said = refused(table(tmp_path, "all,,0,on.png,"), wrong)
    assert "covariance: expected no negative variance, got -" in said


def test_nobody_reads_the_answer(calibration: Path, tmp_path: Path) -> None:
    """As with `| head`: it ends, without a word and with the code for what was stopped."""
    frame(tmp_path / "on.png")
    captures = table(tmp_path, "all,,0,on.png,")
    script = Path(sys.executable).with_name("workbench")
    command: list[str | Path] = [script, "range", captures, "--calibration", calibration, "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as child:
        assert child.stdout is not None
        assert child.stderr is not None
        child.stdout.close()
        said = child.stderr.read()
    assert (child.returncode, said) == (5, b"")
