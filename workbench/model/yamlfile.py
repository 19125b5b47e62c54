"""YAML files that people edit, read into typed models with errors that name file and line."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError
from ruamel.yaml import YAML
from ruamel.yaml.constructor import RoundTripConstructor
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from workbench.model.contents import not_text
from workbench.model.errors import BadInputError
from workbench.model.problems import Location, SchemaProblem, problems

KINDS = {"procedure": "a procedure", "rig": "a rig", "laser_ranger": "a calibration"}
"""The keys that tell what a file is."""


HINTS = {
    "that cannot start any token": "; indent with spaces, and put text that begins so in quotes",
    "but got ':'": "; put text with a colon in it in quotes",
    "mapping values are not allowed here": "; put text with a colon in it in quotes",
    "another document": "; a file holds one document: take out the later ---",
    "expected <block end>": "; indent what belongs together by the same number of spaces",
    "while scanning a quoted scalar": "; close the quotes",
    "found unexpected end of stream": "; close the quotes or brackets",
    "could not find expected ':'": "; after a key there is a colon and a space",
}
"""What to do about YAML's usual mistakes."""


class FileModel(BaseModel):
    """Base of everything read from a file: unknown keys are mistakes, values do not change after reading."""

    told_by: ClassVar[str | None] = None
    """The key of a whole file's kind."""

    # Built at first use: a command uses few of all the models that it imports.
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, defer_build=True)


Model = TypeVar("Model", bound=BaseModel)


@dataclass(frozen=True)
class Mistake:
    """Something wrong with a file."""

    line: int
    """From 1."""
    text: str


@dataclass(frozen=True)
class Document:
    """A YAML file as it was read; mappings and lists keep their line numbers."""

    path: Path
    data: Any
    doubled: tuple[Mistake, ...] = ()
    """Keys that stand in one mapping twice; the first counts."""

    def mistake(self, problem: SchemaProblem) -> Mistake:
        """A problem with its line."""
        return Mistake(line_of(self.data, problem.location), problem.told)

    def mistakes(self, model: type[BaseModel]) -> list[Mistake]:
        """All that keeps the document from being `model`."""
        return [self.mistake(problem) for problem in schema_problems(model, self.data)]


def schema_problems(
    model: type[BaseModel], data: object, part: Location = (), context: object = None
) -> list[SchemaProblem]:
    """All that keeps `data`, which stands at the keys `part` of a file, from being `model`.

    Args:
        model: what it is to be.
        data: what was read.
        part: keys that lead to it; the problems' locations begin with them.
        context: handed to the model's validators.
    """
    try:
        model.model_validate(data, context=context)
    except ValidationError as error:
        return [
            SchemaProblem((*part, *one.location), one.text) for one in problems(model, data, error.errors())
        ]
    return []


def refuse(path: Path, mistakes: Iterable[Mistake]) -> None:
    """Raise where there are mistakes, a line for each, in the order of the file.

    Raises:
        BadInputError: there are.
    """
    in_order = sorted(mistakes, key=lambda mistake: mistake.line)
    if in_order:
        raise BadInputError("\n".join(f"{path}:{one.line}: {one.text}" for one in in_order))


def load_yaml_model(path: Path, model: type[Model]) -> Model:
    """Read `path` and validate it as `model`.

    Raises:
        BadInputError: the file is missing, is not YAML, or does not fit; one line for each problem, with
            file, line, key, what was expected and what came.
    """
    return parse_yaml_model(_read(path), path, model)


def read_document(path: Path) -> Document:
    """Read `path`.

    Raises:
        BadInputError: it cannot be read, or is not one YAML document.
    """
    return parse_document(_read(path), path)


def parse_yaml_model(text: str, path: Path, model: type[Model]) -> Model:
    """Validate YAML `text`, which comes from `path`, as `model`; the errors of `load_yaml_model`."""
    document = parse_document(text, path)
    _check_kind(path, document.data, model)
    try:
        found = model.model_validate(document.data)
    except ValidationError:
        refuse(path, [*document.doubled, *document.mistakes(model)])
        raise
    refuse(path, document.doubled)
    return found


def parse_document(text: str, path: Path) -> Document:
    """Read YAML's safe subset.

    Raises:
        BadInputError: it is not one YAML document.
    """
    yaml = YAML(typ="rt")
    yaml.Constructor = _Constructor
    try:
        data = yaml.load(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = "" if mark is None else f":{mark.line + 1}"
        hint = next((words for part, words in HINTS.items() if part in str(error.problem)), "")
        raise BadInputError(f"{path}{line}: not valid YAML: {error.problem or error.context}{hint}") from None
    except (YAMLError, ValueError) as error:
        raise BadInputError(f"{path}: not valid YAML: {error}") from None
    except RecursionError:
        raise BadInputError(f"{path}: not valid YAML: nested too deep") from None
    if data is None:
        raise BadInputError(f"{path}:1: expected a YAML mapping, the file is empty")
    return Document(path, data, tuple(yaml.constructor.doubled))


class _Constructor(RoundTripConstructor):
    """Goes on after a key that stands in a mapping twice, and notes it: there may be more to tell."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.doubled: list[Mistake] = []

    def check_mapping_key(self, node: Any, key_node: Any, mapping: Any, key: Any, value: Any) -> bool:
        if key not in mapping:
            return True
        first = mapping.lc.data[key][0] + 1 if key in mapping.lc.data else node.start_mark.line + 1
        line = key_node.start_mark.line + 1
        self.doubled.append(Mistake(line, f"{key}: stands here again, after line {first}; leave one of them"))
        return False


def kind_of(data: Any) -> str:
    """What a document is, for people."""
    if not isinstance(data, dict):
        return "no mapping of keys to values"
    kinds = [name for key, name in KINDS.items() if key in data]
    return " and ".join(kinds) or "a mapping of other keys"


def _check_kind(path: Path, data: Any, model: type[BaseModel]) -> None:
    """A file of another kind is one mistake, not as many as it has keys."""
    key = getattr(model, "told_by", None)
    if key is not None and not (isinstance(data, dict) and key in data):
        raise BadInputError(f"{path}:1: expected {KINDS[key]}, with the key {key}; this is {kind_of(data)}")


def _read(path: Path) -> str:
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise BadInputError(f"{path}: no such file; expected a YAML file") from None
    except IsADirectoryError:
        raise BadInputError(f"{path}: expected a YAML file, got a folder; give the files in it") from None
    except (OSError, ValueError) as error:
        raise BadInputError(f"{path}: expected a readable YAML file: {error}") from None
    if (came := not_text(content)) is not None:
        raise BadInputError(f"{path}: expected a YAML file, got {came}")
    return content.decode("utf-8")


def line_of(data: Any, location: Location) -> int:
    """Line (from 1) of the deepest part of `location` that stands in the file."""
    line = 1
    node = data
    for part in location:
        position = getattr(node, "lc", None)
        if position is None or part not in (position.data or {}):
            break  # a key that is missing
        line = position.data[part][0] + 1
        node = node[part]
    return line
