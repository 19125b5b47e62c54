"""Records of a session that ran at stated times, for tests of durations and progress."""

from __future__ import annotations

from workbench.model import event as ev
from workbench.model.target import Placement
from workbench.procedure.engine.plan import PlannedStep


def records(*timed: tuple[float, ev.Event]) -> list[ev.Record]:
    return [ev.Record(n=n, time_ns=round(t * 1e9), event=event) for n, (t, event) in enumerate(timed)]


def started(index: int, shots: int) -> ev.StepStarted:
    return ev.StepStarted(procedure="p", index=index, step="s", title="t", shots=shots)


def placed(key: str) -> ev.TargetPlaced:
    return ev.TargetPlaced(placement=Placement(key=key, standoff_mm=500.0))


def taken(key: str, lit_s: float) -> ev.CaptureTaken:
    frame = ev.FrameRef(path="f", sha256="", time_ns=0)
    return ev.CaptureTaken(
        key=key,
        purpose="calibration",
        laser_id="L1",
        placement_key=key[0],
        standoff_mm=500.0,
        repeat=0,
        on=frame,
        lit_s=lit_s,
    )


def shot(at_s: float, key: str, took_s: float = 0.0, lit_s: float = 0.1) -> list[tuple[float, ev.Event]]:
    """A capture, and its spots found `took_s` later."""
    return [(at_s, taken(key, lit_s)), (at_s + took_s, ev.SpotsFound(key=key, spots=()))]


def exposed(key: str) -> ev.ExposureSet:
    return ev.ExposureSet(key=key, exposure=1.0, unit="", peak=0.6, verdict="good", trials=3)


def finished(index: int) -> ev.StepFinished:
    return ev.StepFinished(procedure="p", index=index, outcome="")


SESSION: list[tuple[float, ev.Event]] = [
    (0, started(1, 4)),
    (20, placed("a")),
    *shot(20.5, "a1", 0.5, lit_s=0.1),
    *shot(21.5, "a2", 0.5, lit_s=0.3),
    (22, ev.PlacementFinished(key="a")),
    (62, placed("b")),
    *shot(64.0, "b1", 1.0, lit_s=0.2),
]
STEPS = [PlannedStep("p", 1, "grid", 3, 6), PlannedStep("p", 2, "fit", 0, 0, 7.0)]
