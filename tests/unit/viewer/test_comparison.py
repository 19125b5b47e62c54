"""Several sessions in one recording."""

from __future__ import annotations

from pathlib import Path

from tests.viewer.conftest import Recorded
from tests.viewer.readback import Contents, layout_views
from workbench.model import event as ev
from workbench.viewer.comparison import Source, compare


def test_each_session_has_its_entities_below_a_letter(recorded: Recorded, tmp_path: Path) -> None:
    records = recorded.records
    end = next(n for n, record in enumerate(records) if isinstance(record.event, ev.FitFinished))
    whole = Source("whole", recorded.folder, recorded.rig, records[: end + 1])
    part = Source("part", recorded.folder, recorded.rig, records[:20])
    out = tmp_path / "both.rrd"
    compare([whole, part], out)
    contents = Contents(out)
    captures = [len(contents.values(f"/{letter}/frame/image", "EncodedDepthImage:blob")) for letter in "ab"]
    counts = [sum(r.event.kind == "capture_taken" for r in one.records) for one in (whole, part)]
    assert captures == counts
    views = layout_views(out)
    assert {view.origin[:3] for view in views} == {"/a/", "/b/"}
    assert all(contents.below(view.origin) for view in views)
    names = " ".join(view.name for view in views)
    assert "whole" in names
    assert "part" in names
