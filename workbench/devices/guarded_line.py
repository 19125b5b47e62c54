"""Protocol of a laser driver: outputs that only the guardian process holds.

A laser driver is a class with the members of `GuardedLine`, named by an entry point in the group
`workbench.lasers`. The workbench reads its `settings_type` and `has_leases`; an instance exists only in the
guardian, which imports the class by module and name. The driver's module must therefore be importable by
both, import little (the guardian starts with it), and have no effects on import. Import a vendor's package in
the constructor.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any, ClassVar, Protocol

from workbench.model.errors import LaserOffNotConfirmedError, RigNotReadyError, WorkbenchError

TRY_BOARD_S = 60.0
"""Time for which a guardian without its workbench tries to switch off hardware that has no leases, s."""


class GuardedLine(Protocol):
    """Outputs that switch lasers: bit n of a mask is laser n + 1 of the rig file.

    Every call must return within about a second. Exceptions other than the workbench's, including
    `SystemExit`, become a `RigNotReadyError`, in `all_off` a `LaserOffNotConfirmedError`.
    """

    settings_type: ClassVar[Any]
    """Block `devices: lasers:` of the rig file, a `DeviceBlock`. The context of its validators is the `Rig`
    in the workbench, and None in the guardian."""
    has_leases: ClassVar[bool]
    """Whether the hardware switches off by itself when a lease ends. If not, only the guardian's clock ends
    an emission, and an unconfirmed off is tried again for `TRY_BOARD_S`."""

    def __init__(self, settings: Any, lasers: int, alarm: Callable[[], bool]) -> None:
        """Open the device exclusively, without switching anything on.

        Args:
            settings: validated block, an instance of `settings_type`.
            lasers: number of lasers of the rig.
            alarm: whether the lasers must be switched off at once. If `light` waits longer than about 20 ms,
                it must call this meanwhile; on true it must switch off and raise an error.

        Raises:
            BadInputError: the settings do not fit the device, for example fewer outputs than lasers.
            RigNotReadyError: the device is missing or held by another program.
        """

    def identify(self, boot_s: float) -> str:
        """Name of the device, which has `boot_s` to boot after it was opened.

        The guardian calls this first, then `all_off`, even after a failure. A device that may have been left
        on must be switched off here or in the constructor, before other requests.

        Raises:
            RigNotReadyError: there is no valid answer.
        """

    def light(self, mask: int, lease_ms: int) -> None:
        """Switch the lasers of `mask` on and the others off, for a lease.

        Hardware with leases switches off `lease_ms` after the last call.

        Raises:
            RigNotReadyError: the request is refused (open interlock) or not answered.
        """

    def all_off(self) -> None:
        """Switch every laser off and verify it at the device.

        Raises:
            LaserOffNotConfirmedError: the device does not confirm it.
        """

    def state(self) -> tuple[int, bool | None]:
        """Mask of the lasers that are on, and whether the interlock is closed (None: unknown).

        Raises:
            RigNotReadyError: the device does not answer.
        """


class CheckedLine:
    """Laser driver with failures as errors of the workbench: a defect must not end the guardian."""

    def __init__(self, line: GuardedLine) -> None:
        self._line = line
        self.has_leases = line.has_leases

    def identify(self, boot_s: float) -> str:
        """See `GuardedLine`."""
        with driver_errors():
            return str(self._line.identify(boot_s))

    def light(self, mask: int, lease_ms: int) -> None:
        """See `GuardedLine`.

        Raises:
            RigNotReadyError: the driver failed in any way.
        """
        with driver_errors(only=RigNotReadyError):
            self._line.light(mask, lease_ms)

    def all_off(self) -> None:
        """See `GuardedLine`.

        Raises:
            LaserOffNotConfirmedError: the driver failed in any way.
        """
        with driver_errors(only=LaserOffNotConfirmedError, raised=LaserOffNotConfirmedError):
            self._line.all_off()

    def state(self) -> tuple[int, bool | None]:
        """See `GuardedLine`.

        Raises:
            RigNotReadyError: the driver failed in any way.
        """
        with driver_errors(only=RigNotReadyError):
            mask, interlock_closed = self._line.state()
            return int(mask), None if interlock_closed is None else bool(interlock_closed)


def line_reference(line_type: type[GuardedLine]) -> str:
    """`module:name` of a laser driver, from which the guardian imports it."""
    return f"{line_type.__module__}:{line_type.__qualname__}"


def open_line(
    reference: str, settings_json: str, lasers: int, alarm: Callable[[], bool], ready: Callable[[], None]
) -> CheckedLine:
    """Import a laser driver and open its device.

    Args:
        reference: reference to the driver, see `line_reference`.
        settings_json: block of the rig file.
        lasers: number of lasers.
        alarm: see `GuardedLine`.
        ready: called after the import and before opening the device.

    Raises:
        WorkbenchError: see `GuardedLine`.
    """
    with driver_errors():
        module, _, name = reference.partition(":")
        line_type: Any = import_module(module)
        for part in name.split("."):
            line_type = getattr(line_type, part)
        settings = line_type.settings_type.model_validate_json(settings_json)
        ready()
        return CheckedLine(line_type(settings, lasers, alarm))


@contextmanager
def driver_errors(
    only: type[WorkbenchError] = WorkbenchError, raised: type[WorkbenchError] = RigNotReadyError
) -> Iterator[None]:
    """Pass errors of the type `only`; replace every other exception by one of the type `raised`."""
    try:
        yield
    except only:
        raise
    except BaseException as error:  # including SystemExit, which would end the guardian with a laser on
        raise raised(
            f"laser driver: {_error_text(error)}; check the device, its settings, and the driver"
        ) from None


def _error_text(error: BaseException) -> str:
    """Message of an exception, with the type of one that is not the workbench's."""
    try:
        return str(error) if isinstance(error, WorkbenchError) else f"{type(error).__name__}: {error}"
    except Exception:  # an exception of another package whose text cannot be formatted
        return type(error).__name__
