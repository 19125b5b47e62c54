"""One laser without a device: a flag that a test's own scene reads."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from workbench.devices.protocols import LaserState


class FakeLasers:
    """Laser bank of one laser, on inside `lit`."""

    ids: tuple[str, ...] = ("L1",)
    identity = "fake"
    is_lit = False

    @contextmanager
    def lit(self, ids: Sequence[str], for_s: float) -> Iterator[None]:
        self.is_lit = bool(ids)
        yield
        self.is_lit = False

    def all_off(self) -> None:
        self.is_lit = False

    def beat(self) -> None:
        pass

    def state(self) -> LaserState:
        return LaserState((), None)

    def close(self) -> None:
        pass
