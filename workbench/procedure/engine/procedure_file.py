"""Schema of the procedure file: name, title, and steps of registered kinds."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from workbench.model.yamlfile import Document, FileModel, load_yaml_model
from workbench.procedure.engine.registry import AnyStep, rebuild_with_new_kinds, step_kinds


class Procedure(FileModel):
    """A procedure file, format 1."""

    kind_key = "procedure"

    @classmethod
    def include_files(cls, document: Document) -> bool:
        """Replace the files that steps name by their contents; whether there was any."""
        steps = document.data.get("steps")
        known = step_kinds()
        included = [
            known[str(step["step"])].include_files(Document(document.path, step))
            for step in (steps if isinstance(steps, list) else [])
            if isinstance(step, dict) and str(step.get("step")) in known
        ]
        return any(included)

    format: Literal[1]
    procedure: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+$")]
    title: str
    steps: Annotated[tuple[AnyStep, ...], Field(min_length=1)]

    def step_name(self, index: int) -> str:
        """Name of the step at `index` (from 1), unique in a session."""
        return f"{self.procedure}.{index}"


rebuild_with_new_kinds(Procedure)


def load_procedure(path: Path) -> Procedure:
    """Read a procedure file.

    Raises:
        BadInputError: see `load_yaml_model`.
    """
    return load_yaml_model(path, Procedure)
