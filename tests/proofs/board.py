"""`python -m tests.proofs.board`: sessions on the virtual bench, fitted with the printed board and without.

Every frame is rendered, stored, read again as `workbench fit` does, and searched for spots and corners. Some
minutes; the table goes to docs/benchmarks.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml as pyyaml

from tests.support.stored_output import store
from workbench.calibration.data.spot_rows import observations_of_rows
from workbench.calibration.estimation.fit import CalibrationFit, fit
from workbench.calibration.verdict.assessment import determined_by
from workbench.model.captures import load_captures
from workbench.model.rig import Rig, load_rig
from workbench.procedure.engine.plan import Plan
from workbench.procedure.engine.procedure_file import Procedure, load_procedure
from workbench.procedure.engine.run import Invocation, run

ROOT = Path(__file__).parents[2]
RIG = ROOT / "rigs/thesis-emulated.yaml"
PROCEDURE = ROOT / "procedures/calibrate-board.yaml"
SEEDS = (2001, 7, 42, 1, 2, 3)
F_LIMIT = 0.001
"""Relative error of the focal length."""


@dataclass(frozen=True)
class Study:
    """One bench: its truth, and what the fits with and without the board say."""

    seed: int
    truth: dict[str, float]
    joint: CalibrationFit
    flat: CalibrationFit

    def f(self, result: CalibrationFit) -> tuple[float, float, float, str]:
        """Error and sd relative to the truth, data share, and what it rests on."""
        true = self.truth["f_px"]
        error, sd = result.values[0] / true - 1, result.sd[0] / true
        return float(error), float(sd), float(result.data_share[0]), determined_by(result)[0]

    @property
    def distance2(self) -> tuple[float, int]:
        """Squared distance of the joint fit's sensor from the truth in its covariance, and its dimension."""
        free = [i for i, p in enumerate(self.joint.table.parameters[self.joint.sensor]) if p.prior.sd]
        names = [self.joint.table.parameters[i].name for i in free]
        error = self.joint.values[free] - np.array([self.truth[name] for name in names])
        covariance = self.joint.covariance[np.ix_(free, free)]
        return float(error @ np.linalg.solve(covariance, error)), len(free)

    @property
    def corner_chi2(self) -> float:
        """Mean square of the corners' residuals in their stated deviations."""
        sd = np.concatenate([view.corners.sd_px for view in self.joint.boards])
        return float(np.mean((self.joint.corner_residual_px / sd) ** 2))

    def error_sd(self, name: str) -> float:
        """Error of a parameter of the joint fit in its stated deviations."""
        i = [p.name for p in self.joint.table.parameters].index(name)
        return float((self.joint.values[i] - self.truth[name]) / self.joint.sd[i])


def study(rig: Rig, procedure: Procedure, seed: int, folder: Path) -> Study:
    """Run a procedure on the bench of a seed, then fit what it stored: all of it, and its flats alone."""
    rig = rig.model_copy(update={"emulator": {**(rig.emulator or {}), "seed": seed}})
    plan = Plan(rig, RIG, (procedure,), (PROCEDURE,))
    session = folder / f"seed-{seed}"
    run(
        plan, session, (), Invocation("proof", "tests.proofs.board", "2000-01-01T00:00:00+0000"), lambda: None
    )
    observations, rejected, boards = observations_of_rows(rig, load_captures(session / "captures.csv"))
    on_boards = {view.placement.key for view in boards}
    flats = [s for s in observations if s.placement not in on_boards]
    return Study(seed, _truth(session), fit(rig, observations, rejected, boards), fit(rig, flats))


def table(studies: list[Study]) -> list[str]:
    """The table, line by line."""
    lines = [
        "f_px: error and stated sd in % of the truth, share that the data determine.",
        "chi2: squared distance of all sensor parameters from the truth in the joint covariance, over their",
        "number. corners: rms of the residuals, and their mean square in stated deviations. print, L1.x:",
        "error in stated deviations.",
        "",
        f"{'':>6}|{'flat alone':^28}|{'with the board':^28}|{'':>7}|{'corners':^20}|{'':>7}{'':>7}",
        f"{'seed':>6}|{'error':>8}{'sd':>7}{'share':>6}{'by':>6} |{'error':>8}{'sd':>7}{'share':>6}{'by':>6} "
        f"|{'chi2':>6} |{'number':>7}{'px':>7}{'sd^2':>5} |{'print':>7}{'L1.x':>7}",
    ]
    for one in studies:
        distance2, free = one.distance2
        corners = one.joint.corner_residual_px
        lines.append(
            f"{one.seed:>6}|{_f(one, one.flat)} |{_f(one, one.joint)} |{distance2 / free:>6.2f} "
            f"|{len(corners):>7}{one.joint.corner_rms_px:>7.3f}{one.corner_chi2:>5.2f} "
            f"|{one.error_sd('print_scale'):>+7.1f}{one.error_sd('L1.x_mm'):>+7.1f}"
        )
    return lines


def misses(studies: list[Study]) -> list[str]:
    """What is not as it should be."""
    found = []
    for one in studies:
        error, sd, share, by = one.f(one.joint)
        if abs(error) > F_LIMIT or sd > F_LIMIT:
            found.append(f"seed {one.seed}: f is off by {100 * error:.3f} %, sd {100 * sd:.3f} %")
        if by != "data" or share < 0.99:
            found.append(f"seed {one.seed}: f is not said to be determined by the data")
        distance2, free = one.distance2
        # Chi-square of `free` degrees of freedom, variance 2 free: four deviations.
        if distance2 > free + 4 * np.sqrt(2 * free):
            found.append(f"seed {one.seed}: the truth lies {distance2:.0f} off for {free} parameters")
    return found


def main() -> int:
    """Run, print, write; 1 if a figure is missed."""
    rig, procedure = load_rig(RIG), load_procedure(PROCEDURE)
    with tempfile.TemporaryDirectory() as name:
        studies = []
        for seed in SEEDS:
            studies.append(study(rig, procedure, seed, Path(name)))
            print(f"seed {seed} done", file=sys.stderr)
    lines = ["", *table(studies), *misses(studies)]
    store("board", "Printed board", "python -m tests.proofs.board", lines)
    return 1 if misses(studies) else 0


def _f(one: Study, result: CalibrationFit) -> str:
    error, sd, share, by = one.f(result)
    return f"{100 * error:>+8.3f}{100 * sd:>7.3f}{share:>6.2f}{by:>6}"


def _truth(session: Path) -> dict[str, float]:
    """What the emulator hides, by the names of the calibration."""
    path = session.with_name(session.name + ".truth.yaml")
    hidden: dict[str, Any] = pyyaml.safe_load(path.read_text())
    rays = {f"{i}.{name}": value for i, ray in hidden["lasers"].items() for name, value in ray.items()}
    return {name: value for name, value in hidden.items() if isinstance(value, float)} | rays


if __name__ == "__main__":
    sys.exit(main())
