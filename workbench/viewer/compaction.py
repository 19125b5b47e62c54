"""Compaction of a closed recording.

While a session runs, every logged value is a chunk of its own, so that a viewer sees it at once and a kill
loses nothing. Each chunk repeats the names and types of its columns. In fewer chunks the same rows take a
quarter less. Static values and layouts that a later one has replaced are dropped.
"""

from __future__ import annotations

from collections import Counter
from contextlib import suppress
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb
from rerun.chunk import OptimizationProfile

from workbench.viewer.rrd import open_rrd
from workbench.viewer.window import is_complete

MOST_BYTES = 1 << 27
"""Largest recording to compact, as of 1000 captures of 640 x 480 px; it takes twice the memory, or more."""
FLUSH_SECONDS = 20.0


def compact(recording: Path, layout: rrb.Blueprint) -> bool:
    """Replace a closed recording by one that shows the same in fewer, larger chunks.

    A compaction that fails leaves the recording as it is.

    Args:
        recording: file of the recording.
        layout: layout that the file opens with.

    Returns:
        Whether the recording was replaced; not where it is incomplete, or larger than `MOST_BYTES`.
    """
    if not is_complete(recording) or recording.stat().st_size > MOST_BYTES:
        return False
    compacted = recording.with_name(recording.name + ".compacted")
    try:
        _write(recording, compacted, layout)
        if not is_complete(compacted) or rows(compacted) != rows(recording):
            return False
        compacted.replace(recording)
    except (OSError, RuntimeError, ValueError):  # of Rerun: a damaged recording, a full disk
        return False
    else:
        return True
    finally:
        with suppress(OSError):
            compacted.unlink()


def rows(recording: Path) -> Counter[str]:
    """Number of rows of each entity that belong to a time; later static values replace earlier ones."""
    counted: Counter[str] = Counter()
    for chunk in open_rrd(recording).stream():
        if not chunk.is_static:
            counted[chunk.entity_path] += chunk.num_rows
    return counted


def _write(recording: Path, out: Path, layout: rrb.Blueprint) -> None:
    reader = open_rrd(recording)
    (store,) = reader.recordings()
    chunks = reader.stream().collect(optimize=OptimizationProfile.OBJECT_STORE)
    copy = rr.RecordingStream(store.application_id, recording_id=store.recording_id, send_properties=False)
    copy.set_sinks(rr.FileSink(str(out)), default_blueprint=layout)
    try:
        copy.send_chunks(chunks)
        copy.flush(timeout_sec=FLUSH_SECONDS)
    finally:
        copy.disconnect()
