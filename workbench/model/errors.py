"""The errors a person can meet, each with the exit code that the command line ends with.

Whoever raises one says what was expected, what came, where, and what to do. Anything else that escapes
is a defect of the workbench and ends with exit code 1.
"""

from __future__ import annotations

from typing import ClassVar


class WorkbenchError(Exception):
    """Base of every expected failure."""

    exit_code: ClassVar[int] = 1


class BadInputError(WorkbenchError):
    """A file, an option or a value that the user gave is wrong (exit 2)."""

    exit_code = 2


class LimitFailedError(WorkbenchError):
    """The work was done and a limit on its result failed (exit 3)."""

    exit_code = 3


class RigNotReadyError(WorkbenchError):
    """A device is missing, silent or contradicts the rig file (exit 4)."""

    exit_code = 4


class StoppedError(WorkbenchError):
    """Stopped before the end; what was captured is safe (exit 5)."""

    exit_code = 5


class AnswerNeededError(WorkbenchError):
    """A question needs an answer and nobody is there to give it (exit 6)."""

    exit_code = 6


class LaserOffNotConfirmedError(WorkbenchError):
    """The controller did not confirm that every laser is off (exit 7). Treat the beams as on."""

    exit_code = 7
