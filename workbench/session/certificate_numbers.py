"""Register of certificate numbers, `certificates.jsonl` in the folder of sessions: a number is assigned once.

A certificate of unchanged content keeps its number. A change of the content (a repair of the session, another
`lab.yaml`) gives a new number, which names the one that it replaces (ISO/IEC 17025, 7.8.8).
"""

from __future__ import annotations

from pathlib import Path

from workbench.model.errors import BadInputError
from workbench.model.problems import short
from workbench.model.yamlfile import FileModel
from workbench.session.appended import append_line, locked, read_lines

REGISTER = "certificates.jsonl"


class AssignedNumber(FileModel):
    """One line of the register."""

    number: str
    session: str
    """Name of the session."""
    content_sha256: str
    """Fingerprint of what the certificate states."""
    assigned: str
    """Time of the assignment, ISO 8601."""
    replaces: str = ""
    """Number of the certificate of the same session before; empty for the first one."""


def assign_number(
    folder: Path, session: str, content_sha256: str, assigned: str, prefix: str
) -> AssignedNumber:
    """The number of a certificate: the one assigned to this content before, else the next one of the year.

    Args:
        folder: folder of sessions.
        session: name of the session.
        content_sha256: fingerprint of what the certificate states.
        assigned: time, ISO 8601; the number contains its year.
        prefix: text before the number.

    Raises:
        BadInputError: the register is damaged, or cannot be written.
    """
    path = folder / REGISTER
    wanted = AssignedNumber(number="", session=session, content_sha256=content_sha256, assigned=assigned)
    with locked(path) as handle:  # two programs never assign one number
        return _assign(handle, path, wanted, prefix)


def _assign(handle: int, path: Path, wanted: AssignedNumber, prefix: str) -> AssignedNumber:
    register = _read(path)
    of_session = [one for one in register if one.session == wanted.session]
    if of_session and of_session[-1].content_sha256 == wanted.content_sha256:
        return of_session[-1]
    stem = f"{prefix}{'-' if prefix else ''}{wanted.assigned[:4]}-"
    taken = {one.number for one in register}
    count = sum(number.startswith(stem) for number in taken) + 1
    while (number := f"{stem}{count:04d}") in taken:
        count += 1
    replaces = of_session[-1].number if of_session else ""
    entry = wanted.model_copy(update={"number": number, "replaces": replaces})
    append_line(handle, path, entry.model_dump_json())
    return entry


def _read(path: Path) -> list[AssignedNumber]:
    register = []
    for number, line in enumerate(read_lines(path, "a register of certificates"), start=1):
        try:
            register.append(AssignedNumber.model_validate_json(line))
        except ValueError:
            raise BadInputError(
                f"{path}:{number}: expected a certificate's number, got {short(line)}; restore the file"
                " from a copy, so that no number is assigned twice"
            ) from None
    return register
