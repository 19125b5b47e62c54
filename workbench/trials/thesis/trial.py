"""Execution of the thesis's simulation, with its tables."""

from __future__ import annotations

from collections.abc import Sequence
from zlib import crc32

import numpy as np

from workbench.model.event import TrialProgress
from workbench.model.table import Column, Table
from workbench.procedure.engine.context import Context
from workbench.session.files import write_record
from workbench.trials.results import finish_trial
from workbench.trials.thesis.figures import figures
from workbench.trials.thesis.schema import ClaimRow, Quantity, SimulatedScene
from workbench.trials.thesis.simulation import claim_rows, claims_csv, readings_csv, simulate

SEED = 2001
"""Seed of a scene's noise together with its name, so that adding a scene does not change the others."""
PERCENT = 100.0
TITLES: dict[Quantity, str] = {
    "range": "Largest relative error of the closest range",
    "angle": "Largest relative error of the incline's angle",
    "shape": "Farthest distance up to which the shape is right",
    "readings": "Readings with a range",
}
RELATIVE = {"range", "angle"}


def run_trial(context: Context, name: str, scenes: Sequence[SimulatedScene], points: int) -> str:
    """Simulate the scenes at `points` distances each; returns the outcome in one line.

    Raises:
        BadInputError: a scene does not match the rig.
        StoppedError: a stop was requested.
    """
    simulated, rows = [], []
    for scene in scenes:
        context.check_stop()
        rng = np.random.default_rng([SEED, crc32(scene.name.encode())])
        one = simulate(scene, context.rig, scene.points or points, rng)
        simulated.append(one)
        rows += claim_rows(one)
        text = f"{scene.name}, {scene.source}: {len(one.set_mm)} distances"
        context.emit(TrialProgress(trial=name, text=text))
    write_record(context.session_dir / f"{name}.csv", claims_csv(rows).encode())
    write_record(context.session_dir / f"{name}-readings.csv", readings_csv(simulated).encode())
    charts = figures({one.scene.name: one for one in simulated})
    finish_trial(context, name, claim_tables(name, rows), charts)
    stated = [row for row in rows if row.reproduced is not None]
    return (
        f"{sum(row.reproduced is True for row in stated)} of {len(stated)} claims of the thesis reproduced;"
        f" workbench better in {sum(row.better for row in rows)} of {len(rows)} rows; tables in {name}.csv"
    )


def claim_tables(name: str, rows: Sequence[ClaimRow]) -> list[Table]:
    """Tables of stated and reached values, one for each claimed quantity."""
    return [
        _claim_table(name, quantity, [row for row in rows if row.quantity == quantity])
        for quantity in TITLES
        if any(row.quantity == quantity for row in rows)
    ]


def _claim_table(name: str, quantity: Quantity, rows: Sequence[ClaimRow]) -> Table:
    relative = quantity in RELATIVE
    form = {"format": ".2f", "scale": PERCENT} if relative else {"format": ".0f"}
    unit = "%" if relative else "mm" if quantity == "shape" else ""
    suffix = "" if relative or not unit else f"_{unit}"

    def value(key: str, heading: str) -> Column:
        return Column(key=f"{key}{suffix}", name=heading, unit=unit, **form)

    columns = (
        Column(key="scene", name="scene"),
        Column(key="nearest_mm", name="from", unit="mm"),
        Column(key="farthest_mm", name="to", unit="mm"),
        value("stated", "stated"),
        value("thesis", "thesis"),
        Column(key="not_reproduced", name=""),
        value("ours", "ours"),
        Column(key="not_better", name=""),
        value("noisy", "noise"),
    )
    return Table(
        name=f"{name}-claims-{quantity}",
        title=TITLES[quantity],
        columns=columns,
        rows=tuple(
            (
                row.scene,
                row.nearest_mm,
                row.farthest_mm,
                row.stated,
                row.thesis,
                row.reproduced is False,
                row.ours,
                not row.better,
                row.noisy,
            )
            for row in rows
        ),
        caption="! after thesis: claim not reproduced; ! after ours: not better than the thesis's chain",
    )
