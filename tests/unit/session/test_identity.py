"""Identity of a session: that of its copies, links and repairs; another for any other session."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.reference_session import copied, repeated
from workbench.session.identity import session_identity
from workbench.session.journal import JOURNAL
from workbench.session.manifest import MANIFEST


def test_copies_links_and_longer_journals_share_it(tmp_path: Path) -> None:
    a, b = copied(tmp_path, "a"), copied(tmp_path, "b")
    (tmp_path / "c").symlink_to("a")
    lines = (b / JOURNAL).read_text().splitlines(keepends=True)
    (b / JOURNAL).write_text("".join(lines[:5]))
    assert session_identity(a) == session_identity(b) == session_identity(tmp_path / "c") != ""


def test_another_time_or_another_sensor_is_another_session(tmp_path: Path) -> None:
    a, later, other = copied(tmp_path, "a"), repeated(tmp_path, "b", days=1), copied(tmp_path, "c")
    text = (other / MANIFEST).read_text()
    (other / MANIFEST).write_text(text.replace("serial: reference-1", "serial: reference-2"))
    assert len({session_identity(one) for one in (a, later, other)}) == 3


@pytest.mark.parametrize(("file", "content"), [(JOURNAL, ""), (JOURNAL, "{torn"), (MANIFEST, "bad: [")])
def test_without_its_files_a_session_has_none(tmp_path: Path, file: str, content: str) -> None:
    session = copied(tmp_path)
    (session / file).write_text(content)
    assert session_identity(session) == ""
    (session / JOURNAL).unlink()
    assert session_identity(session) == ""
