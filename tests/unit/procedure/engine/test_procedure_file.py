"""The procedure file."""

from __future__ import annotations

from pathlib import Path

import pytest

from workbench.model.errors import BadInputError
from workbench.procedure.engine.procedure_file import load_procedure
from workbench.steps.confirm import ConfirmStep
from workbench.steps.message import MessageStep

TEXT = """\
format: 1
procedure: open-up_2
title: Open
steps:
  - {step: message, text: Hello.}
  - {step: confirm, text: Open it.}
"""


def test_steps_are_read_in_order_as_their_kinds(tmp_path: Path) -> None:
    path = tmp_path / "p.yaml"
    path.write_text(TEXT)
    procedure = load_procedure(path)
    assert [type(step) for step in procedure.steps] == [MessageStep, ConfirmStep]
    assert [procedure.step_name(index) for index in (1, 2)] == ["open-up_2.1", "open-up_2.2"]


@pytest.mark.parametrize(
    ("old", "new", "line", "key"),
    [
        ("format: 1", "format: 2", 1, "format"),
        ("open-up_2", "open/up", 2, "procedure"),
        ("title: Open", "title: [Open]", 3, "title"),
        ("text: Open it.", "txt: Open it.", 6, "steps[1].txt"),
    ],
)
def test_a_mistake_is_named_with_its_line_and_key(
    tmp_path: Path, old: str, new: str, line: int, key: str
) -> None:
    path = tmp_path / "p.yaml"
    path.write_text(TEXT.replace(old, new))
    with pytest.raises(BadInputError) as caught:
        load_procedure(path)
    assert any(told.startswith(f"{path}:{line}: {key}: ") for told in str(caught.value).splitlines())


def test_a_procedure_without_steps_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "p.yaml"
    path.write_text(TEXT.partition("steps:")[0] + "steps: []\n")
    with pytest.raises(BadInputError, match=r"p\.yaml:4: steps: "):
        load_procedure(path)
