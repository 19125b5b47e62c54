"""All tables of the documentation that a command makes, by the name in their mark."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from tests.tables import budget, of_proofs, of_sessions, of_thesis

PAGES = (
    "README.md",
    "docs/budget.md",
    "docs/campaigns.md",
    "docs/colours.md",
    "docs/demo.md",
    "docs/design-of-standoffs.md",
    "docs/history.md",
    "docs/layouts.md",
    "docs/ranging.md",
    "docs/scanning.md",
    "docs/spots.md",
    "docs/target-trials.md",
    "docs/thesis-simulation.md",
    "docs/trials.md",
    "docs/validation.md",
    "docs/worlds.md",
)
"""Pages with such tables."""
TABLES: Mapping[str, Callable[[], str]] = {
    "thesis-headlines": of_thesis.headlines,
    "thesis-hardware": of_thesis.hardware,
    "thesis-seeds": of_thesis.seeds,
    "simulation": of_thesis.simulation,
    "simulation-summary": of_thesis.simulation_summary,
    "simulation-many-distances": of_thesis.many_distances,
    "same-frames": of_thesis.same_frames,
    "demo-trial": of_sessions.demo_trial,
    "demo-verdict": of_sessions.demo_verdict,
    "design": of_sessions.design,
    "designs": of_sessions.designs,
    "design-counts": of_sessions.design_counts,
    "shapes-exact": partial(of_proofs.shapes, "Calibration exact"),
    "shapes-calibrated": partial(of_proofs.shapes, "Calibration with the stated errors"),
    "shapes-flat": partial(of_proofs.shapes, "Flats, calibration exact"),
    "campaigns": of_proofs.campaigns,
    "budget": budget.budget,
    "budget-others": budget.others,
    "campaign-archive": of_proofs.campaign_archive,
    "campaign-kills": of_proofs.campaign_kills,
    "speed": of_proofs.speed,
    "speckle": of_proofs.speckle,
    "situations": of_proofs.situations,
    "validation": of_proofs.validation,
    "trials": of_proofs.trials,
    "verification": of_proofs.verification,
    "control-charts": of_proofs.control_charts,
    "colours": of_proofs.colours,
    "scanning": of_proofs.scanning,
    "layouts-view": of_proofs.layouts_view,
    "layouts-resolution": of_proofs.layouts_resolution,
    "layouts-missed": of_proofs.layouts_missed,
    "worlds": of_proofs.worlds,
    "worlds-errors": of_proofs.worlds_errors,
}
