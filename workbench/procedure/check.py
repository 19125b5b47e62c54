"""Looking through files before anybody stands at the bench."""

from __future__ import annotations

from pathlib import Path

from workbench.devices.registry import blocks_of, check_driver
from workbench.model.errors import BadInputError
from workbench.model.procedure import Procedure, load_procedure
from workbench.model.rig import load_rig
from workbench.model.yamlfile import kind_of, line_of, load_yaml, validate


def check_file(path: Path) -> list[str]:
    """What is worth knowing of a procedure or rig file that is right.

    Raises:
        BadInputError: it is wrong; one line for each problem, with file and line.
    """
    data = load_yaml(path)
    kinds = [kind for kind in ("procedure", "rig") if isinstance(data, dict) and kind in data]
    if len(kinds) != 1:
        raise BadInputError(
            f"{path}:1: expected a procedure or a rig, with one key of these names; this is {kind_of(data)}"
        )
    return _check_procedure(path) if kinds == ["procedure"] else _check_rig(path)


def _check_procedure(path: Path) -> list[str]:
    procedure = load_procedure(path)
    notes = []
    made: set[str] = set()
    for index, step in enumerate(procedure.steps):
        needs: str | None = getattr(step, "needs", None)
        if needs is not None and needs not in made:
            where = f"{path}:{line_of(load_yaml(path), ('steps', index))}: steps[{index}]: {step.step}"
            if needs in _given_after(procedure, index):
                raise BadInputError(f"{where} needs what gives {needs} before it, which comes after it")
            notes.append(f"{where} needs a procedure before this one, in the same call, that gives {needs}")
            made.add(needs)
        made.add(getattr(step, "gives", ""))
    return notes


def _given_after(procedure: Procedure, index: int) -> set[str]:
    return {getattr(step, "gives", "") for step in procedure.steps[index:]}


def _check_rig(path: Path) -> list[str]:
    rig = load_rig(path)
    if rig.driver is None:
        return [f"{path}:1: names no driver: it can be fitted but not run"]
    try:
        check_driver(rig)
    except BadInputError as error:
        raise BadInputError(f"{path}:{line_of(load_yaml(path), ('driver',))}: {error}") from None
    for block, model in blocks_of(rig).items():
        validate(path, load_yaml(path), (block,), model, context=rig)
    return []
