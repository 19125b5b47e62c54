"""A simulated scene before one or two lines of lasers, and what is claimed of ranging it."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from workbench.model.rig import PositiveFloat
from workbench.model.yamlfile import FileModel

LineName = Literal["horizontal", "vertical"]
Quantity = Literal["range", "angle", "shape", "readings"]
"""Largest relative error of the closest range or of an incline's angle; farthest distance up to which every
shape is right; number of readings with a range."""
Span = Annotated[tuple[PositiveFloat, ...], Field(min_length=2, max_length=2)]


class Claim(FileModel):
    """What somebody states of a scene, to be held against what is measured."""

    quantity: Quantity
    stated: Annotated[float, Field(ge=0)] | None = None
    """Relative, mm or a number, by `quantity`; nothing where it is only to be measured."""
    set_mm: Span | None = None
    """Distances it holds for; the scene's if not given."""


class SimulatedScene(FileModel):
    """A surface that is put at distances from `set_mm[0]` to `set_mm[1]`.

    Before each line the surface is y(x) = set distance + the incline's slope x, or + the sum of
    coefficients[k] (x - shift)^(k + 1); x runs along the front from the line's first laser, mm.
    """

    name: Annotated[str, Field(pattern=r"^[a-z0-9-]+$")]
    source: str
    """The thesis's figure or section."""
    lines: Annotated[tuple[LineName, ...], Field(min_length=1)] = ("horizontal",)
    incline_deg: Annotated[float, Field(gt=-90, lt=90)] | None = None
    coefficients: tuple[float, ...] = ()
    shift_mm: float = 0.0
    lost: tuple[Annotated[int, Field(ge=1)], ...] = ()
    """Lasers of each line, counted from 1, whose spot nobody sees."""
    set_mm: Span
    points: Annotated[int, Field(ge=2, le=1_000_000)] | None = None
    """Distances to put it at; as many as the step says if not given."""
    claims: Annotated[tuple[Claim, ...], Field(min_length=1)]

    @model_validator(mode="after")
    def _is_one_surface(self) -> SimulatedScene:
        if self.incline_deg is not None and self.coefficients:
            raise ValueError("expected incline_deg or coefficients, got both")
        if not 0 < self.set_mm[0] < self.set_mm[1]:
            raise ValueError(f"set_mm: expected nearest < farthest, got {list(self.set_mm)}")
        if len(set(self.lines)) != len(self.lines):
            raise ValueError(f"lines: expected each once, got {list(self.lines)}")
        return self

    @property
    def shape(self) -> str:
        """Right name of the shape."""
        if self.coefficients:
            return f"round {len(self.coefficients)}"
        return "incline" if self.incline_deg else "flat"


class ChainReadings(FileModel):
    """What one chain made of a scene, a value for each distance."""

    closest_mm: tuple[float | None, ...]
    """None where no spot was seen."""
    shape: tuple[str, ...]
    angle_deg: tuple[float | None, ...]


class SceneSimulated(FileModel):
    """A scene was put at many distances and ranged by three chains."""

    scene: SimulatedScene
    set_mm: tuple[float, ...]
    true_mm: tuple[float, ...]
    """Smallest distance of the surface before the front."""
    thesis: ChainReadings
    """As in the thesis."""
    ours: ChainReadings
    """The workbench's, on frames without noise."""
    noisy: ChainReadings
    """The workbench's, on frames with noise."""


class ClaimRow(FileModel):
    """A claim, and what each chain reached; units by `quantity` as in `Claim`."""

    scene: str
    source: str
    quantity: Quantity
    nearest_mm: float
    farthest_mm: float
    stated: float | None
    thesis: float | None
    ours: float | None
    noisy: float | None
    reproduced: bool | None
    """Whether the thesis's chain keeps what the thesis states, to the digits it states."""
    better: bool
    """Whether ours, without noise as the thesis's, is better than the thesis's, or as good where both are
    perfect."""
