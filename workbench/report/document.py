"""Document as data: title, verdict, key numbers, and sections of facts, texts, tables and charts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Literal

from workbench.model.chart import Chart
from workbench.model.table import Table

NOT_STATED = "not stated"
"""Text of an item that the laboratory file leaves open."""
Tone = Literal["good", "bad", "open"]


@dataclass(frozen=True)
class Fact:
    """One named statement."""

    name: str
    value: str

    @property
    def is_stated(self) -> bool:
        """Whether there is a value."""
        return self.value != NOT_STATED


@dataclass(frozen=True)
class KeyNumber:
    """One of the numbers on the first page."""

    name: str
    value: str
    """With its unit; a dash if it was not measured."""
    note: str
    """Kind of the uncertainty, number of readings, place."""


@dataclass(frozen=True)
class Verdict:
    """Verdict on the first page."""

    tone: Tone
    text: str
    reasons: tuple[str, ...] = ()


@dataclass(frozen=True)
class Section:
    """One section."""

    key: str
    """Name in JSON and in links."""
    title: str
    facts: tuple[Fact, ...] = ()
    texts: tuple[str, ...] = ()
    """Paragraphs."""
    tables: tuple[Table, ...] = ()
    charts: tuple[Chart, ...] = ()


@dataclass(frozen=True)
class Document:
    """A document without the time of printing: equal sources give equal documents."""

    title: str
    number: str
    """Number of a certificate; empty for other documents."""
    replaces: str
    """Number of the certificate that this one replaces; empty if there is none."""
    head: tuple[Fact, ...]
    """Facts below the title."""
    verdict: Verdict
    key_numbers: tuple[KeyNumber, ...]
    sections: tuple[Section, ...]
    authorised_by: str = ""
    """Person who signs; empty: the document is not signed."""
    colors: Mapping[str, str] = field(default_factory=dict)
    """Colours (`#rrggbb`) by the name of a series, for example of lasers."""

    def as_json(self) -> dict[str, object]:
        """Plain values for JSON; tables as records with unscaled values."""
        return {
            "title": self.title,
            "number": self.number,
            "replaces": self.replaces,
            "head": {fact.name: fact.value for fact in self.head},
            "verdict": asdict(self.verdict),
            "key_numbers": [asdict(number) for number in self.key_numbers],
            "sections": [_section_json(section) for section in self.sections],
        }


def _section_json(section: Section) -> dict[str, object]:
    return {
        "key": section.key,
        "title": section.title,
        "facts": {fact.name: fact.value if fact.is_stated else None for fact in section.facts},
        "texts": section.texts,
        "tables": [_table_json(table) for table in section.tables],
        "charts": [chart.model_dump(mode="json") for chart in section.charts],
    }


def _table_json(table: Table) -> dict[str, object]:
    units = {column.key: column.unscaled_unit for column in table.columns if column.unit}
    return {"name": table.name, "title": table.title, "units": units, "rows": table.records()}
