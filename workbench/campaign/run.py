"""Run of the chunks of a campaign on the workers of a cluster."""

from __future__ import annotations

from collections.abc import Callable
from itertools import islice
from typing import TYPE_CHECKING

from workbench.campaign.folder import MANIFEST, CampaignFolder
from workbench.campaign.kind import Chunk
from workbench.campaign.worker import run_chunk
from workbench.model.errors import StoppedError

if TYPE_CHECKING:
    from distributed import Client, Future

AHEAD = 2
"""Number of chunks that wait at the scheduler for each worker, so that none is idle."""
FEWEST_AHEAD = 16
"""Least number of chunks at the scheduler, for workers that join later."""


def run_chunks(
    client: Client, folder: CampaignFolder, missing: list[Chunk], finished: Callable[[Chunk], None]
) -> None:
    """Compute chunks; returns when the files of all are there.

    The scheduler repeats the chunk of a worker that died. Only a bounded number of chunks is at the scheduler
    at a time, and only their numbers return: the memory of this process does not grow with the campaign.

    Args:
        client: connection to the scheduler.
        folder: folder of the campaign; the workers see it under the same path.
        missing: chunks to compute.
        finished: called after each chunk.

    Raises:
        BadInputError: a worker runs another version, or the work cannot be done.
        StoppedError: a file cannot be written, an external cause stopped an item, every worker
            that computes some chunk dies, or the scheduler ends.
    """
    from distributed import KilledWorker, as_completed
    from distributed.client import FutureCancelledError
    from distributed.comm.core import CommClosedError

    manifest, path = (folder.path / MANIFEST).read_text(encoding="utf-8"), str(folder.path.resolve())
    left = iter(missing)
    running: dict[Future[int], Chunk] = {}

    def submit(chunk: Chunk) -> Future[int]:
        key = f"{folder.identity.campaign}-{folder.identity.sha256[:12]}-{chunk.index}"
        future = client.submit(run_chunk, manifest, path, chunk.index, key=key)
        running[future] = chunk
        return future

    window = max(FEWEST_AHEAD, AHEAD * sum(client.nthreads().values()))
    results = as_completed([submit(chunk) for chunk in islice(left, window)])
    for future in results:
        chunk = running.pop(future)
        try:
            future.result()
        except KilledWorker:
            raise StoppedError(
                f"chunk {chunk.index} ({folder.campaign.file.work.thing} {chunk.items.start} to"
                f" {chunk.items.stop - 1}): every worker that computed it died; check memory and disk"
            ) from None
        except (FutureCancelledError, CommClosedError) as error:
            raise StoppedError(f"the connection to the scheduler was lost: {error}") from None
        except OSError as error:
            raise StoppedError(f"chunk {chunk.index}: cannot be written: {error}") from None
        finished(chunk)
        if (following := next(left, None)) is not None:
            results.add(submit(following))
