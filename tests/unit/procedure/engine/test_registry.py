"""Registered kinds of steps, and the schema of a procedure file that is built from them."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import ClassVar, Literal, get_args

import pytest

from workbench.model.errors import BadInputError
from workbench.procedure.engine import registry
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.procedure_file import load_procedure
from workbench.procedure.engine.registry import AnyKind, register, step_kinds
from workbench.procedure.engine.step import StepModel

PROCEDURE = "format: 1\nprocedure: p\ntitle: P\nsteps:\n  - {step: late_kind, number: 3}\n"


class OwnStep(StepModel):
    """A step that does nothing."""

    needs: ClassVar[str | None] = None

    @property
    def title(self) -> str:
        return "Nothing"

    def run(self, context: Context, name: str) -> str:
        return ""


@pytest.fixture
def kinds(monkeypatch: pytest.MonkeyPatch) -> Iterator[dict[str, type[StepModel]]]:
    """The known kinds, as they were again after the test."""
    before = step_kinds()
    known = dict(registry._kinds)
    monkeypatch.setattr(registry, "_kinds", known)
    yield known
    monkeypatch.undo()
    assert step_kinds() == before
    for model in registry._models:
        model.model_rebuild(force=True)


def test_a_class_without_a_tag_is_refused(kinds: dict[str, type[StepModel]]) -> None:
    before = dict(kinds)
    with pytest.raises(TypeError):

        @register
        class Untagged(OwnStep):
            pass

    with pytest.raises(TypeError):

        @register
        class AnyTag(OwnStep):
            step: str

    with pytest.raises(TypeError):

        @register
        class TwoTags(OwnStep):
            step: Literal["one", "two"]

    assert kinds == before


def test_a_class_without_run_is_refused(kinds: dict[str, type[StepModel]]) -> None:
    with pytest.raises(TypeError, match="run"):

        @register
        class Idle(StepModel):
            step: Literal["idle_kind"]
            title: str = "Idle"

    assert "idle_kind" not in kinds


def test_a_doubled_tag_is_refused_and_the_first_class_stays(kinds: dict[str, type[StepModel]]) -> None:
    fit = kinds["fit"]
    with pytest.raises(TypeError, match=r"workbench\.steps\.fit"):

        @register
        class Fit(OwnStep):
            step: Literal["fit"]

    assert kinds["fit"] is fit


def test_a_class_that_is_imported_again_takes_the_place_of_itself(kinds: dict[str, type[StepModel]]) -> None:
    def define() -> type[StepModel]:
        @register
        class Again(OwnStep):
            step: Literal["again_kind"]

        return Again

    define()
    second = define()
    assert kinds["again_kind"] is second


def test_a_kind_registered_late_is_in_the_schema(kinds: dict[str, type[StepModel]], tmp_path: Path) -> None:
    path = tmp_path / "p.yaml"
    path.write_text(PROCEDURE)
    with pytest.raises(BadInputError, match=r"p\.yaml:5: steps\[0\]\.step"):
        load_procedure(path)

    @register
    class Late(OwnStep):
        step: Literal["late_kind"]
        number: int

    (step,) = load_procedure(path).steps
    assert isinstance(step, Late)
    assert step.number == 3
    assert Late in AnyKind.models()
    path.write_text(PROCEDURE.replace("number: 3", "number: three"))
    with pytest.raises(BadInputError, match=r"p\.yaml:5: steps\[0\]\.number"):
        load_procedure(path)


@pytest.mark.parametrize("fault", ["missing", "raise SystemExit(0)", "raise SystemExit", "1 / 0"])
def test_an_entry_point_that_cannot_be_imported_is_bad_input(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, fault: str
) -> None:
    if fault != "missing":
        (tmp_path / "broken_package_of_steps.py").write_text(f"{fault}\n")
    monkeypatch.syspath_prepend(tmp_path)
    broken = EntryPoint("broken", "broken_package_of_steps", registry.GROUP)
    monkeypatch.setattr(registry, "entry_points", lambda group: [broken])
    registry._load_installed.cache_clear()
    try:
        with pytest.raises(BadInputError, match="broken_package_of_steps") as caught:
            step_kinds()
    finally:
        monkeypatch.undo()
        registry._load_installed.cache_clear()
    assert caught.value.exit_code == 2
    assert "fit" in step_kinds()


def test_every_module_of_steps_and_every_trial_is_registered() -> None:
    modules = {kind.__module__ for kind in step_kinds().values()}
    root = Path(registry.__file__).parents[2]
    steps = {f"workbench.steps.{path.stem}" for path in root.glob("steps/*.py") if path.stem != "__init__"}
    trials = {f"workbench.trials.{path.parent.name}.step" for path in root.glob("trials/*/step.py")}
    assert steps | trials <= modules
    assert all(get_args(kind.model_fields["step"].annotation) == (tag,) for tag, kind in step_kinds().items())
