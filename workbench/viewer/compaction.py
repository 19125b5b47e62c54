"""Compaction of a closed recording, block by block in bounded memory.

While a session runs, every logged value is a chunk of its own, so that a viewer sees it at once and a kill
loses nothing. Each chunk repeats the names and types of its columns. In fewer chunks the same rows take a
quarter less. Static values and layouts that a later one has replaced are dropped. The copy has an index,
which takes some 10 kB of memory a capture.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb
from rerun.chunk import Chunk, LazyChunkStream, OptimizationProfile

from workbench.viewer.rrd import open_rrd, release_unused
from workbench.viewer.window import is_complete

BLOCK_BYTES = 1 << 24
"""Size of the chunks that are merged at a time, as written; it takes some six times the memory."""
FIRST_CHUNKS = 200
"""Number of chunks in the first block, before their size is known."""
FLUSH_SECONDS = 20.0


def compact(recording: Path, layout: rrb.Blueprint) -> bool:
    """Replace a closed recording by one that shows the same in fewer, larger chunks.

    A compaction that fails leaves the recording as it is.

    Args:
        recording: file of the recording.
        layout: layout that the file opens with.

    Returns:
        Whether the recording was replaced; not where it is incomplete.
    """
    if not is_complete(recording):
        return False
    compacted = recording.with_name(recording.name + ".compacted")
    try:
        written = _write(recording, compacted, layout)
        if not is_complete(compacted) or rows(open_rrd(compacted).stream()) != written:
            return False
        compacted.replace(recording)
    except (OSError, RuntimeError, ValueError):  # of Rerun: a damaged recording, a full disk
        return False
    else:
        return True
    finally:
        with suppress(OSError):
            compacted.unlink()


def rows(chunks: Iterable[Chunk]) -> Counter[str]:
    """Number of rows of each entity that belong to a time; later static values replace earlier ones."""
    counted: Counter[str] = Counter()
    for chunk in chunks:
        if not chunk.is_static:
            counted[chunk.entity_path] += chunk.num_rows
    return counted


def _write(recording: Path, out: Path, layout: rrb.Blueprint) -> Counter[str]:
    """Write the copy; returns the rows that it must have."""
    reader = open_rrd(recording)
    (store,) = reader.recordings()
    release_unused()
    copy = rr.RecordingStream(store.application_id, recording_id=store.recording_id, send_properties=False)
    copy.set_sinks(rr.FileSink(str(out)), default_blueprint=layout)
    counted: Counter[str] = Counter()
    static = _LastValues()
    try:
        for block in _blocks(reader.stream(), out):
            counted.update(rows(block))
            static.add(block)
            _send(copy, [chunk for chunk in block if not chunk.is_static])
        _send(copy, static.chunks())
    finally:
        copy.disconnect()
    return counted


def _blocks(chunks: Iterable[Chunk], out: Path) -> Iterator[list[Chunk]]:
    """Blocks of consecutive chunks; their number follows from the size of `out` after the earlier blocks."""
    number, passed = FIRST_CHUNKS, 0
    block: list[Chunk] = []
    for chunk in chunks:
        block.append(chunk)
        if len(block) >= number:
            yield block
            passed, block = passed + len(block), []
            size = max(1, out.stat().st_size)
            number = min(2 * number, max(1, BLOCK_BYTES * passed // size))
    yield block


def _send(copy: rr.RecordingStream, chunks: Iterable[Chunk]) -> None:
    """Merge chunks and write them."""
    copy.send_chunks(LazyChunkStream.from_iter(chunks).collect(optimize=OptimizationProfile.OBJECT_STORE))
    copy.flush(timeout_sec=FLUSH_SECONDS)


class _LastValues:
    """Static chunks that have the last value of a component of an entity."""

    def __init__(self) -> None:
        self._last: dict[tuple[str, str], tuple[int, Chunk]] = {}
        self._passed = 0

    def add(self, chunks: Iterable[Chunk]) -> None:
        """Note the static ones of the next chunks."""
        for chunk in chunks:
            self._passed += 1
            if chunk.is_static:
                for name in chunk.to_record_batch().schema.names:
                    self._last[chunk.entity_path, name] = self._passed, chunk

    def chunks(self) -> list[Chunk]:
        """Chunks in their order in the recording, each once."""
        return [chunk for _, chunk in sorted(dict(self._last.values()).items())]
