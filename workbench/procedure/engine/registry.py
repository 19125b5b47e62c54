"""Registry of the kinds of steps, from which the schema of a procedure file is built.

A kind is registered by the decorator `register` when its module is imported. Modules are found through the
entry-point group `workbench.steps`: the project's packages `workbench.steps` and `workbench.trials`, and
those of other installed packages.
"""

from __future__ import annotations

from functools import cache
from importlib.metadata import entry_points
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, Field, GetCoreSchemaHandler
from pydantic.fields import FieldInfo
from pydantic_core import CoreSchema

from workbench.model.errors import BadInputError
from workbench.model.yamlfile import FileModel
from workbench.procedure.engine.step import Step, StepModel

GROUP = "workbench.steps"
StepKind = TypeVar("StepKind", bound=StepModel)
_kinds: dict[str, type[StepModel]] = {}
_models: list[type[FileModel]] = []
"""Models whose schema contains the union of all kinds."""


def register(kind: type[StepKind]) -> type[StepKind]:
    """Class decorator: add a kind of step under the literal of its field `step`.

    Raises:
        TypeError: the class does not implement the protocol `Step`, or another class has the same literal.
    """
    if not issubclass(kind, StepModel):
        raise TypeError(f"{kind.__qualname__}: expected a subclass of StepModel")
    fields: dict[str, FieldInfo] = kind.model_fields
    annotation: Any = fields["step"].annotation if "step" in fields else None
    tags = get_args(annotation) if get_origin(annotation) is Literal else ()
    if len(tags) != 1:
        raise TypeError(f'{kind.__qualname__}: expected a field `step: Literal["..."]`, got {annotation}')
    if missing := [name for name in ("title", "run") if not hasattr(kind, name) and name not in fields]:
        raise TypeError(f"{kind.__qualname__}: expected the members of a Step, {', '.join(missing)} missing")
    known = _kinds.get(tags[0])
    if known is not None and (known.__module__, known.__qualname__) != (kind.__module__, kind.__qualname__):
        raise TypeError(
            f"{kind.__qualname__}: expected a name that no other step has, got {tags[0]}, which is registered"
            f" by {known.__module__}"
        )
    _kinds[tags[0]] = kind
    for model in _models:
        if model.__pydantic_complete__:  # built without this kind
            model.model_rebuild(force=True)
    return kind


def step_kinds() -> dict[str, type[StepModel]]:
    """Kinds of steps by tag, including those of installed packages.

    Raises:
        BadInputError: an installed package's entry point cannot be loaded.
    """
    _load_installed()
    return dict(sorted(_kinds.items()))


@cache
def _load_installed() -> None:
    for point in sorted(entry_points(group=GROUP), key=lambda point: point.name):
        try:
            point.load()
        except (Exception, SystemExit) as error:  # code of other packages may raise anything
            raise BadInputError(
                f"step package {point.value}: cannot be imported ({type(error).__name__}: {error}); repair or"
                " uninstall the package that has this entry point"
            ) from error


class AnyKind:
    """Annotation of a field whose value is one of the registered kinds, selected by the tag `step`."""

    @staticmethod
    def models() -> list[type[BaseModel]]:
        """Registered kinds, for messages that name their keys; see `model.problems`."""
        return list(step_kinds().values())

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Schema of the union of all kinds that are registered when the model is built."""
        kinds = tuple(step_kinds().values())
        return handler.generate_schema(Annotated[Union[kinds], Field(discriminator="step")])  # noqa: UP007


def rebuild_with_new_kinds(model: type[FileModel]) -> None:
    """Rebuild `model`, which has fields of type `AnyStep`, when further kinds are registered."""
    _models.append(model)


AnyStep = Annotated[Step, AnyKind]
