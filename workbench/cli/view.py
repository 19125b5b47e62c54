"""`workbench view`: a session, two of them, a captures file, a calibration or a recording in the viewer."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from workbench.cli.console import print_message
from workbench.cli.sessions import find_session
from workbench.model.contents import read_file
from workbench.model.csvfile import LARGEST_BYTES
from workbench.model.errors import BadInputError
from workbench.model.file_kind import CALIBRATION, kind_of_content
from workbench.session.journal import is_running, read_journal
from workbench.session.manifest import load_session_rig
from workbench.session.state import effective
from workbench.viewer.window import has_display, is_complete, open_viewer, serve

if TYPE_CHECKING:  # loads Rerun
    from workbench.viewer.comparison import Source

RECORDING_FILE = "recording.rrd"
MADE_FROM_FILES = {".rrd", ".yaml", ".yml", ".csv"}
"""Endings of files that are shown; anything else is a session."""
VIEWABLE = "a session, a captures file (.csv, with --rig), a calibration (.yaml) or a recording (.rrd)"
"""Kinds that can be shown, for messages."""
MOST_SIDES = 2
"""Number of sessions that fit side by side on a screen."""


@dataclass(frozen=True)
class Request:
    """Arguments of the command."""

    what: tuple[Path, ...]
    """One or two: names or folders of sessions, captures files; or one calibration or recording."""
    sessions: Path
    """Folder of sessions."""
    rig: Path | None
    """Rig file of captures files."""
    without_mm: tuple[float, ...] = ()
    """Standoffs to exclude from a refit that is shown beside the session."""
    rebuild: bool = False
    web: bool = False


def view(request: Request) -> int:
    """Show what is asked for until the window is closed; returns the viewer's exit code.

    Raises:
        BadInputError: see `recording_of`.
    """
    with tempfile.TemporaryDirectory() as folder:
        recording = recording_of(request, Path(folder))
        if request.web:
            return serve(recording, lambda page: print_message(f"{page}\nserved until Ctrl-C"))
        if not has_display() and request.rebuild:
            print_message(f"{recording} is made again; no display to show it")
            return 0
        if not has_display() and recording.parent == Path(folder):
            raise BadInputError(
                f"{request.what[0]} can be viewed, but there is no display to show it; use --web"
            )
        return open_viewer(recording)


def recording_of(request: Request, folder: Path) -> Path:
    """The recording to show: that of a session, or one made in `folder`.

    Raises:
        BadInputError: there is nothing of that name, an option does not fit to it, or a frame is damaged.
    """
    if len(request.what) > MOST_SIDES:
        raise BadInputError(f"expected one or two sessions or captures files, got {len(request.what)}")
    first = request.what[0]
    if request.rebuild:
        _check_rebuild(request)
    if len(request.what) == 1 and not request.without_mm:
        if first.suffix == ".rrd":
            return first
        if first.suffix in {".yaml", ".yml"}:
            return _of_calibration(first, folder)
        if first.suffix == ".csv":
            return _of_captures(first, request, folder)
        if first.is_file():
            _refuse_kind(first, ())
        return _of_session(find_session(first, request.sessions), folder, rebuild=request.rebuild)
    return _side_by_side(request, folder)


def _check_rebuild(request: Request) -> None:
    first = request.what[0]
    if len(request.what) > 1 or request.without_mm or first.suffix in MADE_FROM_FILES:
        raise BadInputError(
            "--rebuild: expected one session, whose recording is made again from its frames and journal;"
            " a recording of anything else is made each time, or has no frames beside it"
        )


def _of_session(session: Path, folder: Path, *, rebuild: bool) -> Path:
    """The session's recording; made again where it is missing, incomplete, or asked for.

    That of a running session is made in `folder`: the session itself is still writing its own.
    """
    recording = (folder if is_running(session) else session) / RECORDING_FILE
    for path in sorted(session.glob("calibration*.yaml")):
        _note_if_edited(path)
    if rebuild or not is_complete(recording):
        from workbench.viewer.recording import rebuild as made_again

        made_again(session, load_session_rig(session), effective(read_journal(session)), recording)
    return recording


def _of_captures(captures: Path, request: Request, folder: Path) -> Path:
    from workbench.cli.fit import Request as FitRequest
    from workbench.cli.fit import fit_source, record_fit

    out = folder / RECORDING_FILE
    record_fit(fit_source(FitRequest(captures, request.rig, Path(), None, ())), captures.stem, out)
    return out


def _of_calibration(path: Path, folder: Path) -> Path:
    from workbench.model.calibration import load_calibration
    from workbench.viewer.calibration_view import record_calibration

    _refuse_kind(path, (CALIBRATION,))
    _note_if_edited(path)
    return record_calibration(load_calibration(path), path.stem, folder / RECORDING_FILE)


def _refuse_kind(path: Path, accepted: Sequence[str]) -> None:
    """Refuse a file of a kind that cannot be shown; one of no known kind is left to its reader.

    Raises:
        BadInputError: it is refused.
    """
    kind = kind_of_content(read_file(path, VIEWABLE, LARGEST_BYTES))
    if kind is not None and kind not in accepted:
        raise BadInputError(f"{path}: expected {VIEWABLE}, got {kind}")


def _note_if_edited(calibration: Path) -> None:
    """Print one line if the file of a session has changed since; what is shown then is not the record."""
    from workbench.report.certificate.session_record import check_recorded

    try:
        check_recorded(calibration)
    except BadInputError as error:
        print_message(f"note: {error}")


def _side_by_side(request: Request, folder: Path) -> Path:
    from workbench.viewer.comparison import Source, compare

    sources = []
    for path in request.what:
        if path.suffix == ".csv":
            sources.append(_refit(path, request.rig, (), path.stem))
            continue
        session = find_session(path, request.sessions)
        records = effective(read_journal(session))
        sources.append(Source(session.name, session, load_session_rig(session), records))
    if request.without_mm:
        if len(sources) != 1:
            raise BadInputError(
                "--without-standoff shows a refit beside one session or captures file, got two"
            )
        left_out = ", ".join(f"{s:g}" for s in request.without_mm)
        sources.append(
            _refit(_captures_of(request), request.rig, request.without_mm, f"without {left_out} mm")
        )
    out = folder / RECORDING_FILE
    compare(sources, out)
    return out


def _captures_of(request: Request) -> Path:
    """The captures file, or the session's folder, of the first argument."""
    first = request.what[0]
    return first if first.suffix == ".csv" else find_session(first, request.sessions)


def _refit(path: Path, rig_path: Path | None, without_mm: Sequence[float], name: str) -> Source:
    """Fit of a captures file, or of a session's captures, with its records."""
    from workbench.calibration.verdict.records import fit_finished
    from workbench.cli.fit import Request as FitRequest
    from workbench.cli.fit import fit_source
    from workbench.viewer.comparison import Source
    from workbench.viewer.fit_records import fit_records

    found = fit_source(FitRequest(path, rig_path, Path(), None, tuple(without_mm)))
    finished = fit_finished(found.fitted, found.assessment)
    records = fit_records(name, found.rows, found.fitted, finished)
    return Source(name, Path(), found.fitted.rig, list(records))
