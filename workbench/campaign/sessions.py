"""Campaign `sessions`: whole sessions on the virtual bench, from light to file, each of another sensor."""

from __future__ import annotations

import json
import re
import shutil
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Literal
from uuid import uuid4

import numpy as np
import pandas as pd
from pydantic import Field

from workbench.campaign.kind import Chunk, ChunkSize, Inputs, Summary, Work
from workbench.campaign.rig_input import read_rig, rig_of
from workbench.campaign.session_rows import (
    NO_FIT,
    TYPES,
    described,
    listed,
    no_rows,
    row_of,
    session_table,
    verdict_table,
)
from workbench.devices.registry import check_driver, whole_bench
from workbench.model.arrays import FloatArray
from workbench.model.chart import Axis, Chart, Series
from workbench.model.errors import (
    BadInputError,
    LimitFailedError,
    RigNotReadyError,
    StoppedError,
    WorkbenchError,
)
from workbench.model.event import SessionFinished
from workbench.model.number_text import counted
from workbench.model.rig_text import rig_text_of
from workbench.model.table import PERCENT
from workbench.model.yamlfile import standalone_text
from workbench.procedure.engine.plan import Plan
from workbench.procedure.engine.procedure_file import Procedure
from workbench.procedure.engine.resume import resume
from workbench.procedure.engine.run import Invocation, run
from workbench.report.certificate.session_record import read_session
from workbench.session.caller import now
from workbench.session.files import write_atomically
from workbench.session.manifest import MANIFEST

RIG, PROCEDURES = "rig", "procedures"
SESSIONS, FILES = "sessions", "files"
"""Folders in that of the campaign: the sessions, and the files that they were run with."""
SESSION_FILES = r"(rig-\d{6,}|procedure-\d+)\.yaml"
"""Pattern of the names of these files."""
SESSION_ASIDE = re.compile(r"\.\d{6,}-[A-Za-z0-9_-]+-[0-9a-f]{32}")
"""Names of folders in which sessions run."""
BLOCK, SEED = "emulator", "seed"
"""Block and key of a rig file that draw the virtual sensor."""
MOST_RESUMED = 5
"""Largest number of times that a session is resumed after a device did not answer in time, as on a busy
computer."""
RESULTS = (0, LimitFailedError.exit_code)
"""Exit codes of sessions that are results: finished, or ended by a limit on the sensor."""
SHARES = 101
"""Number of points of a chart of shares."""


class Sessions(Work):
    """Sessions on the virtual bench: every one has a sensor, placements and noise of its own."""

    thing = "session"

    kind: Literal["sessions"]
    rig: Path
    """Rig file with a virtual bench, relative to the campaign file."""
    procedures: Annotated[tuple[Path, ...], Field(min_length=1)]
    """Procedure files that each session runs, in this order."""
    sensors: Annotated[int, Field(ge=1, le=1_000_000)]
    """Number of sensors, with one session each."""
    chunk: ChunkSize = 1

    @property
    def input_keys(self) -> tuple[str, ...]:
        """The rig file and the procedure files."""
        return (RIG, PROCEDURES)

    def read_input(self, key: str, base: Path) -> str:
        """Text of the rig file, or texts of the procedure files, in their order."""
        if key == RIG:
            text = read_rig(base / self.rig)
            rig = rig_of(text)
            check_driver(rig)
            bench = whole_bench(rig)
            if bench is None or not bench.virtual or SEED not in (rig.emulator or {}):
                raise BadInputError(
                    f"{base / self.rig}: expected a rig with the virtual bench (driver: emulated) and"
                    f" {BLOCK}.{SEED}: a campaign switches no laser on"
                )
            return text
        Plan.load(base / self.rig, [base / path for path in self.procedures])
        return json.dumps([standalone_text(base / path, Procedure) for path in self.procedures])

    def count(self, inputs: Inputs) -> int:
        """Number of sessions."""
        return self.sensors

    def run(self, inputs: Inputs, chunk: Chunk, folder: Path) -> pd.DataFrame:
        """One row per session, which is kept in the folder of the campaign."""
        seeds = chunk.rng().integers(2**63, size=len(chunk.items))
        rows = [
            self._row(inputs, item, int(seed), folder) for item, seed in zip(chunk.items, seeds, strict=True)
        ]
        return pd.DataFrame(rows).astype(TYPES)

    def _row(self, inputs: Inputs, item: int, seed: int, folder: Path) -> dict[str, object]:
        procedures = _procedure_files(inputs, folder)
        rig = folder / FILES / f"rig-{item:06d}.yaml"
        serial = f"{rig_of(inputs[RIG]).serial}-{item:06d}"
        write_atomically(rig, rig_text_of(inputs[RIG], serial, {BLOCK: {SEED: seed}}).encode())
        plan = Plan.load(rig, procedures)
        session = folder / SESSIONS / f"{item:06d}-{plan.procedures[0].procedure}"
        if not session.exists():
            _run_aside(plan, session)
        return _result(session)

    def summarise(self, inputs: Inputs, frames: Iterable[pd.DataFrame]) -> Summary:
        """Verdicts, and the sessions whose ranges are most uncertain."""
        verdicts: Counter[tuple[str, str]] = Counter()
        most, sds = no_rows(), [np.empty(0)]
        for frame in frames:
            verdicts.update(zip(frame["before"], frame["now"], strict=True))
            sds.append(frame["relative_sd_now"].dropna().to_numpy())
            together = pd.concat([most, frame], ignore_index=True)
            most = listed(together, together["relative_sd_now"])
        by_state = Counter[str]()
        for (_, state), number in verdicts.items():
            by_state[state] += number
        accepted, unfitted = by_state["accepted"], by_state[NO_FIT]
        return Summary(
            headline=f"{accepted} of {verdicts.total()} sessions end with an accepted calibration",
            tables=(verdict_table(verdicts), session_table(most, "are most uncertain")),
            charts=_charts(np.concatenate(sds)),
            notes=(f"{unfitted} of {verdicts.total()} sessions ended without a fit",) if unfitted else (),
        )


def _procedure_files(inputs: Inputs, folder: Path) -> list[Path]:
    """Copies of the procedure files in the folder of the campaign."""
    (folder / FILES).mkdir(exist_ok=True)
    found = []
    for number, text in enumerate(json.loads(inputs[PROCEDURES]), start=1):
        found.append(folder / FILES / f"procedure-{number}.yaml")
        write_atomically(found[-1], text.encode())
    return found


def _run_aside(plan: Plan, session: Path) -> None:
    """Run a session, in a folder that gets its name at the end: a worker that dies leaves no part of one.

    It needs no process of its own: the guardian of the virtual lasers is one, the bench answers its own
    prompts, and signals are left to the worker.

    Raises:
        StoppedError: the session did not finish; none of its files is kept.
        BadInputError: the procedures cannot be run.
    """
    aside = session.parent / f".{session.name}-{uuid4().hex}"
    own = aside / session.name
    try:
        _finish(plan, own)
        try:
            own.rename(session)
        except OSError:
            if not session.exists():  # another worker was faster, with the same result
                raise
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def _finish(plan: Plan, session: Path) -> None:
    """Run a session to its end; it is resumed while its devices do not answer in time.

    Raises:
        StoppedError: the session did not finish, by an external cause.
        BadInputError: the procedures cannot be run.
    """
    caller = Invocation(operator="campaign", command="workbench campaign", created=now())
    why = ""
    for resumed in range(MOST_RESUMED + 1):
        try:
            if (session / MANIFEST).exists():
                resume(session, (), caller, _not_stopped)
            else:
                run(plan, session, (), caller, _not_stopped)
        except LimitFailedError:
            return  # a result of the sensor
        except BadInputError as error:
            raise BadInputError(f"session {session.name}: {error}") from None
        except WorkbenchError as error:
            times = f", resumed {counted(resumed, 'time')}," if resumed else ""
            why = f"session {session.name}{times} did not finish, and is no result: {error}"
            if not isinstance(error, RigNotReadyError):
                break
        else:
            return
    # Not from the error: virtual lasers that may be on must not end the command as real ones do.
    raise StoppedError(why)


def _result(session: Path) -> dict[str, object]:
    """Row of a session that has finished, or has failed a limit.

    Raises:
        BadInputError: it has not, or is damaged.
    """
    row = row_of(session.name)
    found = read_session(session)
    ends = [one.event for one in found.records[-1:] if isinstance(one.event, SessionFinished)]
    if not ends or ends[0].exit_code not in RESULTS:
        raise BadInputError(
            f"{session}: expected a session that finished or failed a limit, got one that is"
            f" {found.status.state}: {found.status.why}; delete this folder, and the session runs again"
        )
    row["serial"] = found.rig.serial
    if found.fit is not None:
        row |= {"now": found.fit.verdict, "rms_px_now": found.fit.rms_px}
        row["reason"] = "; ".join(found.fit.reasons)
    if found.is_own_calibration and found.calibration is not None:
        row |= described(found.calibration, "now")
    if found.status.state != "finished" and not row["reason"]:
        row["reason"] = found.status.why
    return row


def _charts(relative_sd: FloatArray) -> tuple[Chart, ...]:
    """Distribution of the largest stated relative sd of a range."""
    if not len(relative_sd):
        return ()
    shares = np.linspace(0.0, 1.0, SHARES)
    x = tuple((PERCENT * np.quantile(relative_sd, shares)).tolist())
    series = Series(name="sessions", x=x, y=tuple((PERCENT * shares).tolist()), style="line")
    return (
        Chart(
            name="uncertainty",
            title="Share of the sessions whose largest stated sd of a range does not exceed a value",
            x=Axis(label="sd / range", unit="%"),
            y=Axis(label="sessions", unit="%"),
            series=(series,),
        ),
    )


def _not_stopped() -> None:
    """No request to stop: the campaign keeps finished sessions only."""
