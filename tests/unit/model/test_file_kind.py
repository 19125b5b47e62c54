"""Kind of a file for messages."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.reference_session import REFERENCE
from workbench.model.file_kind import CALIBRATION, kind_of_content

ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize(
    ("file", "kind"),
    [
        (ROOT / "rigs/webcam-laser.yaml", "a rig"),
        (ROOT / "procedures/verify.yaml", "a procedure"),
        (ROOT / "data/opencv-chessboards/left01.jpg", "a JPEG image"),
        (REFERENCE / "journal.jsonl", "the journal of a session"),
        (REFERENCE / "calibration.yaml", CALIBRATION),
    ],
)
def test_a_file_is_named_by_its_content(file: Path, kind: str) -> None:
    assert (kind_of_content(file.read_bytes()) or "").startswith(kind)


def test_a_camera_without_lasers_is_no_calibration_of_a_sensor() -> None:
    kind = kind_of_content(b"image_width: 640\nworkbench_camera:\n  format: 1\n") or ""
    assert "camera" in kind
    assert kind != CALIBRATION


@pytest.mark.parametrize("content", [b"", b"laser_id,standoff_mm\nL1,500\n", b"note: none of the keys\n"])
def test_other_text_has_no_kind(content: bytes) -> None:
    assert kind_of_content(content) is None
