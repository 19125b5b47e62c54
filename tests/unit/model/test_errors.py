"""Exit codes of the errors that a person can meet."""

from __future__ import annotations

import pytest

from workbench.model import errors
from workbench.model.errors import WorkbenchError


@pytest.mark.parametrize(
    ("name", "code"),
    [
        ("WorkbenchError", 1),
        ("BadInputError", 2),
        ("LimitFailedError", 3),
        ("RigNotReadyError", 4),
        ("StoppedError", 5),
        ("AnswerNeededError", 6),
        ("LaserOffNotConfirmedError", 7),
    ],
)
def test_each_error_has_its_exit_code(name: str, code: int) -> None:
    error = getattr(errors, name)
    assert issubclass(error, WorkbenchError)
    assert error("why").exit_code == code
