"""PDF pages: numbered, with header, nothing cut off, equal bytes for equal pages."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pypdfium2
import pytest

from tests.support.pango import need_pango
from tests.support.reference_session import certificate
from workbench.model.errors import BadInputError
from workbench.model.table import Column, Table
from workbench.report.document import Document, Fact, KeyNumber, Section, Verdict
from workbench.report.document_html import document_html
from workbench.report.document_pdf import document_pdf

MARGIN_POINTS = 40.0
"""Left and right margin of the pages, 16 mm, less half a letter."""


@pytest.fixture(scope="module")
def page() -> str:
    need_pango()
    return document_html(certificate().document, "2026-12-01 08:00 UTC")


@pytest.fixture(scope="module")
def pdf(page: str) -> bytes:
    return document_pdf(page)


def test_every_page_has_its_number_and_the_certificates(pdf: bytes) -> None:
    document = pypdfium2.PdfDocument(pdf)
    count = len(document)
    assert count >= 5
    for number, one in enumerate(document, start=1):
        text = one.get_textpage().get_text_range()
        assert f"Page {number} of {count}" in text
        assert "Calibration certificate 2026-0001" in text
    assert "End of calibration certificate" in text


def test_the_first_page_has_verdict_and_five_numbers(pdf: bytes) -> None:
    text = pypdfium2.PdfDocument(pdf)[0].get_textpage().get_text_range()
    for words in (
        "Calibration accepted",
        "Calibrated span",
        "Largest U",
        "Rms residual",
        "Largest mean error",
    ):
        assert words in text


def test_no_text_leaves_the_page(pdf: bytes) -> None:
    for one in pypdfium2.PdfDocument(pdf):
        width = one.get_width()
        text = one.get_textpage()
        for n in range(text.count_rects()):
            left, bottom, right, _ = text.get_rect(n)
            assert left >= MARGIN_POINTS
            assert right <= width - MARGIN_POINTS
            assert bottom > 0


def test_equal_pages_give_equal_bytes(page: str, pdf: bytes) -> None:
    assert document_pdf(page) == pdf


def test_no_installed_font_is_needed(page: str, tmp_path: Path) -> None:
    """In a process whose font configuration has no folder of fonts."""
    (tmp_path / "fonts.conf").write_text(
        '<?xml version="1.0"?><!DOCTYPE fontconfig SYSTEM "fonts.dtd">'
        f"<fontconfig><cachedir>{tmp_path}</cachedir></fontconfig>"
    )
    (tmp_path / "page.html").write_text(page)
    script = (
        "import sys; from pathlib import Path; from workbench.report.document_pdf import document_pdf;"
        " Path(sys.argv[2]).write_bytes(document_pdf(Path(sys.argv[1]).read_text()))"
    )
    files = [str(tmp_path / "page.html"), str(tmp_path / "page.pdf")]
    subprocess.run(
        [sys.executable, "-c", script, *files],
        env={"FONTCONFIG_FILE": str(tmp_path / "fonts.conf"), "PATH": ""},
        check=True,
        timeout=120,
    )
    text = pypdfium2.PdfDocument(files[1])[0].get_textpage().get_text_range()
    assert "Calibration accepted" in text


def test_a_missing_system_library_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    class Missing:
        def find_spec(self, name: str, path: object = None, target: object = None) -> None:
            if name.split(".")[0] == "weasyprint":
                raise OSError("cannot load library 'libpango-1.0-0'")

    for name in [one for one in sys.modules if one.split(".")[0] == "weasyprint"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setattr(sys, "meta_path", [Missing(), *sys.meta_path])
    with pytest.raises(BadInputError, match="libpango"):
        document_pdf("<p>text</p>")


def test_an_overlong_word_neither_hangs_nor_leaves_the_page() -> None:
    need_pango()
    word = "m" * 3000
    columns = (Column(key="a", name="a"), Column(key="b", name="b"))
    table = Table(name="t", title="t", columns=columns, rows=((word, "b"), ("a", word)))
    facts = (Fact("Operator", word),)
    section = Section("s", "s", facts, (word,), (table,))
    verdict = Verdict("good", "text", (word,))
    numbers = (KeyNumber("name", "value", word),)
    content = document_pdf(
        document_html(Document("t", "1", "", facts, verdict, numbers, (section,), word), "now")
    )
    pages = pypdfium2.PdfDocument(content)
    assert len(pages) < 5
    for one in pages:
        text = one.get_textpage()
        for n in range(text.count_rects()):
            assert text.get_rect(n)[2] <= one.get_width() - MARGIN_POINTS
