"""Progress of a running session on the terminal."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from types import TracebackType

from rich.console import Console
from rich.padding import Padding
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn
from rich.text import Text

from workbench.cli.replay_progress import NONE_KEPT, ReplayProgress
from workbench.model import event as ev
from workbench.model.errors import StoppedError
from workbench.model.fit_tables import fit_tables
from workbench.model.number_text import counted
from workbench.model.reading_text import reading_remark
from workbench.model.spot import Spot
from workbench.procedure.capture.quality import Quality, quality_of
from workbench.procedure.engine.progress import TimeLeft
from workbench.report.rejected_lines import rejected_lines
from workbench.report.terminal_table import TerminalTable

HEAD = "head"
"""Key of the spots of a scanning head among those of lasers."""


class Terminal:
    """Consumer that shows the records of a session."""

    def __init__(
        self,
        console: Console,
        forecast: TimeLeft,
        details: bool = False,
        kept: Mapping[str, int] = NONE_KEPT,
    ) -> None:
        """Terminal without progress display.

        Args:
            console: terminal.
            forecast: estimate of the time left.
            details: whether to print the tables of a fit, its notes, and the captures that it rejects.
            kept: numbers of captures of the placements that are not captured again, by key.
        """
        self._replay = ReplayProgress(kept)
        self._console, self._forecast, self._details = console, forecast, details
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(bar_width=12),
            MofNCompleteColumn(),
            console=console,
            transient=True,
        )
        self._task: TaskID | None = None
        self._captures: dict[str, ev.CaptureTaken] = {}
        self._spots: dict[str, list[Sequence[Spot]]] = defaultdict(list)
        self._overruled: dict[str, str] = {}
        """Causes of the failed checks that a person overruled, by the key of the question."""

    def __enter__(self) -> Terminal:
        self._progress.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with suppress(OSError):  # a closed terminal
            self._progress.stop()

    @contextmanager
    def quiet(self) -> Iterator[None]:
        """Context without progress display, for prompts."""
        self._progress.stop()
        try:
            yield
        finally:
            self._progress.start()

    def __call__(self, record: ev.Record) -> None:
        """Show one record."""
        self._forecast.take(record)
        self._replay.take(record)
        match record.event:
            case ev.CalibrationLoaded() as e:
                self._console.print(Text(e.text))
            case ev.ProcedureStarted() as e:
                self._length = e.steps
                self._console.print(Text.assemble((e.title, "bold"), f" ({e.procedure}, {e.length})"))
            case ev.StepStarted() as e:
                self._overruled.clear()
                self._print(f"Step {e.index} of {self._length}: {e.title}", indent=2)
                if e.shots:
                    self._task = self._progress.add_task("     capturing", total=e.shots)
            case ev.TargetPlaced(placement=placed):
                self._placed = f"{placed.standoff_mm:g} mm"
                self._spots.clear()
            case ev.ExposureSet() as e:
                self._print(f"{self._placed}: {e.text}", style="" if e.verdict == "good" else "yellow")
            case ev.CaptureTaken() as e:
                self._captures[e.key] = e
                if self._task is not None and _counts(e):
                    self._progress.advance(self._task)
            case ev.SpotsFound() as e if e.key in self._captures:
                self._show_capture(self._captures.pop(e.key), e)
            case ev.PlacementFinished() as e if self._spots:
                kept = self._replay.keeps(e.key)
                self._print(f"{self._placement} (kept)" if kept else self._placement)
                self._print(self._replay_text() if kept else self.progress_text())
            case ev.LimitChecked() as e if e.verdict != "pass":
                value = "not measured" if e.value is None else f"{e.value:.3g}"
                self._print(f"{e.verdict}: {e.of}: {e.quantity} {value}, limit {e.limit}", style="yellow")
            case ev.SetAside() as e:
                self._overruled = {k: v for k, v in self._overruled.items() if not k.startswith(f"{e.key}/")}
                self._print(e.text, style="yellow")
            case ev.SessionResumed() as e:
                self._print(
                    f"resumed, {counted(len(e.changes), 'change')} accepted" if e.changes else "resumed", 2
                )
            case ev.SessionRepaired() as e:
                self._print(f"repair: {e.text}", 2)
            case ev.Answered(overrules=True) as e:
                self._overruled[e.key] = e.question.rpartition(". ")[0] or e.question
            case ev.StandoffAdvised() as e:
                self._print(e.text)
                for cause in self._overruled.values():
                    self._print(f"kept against a check: {cause}", style="yellow")
            case ev.StepFinished() as e:
                self._end_step(e.outcome)
            case ev.FitFinished() as e if self._details:
                for table in fit_tables(e):
                    self._console.print(TerminalTable(table))
                for line in rejected_lines(e.rejected):
                    self._print(f"rejected: {line}")
                for warning in e.warnings:
                    self._print(f"note: {warning}")
            case ev.ReadingTaken() as e if remark := reading_remark(e):
                self._print(remark, style="yellow")
            case ev.TrialFinished() as e:
                for table in e.tables:
                    if table.rows and not table.is_detail:
                        self._console.print(TerminalTable(table))
            case ev.TrialProgress() as e:
                self._print(e.text)
            case _:
                pass

    def progress_text(self) -> str:
        """Text such as `placement 7 of 48 done, about 11 min left`."""
        left = about(self._forecast.seconds_left)
        return f"placement {self._forecast.done} of {self._forecast.total} done, {left} left"

    def _replay_text(self) -> str:
        """Text such as `replayed 120 of 360 captures, about 1 min left`."""
        seconds_left = self._replay.seconds_left
        left = "" if not seconds_left else f", {about(seconds_left)} left"
        return f"replayed {self._replay.done} of {counted(self._replay.total, 'capture')}{left}"

    def _show_capture(self, capture: ev.CaptureTaken, found: ev.SpotsFound) -> None:
        """Update the live line: quality of this laser at this placement, over its repeats so far."""
        # A turned head is another beam: its spots have no common scatter.
        self._spots[capture.laser_id if capture.head_deg is None else HEAD].append(found.spots)
        self._placement = f"{capture.standoff_mm:g} mm: {_summary(self._spots)}"
        if self._task is not None and self._replay.keeps(capture.placement_key):
            self._progress.update(self._task, description=f"     {self._replay_text()}")
        elif self._task is not None:
            turned = "" if capture.head_deg is None else f" at {capture.head_deg:g} deg"
            name = f"{capture.standoff_mm:g} mm {capture.laser_id}{turned}"
            repeats = self._spots.get(capture.laser_id, [found.spots])
            seen = _live(quality_of(repeats)) if capture.laser_id != "all" else ""
            self._progress.update(self._task, description=f"     {name} {seen}")

    _placement = _placed = ""
    _length = 0

    def _end_step(self, outcome: str) -> None:
        if self._task is not None:
            self._progress.remove_task(self._task)
            self._task = None
        self._print(outcome)

    def _print(self, text: str, indent: int = 5, style: str = "") -> None:
        self._console.print(Padding(Text(text, style=style), (0, 0, 0, indent)))


class FaultTolerantConsumer:
    """Consumer whose failure does not end the session, because frames and journal are the record."""

    def __init__(self, consumer: ev.Consumer, name: str, console: Console) -> None:
        self._consumer: ev.Consumer | None = consumer
        self._name, self._console = name, console

    def __call__(self, record: ev.Record) -> None:
        """Pass the record on, unless the consumer has failed before.

        Raises:
            ConsumerFailedError: it fails now.
        """
        if self._consumer is None:
            return
        try:
            self._consumer(record)
        except StoppedError:
            raise  # a signal during the consumer's work
        except Exception as error:
            self._consumer = None
            with suppress(OSError):
                self._console.print(Text(f"warning: {self._name} failed: {error}", style="yellow"))
                self._console.print("Captures continue.")
            raise ev.ConsumerFailedError(self._name, str(error)) from error


def about(seconds: float) -> str:
    """Text of an estimated duration, rounded to its accuracy."""
    if seconds < 10:
        return "a few seconds"
    if seconds < 95:
        return f"about {10 * round(seconds / 10)} s"
    return f"about {seconds / 60:.0f} min" if seconds < 5400 else f"about {seconds / 3600:.1f} h"


def _counts(capture: ev.CaptureTaken) -> bool:
    """Whether the step announced the capture; captures of single lasers in trials are extra."""
    return capture.purpose == "calibration" or capture.laser_id == "all" or capture.head_deg is not None


def _live(quality: Quality) -> str:
    if quality.u_px is None or quality.v_px is None or quality.snr is None:
        return "no spot"
    scatter = "" if quality.scatter_px is None else f", scatter {quality.scatter_px:.3f} px"
    clipped = ", SATURATED" if quality.saturated else ""
    return f"u {quality.u_px:.1f} v {quality.v_px:.1f} snr {quality.snr:.0f}{scatter}{clipped}"


def _summary(spots: dict[str, list[Sequence[Spot]]]) -> str:
    """Summary of a placement: worst quality over the lasers, and the lasers without a spot.

    For all lasers together the number of spots.
    """
    if "all" in spots:
        each = spots["all"]
        return f"{counted(len(each), 'reading')}, at least {counted(min(map(len, each)), 'spot')}"
    if HEAD in spots:
        each = spots[HEAD]
        return f"{counted(len(each), 'capture')} of the head, {sum(map(bool, each))} with a spot"
    found = {name: quality_of(each) for name, each in spots.items()}
    snr = [q.snr for q in found.values() if q.snr is not None]
    scatter = [q.scatter_px for q in found.values() if q.scatter_px is not None]
    parts = [f"{len(snr)}/{len(found)} lasers"]
    if missing := [name for name, q in found.items() if q.snr is None]:
        parts.append(f"NOT SEEN: {', '.join(missing)}")
    if snr:
        parts.append(f"snr {min(snr):.0f}")
    if scatter:
        parts.append(f"scatter {max(scatter):.3f} px")
    if clipped := [name for name, q in found.items() if q.saturated]:
        parts.append(f"SATURATED: {', '.join(clipped)}")
    return ", ".join(parts)
