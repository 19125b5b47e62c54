"""What a laser driver is: a line of outputs, held by the guardian process alone.

A laser driver is one class with the members of `GuardedLine`, named by an entry point in the group
`workbench.lasers`. The workbench reads its `settings_type` and `has_leases`; an instance exists only in the
guardian, which imports the class by its module and name. So the driver's module must be importable by both,
light (the guardian starts with it), and free of effects when it is imported; a vendor's package is imported
in the constructor.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any, ClassVar, Protocol

from workbench.model.errors import LaserOffNotConfirmedError, RigNotReadyError, WorkbenchError

TRY_BOARD_S = 60.0
"""Time for which a guardian without its workbench tries to put off lasers that no lease of the hardware
ends, s."""


class GuardedLine(Protocol):
    """Outputs that switch lasers: bit n of a mask is laser n + 1 of the rig file.

    Every call returns within about a second. An error that is none of the workbench's, `SystemExit` included,
    becomes a `RigNotReadyError`, from `all_off` a `LaserOffNotConfirmedError`.
    """

    settings_type: ClassVar[Any]
    """The block `devices: lasers:` of the rig file, a `DeviceBlock`. Its validators find the `Rig` as their
    context in the workbench, and no context in the guardian."""
    has_leases: ClassVar[bool]
    """Whether the hardware switches off by itself when a lease ends. Where it does not, the guardian's clock
    is all that ends an emission, and an off that is not confirmed is tried again for `TRY_BOARD_S`."""

    def __init__(self, settings: Any, lasers: int, alarm: Callable[[], bool]) -> None:
        """Open the device, which nothing else may hold, and switch nothing on.

        Args:
            settings: the validated block, an instance of `settings_type`.
            lasers: number of lasers of the rig.
            alarm: whether the lasers have to go off at once. A call of `light` that waits longer than some
                20 ms asks it meanwhile, and switches off and raises when it says so.

        Raises:
            BadInputError: the settings do not suit the device, such as fewer outputs than lasers.
            RigNotReadyError: the device is missing or held by another program.
        """

    def identify(self, boot_s: float) -> str:
        """Name of the device. A device that boots when it is opened has `boot_s` to answer.

        The guardian calls this first, then `all_off`, also where this fails. A device that may have been left
        on is switched off here or in the constructor, before it is asked anything.

        Raises:
            RigNotReadyError: it does not answer as expected.
        """

    def light(self, mask: int, lease_ms: int) -> None:
        """Switch the lasers of `mask` on and the others off, for a lease.

        Hardware with leases switches off when `lease_ms` have gone without another call.

        Raises:
            RigNotReadyError: refused, as by an open interlock, or not answered.
        """

    def all_off(self) -> None:
        """Switch every laser off and verify it at the device.

        Raises:
            LaserOffNotConfirmedError: the device does not confirm it.
        """

    def state(self) -> tuple[int, bool | None]:
        """Mask of the lasers that are on; whether the interlock is closed, None where that is not known.

        Raises:
            RigNotReadyError: the device does not answer.
        """


class CheckedLine:
    """A line whose every failure is the workbench's error: a defect of a driver must not end the guardian."""

    def __init__(self, line: GuardedLine) -> None:
        self._line = line
        self.has_leases = line.has_leases

    def identify(self, boot_s: float) -> str:
        """As the line's."""
        with driver_errors():
            return str(self._line.identify(boot_s))

    def light(self, mask: int, lease_ms: int) -> None:
        """As the line's.

        Raises:
            RigNotReadyError: it failed, however.
        """
        with driver_errors(only=RigNotReadyError):
            self._line.light(mask, lease_ms)

    def all_off(self) -> None:
        """As the line's.

        Raises:
            LaserOffNotConfirmedError: it failed, however.
        """
        with driver_errors(only=LaserOffNotConfirmedError, raised=LaserOffNotConfirmedError):
            self._line.all_off()

    def state(self) -> tuple[int, bool | None]:
        """As the line's.

        Raises:
            RigNotReadyError: it failed, however.
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
        reference: of the driver, see `line_reference`.
        settings_json: its block.
        lasers: number of lasers.
        alarm: see `GuardedLine`.
        ready: called between the import and the opening.

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
    """Let errors of the kind `only` pass; every other one is `raised` in its place."""
    try:
        yield
    except only:
        raise
    except BaseException as error:  # SystemExit, too: a driver must not end the guardian with a laser on
        raise raised(
            f"laser driver: {_error_text(error)}; check the device, its settings, and the driver"
        ) from None


def _error_text(error: BaseException) -> str:
    """Message of an error of the workbench; of another one with its kind."""
    try:
        return str(error) if isinstance(error, WorkbenchError) else f"{type(error).__name__}: {error}"
    except Exception:  # a foreign package's error whose own text fails
        return type(error).__name__
