"""Tables of the comparisons with the thesis."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np

from tests.support.same_frames import SameFrames
from tests.support.stored_output import FOLDER, ROOT, newest
from tests.tables.markdown import code_block, markdown_table
from workbench.model.event import TrialFinished
from workbench.model.number_text import two_digits
from workbench.model.rig import load_rig
from workbench.model.table import Cell
from workbench.procedure.engine.procedure_file import load_procedure
from workbench.session.journal import read_journal
from workbench.trials.thesis import thesis_chain
from workbench.trials.thesis.scene import line_of, seen, surface_mm, truth
from workbench.trials.thesis.schema import ChainReadings, Claim, SceneSimulated, SimulatedScene
from workbench.trials.thesis.simulation import claim_rows
from workbench.trials.thesis.step import ThesisSimulationStep

SIMULATION = ROOT / "data/sessions/20261130-115245-thesis-simulation"
PROCEDURE = ROOT / "procedures/thesis-simulation.yaml"
RIG = ROOT / "rigs/thesis-simulated.yaml"
SEED_OF_RIG = 2001
"""Seed of the bench in the rig file."""
HARDWARE_ROW = re.compile(
    r"(?P<figure>.{5})  (?P<target>.{8})  (?P<quantity>.+?) +(?P<to>\d+|-) +(?P<thesis>[\d.]+|-)"
    r" +(?P<ours>[\d.]+|-) +(?P<ratio>[\d.]+|-) +(?P<goal>[\d.]+|-)(?: +(?P<met>yes|NO))?$"
)
HEADLINES = {
    ("flat", "mean range error, %", "2000"): ("flat, mean range error, %", "2000"),
    ("flat", "mean range error, %", "4500"): ("flat, mean range error, %", "4500"),
    ("30 deg", "angle error, %", "500"): ("angle of an incline of 30 deg, error, %", "500"),
    ("60 deg", "angle error, %", "500"): ("angle of an incline of 60 deg, error, %", "500"),
    ("cylinder", "cylinder range error, %", "-"): (
        "cylinder of 178 mm diameter, error of its fitted range, %",
        "1000",
    ),
}
"""Rows in the README by target, quantity and farthest range: their text, and the farthest range, mm."""
MANY = 800
"""Distances of a scene for the claims of the thesis; it does not state its own number."""
ENDS_MM, FEW, SEED = (100, 1000, 1500, 3000, 5000), 60, 1
"""Ends of the spans, distances in each, and seed of the noise, for both chains on the same frames."""
Row = Mapping[str, Cell]
VALUES = ("stated", "thesis", "ours", "noisy")
"""Columns of the simulation."""


@dataclass(frozen=True)
class HardwareRow:
    """One row of the thesis's hardware tests."""

    target: str
    quantity: str
    to_mm: str
    thesis: str
    ours: str
    goal: str
    is_missed: bool


def hardware() -> str:
    """The table as the terminal prints it."""
    return code_block("\n".join(_hardware_lines(SEED_OF_RIG)))


def headlines() -> str:
    """The README's rows."""
    rows = {(row.target, row.quantity, row.to_mm): row for row in _hardware_rows(SEED_OF_RIG)}
    cells = [(*texts, rows[key].thesis, rows[key].ours) for key, texts in HEADLINES.items()]
    return markdown_table(("test", "up to (mm)", "thesis", "workbench"), cells)


def seeds() -> str:
    """All rows with a goal, for every seed with a stored output; that of the rig file comes first."""
    stored = {int(path.stem.rpartition("-")[2]) for path in FOLDER.glob("*-thesis-*.txt")}
    numbers = [SEED_OF_RIG, *sorted(stored - {SEED_OF_RIG})]
    by_seed = [[row for row in _hardware_rows(seed) if row.goal != "-"] for seed in numbers]
    rows = [
        (
            f"{one[0].target}, {one[0].quantity}",
            one[0].to_mm,
            *(f"{row.ours} NO" if row.is_missed else row.ours for row in one),
            one[0].goal,
        )
        for one in zip(*by_seed, strict=True)
    ]
    return markdown_table(("quantity", "to (mm)", *(f"seed {seed}" for seed in numbers), "goal"), rows)


def simulation() -> str:
    """Every claim of the thesis's simulation with the values of all chains."""
    rows = []
    for scene, claim in _claims():
        row = _simulated()[_key(scene, claim)]
        nearest, farthest = claim.set_mm or scene.set_mm
        star = "*" if row["not_reproduced"] else ""
        stated, thesis, ours, noisy = _values(row, claim)
        what = f"{claim.quantity} {nearest:.0f}-{farthest:.0f}"
        rows.append((scene.name, what, stated, thesis + star, ours, noisy))
    return markdown_table(("scene", "what", "stated", "thesis", "ours", "noise"), rows, numbers_from=2)


def simulation_summary() -> str:
    """Largest errors of the ranges to 5 m, and the farthest right shapes."""
    heading = ("largest error of the closest range, to 5 m", "stated", "thesis's chain", "ours")
    inclines, rounds = ("incline-30", "incline-60"), ("round-2", "round-3", "round-4")
    right = "farthest with the right shape: 30 deg / degree 2 / degree 3, m"
    rows = [
        ("flat, %", *_joined(("flat-horizontal",), "range", 100.0)),
        ("incline of 30 / 60 deg, %", *_joined(inclines, "range", 100.0)),
        ("round, degree 2 / 3 / 4, %", *_joined(rounds, "range", 100.0)),
        (right, *_joined(("incline-30", "round-2", "round-3"), "shape", 1e-3)),
    ]
    return markdown_table((*heading, "ours, with noise"), rows)


def many_distances() -> str:
    """Claims of the thesis by its chain at many distances."""
    rows = []
    for scene in _scenes():
        claims = tuple(claim for claim in scene.claims if claim.stated)
        if not claims or scene.lost or "vertical" in scene.lines:
            continue
        for row in claim_rows(_by_thesis_chain(scene.model_copy(update={"claims": claims}))):
            assert row.stated is not None
            assert row.thesis is not None
            what = f"{row.quantity} {row.nearest_mm:.0f}-{row.farthest_mm:.0f}"
            texts = [
                f"{value:.0f} mm" if row.quantity == "shape" else f"{100 * value:.3g} %"
                for value in (row.stated, row.thesis)
            ]
            rows.append((scene.name, what, *texts, "yes" if row.reproduced else "no"))
    return markdown_table(("scene", "what", "stated", "found", "met"), rows, numbers_from=2)


def same_frames() -> str:
    """Both chains on the same frames of a flat."""
    line = line_of(load_rig(RIG), "horizontal")
    frames = [SameFrames(line, noisy, np.random.default_rng(SEED)) for noisy in (False, True)]
    rows = []
    for nearest, farthest in pairwise(ENDS_MM):
        cells = [cell for one in frames for cell in _largest(one, nearest, farthest)]
        rows.append((f"{nearest} to {farthest} mm", *cells))
    of_three = ("thesis's chain", "ours", "ours, mean")
    heading = ("distance", *of_three, *(f"noise: {name}" for name in of_three))
    return markdown_table(heading, rows)


def _largest(frames: SameFrames, nearest_mm: int, farthest_mm: int) -> Iterator[str]:
    """Largest relative errors between two distances: closest ranges by both chains, mean range by ours."""
    errors: tuple[list[float], ...] = ([], [], [])
    for distance_mm in np.linspace(nearest_mm, farthest_mm, FEW).tolist():
        theirs, ours = frames.read(distance_mm)
        ranges = (theirs, ours and ours.closest_mm, ours and ours.flat_mm)
        for one, range_mm in zip(errors, ranges, strict=True):
            if range_mm is not None:
                one.append(abs(range_mm / distance_mm - 1))
    for one in errors:
        missing = f", {FEW - len(one)} missing" if len(one) < FEW else ""
        yield f"{two_digits(100 * max(one))} %{missing}"


def _hardware_lines(seed: int) -> list[str]:
    """Lines of the table, with its title and caption."""
    lines = [line.rstrip() for line in newest(f"thesis-{seed}").lines]
    begin = next(n for n, line in enumerate(lines) if line.startswith("Thesis's hardware tests"))
    return lines[begin : lines.index("lasers left off", begin) + 1]


def _hardware_rows(seed: int) -> Iterator[HardwareRow]:
    for line in _hardware_lines(seed):
        if row := HARDWARE_ROW.match(line):
            yield HardwareRow(
                row["target"].strip(),
                row["quantity"],
                row["to"],
                row["thesis"],
                row["ours"],
                row["goal"],
                row["met"] == "NO",
            )


@cache
def _scenes() -> tuple[SimulatedScene, ...]:
    (step,) = [one for one in load_procedure(PROCEDURE).steps if isinstance(one, ThesisSimulationStep)]
    return step.scenes


def _claims() -> Iterator[tuple[SimulatedScene, Claim]]:
    for scene in _scenes():
        for claim in scene.claims:
            yield scene, claim


def _key(scene: SimulatedScene, claim: Claim) -> tuple[str, str, float, float]:
    nearest, farthest = claim.set_mm or scene.set_mm
    return scene.name, claim.quantity, nearest, farthest


@cache
def _simulated() -> dict[tuple[Cell, ...], Row]:
    """Rows of the stored simulation by scene, quantity, nearest and farthest distance."""
    (finished,) = [r.event for r in read_journal(SIMULATION) if isinstance(r.event, TrialFinished)]
    found: dict[tuple[Cell, ...], Row] = {}
    for table in finished.tables:
        quantity = table.name.rpartition("-")[2]
        for record in table.records():
            key = record["scene"], quantity, record["nearest_mm"], record["farthest_mm"]
            found[key] = {name.removesuffix("_mm"): value for name, value in record.items()}
    return found


def _values(row: Row, claim: Claim) -> list[str]:
    """Stated, and by the three chains."""
    percent = claim.quantity in {"range", "angle"}
    return [
        "-" if not isinstance(value, float) else f"{100 * value:.2f} %" if percent else f"{value:.0f}"
        for value in (row[key] for key in VALUES)
    ]


def _joined(scenes: Sequence[str], quantity: str, scale: float) -> list[str]:
    """Values of the first claim of a quantity of several scenes, joined by slashes."""
    rows = []
    for name in scenes:
        scene = next(one for one in _scenes() if one.name == name)
        claim = next(one for one in scene.claims if one.quantity == quantity)
        rows.append(_simulated()[_key(scene, claim)])
    return [" / ".join(two_digits(scale * float(row[key] or 0.0)) for row in rows) for key in VALUES]


def _by_thesis_chain(scene: SimulatedScene) -> SceneSimulated:
    """A scene at many distances, by the thesis's chain alone."""
    line = line_of(load_rig(RIG), "horizontal")
    nearest, farthest = scene.set_mm
    distances = (np.linspace(nearest**0.5, farthest**0.5, MANY) ** 2).tolist()
    lit = seen(scene, line)
    read = [thesis_chain.read(line, surface_mm(scene, line.front_mm, d), lit) for d in distances]
    readings = ChainReadings(
        closest_mm=tuple(one.closest_mm for one in read),
        shape=tuple(one.shape for one in read),
        angle_deg=tuple(one.angle_deg for one in read),
    )
    true = tuple(float(truth(scene, [line], d).closest_mm or 0.0) for d in distances)
    return SceneSimulated(
        scene=scene, set_mm=tuple(distances), true_mm=true, thesis=readings, ours=readings, noisy=readings
    )
