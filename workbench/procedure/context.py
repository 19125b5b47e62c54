"""What a running procedure carries from step to step."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from workbench.calibration.boards import BoardView
from workbench.calibration.observations import Rejected
from workbench.devices.protocols import Bench
from workbench.model import event as ev
from workbench.model.calibration import Calibration, Provenance
from workbench.model.captures import ALL_LASERS, BOARD
from workbench.model.errors import LaserOffNotConfirmedError, StoppedError
from workbench.model.rig import Rig
from workbench.model.target import Placement
from workbench.session.frames import FrameStore
from workbench.session.journal import Journal
from workbench.spots import Finding, Image, Scanline, find_spots

LEASE_S = 2.0
"""Longest time that a laser may stay lit for one capture: many frames, and short for an eye."""


@dataclass
class Context:
    """The bench, the session and the results so far."""

    session_dir: Path
    rig: Rig
    bench: Bench
    journal: Journal
    consumers: Sequence[ev.Consumer]
    provenance: Provenance
    stopping: Callable[[], str | None]
    """Asked between shots; a text ends the session with it."""
    captures: list[ev.CaptureTaken] = field(default_factory=list)
    findings: dict[str, Finding] = field(default_factory=dict)
    """By the capture's key."""
    boards: dict[str, BoardView | Rejected] = field(default_factory=dict)
    """By the placement's key."""
    accepted: Calibration | None = None
    """What the last fit amounts to."""
    calibration: Calibration | None = None
    """The exported one: what a trial ranges with."""

    def emit(self, event: ev.Event) -> None:
        """Journal an event, then show it to every consumer."""
        record = self.journal.append(event)
        for consumer in self.consumers:
            consumer(record)

    def place(self, placement: Placement) -> Placement:
        """Have the target placed; returns the placement as measured."""
        placed = self.bench.target.place(placement)
        self.emit(ev.TargetPlaced(placement=placed))
        return placed

    def capture(
        self,
        key: str,
        laser_ids: Sequence[str],
        placement: Placement,
        repeat: int,
        scanlines: Sequence[Scanline],
        scene: str | None = None,
    ) -> Finding:
        """Take a pair of frames with `laser_ids` lit and all off, store it, and find the spots in it.

        A capture with a scene belongs to a trial, one without to the calibration.

        Raises:
            StoppedError: a stop was asked for.
            LaserOffNotConfirmedError: a beam stays on.
        """
        self._begin(key)
        with self.bench.lasers.lit(laser_ids, for_s=LEASE_S):
            on = self.bench.camera.grab()
        off = self.bench.camera.grab()
        frames = FrameStore(self.session_dir)
        taken = ev.CaptureTaken(
            key=key,
            purpose="calibration" if scene is None else "trial",
            scene=scene,
            laser_id=laser_ids[0] if len(laser_ids) == 1 else ALL_LASERS,
            placement_key=placement.key,
            standoff_mm=placement.standoff_mm,
            standoff_sd_mm=placement.standoff_sd_mm,
            repeat=repeat,
            on=frames.save(key, "on", on.image, on.time_ns),
            off=frames.save(key, "off", off.image, off.time_ns),
        )
        self.emit(taken)
        finding = find_spots(on.image, off.image, scanlines=scanlines, expected=len(laser_ids))
        self.emit(_spots_found(key, finding, laser_ids))
        if not finding.spots:
            self._check_dark(key, off.image, scanlines)
        self.captures.append(taken)
        self.findings[key] = finding
        return finding

    def capture_room_light(self, key: str, placement: Placement, repeat: int) -> Image:
        """Take a frame of the board with no laser lit, and store it.

        Raises:
            StoppedError: a stop was asked for.
        """
        self._begin(key)
        frame = self.bench.camera.grab_ambient()
        taken = ev.CaptureTaken(
            key=key,
            purpose="calibration",
            laser_id=BOARD,
            placement_key=placement.key,
            standoff_mm=placement.standoff_mm,
            standoff_sd_mm=placement.standoff_sd_mm,
            repeat=repeat,
            on=FrameStore(self.session_dir).save(key, "on", frame.image, frame.time_ns),
        )
        self.emit(taken)
        self.captures.append(taken)
        return frame.image

    def _begin(self, key: str) -> None:
        if (reason := self.stopping()) is not None:
            raise StoppedError(reason)
        self.bench.mark(key)

    def _check_dark(self, key: str, off: Image, scanlines: Sequence[Scanline]) -> None:
        """Look for a beam that burns in both frames of a pair: it leaves no spot in their difference.

        Raises:
            LaserOffNotConfirmedError: there is a spot in it.
        """
        if stuck := find_spots(off, scanlines=scanlines).spots:
            at = f"u = {stuck[0].u_px:.0f}, v = {stuck[0].v_px:.0f} px"
            raise LaserOffNotConfirmedError(
                f"capture {key}: the frame with all lasers off shows a spot at {at}. A beam may be on"
                " although the controller says that it is off: cut the lasers' supply, keep out of the"
                " beams, then check the controller. If a lamp or its reflection stands there, cover it"
                " and start anew"
            )


def _spots_found(key: str, finding: Finding, laser_ids: Sequence[str]) -> ev.SpotsFound:
    only = laser_ids[0] if len(laser_ids) == 1 and len(finding.spots) == 1 else None
    return ev.SpotsFound(
        key=key,
        spots=tuple(
            ev.SpotRecord(
                laser_id=only,
                u_px=spot.u_px,
                v_px=spot.v_px,
                u_sd_px=spot.u_sd_px,
                v_sd_px=spot.v_sd_px,
                flux_dn=spot.flux_dn,
                width_px=spot.width_px,
                peak_dn=spot.peak_dn,
                flags=tuple(sorted(spot.flags)),
            )
            for spot in finding.spots
        ),
        failures=tuple(finding.failures),
    )
