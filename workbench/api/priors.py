"""What-if rigs: a parameter known better, worse or otherwise than the rig file states."""

from __future__ import annotations

from pathlib import Path

from pydantic import ValidationError

from workbench.api.arguments import rig_of, words_of
from workbench.model.errors import BadInputError
from workbench.model.nested import with_prior as changed_prior
from workbench.model.rig import Rig


def with_prior(rig: str | Path | Rig, name: str, value: float | None = None, sd: float | None = None) -> Rig:
    """A rig that knows one parameter otherwise, for `fit`, `design` and `simulate`.

    Examples:
        >>> import workbench as wb
        >>> rig = wb.with_prior("rigs/thesis-emulated.yaml", "L1.x_mm", sd=0.02)
        >>> rig.lasers[0].x_mm.value, rig.lasers[0].x_mm.sd
        (-60.0, 0.02)

    Args:
        rig: a rig file, or its contents.
        name: parameter, as in `Calibration.parameters`: `f_px`, `offset_mm`, `L1.x_mm`.
        value: mean of its prior in its unit; None keeps the rig's.
        sd: 1 sigma of its prior; 0 makes it a constant, None keeps the rig's.

    Raises:
        BadInputError: the rig has no such parameter, or a number is wrong.
    """
    try:
        changed = changed_prior(rig_of(rig), words_of("name", name, "the name of a parameter"), value, sd)
        Rig.model_validate(changed.model_dump())
    except ValidationError as error:
        first = error.errors()[0]
        raise BadInputError(f"with_prior {name}: {first['msg']}, got value {value}, sd {sd}") from None
    return changed
