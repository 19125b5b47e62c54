"""Folder of a campaign: its identity, a lock, and the chunks that are finished."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import pandas as pd
from pydantic import ValidationError

from workbench.campaign.campaign_file import Campaign, CampaignFile
from workbench.campaign.chunk_file import CHUNK_FILES, is_finished, read_chunk
from workbench.campaign.identity import Identity, difference, identity_of
from workbench.campaign.kind import Chunk
from workbench.campaign.lock import CLIENT, WRITERS, client_lock, no_writer
from workbench.campaign.sessions import FILES, SESSION_ASIDE, SESSION_FILES, SESSIONS
from workbench.model.contents import read_file
from workbench.model.errors import BadInputError
from workbench.model.yamlfile import FileModel
from workbench.session.files import temporary_pattern, write_atomically

MANIFEST, CHUNKS, TABLES, PAGE = "campaign.json", "chunks", "tables", "report.html"
"""Names in the folder: manifest, results of chunks, tables of the results, and their page."""
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
    with ExitStack() as stack:
        try:
            path.mkdir(parents=True, exist_ok=True)
            _refuse_other_files(path)  # before a file is written into it
            stack.enter_context(client_lock(path))
            _make(path, campaign, identity)
        except OSError as error:
            raise BadInputError(f"{path}: cannot be used: {error.strerror or error}") from None
        if differs := difference(_read_identity(path / MANIFEST), identity):
            raise BadInputError(f"{path}: {differs}. Name another folder with -o, or delete this one")
        _remove_remains(path)
        yield CampaignFolder(path, campaign, identity)
        _remove_remains(path)


def _refuse_other_files(path: Path) -> None:
    names = [one.name for one in path.iterdir()]
    own = temporary_pattern(re.escape(MANIFEST))
    others = [name for name in names if name not in {CLIENT, WRITERS} and not own.fullmatch(name)]
    if others and MANIFEST not in names:
        raise BadInputError(
            f"{path}: expected a new or empty folder or one of a campaign, found other files, such as"
            f" {min(others)}"
        )


def _make(path: Path, campaign: Campaign, identity: Identity) -> None:
    """Write what the folder lacks."""
    if not (path / MANIFEST).exists():
        manifest = CampaignManifest(identity=identity, file=campaign.file, inputs=dict(campaign.inputs))
        write_atomically(path / MANIFEST, manifest.model_dump_json(indent=2).encode())
    (path / CHUNKS).mkdir(exist_ok=True)
    (path / WRITERS).touch()


def _read_identity(manifest: Path) -> Identity:
    content = read_file(manifest, "the manifest of a campaign", LARGEST_BYTES)
    try:
        return CampaignManifest.model_validate_json(content).identity
    except ValidationError:
        raise BadInputError(
            f"{manifest}: expected the manifest of a campaign, got other contents. Name another folder with"
            " -o"
        ) from None


REMAINS = {
    "": temporary_pattern("|".join(map(re.escape, (MANIFEST, PAGE)))),
    CHUNKS: temporary_pattern(CHUNK_FILES),
    FILES: temporary_pattern(SESSION_FILES),
    TABLES: temporary_pattern(r"[\w-]+\.(csv|parquet)"),
}
"""Names of temporary files by their folder in that of the campaign."""


def _remove_remains(path: Path) -> None:
    """Remove what killed programs did not finish: temporary files, and parts of sessions.

    While a worker writes, such as one of an earlier program at the same scheduler, nothing is removed. Files
    with other names than the campaign's own stay.
    """
    with suppress(OSError), no_writer(path) as is_quiet:
        if not is_quiet:
            return
        for folder, own in REMAINS.items():
            for remains in _named(path / folder, own):
                with suppress(OSError):
                    remains.unlink()
        for remains in _named(path / SESSIONS, SESSION_ASIDE):
            shutil.rmtree(remains, ignore_errors=True)


def _named(folder: Path, own: re.Pattern[str]) -> list[Path]:
    """Entries of a folder with names of a pattern; none if there is no such folder."""
    return [one for one in folder.glob(".*") if own.fullmatch(one.name)]
