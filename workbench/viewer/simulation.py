"""The thesis's simulation: errors of each chain over the distance, and the table of claims."""

from __future__ import annotations

import rerun as rr

from workbench.model.simulation import ChainReadings, SceneSimulated, SimulationFinished
from workbench.viewer import documents
from workbench.viewer import entities as at
from workbench.viewer.stream import Stream

PERCENT = 100.0
CHAINS = ("thesis", "ours", "noisy")


def log_scene(stream: Stream, event: SceneSimulated) -> None:
    """Errors of the closest range, (measured - true) / true in percent, on the timeline of standoffs."""
    for name in CHAINS:
        chain: ChainReadings = getattr(event, name)
        errors = {
            round(set_mm): PERCENT * (closest - true) / true
            for set_mm, closest, true in zip(event.set_mm, chain.closest_mm, event.true_mm, strict=True)
            if closest is not None
        }
        stream.curve(at.under(at.SIMULATION, event.scene.name, name), errors)


def log_claims(stream: Stream, event: SimulationFinished) -> None:
    """The table, where a trial's stands."""
    text = documents.claim_table(event)
    stream.log(at.TRIAL_SUMMARY, rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN))
