"""Issue of a certificate: its sources in the folder of sessions, and its number."""

from __future__ import annotations

from workbench.model.errors import BadInputError
from workbench.model.laboratory import Laboratory
from workbench.model.rig import UNKNOWN_SERIAL
from workbench.report.certificate.assemble import Certificate, Sources, fingerprint
from workbench.report.certificate.predecessor import Predecessor, load_predecessor
from workbench.report.certificate.session_record import SessionRecord, unchanged
from workbench.session.caller import now
from workbench.session.certificate_numbers import assign_number
from workbench.session.identity import session_identity
from workbench.session.index import indexed_sessions


def sources_of(session: SessionRecord, laboratory: Laboratory) -> tuple[Sources, str]:
    """Sources of the certificate, with the calibration of the same sensor before.

    Returns:
        The sources, and a note where that calibration is damaged and therefore not used; else an empty text.
    """
    try:
        return Sources(session, laboratory, _predecessor(session)), ""
    except BadInputError as error:
        return Sources(session, laboratory), f"the calibration before is not used: {error}"


def numbered(certificate: Certificate) -> Certificate:
    """The certificate with its number, which is assigned at the first call.

    Raises:
        BadInputError: the register of numbers cannot be written.
    """
    sources = certificate.sources
    folder, prefix = sources.session.folder, sources.laboratory.number_prefix
    number = assign_number(folder.parent, folder.name, fingerprint(sources), now(), prefix)
    return certificate.numbered(number)


def _predecessor(session: SessionRecord) -> Predecessor | None:
    """The last calibration of the same sensor in the folder, made before the session's own.

    Raises:
        BadInputError: its file is damaged.
    """
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
    return load_predecessor(unchanged(last.status.session_dir / last.calibration, last.calibration_sha256))
