"""Steps as a procedure file has them, for tests of single kinds."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from workbench.model.errors import BadInputError
from workbench.model.yamlfile import parse_yaml_model
from workbench.procedure.engine.procedure_file import Procedure


def parse_step(text: str) -> Any:
    """The step of a procedure file with one step, given as `key: value, ...` on line 5.

    Raises:
        BadInputError: as reading the file does, of `p.yaml`.
    """
    lines = f"format: 1\nprocedure: p\ntitle: P\nsteps:\n  - {{{text}}}\n"
    (step,) = parse_yaml_model(lines, Path("p.yaml"), Procedure).steps
    return step


def wrong_keys(text: str) -> list[str]:
    """Keys that a mistake is found at, as in `steps[0].repeats`."""
    try:
        parse_step(text)
    except BadInputError as error:
        told = [line.removeprefix("p.yaml:5: ") for line in str(error).splitlines()]
        return [line.partition(": ")[0] for line in told]
    return []
