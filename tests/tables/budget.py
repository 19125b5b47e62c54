"""Tables of the budget: latency, power, cost and weight, as the thesis states them and here."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tests.support.stored_output import ROOT
from tests.tables.markdown import markdown_table
from tests.tables.of_proofs import ranging_times
from workbench.model.rig import Rig, load_rig

FRAMES_PER_S = 30
"""Rate of the thesis's camera."""
FRAMES_OF_PAIR = 2
THESIS, BUILT = "rigs/thesis-emulated.yaml", "rigs/uno-webcam.yaml"
OTHERS = (
    ("Polaroid 6500, sonar", "$50", "0.45 to 9 W", "2.4 ms", "43 mm diameter x 8 mm"),
    ("Sharp GP2D12, infrared", "$20", "97 mW", "38 ms", "45 x 19 x 14 mm"),
    ("Fujitsu, radar of 76 GHz", "$10 000", "14 W", "100 ms", "106 x 88 x 90 mm"),
    ("Multispectral, ultra-wideband radar", "$1000 to $2000", "25 uW (average)", "0.1 ms", "2500 cm3"),
    ("SICK LMS-200, laser scanner", "$5750", "?7.5 W at most", "13 to 56 ms", "?55 x 185 x 156 mm"),
)
"""Tables 1 to 5 of the thesis; a question mark is a digit that the scan has lost."""


def budget() -> str:
    """Times of a reading by the frames that it takes and by the stored output of `make bench`."""
    times = ranging_times()
    plain, worst = (f"{int(times['horizontal', scene][1]) / 1000:.1f} ms" for scene in ("flat", "worst"))
    thesis, built = load_rig(ROOT / THESIS), load_rig(ROOT / BUILT)
    late = f"`{BUILT}`, {_discarded(built)} frames discarded after each switching"
    return markdown_table(
        ("", "goal of the thesis", "the thesis reached", "here"),
        (
            ("frames of a reading", "33 ms", "33 ms", _frames(1, thesis)),
            ("frames of an ambiguous reading", "", "130 ms", _frames(1 + len(thesis.lasers), thesis)),
            (f"frames of a reading, {late}", "", "", _frames(1, built)),
            ("frames of an ambiguous reading, the same", "", "", _frames(1 + len(built.lasers), built)),
            ("computing, 99th percentile", "", "in the above", plain),
            ("computing, ambiguous, the same", "", "in the above", worst),
        ),
    )


def others() -> str:
    """Sensors that the thesis compares itself with."""
    return markdown_table(("sensor", "cost", "power", "response", "size"), OTHERS)


def _frames(pairs: int, rig: Rig) -> str:
    count = pairs * FRAMES_OF_PAIR * (1 + _discarded(rig))
    return f"{1000 * count / FRAMES_PER_S:.0f} ms ({count})"


def _discarded(rig: Rig) -> int:
    """Frames that a rig discards after each switching of a laser; the virtual bench has no latency."""
    settings: Mapping[str, Any] = {} if rig.devices is None else rig.devices.camera.model_dump()
    return int(settings.get("latency_frames", 0))
