"""Manifest of the pictures in the documentation: what each shows, so that a test finds stale ones.

A picture of the viewer cannot be compared by pixels: drivers differ. It is stale if the layout, the look of
the charts, the numbers on it, or the viewer's version have changed since `make pictures`.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import rerun.blueprint as rrb

from tests.support.stored_output import ROOT, newest
from tests.tables.of_thesis import SIMULATION
from workbench.api import open_session
from workbench.figures.figure import svg
from workbench.figures.picture import picture
from workbench.model.chart import Chart
from workbench.model.rig import load_rig
from workbench.report.document_html import document_html
from workbench.viewer.blueprint import TrialTab, blueprint

IMAGES = ROOT / "docs/images"
MANIFEST = IMAGES / "pictures.json"
CERTIFICATE = ROOT / "docs/certificate-demo.pdf"
BAD_STANDOFF = ROOT / "data/sessions/20261130-120758-bad-standoff"
REFERENCE = ROOT / "data/session-0.1.0"
CHARTS = ("figure-21", "figure-23", "figure-28")
"""Charts of the stored simulation that are in the documentation."""
DRAWINGS = ("triangulation.svg", "wiring.svg")
"""Drawn by hand."""
DEMO_SCREENS = ("captures.png", "fit.png", "fit-details.png", "trial.png", "bench.png")
Shown = dict[str, str]


def shown_by(name: str) -> Shown:
    """Hashes and versions of what a picture shows, by name.

    Raises:
        LookupError: no command makes a picture of this name.
    """
    screen = {"layout": layout(), "charts": look_of_charts(), "viewer": version("rerun-sdk")}
    if name in DEMO_SCREENS:
        return screen | {"demo": demo()}
    if name == "faults.png":
        return screen | {"session": file_hash(Path(__file__).with_name("faults.py"))}
    if name == "notebook-viewer.png":
        return screen | {"session": file_hash(BAD_STANDOFF / "journal.jsonl")}
    if name in {"certificate.png", CERTIFICATE.name}:
        return {"page": page(), "demo": demo()}
    raise LookupError(f"no command makes {name}")


def names() -> list[str]:
    """All pictures of the manifest."""
    return [*DEMO_SCREENS, "faults.png", "notebook-viewer.png", "certificate.png", CERTIFICATE.name]


def path_of(name: str) -> Path:
    """File of a picture."""
    return CERTIFICATE if name == CERTIFICATE.name else IMAGES / name


def record(*made: str) -> None:
    """Write into the manifest what pictures show that were made just now."""
    manifest: dict[str, Any] = json.loads(MANIFEST.read_text()) if MANIFEST.exists() else {}
    for name in made:
        manifest[name] = {"sha256": file_hash(path_of(name)), "shows": shown_by(name)}
    MANIFEST.write_text(json.dumps(manifest, indent=2, sort_keys=True) + "\n")


def chart_svg(name: str) -> bytes:
    """A chart of the stored simulation, as the session's figure."""
    return svg(_chart(name), {})


def file_hash(path: Path) -> str:
    """SHA-256 of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


@cache
def layout() -> str:
    """Hash of the demo's layout: views with their names, contents and properties."""
    rig = load_rig(ROOT / "rigs/thesis-emulated.yaml")
    tab = TrialTab("accuracy-flat.1", (("accuracy-flat.1-errors", "Errors"),))
    return _hash(*(_lines(blueprint(rig, [tab], "trial").root_container)))


@cache
def look_of_charts() -> str:
    """Hash of one chart's pixels as the recording has them."""
    return _hash(hashlib.sha256(picture(_chart(CHARTS[0]), {}).png).hexdigest())


@cache
def demo() -> str:
    """Hash of what the demo prints, without names of sessions."""
    return _hash(*(line for line in newest("demo").lines if "sessions/" not in line))


@cache
def page() -> str:
    """Hash of the certificate's page for a stored session."""
    return _hash(document_html(open_session(REFERENCE).report().certificate.document, ""))


def _chart(name: str) -> Chart:
    charts = open_session(SIMULATION).trials["thesis-simulation.1"].charts
    return next(chart for chart in charts if chart.name == name)


def _lines(part: Any) -> Iterator[str]:
    """Description of a container or a view, and of all parts below."""
    if isinstance(part, rrb.Container):
        yield _joined(type(part).__name__, part.name, part.column_shares, part.row_shares)
        for below in part.contents:
            yield from _lines(below)
        return
    yield _joined(type(part).__name__, part.name, part.origin, part.contents)
    for name, value in sorted(part.properties.items()):
        for batch in value.as_component_batches():
            yield _joined(name, batch.component_descriptor(), batch.as_arrow_array().to_pylist())


def _joined(*values: object) -> str:
    return " ".join(map(str, values))


def _hash(*texts: str) -> str:
    return hashlib.sha256("\n".join(texts).encode()).hexdigest()
