"""Short procedures on the emulated rig, and what their sessions journal."""

from __future__ import annotations

from pathlib import Path

from workbench.model import event as ev
from workbench.procedure.engine.plan import Plan
from workbench.procedure.engine.run import Invocation
from workbench.session.journal import read_journal

RIG = Path(__file__).parents[2] / "rigs/thesis-emulated.yaml"
CALLER = Invocation(operator="A. Technician", command="workbench run", created="2026-01-01T12:00:00+0000")


def plan_of(folder: Path, rig: Path = RIG, **procedures: str) -> Plan:
    """A plan of procedure files written to `folder`, given as YAML lists of steps by name."""
    paths = []
    for name, steps in procedures.items():
        paths.append(folder / f"{name}.yaml")
        paths[-1].write_text(f"format: 1\nprocedure: {name}\ntitle: T\nsteps:\n{steps}")
    return Plan.load(rig, paths)


def story(session: Path) -> list[ev.Event]:
    """Events of a session, in order."""
    return [record.event for record in read_journal(session)]
