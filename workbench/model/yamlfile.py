"""YAML files that people edit, read into typed models with errors that name file and line."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError
from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from workbench.model.errors import BadInputError
from workbench.model.problems import Location, Problem, problems

KINDS = {"procedure": "a procedure", "rig": "a rig", "laser_ranger": "a calibration"}
"""The keys that tell what a file is."""


class FileModel(BaseModel):
    """Base of everything read from a file: unknown keys are mistakes, values do not change after reading."""

    told_by: ClassVar[str | None] = None
    """The key of a whole file's kind."""

    # Built at first use: a command uses few of all the models that it imports.
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, defer_build=True)


Model = TypeVar("Model", bound=BaseModel)


def load_yaml_model(path: Path, model: type[Model]) -> Model:
    """Read `path` and validate it as `model`.

    Raises:
        BadInputError: the file is missing, is not YAML, or does not fit; one line for each problem, with
            file, line, key, what was expected and what came.
    """
    return parse_yaml_model(_read(path), path, model)


def load_yaml(path: Path) -> Any:
    """Read `path` as `parse_yaml` does; the errors of `load_yaml_model`."""
    return parse_yaml(_read(path), path)


def parse_yaml_model(text: str, path: Path, model: type[Model]) -> Model:
    """Validate YAML `text`, which comes from `path`, as `model`; the errors of `load_yaml_model`."""
    data = parse_yaml(text, path)
    _check_kind(path, data, model)
    return validate(path, data, (), model)


def validate(path: Path, data: Any, part: Location, model: type[Model], context: object = None) -> Model:
    """Validate a part of `data`, which comes from `path`, as `model`; the errors of `load_yaml_model`.

    Args:
        path: for the message.
        data: the whole document.
        part: keys that lead to the part; one that is not there is empty.
        model: what the part is to be.
        context: handed to the model's validators.
    """
    node = data
    for key in part:
        node = node.get(key) or {}
    try:
        return model.model_validate(node, context=context)
    except ValidationError as error:
        found = [Problem((*part, *one.location), one.text) for one in problems(node, error.errors())]
        lines = [f"{path}:{line_of(data, one.location)}: {one.key}: {one.text}" for one in found]
        raise BadInputError("\n".join(lines)) from None


def parse_yaml(text: str, path: Path) -> Any:
    """Read YAML's safe subset; mappings and lists keep their line numbers.

    Raises:
        BadInputError: it is not one YAML document.
    """
    try:
        data = YAML(typ="rt").load(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = "" if mark is None else f":{mark.line + 1}"
        raise BadInputError(f"{path}{line}: not valid YAML: {error.problem or error.context}") from None
    except (YAMLError, ValueError) as error:
        raise BadInputError(f"{path}: not valid YAML: {error}") from None
    except RecursionError:
        raise BadInputError(f"{path}: not valid YAML: nested too deep") from None
    if data is None:
        raise BadInputError(f"{path}:1: expected a YAML mapping, the file is empty")
    return data


def kind_of(data: Any) -> str:
    """What a document is, for people."""
    if not isinstance(data, dict):
        return "no mapping of keys to values"
    return next((name for key, name in KINDS.items() if key in data), "a mapping of other keys")


def _check_kind(path: Path, data: Any, model: type[BaseModel]) -> None:
    """A file of another kind is one mistake, not as many as it has keys."""
    key = getattr(model, "told_by", None)
    if key is not None and not (isinstance(data, dict) and key in data):
        raise BadInputError(f"{path}:1: expected {KINDS[key]}, with the key {key}; this is {kind_of(data)}")


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise BadInputError(f"{path}: no such file; expected a YAML file") from None
    except IsADirectoryError:
        raise BadInputError(f"{path}: expected a YAML file, got a folder; give the files in it") from None
    except (OSError, ValueError) as error:
        raise BadInputError(f"{path}: expected a readable UTF-8 YAML file: {error}") from None


def line_of(data: Any, location: Location) -> int:
    """Line (from 1) of the deepest part of `location` that stands in the file."""
    line = 1
    node = data
    for part in location:
        position = getattr(node, "lc", None)
        if position is None or part not in (position.data or {}):
            continue  # the name of a kind of step, which pydantic puts in, or a key that is missing
        line = position.data[part][0] + 1
        node = node[part]
    return line
