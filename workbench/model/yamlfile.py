"""Reader of YAML files into typed models, with errors that name file and line."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any, ClassVar, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError
from ruamel.yaml import YAML
from ruamel.yaml.constructor import ConstructorError, RoundTripConstructor
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import MappingNode, ScalarNode, SequenceNode

from workbench.model.contents import CONTROL, not_text, printable, read_file
from workbench.model.errors import BadInputError
from workbench.model.problems import Location, SchemaProblem, problems

KINDS = {
    "procedure": "a procedure",
    "rig": "a rig",
    "campaign": "a campaign",
    "world": "a world",
    "laser_ranger": "a calibration",
    "workbench_camera": "a calibration of a camera without lasers",
    "scanning_head": "a calibration of a scanning head",
}
"""Keys that identify the kind of a file, with the kind's name."""
LARGEST_BYTES = 4 * 2**20
"""Largest YAML file; a calibration of 100 lasers takes 3 MiB."""
MOST_VALUES = 250_000
"""Most values of a YAML file, aliases written out; a calibration of 100 lasers has 170 000."""

HINTS = {
    "that cannot start any token": "; indent with spaces; quote text that begins with a special character",
    "but got ':'": "; quote text that contains a colon",
    "mapping values are not allowed here": "; quote text that contains a colon",
    "another document": "; a file contains one document: remove the later ---",
    "expected <block end>": "; indent items of one list or mapping by the same number of spaces",
    "while scanning a quoted scalar": "; close the quotes",
    "found unexpected end of stream": "; close the quotes or brackets",
    "could not find expected ':'": "; put a colon and a space after a key",
}
"""Remedies for frequent mistakes, by a part of YAML's error message."""


class FileModel(BaseModel):
    """Base class of models read from a file: unknown keys are mistakes, values are immutable."""

    kind_key: ClassVar[str | None] = None
    """Key that identifies a file of this kind; None for a part of a file."""

    # Validators are built at first use: a command uses few of the models that it imports.
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, defer_build=True)

    @classmethod
    def include_files(cls, document: Document) -> bool:
        """Replace what a document takes from other files; whether there was any. By default there is none."""
        return False


Model = TypeVar("Model", bound=BaseModel)


@dataclass(frozen=True)
class Mistake:
    """Mistake in a file, with its line."""

    line: int
    """Line number, from 1."""
    text: str


@dataclass(frozen=True)
class Document:
    """Content of a YAML file; mappings and lists keep their line numbers."""

    path: Path
    data: Any
    doubled: tuple[Mistake, ...] = ()
    """Keys that occur twice in one mapping; the first value is used."""

    def mistake(self, problem: SchemaProblem) -> Mistake:
        """Mistake for a schema violation, with its line."""
        return Mistake(line_of(self.data, problem.location), problem.message)

    def mistakes(self, model: type[BaseModel], context: object = None) -> list[Mistake]:
        """Violations of the schema of `model`, with their lines."""
        return [self.mistake(problem) for problem in schema_problems(model, self.data, context=context)]


def schema_problems(
    model: type[BaseModel], data: object, part: Location = (), context: object = None
) -> list[SchemaProblem]:
    """Violations of the schema of `model` by a part of a file.

    Args:
        model: expected model.
        data: values as read.
        part: location of `data` in the file; prefix of the problems' locations.
        context: context for the model's validators.
    """
    try:
        model.model_validate(data, context=context)
    except ValidationError as error:
        return [
            SchemaProblem((*part, *one.location), one.text) for one in problems(model, data, error.errors())
        ]
    return []


def refuse(path: Path, mistakes: Iterable[Mistake]) -> None:
    """Raise an error if there are mistakes.

    Raises:
        BadInputError: there are mistakes; one line for each, in the order of the file.
    """
    in_order = sorted(mistakes, key=lambda mistake: mistake.line)
    if in_order:
        raise BadInputError("\n".join(f"{path}:{one.line}: {one.text}" for one in in_order))


def load_yaml_model(path: Path, model: type[Model]) -> Model:
    """Read `path` and validate it as `model`.

    Raises:
        BadInputError: the file is missing, is not YAML, or violates the schema; one line for each problem,
            with file, line, key, expected value and actual value.
    """
    return parse_yaml_model(_read(path), path, model)


def read_document(path: Path) -> Document:
    """Read a YAML file.

    Raises:
        BadInputError: the file cannot be read or is not one YAML document.
    """
    return parse_document(_read(path), path)


def parse_yaml_model(text: str, path: Path, model: type[Model], context: object = None) -> Model:
    """Validate YAML `text` from the file `path` as `model`; raises the errors of `load_yaml_model`.

    Args:
        text: content.
        path: file, for messages.
        model: expected model.
        context: context for the model's validators.
    """
    document = parse_document(text, path)
    _check_kind(path, document.data, model)
    include_files(document, model)
    try:
        found = model.model_validate(document.data, context=context)
    except ValidationError:
        refuse(path, [*document.doubled, *document.mistakes(model, context)])
        raise
    refuse(path, document.doubled)
    return found


def include_files(document: Document, model: type[BaseModel]) -> bool:
    """Replace what a document takes from other files by their contents; whether there was any.

    Raises:
        BadInputError: such a file is missing or wrong.
    """
    return issubclass(model, FileModel) and isinstance(document.data, dict) and model.include_files(document)


def include_content(document: Document, key: str, model: type[BaseModel], what: str) -> bool:
    """Replace the path at a key, relative to the document, by the file's content; whether there was a path.

    Args:
        document: document with the key.
        key: key at the top of the document.
        model: expected model of the file.
        what: words for the file in messages.

    Raises:
        BadInputError: the file is missing or wrong.
    """
    named = document.data.get(key)
    if not isinstance(named, str):
        return False
    path = document.path.parent / Path(named)
    try:
        load_yaml_model(path, model)
    except BadInputError as error:
        where = f"{document.path}:{line_of(document.data, (key,))}: {key}"
        raise BadInputError(f"{where}: the {what} {named} cannot be used\n{error}") from None
    document.data[key] = read_document(path).data
    return True


def standalone_text(path: Path, model: type[BaseModel]) -> str:
    """Text of a YAML file that depends on no other file: verbatim, where it names none.

    Raises:
        BadInputError: the file, or one that it names, is missing or wrong.
    """
    text = _read(path)
    document = parse_document(text, path)
    if not include_files(document, model):
        return text
    stream = StringIO()
    YAML().dump(document.data, stream)
    return stream.getvalue()


def parse_document(text: str, path: Path) -> Document:
    """Parse the safe subset of YAML.

    Raises:
        BadInputError: `text` is not one YAML document.
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
        raise BadInputError(f"{path}: not valid YAML: nested too deeply") from None
    if data is None:
        raise BadInputError(f"{path}:1: expected a YAML mapping, the file is empty")
    return Document(path, data, tuple(yaml.constructor.doubled))


class _Constructor(RoundTripConstructor):
    """Constructor of plain values: no tags, no keys but plain ones, a bounded number of values.

    Collects duplicate keys instead of stopping at the first one; escapes control characters in text.
    """

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.doubled: list[Mistake] = []

    def construct_document(self, node: Any) -> Any:
        self._count_values(node, {})
        return super().construct_document(node)

    def _count_values(self, node: Any, counts: dict[int, int]) -> int:
        """Number of values of a node with its aliases written out; checks what a file may contain.

        Args:
            node: node of the file.
            counts: numbers of the nodes counted so far, by identity; 0 while a node is being counted.

        Raises:
            ConstructorError: a tag, a key that is a list or mapping, a list or mapping that contains itself,
                or more than MOST_VALUES values.
        """
        if (known := counts.get(id(node))) is not None:
            if known:
                return known
            raise _not_accepted("an alias of a list or mapping that contains it; write its values out", node)
        if str(node.ctag) != self._plain_tag(node):
            raise _not_accepted(f"the tag {node.ctag}; remove it (text: in quotes)", node)
        counts[id(node)] = 0
        total = 1
        if isinstance(node, MappingNode):
            for key, value in node.value:
                if not isinstance(key, ScalarNode):
                    raise _not_accepted("a key that is a list or mapping", key)
                total += self._count_values(key, counts) + self._count_values(value, counts)
        elif isinstance(node, SequenceNode):
            total += sum(self._count_values(value, counts) for value in node.value)
        if total > MOST_VALUES:
            raise _not_accepted(f"more than {MOST_VALUES} values", node)
        counts[id(node)] = total
        return total

    def _plain_tag(self, node: Any) -> str:
        """Tag of a node that states none."""
        is_plain = isinstance(node, ScalarNode) and node.style is None
        return str(self.resolver.resolve(type(node), node.value if is_plain else None, (is_plain, True)))

    def construct_scalar(self, node: Any) -> Any:
        value = super().construct_scalar(node)
        return printable(value) if isinstance(value, str) and CONTROL.search(value) else value

    def check_mapping_key(self, node: Any, key_node: Any, mapping: Any, key: Any, value: Any) -> bool:
        if key not in mapping:
            return True
        first = mapping.lc.data[key][0] + 1 if key in mapping.lc.data else node.start_mark.line + 1
        line = key_node.start_mark.line + 1
        self.doubled.append(Mistake(line, f"{key}: duplicate key, first on line {first}; remove one of them"))
        return False


def _not_accepted(what: str, node: Any) -> ConstructorError:
    return ConstructorError(None, None, f"expected plain values, got {what}", node.start_mark)


def kind_of(data: Any) -> str:
    """Kind of a document, for messages."""
    if not isinstance(data, dict):
        return "no mapping of keys to values"
    kinds = [name for key, name in KINDS.items() if key in data]
    return " and ".join(kinds) or "a mapping of other keys"


def _check_kind(path: Path, data: Any, model: type[BaseModel]) -> None:
    """Refuse a file of another kind with one mistake instead of one for each key."""
    key = getattr(model, "kind_key", None)
    if key is not None and not (isinstance(data, dict) and key in data):
        raise BadInputError(f"{path}:1: expected {KINDS[key]}, with the key {key}; this is {kind_of(data)}")


def _read(path: Path) -> str:
    content = read_file(path, "a YAML file", LARGEST_BYTES)
    if (got := not_text(content)) is not None:
        raise BadInputError(f"{path}: expected a YAML file, got {got}")
    return content.decode("utf-8")


def line_of(data: Any, location: Location) -> int:
    """Line number (from 1) of the deepest part of `location` that exists in the file."""
    line = 1
    node = data
    for part in location:
        position = getattr(node, "lc", None)
        if position is None or part not in (position.data or {}):
            break  # a key that is missing
        line = position.data[part][0] + 1
        node = node[part]
    return line
