"""Schema of simulated scenes in front of one or two lines of lasers, and of claims about their ranges."""

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
    """Stated value of a quantity of a scene, to be compared with the measured value."""

    quantity: Quantity
    stated: Annotated[float, Field(ge=0)] | None = None
    """Relative error, mm or number, depending on `quantity`; None: only measured."""
    set_mm: Span | None = None
    """Distances of the claim; None: those of the scene."""


class SimulatedScene(FileModel):
    """Surface at distances from `set_mm[0]` to `set_mm[1]`.

    In front of each line the surface is y(x) = set distance + slope x for an incline. For coefficients, the
    second term is the sum of coefficients[k] (x - shift)^(k + 1). The position x along the front counts from
    the line's first laser, mm.
    """

    name: Annotated[str, Field(pattern=r"^[a-z0-9-]+$")]
    source: str
    """Figure or section of the thesis."""
    lines: Annotated[tuple[LineName, ...], Field(min_length=1)] = ("horizontal",)
    incline_deg: Annotated[float, Field(gt=-90, lt=90)] | None = None
    coefficients: tuple[float, ...] = ()
    shift_mm: float = 0.0
    lost: tuple[Annotated[int, Field(ge=1)], ...] = ()
    """Lasers of each line, counted from 1, whose spot is not visible."""
    set_mm: Span
    points: Annotated[int, Field(ge=2, le=1_000_000)] | None = None
    """Number of distances; None: that of the step."""
    claims: Annotated[tuple[Claim, ...], Field(min_length=1)]

    @model_validator(mode="after")
    def _is_one_surface(self) -> SimulatedScene:
        if self.incline_deg is not None and self.coefficients:
            raise ValueError("expected incline_deg or coefficients, got both")
        if not 0 < self.set_mm[0] < self.set_mm[1]:
            raise ValueError(f"set_mm: expected nearest < farthest, got {list(self.set_mm)}")
        if len(set(self.lines)) != len(self.lines):
            raise ValueError(f"lines: expected each line once, got {list(self.lines)}")
        return self

    @property
    def shape(self) -> str:
        """True shape."""
        if self.coefficients:
            return f"round {len(self.coefficients)}"
        return "incline" if self.incline_deg else "flat"


class ChainReadings(FileModel):
    """Results of one chain for a scene, one value per distance."""

    closest_mm: tuple[float | None, ...]
    """Closest ranges; None where no spot was seen."""
    shape: tuple[str, ...]
    angle_deg: tuple[float | None, ...]


class SceneSimulated(FileModel):
    """Scene at many distances, ranged by three chains."""

    scene: SimulatedScene
    set_mm: tuple[float, ...]
    true_mm: tuple[float, ...]
    """Smallest distance of the surface along the front."""
    thesis: ChainReadings
    """Chain of the thesis."""
    ours: ChainReadings
    """Chain of the workbench on noise-free frames."""
    noisy: ChainReadings
    """Chain of the workbench on frames with noise."""


class ClaimRow(FileModel):
    """Claim with the value that each chain reaches; units depend on `quantity`, see `Claim`."""

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
    """Whether the thesis's chain reaches the stated value, to the stated digits."""
    better: bool
    """Whether the workbench's chain without noise is better than the thesis's; true if both are perfect."""
