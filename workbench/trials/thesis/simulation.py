"""Stand-alone simulation of the thesis with its chain and the workbench's, compared with its claims."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal

import numpy as np
import pandas as pd
from numpy.random import Generator

from workbench.model.rig import Rig
from workbench.trials.thesis import thesis_chain
from workbench.trials.thesis.scene import LaserLine, Outcome, line_of, seen, surface_mm, truth
from workbench.trials.thesis.schema import ChainReadings, Claim, ClaimRow, SceneSimulated, SimulatedScene
from workbench.trials.thesis.workbench_chain import Chain

CHAINS = ("thesis", "ours", "noisy")
RIGHT_ANGLE = 0.2
"""Largest relative error of the angle of a recognised incline; the thesis states no bound."""
ROUND_MM = 100.0
"""Resolution of the distances that the thesis states."""


@dataclass(frozen=True)
class Lines:
    """Lines of lasers of a scene, with the workbench's chains for them."""

    lines: tuple[LaserLine, ...]
    ours: tuple[Chain, ...]
    noisy: tuple[Chain, ...]

    @classmethod
    def of(cls, rig: Rig, scene: SimulatedScene) -> Lines:
        """Lines of a scene.

        Raises:
            BadInputError: the rig lacks a line.
        """
        lines = tuple(line_of(rig, name) for name in scene.lines)
        span = (scene.set_mm[0], scene.set_mm[1])
        return cls(
            lines,
            tuple(Chain(line, False, span) for line in lines),
            tuple(Chain(line, True, span) for line in lines),
        )


def simulate(scene: SimulatedScene, rig: Rig, points: int, rng: Generator) -> SceneSimulated:
    """Simulate a scene at `points` distances with every chain.

    Distances are equally spaced in their square root, because the period of the thesis's sawtooth error is
    proportional to the square of the distance.

    Raises:
        BadInputError: the scene does not match the rig.
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
    assert closest is not None  # noqa: S101 - a surface has a distance everywhere
    return closest


def _read(lines: Lines, scene: SimulatedScene, set_mm: float, rng: Generator) -> dict[str, Outcome]:
    depths = [surface_mm(scene, line.front_mm, set_mm) for line in lines.lines]
    lit = [seen(scene, line) for line in lines.lines]
    placed = list(zip(depths, lit, strict=True))
    by_thesis = [thesis_chain.read(n, *at) for n, at in zip(lines.lines, placed, strict=True)]
    by_ours = [chain.read(*at, rng) for chain, at in zip(lines.ours, placed, strict=True)]
    by_noisy = [chain.read(*at, rng) for chain, at in zip(lines.noisy, placed, strict=True)]
    return {
        "thesis": combined(by_thesis, [line.length_px for line in lines.lines]),
        "ours": combined(by_ours, [_information(o) for o in by_ours]),
        "noisy": combined(by_noisy, [_information(o) for o in by_noisy]),
    }


def _information(outcome: Outcome) -> float:
    return 0.0 if outcome.sigma_mm is None else outcome.sigma_mm**-2


def combined(outcomes: Sequence[Outcome], weights: Sequence[float]) -> Outcome:
    """Combined result of one or two lines: weighted mean of the closest ranges, shapes joined."""
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
    """Every claim of the scene with the values that the chains reach."""
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
        and not _has_fewer(simulated, claim, simulated.ours, simulated.thesis),
    )


def _reached(simulated: SceneSimulated, claim: Claim, chain: ChainReadings) -> float | None:
    inside = _inside(simulated, claim)
    if claim.quantity == "shape":
        return _farthest_right(simulated, chain, inside)
    if claim.quantity == "readings":
        return float(sum(chain.closest_mm[i] is not None for i in inside))
    errors = [e for i in inside if (e := _error(simulated, claim, chain, i)) is not None]
    return max(errors, default=None)


def _inside(simulated: SceneSimulated, claim: Claim) -> list[int]:
    """Indices of the distances of a claim."""
    nearest, farthest = claim.set_mm or simulated.scene.set_mm
    set_mm = np.array(simulated.set_mm)
    inside = np.flatnonzero((set_mm >= nearest * (1 - 1e-9)) & (set_mm <= farthest * (1 + 1e-9)))
    return [int(i) for i in inside]


def _error(simulated: SceneSimulated, claim: Claim, chain: ChainReadings, i: int) -> float | None:
    error = _angle_error if claim.quantity == "angle" else _range_error
    return error(simulated, chain, i)


def _has_fewer(simulated: SceneSimulated, claim: Claim, one: ChainReadings, other: ChainReadings) -> bool:
    """Whether the largest error of `one` is over fewer readings than that of `other`."""
    if claim.quantity not in ("range", "angle"):
        return False
    return _missing(simulated, claim, one) > _missing(simulated, claim, other)


def _missing(simulated: SceneSimulated, claim: Claim, chain: ChainReadings) -> int:
    """Number of readings without a range or an angle."""
    return sum(_error(simulated, claim, chain, i) is None for i in _inside(simulated, claim))


def _range_error(simulated: SceneSimulated, chain: ChainReadings, i: int) -> float | None:
    """Relative error of the range; None if no spot was seen."""
    closest, true = chain.closest_mm[i], simulated.true_mm[i]
    return None if closest is None else abs(closest - true) / true


def _angle_error(simulated: SceneSimulated, chain: ChainReadings, i: int) -> float | None:
    """Relative error of the angle, 0 degrees for a flat; None for other shapes."""
    measured = 0.0 if chain.shape[i] == "flat" else chain.angle_deg[i]
    true = simulated.scene.incline_deg
    return None if measured is None or not true else abs(measured - true) / abs(true)


def _farthest_right(simulated: SceneSimulated, chain: ChainReadings, inside: Sequence[int]) -> float:
    """Last distance with the true shape before two consecutive wrong ones; 0 if there is none.

    The significance test rejects one true shape in a hundred, so a single rejection does not end the span.
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
    """Whether the reached value, rounded to the digits of the stated one, satisfies the claim."""
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
    """CSV of all readings, one line per scene and distance; ranges in mm, angles in degrees."""
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
    """CSV of the claims, columns as in `ClaimRow`."""
    return pd.DataFrame([row.model_dump() for row in rows]).to_csv(index=False, lineterminator="\n")
