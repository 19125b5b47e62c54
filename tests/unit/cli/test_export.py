"""`workbench export`: one file for each table, as CSV or Parquet."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from tests.support.command_line import Run, refused
from tests.support.reference_session import REFERENCE, copied
from workbench.report.table_export import session_tables


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_tables_read_back_as_they_were(workbench: Run, tmp_path: Path, ending: str) -> None:
    options = ["--parquet"] if ending == "parquet" else []
    folder = tmp_path / "tables"
    assert workbench("export", REFERENCE, "--tables", folder, *options).code == 0
    tables = session_tables(REFERENCE)
    assert {path.name for path in folder.iterdir()} == {f"{name}.{ending}" for name in tables}
    for name in ("residuals", "parameters", "reference.6-bias"):
        path = folder / f"{name}.{ending}"
        read = pd.read_csv(path) if ending == "csv" else pd.read_parquet(path)
        pd.testing.assert_frame_equal(read, tables[name], check_dtype=False, rtol=1e-15)


def test_a_folder_with_files_is_left_alone(workbench: Run, tmp_path: Path) -> None:
    session = copied(tmp_path)
    before = sorted(session.iterdir())
    refused(workbench("export", session, "--tables", session), 2, "empty folder")
    assert sorted(session.iterdir()) == before


def test_a_folder_that_cannot_be_made_is_named(workbench: Run, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    refused(workbench("export", REFERENCE, "--tables", tmp_path / "file/tables"), 2, "file/tables")
