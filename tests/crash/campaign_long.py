"""A campaign whose workers are killed twice: `python -m tests.crash.campaign_long [sensors]`.

The campaign of procedures/campaigns/thesis.yaml runs undisturbed, and again with two kills of a worker at
random. All chunks and tables must be bit-identical.
"""

from __future__ import annotations

import hashlib
import json
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from tests.crash.campaigns import finished, kill_workers, results, start
from tests.support.stored_output import store
from workbench.campaign.folder import MANIFEST

ROOT = Path(__file__).parents[2]
CAMPAIGN = ROOT / "procedures/campaigns/thesis.yaml"
SENSORS = 100_000
CHUNK = 1000
"""Number of calibrations of a chunk: the default of the campaign file."""
KILLS = 2
SEED = 1
LONGEST_S = 3600.0


def run(campaign: Path, out: Path, kills: list[int], rng: np.random.Generator) -> tuple[str, float]:
    """One hash of all chunks and tables, and the time, s; workers die at these numbers of chunks."""
    began_s = time.monotonic()
    process = start(campaign, out)
    kill_workers(process, out, kills, rng, LONGEST_S)
    errors = process.communicate()[1]
    if process.returncode:
        raise RuntimeError(f"exit code {process.returncode}: {errors}")
    files = json.dumps(results(out))
    return hashlib.sha256(files.encode()).hexdigest(), time.monotonic() - began_s


def main() -> int:
    """Run both; 1 if their results differ."""
    sensors = int(sys.argv[1]) if len(sys.argv) > 1 else SENSORS
    chunks, rng = -(-sensors // CHUNK), np.random.default_rng(SEED)
    kills = sorted(rng.choice(np.arange(1, chunks - 1), KILLS, replace=False).tolist())
    text = CAMPAIGN.read_text().replace("../../rigs", str(ROOT / "rigs"))
    if f"sensors: {SENSORS}" not in text:
        raise ValueError(f"{CAMPAIGN}: expected {SENSORS} sensors")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        campaign = folder / "campaign.yaml"
        campaign.write_text(text.replace(f"sensors: {SENSORS}", f"sensors: {sensors}"))
        calm, calm_s = run(campaign, folder / "calm", [], rng)
        killed, killed_s = run(campaign, folder / "killed", kills, rng)
        manifests = {(folder / name / MANIFEST).read_bytes() for name in ("calm", "killed")}
        if len(manifests) > 1:
            raise RuntimeError("expected equal sources in both runs, some have changed meanwhile")
        if finished(folder / "killed") != chunks:
            raise RuntimeError(f"expected {chunks} chunks, found {finished(folder / 'killed')}")
    lines = [
        f"{sensors} simulated calibrations in {chunks} chunks; hash of all chunks and tables",
        "",
        f"undisturbed                            {calm[:32]} {calm_s:5.0f} s",
        f"a worker killed after {' and '.join(map(str, kills)):>9} chunks {killed[:32]} {killed_s:5.0f} s",
        "",
        "bit-identical" if killed == calm else "THEY DIFFER",
    ]
    store("campaign-kills", "Campaign with kills", "python -m tests.crash.campaign_long", lines)
    return 0 if killed == calm else 1


if __name__ == "__main__":
    sys.exit(main())
