"""Report of a session: a certificate as HTML, PDF or JSON."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from workbench.api.arguments import path_of
from workbench.model.errors import BadInputError
from workbench.model.laboratory import Laboratory, load_laboratory
from workbench.report.certificate.assemble import Certificate, certificate_of
from workbench.report.certificate.issue import numbered, sources_of
from workbench.report.certificate.session_record import read_session
from workbench.report.document_files import page_of, write_document
from workbench.session.files import check_output, write_output

HTML, PDF, JSON = ".html", ".pdf", ".json"


@dataclass(frozen=True)
class Report:
    """Result of `Session.report`.

    Examples:
        >>> import workbench as wb
        >>> report = wb.open_session("data/session-0.1.0").report()
        >>> [section["key"] for section in report.data["sections"]][:3]
        ['laboratory', 'sensor', 'conditions']
    """

    certificate: Certificate
    notes: tuple[str, ...]
    """Remarks, for example that the calibration before is damaged."""

    @property
    def verdict(self) -> str:
        """Verdict on the first page, in one line."""
        return self.certificate.document.verdict.text

    @property
    def html(self) -> str:
        """The page, without a number."""
        return page_of(self.certificate.document)

    @property
    def data(self) -> dict[str, object]:
        """Verdict, key numbers, sections and uncertainties as plain values, as `workbench report --json`."""
        return self.certificate.as_json()

    def save(self, path: str | Path) -> str:
        """Write the certificate with its number, which the folder of the session records as used.

        Args:
            path: name of the file, which ends with .html, .pdf or .json.

        Returns:
            The number.

        Raises:
            BadInputError: the name has another ending, the file or the register of numbers cannot be written,
                or the PDF needs a system library that is missing.
        """
        file = path_of("path", path, "the name of a file")
        if file.suffix.lower() not in {HTML, PDF, JSON}:
            raise BadInputError(f"path: expected a name that ends with {HTML}, {PDF} or {JSON}, got {file}")
        check_output(file)
        certificate = numbered(self.certificate)
        if file.suffix.lower() == JSON:
            write_output(file, (json.dumps(certificate.as_json()) + "\n").encode())
        else:
            is_pdf = file.suffix.lower() == PDF
            write_document(certificate.document, None if is_pdf else file, file if is_pdf else None)
        return certificate.document.number


def report_of(folder: Path) -> Report:
    """Report of the session in a folder; see `Session.report`."""
    record = read_session(folder.resolve())
    laboratory = load_laboratory(record.folder.parent) or Laboratory(format=1)
    sources, note = sources_of(record, laboratory)
    return Report(certificate_of(sources), (note,) if note else ())
