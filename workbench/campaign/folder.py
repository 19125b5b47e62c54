"""Folder of a campaign: its identity, a lock, and the chunks that are finished."""

from __future__ import annotations

import fcntl
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pandas as pd
from pydantic import ValidationError

from workbench.campaign.campaign_file import Campaign, CampaignFile
from workbench.campaign.chunk_file import is_finished, read_chunk
from workbench.campaign.identity import Identity, difference, identity_of
from workbench.campaign.kind import Chunk
from workbench.campaign.sessions import SESSIONS
from workbench.model.contents import read_file
from workbench.model.errors import BadInputError
from workbench.model.yamlfile import FileModel
from workbench.session.files import write_atomically

MANIFEST, CHUNKS = "campaign.json", "chunks"
LARGEST_BYTES = 2**26
"""Largest manifest: it contains the inputs of the campaign."""


class CampaignManifest(FileModel):
    """Manifest of a campaign's folder: what its results depend on."""

    format: int = 1
    identity: Identity
    file: CampaignFile
    inputs: dict[str, str]


@dataclass(frozen=True)
class CampaignFolder:
    """Folder of a campaign that is open in this program alone."""

    path: Path
    campaign: Campaign
    identity: Identity

    @property
    def chunks(self) -> Path:
        """Folder of the chunks' files."""
        return self.path / CHUNKS

    def missing(self) -> list[Chunk]:
        """Chunks that are not finished."""
        sha256 = self.identity.sha256
        return [one for one in self.campaign.chunks if not is_finished(self.chunks, one, sha256)]

    def frames(self) -> Iterator[pd.DataFrame]:
        """Results of the chunks in their order, one at a time.

        Raises:
            BadInputError: a chunk is missing or damaged.
        """
        for chunk in self.campaign.chunks:
            yield read_chunk(self.chunks, chunk, self.identity.sha256)


@contextmanager
def open_folder(path: Path, campaign: Campaign) -> Iterator[CampaignFolder]:
    """Create the folder of a campaign, or open it again; no other program can open it meanwhile.

    Raises:
        BadInputError: the folder has results of another campaign, seed or version, is in use, or cannot be
            written.
    """
    identity = identity_of(campaign)
    manifest = path / MANIFEST
    try:
        path.mkdir(parents=True, exist_ok=True)
        if not manifest.exists():
            if any(path.iterdir()):
                raise BadInputError(
                    f"{path}: expected a new or empty folder or one of a campaign, found other files"
                )
            found = CampaignManifest(identity=identity, file=campaign.file, inputs=dict(campaign.inputs))
            write_atomically(manifest, found.model_dump_json(indent=2).encode())
        (path / CHUNKS).mkdir(exist_ok=True)
        lock = os.open(manifest, os.O_RDWR | os.O_CLOEXEC)
    except OSError as error:
        raise BadInputError(f"{path}: cannot be used: {error.strerror or error}") from None
    try:
        _lock(lock, path)
        if differs := difference(_read_identity(manifest), identity):
            raise BadInputError(f"{path}: {differs}. Name another folder with -o, or delete this one")
        _remove_remains(path)
        yield CampaignFolder(path, campaign, identity)
        _remove_remains(path)
    finally:
        os.close(lock)


def _lock(handle: int, path: Path) -> None:
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise BadInputError(f"{path}: another program is running this campaign") from None
    except OSError as error:
        raise BadInputError(f"{path}: cannot be locked: {error.strerror or error}") from None


def _read_identity(manifest: Path) -> Identity:
    content = read_file(manifest, "the manifest of a campaign", LARGEST_BYTES)
    try:
        return CampaignManifest.model_validate_json(content).identity
    except ValidationError:
        raise BadInputError(
            f"{manifest}: expected the manifest of a campaign, got other contents. Name another folder with"
            " -o"
        ) from None


def _remove_remains(path: Path) -> None:
    """Remove files and sessions that a killed worker did not finish; their names begin with a dot."""
    for remains in (path / CHUNKS).glob(".*"):
        remains.unlink(missing_ok=True)
    for remains in (path / SESSIONS).glob(".*/"):
        shutil.rmtree(remains)
