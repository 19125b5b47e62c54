"""Register of certificate numbers, `certificates.jsonl` in the folder of sessions: a number is assigned once.

A certificate of unchanged content keeps its number. A change of the content (a repair of the session, another
`lab.yaml`) gives a new number, which names the one that it replaces (ISO/IEC 17025, 7.8.8).
"""

from __future__ import annotations

import fcntl
import os
from pathlib import Path

from workbench.model.contents import read_file
from workbench.model.errors import BadInputError
from workbench.model.problems import short
from workbench.model.yamlfile import FileModel

REGISTER = "certificates.jsonl"
LARGEST_BYTES = 2**26


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
    try:
        handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o666)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX)  # two programs never assign one number
            return _assign(handle, path, wanted, prefix)
        finally:
            os.close(handle)
    except OSError as error:
        raise BadInputError(f"{path}: cannot be written: {error.strerror or error}") from None


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
    start = "" if _ends_a_line(path) else "\n"
    os.write(handle, f"{start}{entry.model_dump_json()}\n".encode())
    os.fsync(handle)
    return entry


def _ends_a_line(path: Path) -> bool:
    """Whether a new line can follow; an editor may have removed the last line's end."""
    return path.read_bytes()[-1:] in {b"", b"\n"}


def _read(path: Path) -> list[AssignedNumber]:
    lines = read_file(path, "a register of certificates", LARGEST_BYTES).decode(errors="replace").splitlines()
    register = []
    for number, line in enumerate(lines, start=1):
        try:
            register.append(AssignedNumber.model_validate_json(line))
        except ValueError:
            raise BadInputError(
                f"{path}:{number}: expected a certificate's number, got {short(line)}; restore the file"
                " from a copy, so that no number is assigned twice"
            ) from None
    return register
