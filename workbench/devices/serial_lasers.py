"""Lasers behind a serial line: the driver of any controller that speaks docs/laser-controller.md.

Or, with the driver `nidaqmx`, on a digital output board. It never touches port or board. A guardian process
does, and puts the lasers off when this one no longer can.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import cast

from workbench.devices.guardian_client import GuardianClient
from workbench.model.errors import BadInputError
from workbench.model.rig import LaserDriver

HANG_S = 0.5
"""After this time without a beat whatever is lit goes off."""
LONGEST_LEASE_S = 60.0


@dataclass(frozen=True)
class LaserState:
    """What the controller tells of its outputs and its interlock."""

    lit: tuple[str, ...]
    interlock_closed: bool | None
    """None where the driver knows nothing of one."""


class SerialLaserBank:
    """The lasers `ids`, in the order of the controller's lines 1, 2, ...; see `protocols.LaserBank`."""

    def __init__(
        self,
        port: str,
        ids: Sequence[str],
        baud: int = 115_200,
        boot_s: float = 3.0,
        hang_s: float = HANG_S,
        driver: LaserDriver = "serial",
        virtual: bool = False,
    ) -> None:
        """Open the port and put every laser off.

        A controller that starts anew when its port is opened (an Arduino does) has `boot_s` to answer.
        Nobody stands in the beams of `virtual` lasers.

        Raises:
            BadInputError: a board's port names fewer lines than lasers.
            RigNotReadyError: no such port, another program holds it, or nobody answers as expected.
            LaserOffNotConfirmedError: the controller answers, but not that all are off.
        """
        self.ids = tuple(ids)
        self._guardian = GuardianClient(driver, port, baud, len(ids), boot_s, hang_s, virtual)
        self.identity = self._guardian.identity
        self._lit = False

    @contextlib.contextmanager
    def lit(self, ids: Sequence[str], for_s: float) -> Iterator[None]:
        """Hold `ids` lit inside the block, `for_s` seconds at the most; see `protocols.LaserBank`."""
        mask = self._mask(ids)
        if not 0 < for_s <= LONGEST_LEASE_S:
            raise BadInputError(
                f"a lease: expected more than 0 and at most {LONGEST_LEASE_S:g} s, got {for_s:g}"
            )
        try:
            self._guardian.ask(f"LIT {mask} {math.ceil(for_s * 1000)}")
            self._lit = True
            yield
        finally:
            self.all_off()

    def beat(self) -> None:
        """Tell that the work goes on; to be called by the thread that does it. Nothing while all are off."""
        if self._lit:
            self._guardian.tell("BEAT")

    def all_off(self) -> None:
        """Put every laser off and ask the controller whether it did; tried twice.

        Raises:
            LaserOffNotConfirmedError: it did not say so.
            RigNotReadyError, StoppedError: they are off, but went off before this was called.
        """
        self._lit = False
        self._guardian.ask("OFF")

    def state(self) -> LaserState:
        """What is lit at this moment.

        Raises:
            RigNotReadyError: the controller does not answer.
        """
        mask, interlock_closed = cast("tuple[int, bool | None]", self._guardian.ask("STATE"))
        lit = tuple(name for bit, name in enumerate(self.ids) if mask >> bit & 1)
        return LaserState(lit, interlock_closed)

    def close(self) -> None:
        """All off, then release the port; the errors of `all_off`."""
        if not self._guardian.is_open:
            return
        try:
            self.all_off()
        finally:
            self._guardian.close()

    def _mask(self, ids: Sequence[str]) -> int:
        unknown = [name for name in ids if name not in self.ids]
        if unknown or not ids:
            raise BadInputError(f"lasers to light: expected some of {', '.join(self.ids)}, got {list(ids)}")
        return sum(1 << self.ids.index(name) for name in set(ids))
