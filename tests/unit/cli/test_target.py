"""`workbench target`; the page itself is tested with `report.board_page`."""

from __future__ import annotations

from pathlib import Path

from tests.support.command_line import Run, refused


def test_a_pdf_of_the_rigs_board_is_written(workbench: Run, tmp_path: Path) -> None:
    rig, text = tmp_path / "rig.yaml", (Path(__file__).parents[3] / "rigs/thesis-emulated.yaml").read_text()
    rig.write_text(text + "board: {columns: 5}\n")
    usual, other = tmp_path / "a.pdf", tmp_path / "b.pdf"
    assert workbench("target", "--pdf", usual).code == 0
    assert workbench("target", "--pdf", other, "--rig", rig).code == 0
    assert usual.read_bytes().startswith(b"%PDF")
    assert usual.read_bytes() != other.read_bytes()


def test_a_page_that_cannot_be_written_is_refused(workbench: Run, tmp_path: Path) -> None:
    refused(workbench("target", "--pdf", tmp_path / "no/a.pdf"), 2, tmp_path / "no/a.pdf")
