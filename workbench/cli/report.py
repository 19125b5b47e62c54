"""`workbench report`: certificate of a session as HTML, PDF, Digital Calibration Certificate and JSON."""

from __future__ import annotations

import json
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from workbench.cli.console import print_message
from workbench.cli.lab_questions import laboratory_of
from workbench.cli.sessions import find_session
from workbench.model.errors import BadInputError
from workbench.model.laboratory import Laboratory
from workbench.report.certificate.assemble import Certificate, certificate_of
from workbench.report.certificate.assessment import future_texts
from workbench.report.certificate.dcc import certificate_xml, required_parties
from workbench.report.certificate.issue import numbered, sources_of
from workbench.report.certificate.session_record import SessionRecord, read_session
from workbench.report.certificate.signature import Signer
from workbench.report.document_files import write_document
from workbench.session.files import check_output, write_output

HTML, PDF, XML = (".html", ".htm"), (".pdf",), (".xml",)
"""Endings of the files of each kind."""
DEFAULT_NAME = "certificate.html"
"""File in the session folder if no other output is asked for."""


@dataclass(frozen=True)
class Outputs:
    """Files to write; None: not asked for."""

    html: Path | None = None
    pdf: Path | None = None
    dcc: Path | None = None
    as_json: bool = False
    signer: Signer | None = None
    """Signer of the Digital Calibration Certificate; None: it is not signed."""

    @property
    def files(self) -> list[Path]:
        """Files that are asked for."""
        return [path for path in (self.html, self.pdf, self.dcc) if path is not None]

    def check(self) -> None:
        """Check that the files can be written, and have the endings of their kinds.

        A wrong ending may be that of a file of the record, which must not be replaced.

        Raises:
            BadInputError: a file has another ending, or cannot be written.
        """
        for path, endings in ((self.html, HTML), (self.pdf, PDF), (self.dcc, XML)):
            if path is None:
                continue
            if path.suffix.lower() not in endings:
                raise BadInputError(f"{path}: expected a name that ends with {endings[0]}")
            check_output(path)


def report_session(name: Path, sessions: Path, outputs: Outputs, no_input: bool) -> None:
    """Write the certificate of a session.

    Raises:
        BadInputError: there is no such session, it is damaged, or a file cannot be written.
    """
    folder = find_session(name, sessions).resolve()
    outputs.check()
    session = read_session(folder)
    laboratory = laboratory_of(folder.parent, no_input)
    if outputs.dcc is not None:
        required_parties(laboratory, session)  # before a number is assigned
    certificate = _issued(session, laboratory)
    if not outputs.files and not outputs.as_json:
        outputs = Outputs(html=folder / DEFAULT_NAME)
    write_document(certificate.document, outputs.html, outputs.pdf)
    if outputs.dcc is not None:
        xml = certificate_xml(certificate, datetime.now(UTC))
        write_output(outputs.dcc, xml if outputs.signer is None else outputs.signer.sign(xml))
    if outputs.as_json:
        print(json.dumps(certificate.as_json()))
    _print_summary(certificate, outputs)


def certify(session_dir: Path) -> str:
    """Write the certificate of a session into its folder, without questions; returns its title and number.

    Raises:
        BadInputError: the session is damaged, or a file cannot be written.
    """
    certificate = _issued(read_session(session_dir), laboratory_of(session_dir.parent, no_input=True))
    write_document(certificate.document, session_dir / DEFAULT_NAME)
    return f"{certificate.document.title} {certificate.document.number}"


def compare_sessions(names: tuple[Path, Path], sessions: Path, outputs: Outputs) -> None:
    """Write a comparison of the calibrations of two sessions; it has no number.

    Raises:
        BadInputError: a session is missing, damaged or without calibration, or they have nothing in common.
    """
    from workbench.report.comparison import comparison_document

    if outputs.dcc is not None:
        raise BadInputError("--dcc: expected one session; a comparison is no calibration certificate")
    outputs.check()
    a, b = (read_session(find_session(name, sessions)) for name in names)
    document = comparison_document(a, b)
    write_document(document, outputs.html, outputs.pdf)
    if outputs.as_json:
        print(json.dumps(document.as_json()))
    print_message("\n".join((document.verdict.text, *(f"note: {one}" for one in document.verdict.reasons))))


def _issued(session: SessionRecord, laboratory: Laboratory) -> Certificate:
    sources, note = sources_of(session, laboratory)
    if note:
        print_message(f"note: {note}")
    return numbered(certificate_of(sources))  # one that cannot be made gets no number


def _print_summary(certificate: Certificate, outputs: Outputs) -> None:
    document = certificate.document
    print_message(f"{document.title} {document.number}: {document.verdict.text}")
    session = certificate.sources.session
    for remark in filter(None, (*future_texts(session, session.calibration), session.chain_remark)):
        print_message(f"note: {remark}")
    for path in outputs.files:
        print_message(f"{path} written")
    open_items = [fact.name for fact in document.head if not fact.is_stated]
    if open_items:
        names = ", ".join(open_items)
        print_message(f"not stated: {names}; write them into lab.yaml beside the session")
