"""A running session without a procedure: the context that a step runs in, on the virtual bench."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

from tests.support.ideal import exact, ideal_rig, laser
from tests.support.plain_bench import plain_bench
from tests.support.rigs import PROVENANCE
from workbench.devices.protocols import Operator
from workbench.model import event as ev
from workbench.model.errors import AnswerNeededError
from workbench.model.prompt import Answer, Prompt
from workbench.model.rig import Rig
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.replay import ReplayingJournal
from workbench.session.journal import Journal

YES = Answer()
CY_PX = 59.5


def two_laser_rig() -> Rig:
    """Two lasers of exactly known baselines, without noise; a low picture, which is fast to draw."""
    camera = {"height_px": 120, "cy_px": exact(CY_PX)}
    return ideal_rig(laser("L1", -60.0), laser("L2", 60.0), camera=camera)


def with_emulator(rig: Rig, **blocks: object) -> Rig:
    """The rig with other blocks of its virtual bench."""
    return rig.model_copy(update={"emulator": {**(rig.emulator or {}), **blocks}})


@dataclass
class Scripted:
    """Answers prompts by key, each in turn, and `otherwise` every other one; keeps what was asked."""

    answers: Mapping[str, Sequence[Answer]] = field(default_factory=dict)
    otherwise: Answer | None = YES
    asked: list[Prompt] = field(default_factory=list)

    def ask(self, prompt: Prompt) -> Answer:
        times = sum(one.key == prompt.key for one in self.asked)
        self.asked.append(prompt)
        given = self.answers.get(prompt.key, ())
        answer = given[times] if times < len(given) else self.otherwise
        if answer is None:
            raise AnswerNeededError(prompt.key)
        return answer

    @property
    def keys(self) -> list[str]:
        return [prompt.key for prompt in self.asked]


@dataclass
class Running:
    """A context, and the events that its steps have journalled."""

    context: Context
    records: list[ev.Record]
    stop: list[str] = field(default_factory=list)
    """A reason put in here stops the session."""

    @property
    def events(self) -> list[ev.Event]:
        return [record.event for record in self.records]

    @property
    def kinds(self) -> list[str]:
        return [event.kind for event in self.events]


@contextmanager
def running(
    folder: Path,
    rig: Rig | None = None,
    operator: Operator | None = None,
    before: Sequence[ev.Record] = (),
    *,
    rests: bool = True,
) -> Iterator[Running]:
    """A session in `folder`/s that goes on after `before`; the operator says yes to everything by default.

    `rests`: as of `Bench`.
    """
    session = folder / "s"
    session.mkdir(exist_ok=True)
    rig = rig or two_laser_rig()
    seen: list[ev.Record] = []
    stop: list[str] = []
    with replace(plain_bench(rig, folder), rests=rests) as bench, Journal(session) as journal:
        recorder = ReplayingJournal(journal, [seen.append], before)
        context = Context(
            session,
            rig,
            bench,
            operator or Scripted(),
            recorder,
            PROVENANCE,
            lambda: stop[0] if stop else None,
        )
        yield Running(context, seen, stop)
