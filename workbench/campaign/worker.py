"""Work on one chunk, as a worker of the cluster runs it."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from workbench.campaign.campaign_file import Campaign
from workbench.campaign.chunk_file import is_finished, write_chunk
from workbench.campaign.folder import CHUNKS, CampaignManifest
from workbench.campaign.identity import Identity, check_environment, difference, identity_of
from workbench.campaign.lock import writer_lock
from workbench.model.errors import BadInputError


def run_chunk(manifest: str, folder: str, index: int) -> int:
    """Compute a chunk and write its file, unless it is there.

    Args:
        manifest: text of the campaign's manifest.
        folder: folder of the campaign, as this worker sees it.
        index: of the chunk.

    Returns:
        `index`.

    Raises:
        BadInputError: this worker runs another version or with several threads, does not see the folder, or
            the work cannot be done.
        StoppedError: an external cause stopped the work, which is not finished.
        OSError: the file could not be written.
    """
    check_environment()
    campaign, identity = _read(manifest)
    chunks = Path(folder) / CHUNKS
    chunk = campaign.chunk_at(index)
    with writer_lock(Path(folder)):
        if not is_finished(chunks, chunk, identity.sha256):
            frame = campaign.file.work.run(campaign.inputs, chunk, Path(folder))
            write_chunk(chunks, chunk, identity.sha256, frame)
    return index


@lru_cache(maxsize=4)
def _read(manifest: str) -> tuple[Campaign, Identity]:
    """The campaign of a manifest, with its identity, which is that of this worker."""
    found = CampaignManifest.model_validate_json(manifest)
    campaign = Campaign(found.file, found.inputs)
    if differs := difference(found.identity, identity_of(campaign)):
        raise BadInputError(f"a worker differs from this program: {differs}; install one version on both")
    return campaign, found.identity
