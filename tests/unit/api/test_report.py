"""Reports of sessions in Python."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

import workbench as wb
from tests.support.pango import need_pango

ROOT = Path(__file__).parents[3]


@pytest.fixture
def session(tmp_path: Path) -> wb.Session:
    folder = shutil.copytree(ROOT / "data/session-0.1.0", tmp_path / "session")
    return wb.open_session(folder)


def files(folder: Path) -> set[Path]:
    return {path.relative_to(folder) for path in folder.rglob("*")}


def test_a_report_is_made_without_writing(session: wb.Session, tmp_path: Path) -> None:
    before = files(tmp_path)
    report = session.report()
    assert report.verdict in report.html
    assert report.data["number"] == ""
    assert report.data["session"] == "session"
    assert files(tmp_path) - before <= {Path(".sessions.sqlite3")}


@pytest.mark.long_cases
@pytest.mark.parametrize(
    ("name", "begins"),
    [("a.html", b"<!"), ("a.json", b"{"), ("a.pdf", b"%PDF")],
)
def test_a_saved_report_has_the_number_of_the_command(
    session: wb.Session, tmp_path: Path, name: str, begins: bytes
) -> None:
    if name.endswith(".pdf"):
        need_pango()
    number = session.report().save(tmp_path / name)
    assert (tmp_path / name).read_bytes().startswith(begins)
    assert session.report().save(tmp_path / "again.json") == number
    assert json.loads((tmp_path / "again.json").read_text())["number"] == number
    register = (tmp_path / "certificates.jsonl").read_text().splitlines()
    assert [json.loads(line)["number"] for line in register] == [number]


def test_the_laboratory_is_that_beside_the_session(session: wb.Session, tmp_path: Path) -> None:
    (tmp_path / "lab.yaml").write_text("format: 1\nnumber_prefix: EOL\nlaboratory: {name: Optics}\n")
    report = session.report()
    assert "Optics" in report.html
    assert report.save(tmp_path / "a.html").startswith("EOL-")


@pytest.mark.parametrize("name", ["a.txt", "a", "nowhere/a.html"])
def test_a_wrong_name_gets_no_number(session: wb.Session, tmp_path: Path, name: str) -> None:
    with pytest.raises(wb.BadInputError):
        session.report().save(tmp_path / name)
    assert not (tmp_path / "certificates.jsonl").exists()


def test_a_session_whose_calibration_changed_is_refused(session: wb.Session) -> None:
    path = session.folder / "calibration.yaml"
    path.write_text(path.read_text() + "# edited\n")
    with pytest.raises(wb.BadInputError, match=r"calibration\.yaml"):
        session.report()
