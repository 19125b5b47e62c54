"""Expected errors, each with the exit code of the command line.

A message states what happened and where, the expected and the actual value, and what to do. Any other
exception that reaches the command line is a defect of the workbench and ends with exit code 1.
"""

from __future__ import annotations

from typing import ClassVar


class WorkbenchError(Exception):
    """Base class of every expected failure."""

    exit_code: ClassVar[int] = 1


class BadInputError(WorkbenchError):
    """A file, an option or a value from the user is wrong (exit 2)."""

    exit_code = 2


class LimitFailedError(WorkbenchError):
    """A limit on the result of completed work failed (exit 3)."""

    exit_code = 3


class RigNotReadyError(WorkbenchError):
    """A device is missing, does not answer or contradicts the rig file (exit 4)."""

    exit_code = 4


class LeaseEndedError(RigNotReadyError):
    """Lasers were switched off at the end of their lease, before all frames with them on were taken."""


class StoppedError(WorkbenchError):
    """The command was stopped before its end; all captures are on disk (exit 5)."""

    exit_code = 5


class AnswerNeededError(WorkbenchError):
    """A prompt needs an answer and there is no operator to give one (exit 6)."""

    exit_code = 6


class LaserOffNotConfirmedError(WorkbenchError):
    """The controller did not confirm that every laser is off (exit 7). Treat the beams as on."""

    exit_code = 7
