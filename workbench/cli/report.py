"""`workbench report`: certificate of a session as HTML, PDF, Digital Calibration Certificate and JSON."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import typer

from workbench.cli.console import print_message
from workbench.cli.lab_questions import laboratory_of
from workbench.cli.sessions import find_session
from workbench.model.contents import printable
from workbench.model.errors import AnswerNeededError, BadInputError
from workbench.model.laboratory import Laboratory
from workbench.model.rig import UNKNOWN_SERIAL
from workbench.report.certificate.assemble import Certificate, Sources, certificate_of, fingerprint
from workbench.report.certificate.dcc import certificate_xml, required_parties
from workbench.report.certificate.predecessor import Predecessor, load_predecessor
from workbench.report.certificate.session_record import SessionRecord, read_session, unchanged
from workbench.report.certificate.signature import Signer
from workbench.report.document import Document
from workbench.session.caller import now
from workbench.session.certificate_numbers import assign_number
from workbench.session.files import check_output, write_output
from workbench.session.identity import session_identity
from workbench.session.index import indexed_sessions

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
    laboratory = laboratory_of(folder.parent, no_input, _ask)
    if outputs.dcc is not None:
        required_parties(laboratory, session)  # before a number is assigned
    certificate = numbered(session, laboratory)
    if not outputs.files and not outputs.as_json:
        outputs = Outputs(html=folder / DEFAULT_NAME)
    write_document(certificate.document, outputs)
    if outputs.dcc is not None:
        xml = certificate_xml(certificate, datetime.now(UTC))
        write_output(outputs.dcc, xml if outputs.signer is None else outputs.signer.sign(xml))
    if outputs.as_json:
        print(json.dumps(certificate.as_json()))
    _print_summary(certificate, outputs)


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
    write_document(document, outputs)
    if outputs.as_json:
        print(json.dumps(document.as_json()))
    print_message("\n".join((document.verdict.text, *(f"note: {one}" for one in document.verdict.reasons))))


def write_document(document: Document, outputs: Outputs) -> None:
    """Write HTML and PDF of a document, as far as they are asked for.

    Raises:
        BadInputError: a file cannot be written, or the PDF needs a system library that is missing.
    """
    if outputs.html is None and outputs.pdf is None:
        return
    from workbench.report.document_html import document_html

    page = document_html(document, f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC")
    if outputs.html is not None:
        write_output(outputs.html, page.encode())
    if outputs.pdf is not None:
        from workbench.report.document_pdf import document_pdf

        write_output(outputs.pdf, document_pdf(page))


def numbered(session: SessionRecord, laboratory: Laboratory) -> Certificate:
    """The certificate with its number, which is assigned at the first call.

    Raises:
        BadInputError: a calibration is damaged, or the register of numbers cannot be written.
    """
    lab_folder = session.folder.parent
    sources = Sources(session, laboratory, _predecessor(session))
    certificate = certificate_of(sources)  # one that cannot be made gets no number
    key = fingerprint(sources)
    number = assign_number(lab_folder, session.folder.name, key, now(), laboratory.number_prefix)
    return certificate.numbered(number)


def _predecessor(session: SessionRecord) -> Predecessor | None:
    """The last calibration of the same sensor in the folder, made before the session's own."""
    if not session.is_own_calibration or session.rig.serial == UNKNOWN_SERIAL:
        return None
    own = session_identity(session.folder)
    before = [
        one
        for one in indexed_sessions(session.folder.parent)
        if one.serial == session.rig.serial
        and one.calibration
        and one.verdict in {"accepted", "exception"}
        and (not own or one.identity != own)
        and (one.began, one.name) < (session.manifest.created, session.folder.name)
    ]
    if not before:
        return None
    last = max(before, key=lambda one: (one.began, one.name))
    try:
        path = unchanged(last.status.session_dir / last.calibration, last.calibration_sha256)
        return load_predecessor(path)
    except BadInputError as error:
        print_message(f"note: the calibration before is not used: {error}")
        return None


def _ask(question: str) -> str:
    """Typed answer in one line.

    Raises:
        AnswerNeededError: the terminal was closed, or end-of-file was typed (^D).
    """
    typer.echo(f"{question}: ", err=True, nl=False)
    typed = sys.stdin.readline()
    if not typed:
        raise AnswerNeededError(
            f"{question}: no answer; nothing was written. --no-input reports what is not known as not stated"
        )
    return printable(typed)


def _print_summary(certificate: Certificate, outputs: Outputs) -> None:
    document = certificate.document
    print_message(f"{document.title} {document.number}: {document.verdict.text}")
    for path in outputs.files:
        print_message(f"{path} written")
    open_items = [fact.name for fact in document.head if not fact.is_stated]
    if open_items:
        names = ", ".join(open_items)
        print_message(f"not stated: {names}; write them into lab.yaml beside the session")
