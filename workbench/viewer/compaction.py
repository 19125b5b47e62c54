"""Compaction of a closed recording.

While a session runs, every logged value is a chunk of its own, so that a viewer sees it at once and a kill
loses nothing. Each chunk repeats the names and types of its columns: 100 MB for 71 MB of frames become 78 MB.
Static values that a later one has replaced are dropped.
"""

from __future__ import annotations

import subprocess
from contextlib import suppress
from pathlib import Path

from workbench.model.errors import BadInputError
from workbench.viewer.window import is_complete, viewer_environment, viewer_executable

LIMIT_S = 60.0
"""Longest time for the compaction; a session of 500 captures takes 1.5 s."""


def compact(recording: Path) -> bool:
    """Replace a closed recording by one that shows the same in fewer, larger chunks.

    A compaction that fails leaves the recording as it is.

    Returns:
        Whether the recording was replaced; not where there is none, or an incomplete one.
    """
    if not is_complete(recording):
        return False
    compacted = recording.with_name(recording.name + ".compacted")
    try:
        command = [str(viewer_executable()), "rrd", "optimize", str(recording), "-o", str(compacted)]
        done = subprocess.run(  # noqa: S603  # the executable comes from our own dependency
            command,
            env=viewer_environment(),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # a signal at the terminal must not interrupt it
            timeout=LIMIT_S,
            check=False,
        )
        if done.returncode != 0 or not is_complete(compacted):
            return False
        compacted.replace(recording)
    except (OSError, subprocess.TimeoutExpired, BadInputError):
        return False
    else:
        return True
    finally:
        with suppress(OSError):
            compacted.unlink()
