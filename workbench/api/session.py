"""Recorded sessions, read-only: captures, spots, residuals, readings, trials, frames."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import pandas as pd

from workbench.api.arguments import millimetres_of, path_of, whole_of, words_of
from workbench.api.calibration import Calibration, load_calibration
from workbench.model.arrays import Image
from workbench.model.chart import Chart
from workbench.model.errors import BadInputError
from workbench.model.event import CaptureTaken, Record, TrialFinished
from workbench.model.rig import Rig
from workbench.report.certificate.session_record import recorded_calibration
from workbench.report.frames import SESSION_COLUMNS, frame_of, frame_of_table
from workbench.report.session_frames import (
    captures_frame,
    cross_validation_frame,
    readings_frame,
    residuals_frame,
    spots_frame,
)
from workbench.session.capture_table import first_time_ns, part_name, seconds_after
from workbench.session.frames import read_image
from workbench.session.journal import read_journal
from workbench.session.manifest import load_manifest, load_session_rig
from workbench.session.state import effective, session_statuses

if TYPE_CHECKING:
    from workbench.api.report import Report


@dataclass(frozen=True)
class Trial:
    """Results of one trial of a session."""

    name: str
    """Name of the procedure and number of the step: `accuracy-flat.1`."""
    tables: Mapping[str, pd.DataFrame]
    """By the name of the table; values are unscaled."""
    charts: tuple[Chart, ...]

    @property
    def table(self) -> pd.DataFrame:
        """The table with the trial's name, else the first one.

        Raises:
            BadInputError: the trial has no table.
        """
        if not self.tables:
            raise BadInputError(f"trial {self.name}: expected a table, it has none")
        return self.tables.get(self.name, next(iter(self.tables.values())))


@dataclass(frozen=True)
class Session:
    """A session folder; see `open_session`.

    Examples:
        >>> import workbench as wb
        >>> session = wb.open_session("data/session-0.1.0")
        >>> session.captures.groupby("laser_id").size().to_dict()
        {'L1': 3, 'L4': 3, 'all': 1}
        >>> session.spots.loc[0, ["u_px", "v_px"]].round(1).tolist()
        [262.6, 249.6]
    """

    folder: Path

    @cached_property
    def rig(self) -> Rig:
        """The rig file with which the session began."""
        return load_session_rig(self.folder)

    @cached_property
    def captures(self) -> pd.DataFrame:
        """One row per capture, in order of time; `on` and `off` are the paths of its frames."""
        return captures_frame(self.folder, self._events)

    @cached_property
    def spots(self) -> pd.DataFrame:
        """One row per spot; pixels, digital numbers (DN), 1 sigma.

        The origin is the centre of the top-left pixel. `laser_id` is that of the capture. It is empty
        where several lasers were on and the spot is not assigned. `flags` are names separated by spaces.
        """
        return spots_frame(self._events)

    @cached_property
    def residuals(self) -> pd.DataFrame:
        """Residuals of the last fit, observed - predicted: one row per laser and placement, px, 1 sigma."""
        return residuals_frame(self._events)

    @cached_property
    def cross_validation(self) -> pd.DataFrame:
        """Placements of the last fit, each ranged by the fit without it; mm, 1 sigma as it predicts it."""
        return cross_validation_frame(self._events)

    @cached_property
    def readings(self) -> pd.DataFrame:
        """Readings of all trials; mm, 1 sigma, error = measured - true."""
        return readings_frame(self._events)

    @cached_property
    def trials(self) -> Mapping[str, Trial]:
        """Results of finished trials by their name."""
        return {
            event.trial: Trial(
                event.trial, {table.name: frame_of_table(table) for table in event.tables}, event.charts
            )
            for event in self._events
            if isinstance(event, TrialFinished)
        }

    @cached_property
    def calibration(self) -> Calibration:
        """The calibration that the session exported last, or the existing one that it used.

        Raises:
            BadInputError: the session has none, or its file is damaged or has changed since.
        """
        path = recorded_calibration(self.folder, self._events)
        if path is None:
            raise BadInputError(f"{self.folder}: expected a calibration, the session has none")
        return load_calibration(path)

    def captures_for_fit(self, without: float | Collection[float] = ()) -> pd.DataFrame:
        """Captures of the calibration, as columns of a captures file, for `fit`.

        Args:
            without: standoff to leave out, or several, mm.

        Raises:
            BadInputError: a standoff in `without` has no capture, or is no number.
        """
        excluded = millimetres_of("without", without)
        captures = self.captures[self.captures["purpose"] == "calibration"]
        if unknown := set(excluded) - set(captures["standoff_mm"]):
            raise BadInputError(f"without: no capture has the standoff {min(unknown):g} mm")
        kept = captures[~captures["standoff_mm"].isin(excluded)]
        scene = kept["scene"].where(kept["scene"] != "", kept["placement"])
        taken = [self._captures[key] for key in kept["capture"]]
        zero_ns = first_time_ns(taken)
        times_s = [seconds_after(zero_ns, capture) for capture in taken]
        parts = [part_name(capture) for capture in taken]
        columns = ["laser_id", "standoff_mm", "repeat", "on", "off", "scene", "standoff_sd_mm"]
        found = kept.assign(scene=scene, time_s=times_s, part=parts)
        return found[[*columns, "time_s", "part"]].reset_index(drop=True)

    def frame(self, capture: str, off: bool = False) -> Image:
        """A frame, (height, width), uint8 or uint16: lasers on, or all off.

        Args:
            capture: key of the capture, as in the column `capture`.
            off: whether to return the frame with all lasers off.

        Raises:
            BadInputError: the session has no such capture or frame, or the file is damaged.
        """
        event = self._captures.get(words_of("capture", capture, "the key of a capture"))
        reference = None if event is None else event.off if off else event.on
        if reference is None:
            raise BadInputError(f"{self.folder}: expected a capture of the session, got {capture!r}")
        return read_image(self.folder / reference.path)

    def crop(self, spot: pd.Series, half_px: int = 12) -> Image:
        """The part of the frame around a spot, lasers on.

        Args:
            spot: a row of `spots`.
            half_px: half width and half height of the part; it ends at the border of the image.

        Returns:
            (height, width), at most 2 half_px + 1 each; uint8 or uint16.

        Raises:
            BadInputError: this is no row of `spots`, or `half_px` no number of pixels.
        """
        half = whole_of("half_px", half_px, least=0)
        try:
            image = self.frame(spot["capture"])
            u, v = round(float(spot["u_px"])), round(float(spot["v_px"]))
        except (LookupError, TypeError, ValueError, OverflowError):
            raise BadInputError(
                "spot: expected a row of Session.spots, such as session.spots.iloc[0]"
            ) from None
        return image[max(v - half, 0) : v + half + 1, max(u - half, 0) : u + half + 1]

    def viewer(self, height_px: int = 700) -> object:
        """The session in the Rerun viewer, as a widget for the last line of a notebook's cell.

        The recording is made again from the frames, which takes some seconds.

        Raises:
            BadInputError: the extra `notebooks` is not installed, or a frame is missing or has changed.
        """
        from workbench.viewer.notebook import notebook_viewer  # loads Rerun

        height = whole_of("height_px", height_px)
        return notebook_viewer(self.folder, self.rig, self._records, height)

    def report(self) -> Report:
        """Certificate of the session, as `workbench report` writes it; see `Report.save`.

        Nothing is written. The laboratory is that of `lab.yaml` beside the session; its missing items read
        "not stated".

        Raises:
            BadInputError: a file of the session or `lab.yaml` is damaged, or the calibration or a frame has
                changed since.
        """
        from workbench.api.report import report_of  # loads matplotlib

        return report_of(self.folder)

    @cached_property
    def _records(self) -> list[Record]:
        """Records that are in effect, in order."""
        return list(effective(read_journal(self.folder)))

    @cached_property
    def _events(self) -> list[object]:
        """Their events."""
        return [record.event for record in self._records]

    @cached_property
    def _captures(self) -> dict[str, CaptureTaken]:
        """By key."""
        return {event.key: event for event in self._events if isinstance(event, CaptureTaken)}


def open_session(folder: str | Path) -> Session:
    """Open a session folder for reading; nothing in it changes.

    Raises:
        BadInputError: this is no session folder, or its manifest is damaged.
    """
    path = path_of("folder", folder, "the path of a session folder")
    load_manifest(path)
    return Session(path)


def sessions(folder: str | Path = "sessions") -> pd.DataFrame:
    """The sessions in a folder, by time: one row each, with state and number of captures.

    Raises:
        BadInputError: the folder does not exist.
    """
    rows = (
        {
            "session": status.session_dir.name,
            "folder": str(status.session_dir),
            "state": status.state,
            "procedures": " ".join(status.procedures),
            "captures": status.captures,
            "reason": status.why,
        }
        for status in session_statuses(path_of("folder", folder, "the path of a folder of sessions"))
    )
    return frame_of(rows, SESSION_COLUMNS)
