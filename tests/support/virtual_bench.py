"""The thesis's rig on the virtual bench, and single shots of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from workbench.emulator import EmulatedBench
from workbench.model.arrays import Image
from workbench.model.rig import Rig, load_rig
from workbench.model.target import FlatTarget, Placement
from workbench.model.yamlfile import parse_document

THESIS = load_rig(Path(__file__).parents[2] / "rigs" / "thesis-emulated.yaml")


def emulated_thesis(**emulator: Any) -> Rig:
    return THESIS.model_copy(update={"emulator": {"seed": 2001, **emulator}})


def put(bench: EmulatedBench, standoff_mm: float, key: str = "P") -> None:
    bench.target.place(Placement(key=key, standoff_mm=standoff_mm, target=FlatTarget()))


def shot(bench: EmulatedBench, key: str) -> Image:
    """A frame with all lasers on."""
    bench.mark(key)
    with bench.lasers.lit(bench.lasers.ids, for_s=5.0):
        return bench.camera.grab().image


def read_truth(path: Path) -> Any:
    return parse_document(path.read_text(), path).data
