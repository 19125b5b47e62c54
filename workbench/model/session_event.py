"""Events about a session's own records: void ones, resumptions, repairs, failed views."""

from __future__ import annotations

from typing import Literal

from workbench.model.yamlfile import FileModel


class SetAside(FileModel):
    """The records from `from_n` on are void: a placement is captured again or skipped."""

    kind: Literal["set_aside"] = "set_aside"
    key: str
    """Key of the placement."""
    from_n: int
    reason: str
    retry: bool = False
    """Whether a failed limit with `on_fail: retry` is the cause; the number of such retries is limited."""
    left_out: bool = False
    """Whether the placement is skipped instead of captured again."""

    @property
    def text(self) -> str:
        """Summary in one line."""
        return f"{self.key} is {'skipped' if self.left_out else 'captured again'}: {self.reason}"


class SessionResumed(FileModel):
    """A session that ended early is resumed; its records from `from_n` on are void."""

    kind: Literal["session_resumed"] = "session_resumed"
    from_n: int
    operator: str
    command: str
    created: str
    changes: tuple[str, ...] = ()
    """Differences from the session's start: rig file, procedure files, versions."""
    accepted_because: str | None = None


class SessionRepaired(FileModel):
    """Decisions about placements of a session that has ended; its procedures then run again.

    The later of two decisions about a placement counts. Placements are named by their keys.
    """

    kind: Literal["session_repaired"] = "session_repaired"
    operator: str
    command: str
    created: str
    reason: str
    recapture: tuple[str, ...] = ()
    """To be captured again; the captures so far do not count."""
    leave_out: tuple[str, ...] = ()
    """To be ignored; the captures stay on disk."""
    restore: tuple[str, ...] = ()
    """To be used again; captured if they were skipped; if captured again, the captures before count."""
    add_mm: tuple[float, ...] = ()
    """Standoffs of additional placements in the last grid before the fit."""
    accept: bool = False
    """Whether a calibration that fails its limits is accepted."""

    @property
    def text(self) -> str:
        """Summary in one line."""
        parts = [
            f"{what} {', '.join(keys)}"
            for what, keys in (
                ("capture again", self.recapture),
                ("leave out", self.leave_out),
                ("restore", self.restore),
                ("add", tuple(f"{standoff:g} mm" for standoff in self.add_mm)),
                ("accept the calibration", ("although it fails its limits",) * self.accept),
            )
            if keys
        ]
        return f"{'; '.join(parts)}: {self.reason}"


class Incident(FileModel):
    """A view of the session has failed. Captures continue, because frames and journal are the record."""

    kind: Literal["incident"] = "incident"
    of: str
    """The view: the recording, the figures, the progress on the terminal."""
    message: str
    """Cause in one line."""
