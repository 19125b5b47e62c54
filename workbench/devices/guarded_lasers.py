"""Lasers of a rig, with any driver.

A guardian process holds the device and switches the lasers off when this process no longer can
(docs/laser-controller.md).
"""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Iterator, Sequence
from typing import cast

from workbench.devices.guarded_line import GuardedLine
from workbench.devices.guardian_client import GuardianClient
from workbench.devices.protocols import LaserState
from workbench.model.device_block import DeviceBlock
from workbench.model.errors import BadInputError, LeaseEndedError

HANG_S = 0.5
"""Time without a beat after which lasers are switched off, s."""
BOOT_S = 3.0
"""Time for a controller that boots when its port is opened, such as an Arduino, s."""
LONGEST_LEASE_S = 60.0
"""Longest accepted lease, s."""


class GuardedLaserBank:
    """Lasers `ids` on the device's lines 1, 2, ...; see `protocols.LaserBank`."""

    def __init__(
        self,
        line_type: type[GuardedLine],
        settings: DeviceBlock,
        ids: Sequence[str],
        boot_s: float = BOOT_S,
        hang_s: float = HANG_S,
        virtual: bool = False,
        lines: Sequence[int] | None = None,
    ) -> None:
        """Start the guardian, which opens the device and switches every laser off.

        Args:
            line_type: class of the laser driver.
            settings: block of the rig file.
            ids: lasers in the order of the lines.
            boot_s: time in which the device must answer, s.
            hang_s: time without a beat after which lasers are switched off, s.
            virtual: whether the beams are simulated.
            lines: index of each laser's line; lasers of one line are on together. None: a line for each.

        Raises:
            BadInputError: the device has fewer outputs than there are lasers.
            RigNotReadyError: the device is missing or held by another program; or it was not identified, but
                confirmed that all lasers are off.
            LaserOffNotConfirmedError: the opened device does not confirm that all lasers are off.
        """
        self.ids = tuple(ids)
        self._lines = tuple(range(len(ids)) if lines is None else lines)
        self._guardian = GuardianClient(line_type, settings, len(set(self._lines)), boot_s, hang_s, virtual)
        self.identity = self._guardian.identity
        self._lit = False

    @contextlib.contextmanager
    def lit(self, ids: Sequence[str], for_s: float) -> Iterator[None]:
        """Hold `ids` on inside the block, for at most `for_s` seconds; see `protocols.LaserBank`."""
        mask = self._mask(ids)
        if not 0 < for_s <= LONGEST_LEASE_S:
            raise BadInputError(
                f"lease: expected more than 0 and at most {LONGEST_LEASE_S:g} s, got {for_s:g}"
            )
        began = time.monotonic()
        try:
            self._guardian.ask(f"LIT {mask} {math.ceil(for_s * 1000)}")
            self._lit = True
            yield
        finally:
            lit_s = time.monotonic() - began
            self.all_off()
        if lit_s > for_s:
            raise LeaseEndedError(
                f"the lasers: expected all frames with them on within {for_s:g} s, it took {lit_s:.1f} s, and"
                " they were switched off before; use a faster camera, or a computer that is less busy"
            )

    def beat(self) -> None:
        """Renew the lease, see `protocols.LaserBank`; without effect while all lasers are off."""
        if self._lit:
            self._guardian.send("BEAT")

    def all_off(self) -> None:
        """Switch every laser off and verify it at the device.

        Raises:
            LaserOffNotConfirmedError: the device does not confirm it.
            RigNotReadyError, StoppedError: the lasers are off, but were switched off before this call.
        """
        self._lit = False
        self._guardian.ask("OFF")

    def state(self) -> LaserState:
        """Present state of lasers and interlock.

        Raises:
            RigNotReadyError: the device does not answer.
        """
        mask, interlock_closed = cast("tuple[int, bool | None]", self._guardian.ask("STATE"))
        lit = tuple(name for bit, name in zip(self._lines, self.ids, strict=True) if mask >> bit & 1)
        return LaserState(lit, interlock_closed)

    def close(self) -> None:
        """Switch all lasers off, then release the device; raises the errors of `all_off`."""
        if not self._guardian.is_open:
            return
        try:
            self.all_off()
        finally:
            self._guardian.close()

    def _mask(self, ids: Sequence[str]) -> int:
        unknown = [name for name in ids if name not in self.ids]
        if unknown or not ids:
            got = ", ".join(ids) or "none"
            raise BadInputError(f"lasers to switch on: expected some of {', '.join(self.ids)}, got {got}")
        return sum(1 << line for line in {self._lines[self.ids.index(name)] for name in ids})
