"""Recording of several sessions side by side."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from workbench.model import event as ev
from workbench.model.rig import Rig
from workbench.viewer.blueprint import comparison
from workbench.viewer.open_recording import OpenRecording
from workbench.viewer.stream import Stream


@dataclass(frozen=True)
class Source:
    """Records of a session, or of a fit of a captures file."""

    name: str
    folder: Path
    """Folder to which the paths of frames are relative."""
    rig: Rig
    records: Iterable[ev.Record]


def compare(sources: Sequence[Source], out: Path) -> None:
    """Record several sessions side by side, with one cursor on the standoff.

    Raises:
        BadInputError: a frame of a record is missing, or has changed.
    """
    prefixes = [chr(ord("a") + n) for n in range(len(sources))]
    columns = {prefix: (source.rig, source.name) for prefix, source in zip(prefixes, sources, strict=True)}
    stream = Stream(out, " and ".join(source.name for source in sources), comparison(columns))
    for prefix, source in zip(prefixes, sources, strict=True):
        part = OpenRecording(stream.below(prefix), source.folder, source.rig)
        for record in source.records:
            part.take(record)
    stream.close()
