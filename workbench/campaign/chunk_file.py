"""Results of one chunk: a Parquet file with the identity of the campaign, and its hash beside it.

The file with the hash is written last, in the format of `sha256sum`: a chunk is finished when it is there.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from workbench.campaign.kind import Chunk
from workbench.model.errors import BadInputError
from workbench.session.files import write_atomically

IDENTITY, CHUNK = b"workbench_campaign", b"workbench_chunk"
"""Keys in the metadata of the Parquet file: hash of the identity, number of the chunk."""
CHUNK_FILES = r"\d{6,}\.(parquet|sha256)"
"""Pattern of the names of both files."""


def chunk_path(folder: Path, index: int) -> Path:
    """Parquet file of a chunk in the folder of chunks."""
    return folder / f"{index:06d}.parquet"


def hash_path(folder: Path, index: int) -> Path:
    """File with its hash."""
    return folder / f"{index:06d}.sha256"


def write_chunk(folder: Path, chunk: Chunk, identity: str, frame: pd.DataFrame) -> None:
    """Write the results of a chunk.

    Args:
        folder: folder of chunks.
        chunk: the chunk.
        identity: hash of the campaign's identity.
        frame: one row per item.

    Raises:
        OSError: a file could not be written; then the chunk is not finished.
    """
    table = pa.Table.from_pandas(frame, preserve_index=False)
    described = {IDENTITY: identity.encode(), CHUNK: str(chunk.index).encode()}
    sink = pa.BufferOutputStream()
    pq.write_table(table.replace_schema_metadata({**(table.schema.metadata or {}), **described}), sink)
    content, path = sink.getvalue().to_pybytes(), chunk_path(folder, chunk.index)
    write_atomically(path, content)
    write_atomically(hash_path(folder, chunk.index), _hash_line(content, path))


def read_chunk(folder: Path, chunk: Chunk, identity: str) -> pd.DataFrame:
    """Read and check the results of a chunk.

    Raises:
        BadInputError: a file is missing or damaged, or of another chunk or campaign.
    """
    path = chunk_path(folder, chunk.index)
    try:
        content, stored = path.read_bytes(), hash_path(folder, chunk.index).read_bytes()
    except OSError as error:
        raise BadInputError(f"{error.filename}: cannot be read: {error.strerror}") from None
    if stored != _hash_line(content, path):
        raise BadInputError(f"{path}: damaged: expected the hash in {hash_path(folder, chunk.index).name}")
    try:
        table = pq.read_table(pa.BufferReader(content))
    except pa.ArrowException as error:
        raise BadInputError(f"{path}: expected a Parquet file, got other contents: {error}") from None
    found = table.schema.metadata or {}
    if (found.get(IDENTITY), found.get(CHUNK)) != (identity.encode(), str(chunk.index).encode()):
        raise BadInputError(f"{path}: expected chunk {chunk.index} of this campaign, got another one")
    frame: pd.DataFrame = table.to_pandas()
    return frame


def is_finished(folder: Path, chunk: Chunk, identity: str) -> bool:
    """Whether the results of a chunk are there and intact; others are computed again."""
    try:
        read_chunk(folder, chunk, identity)
    except BadInputError:
        return False
    return True


def _hash_line(content: bytes, path: Path) -> bytes:
    return f"{hashlib.sha256(content).hexdigest()}  {path.name}\n".encode()
