"""The layout: every view looks at something that a session's recording has, in the rig's own measures."""

from __future__ import annotations

from collections.abc import Iterator

import rerun.blueprint as rrb

from tests.support.rigs import prior
from tests.viewer.conftest import Recorded
from tests.viewer.readback import Contents
from tests.viewer.session import a_rig
from workbench.model.rig import Rig
from workbench.viewer.blueprint import PICTURE_VIEW, blueprint


def views(rig: Rig) -> dict[str, rrb.View]:
    def below(container: rrb.Container) -> Iterator[rrb.View]:
        for part in container.contents:
            if isinstance(part, rrb.Container):
                yield from below(part)
            elif isinstance(part, rrb.View):
                yield part

    return {str(view.name): view for view in below(blueprint(rig).root_container)}


def test_every_view_shows_what_a_session_has_recorded(recorded: Recorded) -> None:
    entities = Contents(recorded.recording).entities
    found = views(recorded.rig)
    assert len(found) > 10
    for name, view in found.items():
        origin = f"/{view.origin}"
        assert any(f"{entity}/".startswith(f"{origin}/") for entity in entities), name


def test_the_picture_has_the_size_of_the_camera_s() -> None:
    rig = a_rig()
    camera = rig.camera.model_copy(update={"width_px": 1024, "height_px": 768})
    picture = views(rig.model_copy(update={"camera": camera}))[PICTURE_VIEW]
    bounds = picture.properties["VisualBounds2D"]
    assert isinstance(bounds, rrb.VisualBounds2D)
    assert bounds.range is not None
    (seen,) = bounds.range.as_arrow_array().to_pylist()
    assert seen == {"x_range": [0.0, 1024.0], "y_range": [0.0, 768.0]}


def test_the_curve_of_spots_is_along_the_lasers_line() -> None:
    rig = a_rig()
    upright = tuple(
        laser.model_copy(update={"axis": "v", "x_mm": prior(0.0, 0.2), "y_mm": laser.x_mm})
        for laser in rig.lasers
    )
    origins = [
        {view.origin for view in views(one).values()}
        for one in (rig, rig.model_copy(update={"lasers": upright}))
    ]
    assert "spots/u_px" in origins[0] - origins[1]
    assert "spots/v_px" in origins[1] - origins[0]


def test_the_technician_s_tab_is_in_front() -> None:
    tabs = blueprint(a_rig()).root_container
    assert isinstance(tabs, rrb.Tabs)
    assert tabs.active_tab == 0
    front, *_ = tabs.contents
    assert isinstance(front, rrb.Container)
    assert front.name == "Live"
