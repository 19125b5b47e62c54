"""Violations of every model are reported in plain words, never in those of pydantic."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import re
from collections.abc import Iterator
from datetime import date
from pathlib import Path
from typing import Annotated, Any

import pytest
from pydantic import BaseModel, Field, ValidationError

import workbench
from workbench.model.errors import BadInputError
from workbench.model.problems import EXPECTED, SPELLED, closest_first, problems
from workbench.model.prompt import Answer
from workbench.model.yamlfile import FileModel, load_yaml_model

LIBRARY = re.compile(
    r"input should|should match|should be|valid (integer|number|string|list|tuple|dict)|(?<!cross_)validation"
    r"|pydantic"
    r"|field required|extra inputs|unable to|discriminator|tag |items? after|something else|\{\w*\}|inf_nan"
)
"""As pydantic puts things, and what our own words would look like if they were not filled in."""


ODD: tuple[Any, ...] = (
    None, True, False, -1e300, -91, -1, 0, 0.5, 1, 95, 1e300, 10**400, float("nan"), float("inf"),
    "", " ", "ä/ö", "1 W", "2,5", "x" * 300, b"\xff", date(2026, 11, 23), {1, 2},
    [], [None], ["a"], [1], [-1, -1], [[]], [1] * 30, {}, {"a": 1}, {1: {}}, {"step": "dance"}, {"step": 3},
    {"shape": "egg"}, [{"step": "fit", "limit": 1}], {"value": [], "sd": "x"}, [{"step": 3}],
)  # fmt: skip


UNMET = {
    "bool_type",
    "list_type",
    "dict_type",
    "int_parsing_size",
    "model_type",
    "float_type",
    "string_unicode",
}
"""Kinds of errors that pydantic would raise of other values, or in other versions."""


def every_model() -> list[type[BaseModel]]:
    for module in pkgutil.walk_packages(workbench.__path__, "workbench."):
        importlib.import_module(module.name)

    def below(model: type[BaseModel]) -> Iterator[type[BaseModel]]:
        for one in model.__subclasses__():
            yield one
            yield from below(one)

    ours = {
        m
        for m in below(BaseModel)
        if m.__module__.startswith("workbench.") and "[" not in m.__name__ and not inspect.isabstract(m)
    }
    return sorted(ours, key=lambda m: (m.__module__, m.__qualname__))


def constraints(node: object) -> Iterator[tuple[str, Any]]:
    """(name, value) of every entry of a core schema."""
    if isinstance(node, dict):
        for name, value in node.items():
            yield name, value
            yield from constraints(value)
    elif isinstance(node, list | tuple):
        for value in node:
            yield from constraints(value)


def test_every_model_answers_odd_values_in_plain_words() -> None:
    kinds = set()
    for model in every_model():
        names = [field.alias or name for name, field in model.model_fields.items()]
        inputs = [*ODD, *({name: value} for name in names for value in ODD)]
        inputs += [{name: "x", f"{name}s": "x"} for name in names]
        for value in inputs:
            try:
                model.model_validate(value)
            except ValidationError as error:
                errors = error.errors()
            else:
                continue
            kinds |= {one["type"] for one in errors}
            said = [one.message for one in problems(model, value, errors)]
            assert said, (model, value)
            for text in said:
                without_input = re.sub(r", got .*", "", text, flags=re.DOTALL)
                assert not LIBRARY.search(without_input.lower()), (model, value, text)
    assert kinds - {"value_error"} <= set(EXPECTED)
    # Otherwise the odd values are not odd enough.
    assert kinds >= set(EXPECTED) - UNMET


def test_every_pattern_is_spelled_out_with_an_example_that_fits() -> None:
    found = set()
    for model in every_model():
        model.model_rebuild()
        schema = constraints(model.__pydantic_core_schema__)
        found |= {value for name, value in schema if name == "pattern" and isinstance(value, str)}
    assert found == set(SPELLED)
    for pattern, words in SPELLED.items():
        examples = re.findall(r"[\w.#-]+", words.partition("such as ")[2].partition(", of")[0])
        assert [e for e in examples if re.match(pattern, e)], words
        assert re.match(pattern, examples[-1]), words


class Beam(FileModel):
    """A file."""

    power_mw: float
    colours: tuple[str, ...] = ()


def told(text: str, tmp_path: Path, model: type[BaseModel] = Beam) -> list[str]:
    path = tmp_path / "f.yaml"
    path.write_text(text)
    with pytest.raises(BadInputError) as caught:
        load_yaml_model(path, model)
    return str(caught.value).replace(f"{tmp_path}/", "").splitlines()


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("power_mw: 2,5", "f.yaml:1: power_mw: expected a number, such as 2.5, got '2,5'"),
        ("power_mw: 3 mW", "f.yaml:1: power_mw: expected a number, such as 3, got '3 mW'"),
        ("power_mw:", "f.yaml:1: power_mw: expected a number, such as 12.5, got nothing"),
        ("power_mw: 1\ncolours: red", "f.yaml:2: colours: expected a list, such as [red], got 'red'"),
        ("power_mw: 1\ncolours: [red, 7]", 'f.yaml:2: colours[1]: expected text, such as "7", got 7'),
        # One mistake: a key that is missing, and one of nearly its name.
        ("powr_mw: 1", "f.yaml:1: powr_mw: no such key; expected one of power_mw, colours"),
        (
            "power_mw: 1\npower_mw: 2",
            "f.yaml:2: power_mw: duplicate key, first on line 1; remove one of them",
        ),
    ],
)
def test_one_mistake_is_one_line(text: str, says: str, tmp_path: Path) -> None:
    assert told(text, tmp_path) == [says]


def test_all_that_is_wrong_is_told_in_the_order_of_the_file(tmp_path: Path) -> None:
    lines = told("shade: 1\npower_mw: x\nshade: 2\ncolours: 3\npower_mw: 4\n", tmp_path)
    assert [line.split(":")[1] for line in lines] == ["1", "2", "3", "4", "5"]


def test_the_nearest_name_comes_first() -> None:
    assert closest_first("repeat", ["step", "standoffs_mm", "repeats"]) == ["repeats", "step", "standoffs_mm"]
    assert closest_first("zzz", ["b", "a"]) == ["b", "a"]


def test_a_value_that_fits_no_type_of_a_union_is_one_mistake_at_its_key() -> None:
    with pytest.raises(ValidationError) as caught:
        Answer.model_validate({"value": [1]})
    assert caught.value.error_count() > 1
    (found,) = problems(Answer, {"value": [1]}, caught.value.errors())
    assert found.location == ("value",)


class Bounded(FileModel):
    both: Annotated[float, Field(ge=-80, le=80)] = 0.0
    one: Annotated[float, Field(ge=0)] = 0.0


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"both": 95}, "both: expected -80 to 80, got 95"),
        ({"both": -95}, "both: expected -80 to 80, got -95"),
        ({"one": -1}, "one: expected at least 0, got -1"),
    ],
)
def test_the_message_of_a_number_outside_names_both_bounds(values: dict[str, float], text: str) -> None:
    with pytest.raises(ValidationError) as caught:
        Bounded.model_validate(values)
    (problem,) = problems(Bounded, values, caught.value.errors())
    assert problem.message == text
