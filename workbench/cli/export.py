"""`workbench export`: a session as tidy tables for other programs."""

from __future__ import annotations

from pathlib import Path

from workbench.cli.console import print_message
from workbench.cli.sessions import find_session
from workbench.model.errors import BadInputError
from workbench.report.table_export import session_tables


def export_tables(name: Path, sessions: Path, folder: Path, parquet: bool) -> None:
    """Write the tables of a session, one file each, and `dictionary`.

    Raises:
        BadInputError: there is no such session, it is damaged, or the folder is not empty or not writable.
    """
    session = find_session(name, sessions)
    tables = session_tables(session)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()):
            raise BadInputError(f"{folder}: expected a new or empty folder, found files; nothing was written")
        for table, frame in tables.items():
            if parquet:
                frame.to_parquet(folder / f"{table}.parquet", index=False)
            else:
                frame.to_csv(folder / f"{table}.csv", index=False, lineterminator="\n")
    except OSError as error:
        raise BadInputError(f"{folder}: cannot be written: {error.strerror or error}") from None
    rows = ", ".join(f"{table} {len(frame)}" for table, frame in tables.items())
    print_message(f"{folder}: tables with their numbers of rows: {rows}")
