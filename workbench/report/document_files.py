"""Files of a document: HTML and PDF."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

from workbench.report.document import Document
from workbench.session.files import write_output


def page_of(document: Document) -> str:
    """HTML page of a document, with the present time as that of printing."""
    from workbench.report.document_html import document_html  # loads matplotlib

    return document_html(document, f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC")


def write_document(document: Document, html: Path | None = None, pdf: Path | None = None) -> None:
    """Write HTML and PDF of a document, as far as their paths are given.

    Raises:
        BadInputError: a file cannot be written, or the PDF needs a system library that is missing.
    """
    if html is None and pdf is None:
        return
    page = page_of(document)
    if html is not None:
        write_output(html, page.encode())
    if pdf is not None:
        from workbench.report.document_pdf import document_pdf  # loads WeasyPrint

        write_output(pdf, document_pdf(page))
