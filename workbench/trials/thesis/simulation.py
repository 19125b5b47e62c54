"""The thesis's stand-alone simulation, run with its own chain and with ours, and what it claims of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal

import numpy as np
import pandas as pd
from numpy.random import Generator

from workbench.model.rig import Rig
from workbench.trials.thesis import thesis_chain
from workbench.trials.thesis.scene import Line, Outcome, line_of, seen, surface_mm, truth
from workbench.trials.thesis.schema import ChainReadings, Claim, ClaimRow, SceneSimulated, SimulatedScene
from workbench.trials.thesis.workbench_chain import Chain

CHAINS = ("thesis", "ours", "noisy")
RIGHT_ANGLE = 0.2
"""An incline is recognised when its angle is right to this part; the thesis gives no bound."""
ROUND_MM = 100.0
"""The thesis states distances in hundreds of millimetres."""


@dataclass(frozen=True)
class Lines:
    """The lines of lasers of a scene with the workbench's chains for them."""

    lines: tuple[Line, ...]
    ours: tuple[Chain, ...]
    noisy: tuple[Chain, ...]

    @classmethod
    def of(cls, rig: Rig, scene: SimulatedScene) -> Lines:
        """The lines that a scene asks for.

        Raises:
            BadInputError: the rig does not have them.
        """
        lines = tuple(line_of(rig, name) for name in scene.lines)
        span = (scene.set_mm[0], scene.set_mm[1])
        return cls(
            lines,
            tuple(Chain(line, False, span) for line in lines),
            tuple(Chain(line, True, span) for line in lines),
        )


def simulate(scene: SimulatedScene, rig: Rig, points: int, rng: Generator) -> SceneSimulated:
    """Put the scene at `points` distances and range it with every chain.

    They are evenly spaced in their square root: a tooth of the thesis's error is as long as the square of the
    distance, and the near teeth are many.

    Raises:
        BadInputError: scene and rig do not go together.
    """
    lines = Lines.of(rig, scene)
    nearest, farthest = scene.set_mm
    distances = (np.linspace(nearest**0.5, farthest**0.5, points) ** 2).tolist()
    read = [_read(lines, scene, set_mm, rng) for set_mm in distances]
    return SceneSimulated(
        scene=scene,
        set_mm=tuple(distances),
        true_mm=tuple(_true_mm(lines, scene, set_mm) for set_mm in distances),
        **{chain: _readings([one[chain] for one in read]) for chain in CHAINS},
    )


def _true_mm(lines: Lines, scene: SimulatedScene, set_mm: float) -> float:
    closest = truth(scene, lines.lines, set_mm).closest_mm
    assert closest is not None  # noqa: S101 - a surface is everywhere somewhere
    return closest


def _read(lines: Lines, scene: SimulatedScene, set_mm: float, rng: Generator) -> dict[str, Outcome]:
    depths = [surface_mm(scene, line.front_mm, set_mm) for line in lines.lines]
    lit = [seen(scene, line) for line in lines.lines]
    placed = list(zip(depths, lit, strict=True))
    by_thesis = [thesis_chain.read(n, *at) for n, at in zip(lines.lines, placed, strict=True)]
    by_ours = [chain.read(*at, rng) for chain, at in zip(lines.ours, placed, strict=True)]
    by_noisy = [chain.read(*at, rng) for chain, at in zip(lines.noisy, placed, strict=True)]
    return {
        "thesis": together(by_thesis, [line.length_px for line in lines.lines]),
        "ours": together(by_ours, [_information(o) for o in by_ours]),
        "noisy": together(by_noisy, [_information(o) for o in by_noisy]),
    }


def _information(outcome: Outcome) -> float:
    return 0.0 if outcome.sigma_mm is None else outcome.sigma_mm**-2


def together(outcomes: Sequence[Outcome], weights: Sequence[float]) -> Outcome:
    """One answer of one or two lines: closest ranges averaged by weight, shapes side by side."""
    found = [(o, w) for o, w in zip(outcomes, weights, strict=True) if o.closest_mm is not None]
    if len(found) == 1:
        return found[0][0]
    if not found:
        return outcomes[0]
    closest = np.average([o.closest_mm for o, _ in found], weights=[w for _, w in found])
    return Outcome(float(closest), " + ".join(o.shape for o, _ in found))


def _readings(outcomes: Sequence[Outcome]) -> ChainReadings:
    return ChainReadings(
        closest_mm=tuple(o.closest_mm for o in outcomes),
        shape=tuple(o.shape for o in outcomes),
        angle_deg=tuple(o.angle_deg for o in outcomes),
    )


def claim_rows(simulated: SceneSimulated) -> list[ClaimRow]:
    """Every claim of the scene with what each chain reached."""
    return [_row(simulated, claim) for claim in simulated.scene.claims]


def _row(simulated: SceneSimulated, claim: Claim) -> ClaimRow:
    scene = simulated.scene
    nearest, farthest = claim.set_mm or scene.set_mm
    reached = {chain: _reached(simulated, claim, getattr(simulated, chain)) for chain in CHAINS}
    return ClaimRow(
        scene=scene.name,
        source=scene.source,
        quantity=claim.quantity,
        nearest_mm=nearest,
        farthest_mm=farthest,
        stated=claim.stated,
        **reached,
        reproduced=_reproduced(claim, reached["thesis"]),
        better=_better(claim, farthest, reached["ours"], reached["thesis"])
        and not _tells_less(simulated, claim, simulated.ours, simulated.thesis),
    )


def _reached(simulated: SceneSimulated, claim: Claim, chain: ChainReadings) -> float | None:
    inside = _inside(simulated, claim)
    if claim.quantity == "shape":
        return _farthest_right(simulated, chain, inside)
    if claim.quantity == "readings":
        return float(sum(chain.closest_mm[i] is not None for i in inside))
    told = [e for i in inside if (e := _error(simulated, claim, chain, i)) is not None]
    return max(told, default=None)


def _inside(simulated: SceneSimulated, claim: Claim) -> list[int]:
    """Which of the distances a claim is about."""
    nearest, farthest = claim.set_mm or simulated.scene.set_mm
    set_mm = np.array(simulated.set_mm)
    inside = np.flatnonzero((set_mm >= nearest * (1 - 1e-9)) & (set_mm <= farthest * (1 + 1e-9)))
    return [int(i) for i in inside]


def _error(simulated: SceneSimulated, claim: Claim, chain: ChainReadings, i: int) -> float | None:
    error = _angle_error if claim.quantity == "angle" else _range_error
    return error(simulated, chain, i)


def _tells_less(simulated: SceneSimulated, claim: Claim, one: ChainReadings, other: ChainReadings) -> bool:
    """Whether a largest error of `one` is that of fewer readings."""
    if claim.quantity not in ("range", "angle"):
        return False
    return _untold(simulated, claim, one) > _untold(simulated, claim, other)


def _untold(simulated: SceneSimulated, claim: Claim, chain: ChainReadings) -> int:
    """How many readings tell no range, or no angle."""
    return sum(_error(simulated, claim, chain, i) is None for i in _inside(simulated, claim))


def _range_error(simulated: SceneSimulated, chain: ChainReadings, i: int) -> float | None:
    """Relative; None where no spot was seen."""
    closest, true = chain.closest_mm[i], simulated.true_mm[i]
    return None if closest is None else abs(closest - true) / true


def _angle_error(simulated: SceneSimulated, chain: ChainReadings, i: int) -> float | None:
    """Relative; a flat is an incline of 0 degrees, and what is neither tells no angle."""
    told = 0.0 if chain.shape[i] == "flat" else chain.angle_deg[i]
    true = simulated.scene.incline_deg
    return None if told is None or not true else abs(told - true) / abs(true)


def _farthest_right(simulated: SceneSimulated, chain: ChainReadings, inside: Sequence[int]) -> float:
    """Last distance with the right shape before two in a row are wrong; 0 if there is none.

    A test of significance rejects one right shape in a hundred: a single one does not end the span.
    """
    right = [_is_right(simulated, chain, i) for i in inside]
    end = next((k for k in range(1, len(right)) if not (right[k - 1] or right[k])), len(right))
    good = [i for i, is_right in zip(inside[:end], right[:end], strict=True) if is_right]
    return simulated.set_mm[good[-1]] if good else 0.0


def _is_right(simulated: SceneSimulated, chain: ChainReadings, i: int) -> bool:
    if chain.shape[i] != simulated.scene.shape:
        return False
    error = _angle_error(simulated, chain, i) if simulated.scene.shape == "incline" else None
    return error is None or error <= RIGHT_ANGLE


def _reproduced(claim: Claim, reached: float | None) -> bool | None:
    """Whether what was reached, rounded to the digits that the thesis states, keeps what it states."""
    if claim.stated is None or reached is None:
        return None
    if claim.quantity == "shape":
        return round(reached / ROUND_MM) * ROUND_MM >= claim.stated
    digits = Decimal(str(claim.stated)).as_tuple().exponent
    return round(reached, -int(digits)) <= claim.stated


def _better(claim: Claim, farthest: float, ours: float | None, thesis: float | None) -> bool:
    if ours is None or thesis is None:
        return ours is not None or thesis is None
    if claim.quantity == "shape":
        return ours > thesis or ours >= farthest
    return ours < thesis or ours == 0


def readings_csv(simulated: Sequence[SceneSimulated]) -> str:
    """Every reading, a line for each scene and distance; ranges in mm, angles in degrees."""
    tables = [
        pd.DataFrame(
            {"scene": one.scene.name, "set_mm": one.set_mm, "true_mm": one.true_mm}
            | {
                f"{chain}_{column}": getattr(getattr(one, chain), column)
                for chain in CHAINS
                for column in ("closest_mm", "shape", "angle_deg")
            }
        )
        for one in simulated
    ]
    return pd.concat(tables).to_csv(index=False, lineterminator="\n")


def claims_csv(rows: Sequence[ClaimRow]) -> str:
    """The table of claims as CSV, columns as in `ClaimRow`."""
    return pd.DataFrame([row.model_dump() for row in rows]).to_csv(index=False, lineterminator="\n")
