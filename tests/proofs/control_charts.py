"""`python -m tests.proofs.control_charts`: run lengths of the control charts of `workbench history`.

Simulated sensors with five distances and five readings each; normal errors. Half a minute.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np

from tests.support.stored_output import store
from workbench.model.arrays import FloatArray
from workbench.trials.statistics.control_chart import FIRST_SESSIONS, control_chart

SENSORS, CHARTS, REPEATS = 600, 5, 5
SEED = 2026
LONGEST = 1000
"""Number of sessions after which a simulated run ends; it shortens the mean run length."""
DRIFTING = 60
"""Number of sessions of a drifting sensor."""
DRIFT_SD = 0.25
"""Drift of one distance from session to session, in standard deviations."""


@dataclass(frozen=True)
class RunLengths:
    """Sessions until the first alarm of any chart, one number for each sensor."""

    sound: tuple[int, ...]
    """At most `LONGEST`."""
    drifting: tuple[int, ...]

    @property
    def false_alarms(self) -> int:
        """Number of sound sensors with an alarm."""
        return sum(length < LONGEST for length in self.sound)


def simulated() -> RunLengths:
    """Run lengths of sound and of drifting sensors."""
    random = np.random.default_rng(SEED)
    sound = [run_length(*drawn(random, FIRST_SESSIONS + LONGEST, 0.0)) for _ in range(SENSORS)]
    drifting = [run_length(*drawn(random, FIRST_SESSIONS + DRIFTING, DRIFT_SD)) for _ in range(SENSORS)]
    return RunLengths(tuple(sound), tuple(drifting))


def drawn(random: np.random.Generator, sessions: int, drift_sd: float) -> tuple[FloatArray, FloatArray]:
    """Values and scatters (charts, sessions) of a sensor; the first chart drifts after the first sessions."""
    values = random.standard_normal((CHARTS, sessions))
    values[0, FIRST_SESSIONS:] += drift_sd * np.arange(1, sessions - FIRST_SESSIONS + 1)
    freedom = REPEATS - 1
    return values, np.sqrt(random.chisquare(freedom, (CHARTS, sessions)) / freedom)


def run_length(values: FloatArray, scatter: FloatArray) -> int:
    """Number of sessions after the first k until the first alarm of any chart."""
    ends = [len(values[0])]
    for one, spread in zip(values, scatter, strict=True):
        chart = control_chart(one, spread, np.full(len(one), REPEATS), CHARTS)
        assert chart is not None
        if chart.alarm is not None:
            ends.append(chart.alarm.index + 1)
    return min(ends) - FIRST_SESSIONS


def main() -> int:
    """Run, print, write."""
    found = simulated()
    low, high = np.percentile(found.drifting, [5, 95])
    lines = [
        f"seed {SEED}, {SENSORS} sensors, {CHARTS} distances, {REPEATS} readings; runs end at {LONGEST}",
        f"sound: one false alarm in {sum(found.sound) / found.false_alarms:.0f} sessions;"
        f" mean run length {np.mean(found.sound):.0f}",
        f"one distance drifts by {DRIFT_SD} sd a session: found after"
        f" {np.mean(found.drifting):.1f} sessions on average (5 to 95 %: {low:.0f} to {high:.0f})",
    ]
    store("control_charts", "Control charts", "python -m tests.proofs.control_charts", lines)
    return 0


if __name__ == "__main__":
    sys.exit(main())
