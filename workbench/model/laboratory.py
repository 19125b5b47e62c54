"""Schema of `lab.yaml`: what a certificate states about the laboratory, its standards and its conditions.

docs/certificate.md describes the format. Every key but `format` may be missing: the certificate then reports
that it is not stated.
"""

from __future__ import annotations

from datetime import date, datetime
from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, BeforeValidator, Field, field_validator

from workbench.model.name import Name
from workbench.model.text_length import length_error
from workbench.model.yamlfile import FileModel, load_yaml_model

LABORATORY_FILE = "lab.yaml"
Span = tuple[float, float]
"""Lowest and highest value."""


def _as_day(value: object) -> date:
    """Day of a date or of its text."""
    if isinstance(value, date):
        return value.date() if isinstance(value, datetime) else value
    try:
        return date.fromisoformat(value if isinstance(value, str) else "")
    except ValueError:
        raise ValueError(f"expected a day, such as 2026-11-30, got {value!r}") from None


def _not_too_long(text: str) -> str:
    if wrong := length_error(text):
        raise ValueError(wrong)
    return text


Text = Annotated[Name, AfterValidator(_not_too_long)]
Day = Annotated[date, BeforeValidator(_as_day)]
"""A day, as 2026-11-30."""


class Party(FileModel):
    """A laboratory or a customer."""

    name: Text
    address: Text = ""
    contact: Text = ""


class Standard(FileModel):
    """An instrument, or a reference standard from which true values come."""

    name: Text
    serial: Text = ""
    certificate: Text = ""
    """Number of its calibration certificate and the laboratory that issued it."""
    calibrated: Day | None = None
    due: Day | None = None
    """Day of its next calibration."""
    expanded_uncertainty: Annotated[float, Field(gt=0)] | None = None
    unit: Text = ""
    coverage_factor: Annotated[float, Field(gt=0)] = 2.0


class Ambient(FileModel):
    """Ambient conditions, as measured or as the room is controlled."""

    temperature_c: Span | None = None
    humidity_percent: Span | None = None

    @field_validator("temperature_c", "humidity_percent")
    @classmethod
    def _is_a_span(cls, span: Span | None) -> Span | None:
        if span is not None and span[0] > span[1]:
            raise ValueError(f"expected [lowest, highest], got {list(span)}")
        return span


class Recalibration(FileModel):
    """Interval of recalibration that was agreed with the customer."""

    months: Annotated[int, Field(ge=1, le=120)]
    reason: Text


class Laboratory(FileModel):
    """A laboratory file, format 1."""

    format: Literal[1]
    laboratory: Party | None = None
    country: Annotated[str, Field(pattern=r"^([A-Z]{2})?$")] = ""
    """Country of the laboratory, two letters of ISO 3166-1."""
    place: Text = ""
    """Place of the work, if it is not the laboratory's address."""
    customer: Party | None = None
    manufacturer: Text = ""
    """Manufacturer of the sensor."""
    received: Day | None = None
    """Day on which the sensor was received."""
    authorised_by: Text = ""
    """Person who authorises the certificate."""
    number_prefix: Annotated[str, Field(pattern=r"^[A-Za-z0-9-]{0,12}$")] = ""
    """Letters before the certificates' numbers."""
    standards: tuple[Standard, ...] = ()
    ambient: Ambient = Ambient()
    warm_up_min: Annotated[float, Field(ge=0)] | None = None
    target_material: Text = ""
    recalibration: Recalibration | None = None
    remarks: Text = ""


def load_laboratory(folder: Path) -> Laboratory | None:
    """Read `lab.yaml` of a folder of sessions; None if there is none.

    Raises:
        BadInputError: the file is wrong.
    """
    path = folder / LABORATORY_FILE
    return load_yaml_model(path, Laboratory) if path.exists() else None
