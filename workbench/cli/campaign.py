"""`workbench campaign`."""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer
from rich.console import Console

from workbench.campaign.campaign_file import load_campaign
from workbench.campaign.cluster import local_client, remote_client
from workbench.campaign.folder import CampaignFolder, open_folder
from workbench.campaign.kind import Chunk, Summary
from workbench.campaign.results import page_path, summarise, write_results
from workbench.campaign.run import run_chunks
from workbench.cli.console import print_message
from workbench.cli.invocation import command_line
from workbench.model.errors import BadInputError, StoppedError
from workbench.model.number_text import counted, duration
from workbench.report.terminal_table import TerminalTable
from workbench.viewer.recording import RECORDING_FILE
from workbench.viewer.results_view import record_results

if TYPE_CHECKING:
    from distributed import Client

QUIET_S = 30.0
"""Time between lines of progress where standard error is no terminal."""


@dataclass(frozen=True)
class CampaignRequest:
    """Arguments of the command."""

    file: Path
    output: Path
    workers: int | None
    """Number of worker processes; None: one for each core."""
    scheduler: str | None
    """Address of a scheduler that runs already; None: worker processes of this computer."""

    def client(self) -> AbstractContextManager[Client]:
        """Connection to the scheduler."""
        if self.scheduler is not None:
            return remote_client(self.scheduler)
        return local_client(self.workers or len(os.sched_getaffinity(0)))


def run_campaign(request: CampaignRequest, as_json: bool) -> None:
    """Compute the chunks that are missing, and print and write the results.

    Raises:
        BadInputError: a file or an option is wrong, or the folder has results of another campaign.
        StoppedError: the command was stopped; finished chunks are kept.
    """
    campaign = load_campaign(request.file)
    with open_folder(request.output, campaign) as folder:
        missing = folder.missing()
        if missing:
            with _resumable(), request.client() as client:
                progress = Progress(folder, missing)
                progress.show(len(client.nthreads()))
                run_chunks(client, folder, missing, progress.add)
                progress.end()
        summary = summarise(folder)
        write_results(folder, summary)
        _record(folder, summary)
        if as_json:
            print(json.dumps({table.name: table.records() for table in summary.tables}))
        _print(folder, summary)


@contextmanager
def _resumable() -> Iterator[None]:
    """Add the command that continues to the error of a stop."""
    try:
        yield
    except StoppedError as error:
        error.add_note(f"resume:  {command_line()}")
        raise


class Progress:
    """Progress on standard error: items done, their rate, time left."""

    def __init__(
        self,
        folder: CampaignFolder,
        missing: list[Chunk],
        clock_s: Callable[[], float] = time.monotonic,
    ) -> None:
        """Progress before the first chunk.

        Args:
            folder: folder of the campaign.
            missing: chunks to compute.
            clock_s: monotonic time, s.
        """
        work = folder.campaign.file.work
        self._thing, self._total = work.thing, work.count(folder.campaign.inputs)
        self._to_do = sum(len(chunk.items) for chunk in missing)
        self._done = 0
        self._clock_s = clock_s
        self._began_s = self._shown_s = clock_s()

    def show(self, workers: int) -> None:
        """Print what there is to do."""
        kept = self._total - self._to_do
        before = f", {kept} done before" if kept else ""
        print_message(
            f"{counted(self._total, self._thing)}{before}; {counted(workers, 'worker')}. Ctrl-C stops;"
            " finished chunks are kept"
        )

    def add(self, chunk: Chunk) -> None:
        """Count a finished chunk."""
        self._done += len(chunk.items)
        now_s = self._clock_s()
        if sys.stderr.isatty():
            typer.echo(f"\r{self.text()}\x1b[K", err=True, nl=False)
        elif now_s - self._shown_s >= QUIET_S:
            self._shown_s = now_s
            print_message(self.text())

    def text(self) -> str:
        """Progress in one line."""
        elapsed_s = max(self._clock_s() - self._began_s, 1e-9)
        rate = self._done / elapsed_s
        left = duration((self._to_do - self._done) / rate) if rate else "unknown time"
        done = self._total - self._to_do + self._done
        return (
            f"{done} of {self._total} ({100 * done / self._total:.0f} %), {rate:.3g} per second, {left} left"
        )

    def end(self) -> None:
        """End the line of progress."""
        if sys.stderr.isatty():
            typer.echo(err=True)


def _record(folder: CampaignFolder, summary: Summary) -> None:
    """Write the recording of the results.

    Raises:
        BadInputError: the file cannot be written.
    """
    path, text = folder.path / RECORDING_FILE, "\n".join((summary.headline, *summary.notes))
    name = folder.identity.campaign
    try:
        record_results(path, name, text, summary.tables, summary.charts, summary.colors)
    except OSError as error:
        raise BadInputError(f"{path}: cannot be written: {error.strerror or error}") from None


def _print(folder: CampaignFolder, summary: Summary) -> None:
    console = Console(stderr=True, markup=False)
    for table in summary.tables:
        if not table.is_detail:
            console.print(TerminalTable(table))
    print_message(f"\n{summary.headline}")
    for note in summary.notes:
        print_message(f"note: {note}")
    print_message(f"report:  {page_path(folder)}")
    print_message(f"view:    workbench view {folder.path / RECORDING_FILE}")
