import os
import shutil
from pathlib import Path

import hypothesis
import pytest

# As the command line does. Two workers with two threads each on two cores spend most of their time waiting.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# Hypothesis would fail an example that takes more than 200 ms, as on a busy computer.
hypothesis.settings.register_profile("workbench", deadline=None)
hypothesis.settings.load_profile("workbench")

MEMORY = Path("/dev/shm")  # noqa: S108  # only a place for pytest's own temporary folders
ROOM_BYTES = 6 * 2**30
"""Sessions of all tests together take a quarter of this. In memory they wait for no disk."""
if MEMORY.is_dir() and shutil.disk_usage(MEMORY).free > ROOM_BYTES:
    os.environ.setdefault("PYTEST_DEBUG_TEMPROOT", str(MEMORY))

REAL_TIME = {
    "tests/bench/test_example_laser_driver.py",
    "tests/bench/test_unplugged.py",
    "tests/firmware/test_pins.py",
    "tests/unit/devices/test_digital_output.py",
    "tests/unit/devices/test_guarded_line.py",
    "tests/unit/devices/test_guardian.py",
    "tests/unit/devices/test_real_bench.py",
}
"""They run processes of real-time priority and measure milliseconds. `make test` runs them alone: another
worker that computes keeps their processes from running, as nothing does at a bench."""

SLOW = {
    "tests/unit/api/test_arguments.py",
    "tests/unit/api/test_documentation.py",
    "tests/unit/api/test_simulation.py",
    "tests/unit/calibration/checks/test_cross_validation.py",
    "tests/unit/calibration/checks/test_faults.py",
    "tests/unit/calibration/checks/test_hypotheses.py",
    "tests/unit/calibration/checks/test_mistaken_data.py",
    "tests/unit/calibration/checks/test_residuals.py",
    "tests/unit/calibration/data/test_boards.py",
    "tests/unit/calibration/design/test_expected_spot.py",
    "tests/unit/calibration/design/test_forecast.py",
    "tests/unit/calibration/design/test_simulation.py",
    "tests/unit/calibration/design/test_standoffs.py",
    "tests/unit/calibration/estimation/test_batch.py",
    "tests/unit/calibration/estimation/test_fisheye.py",
    "tests/unit/calibration/estimation/test_fit.py",
    "tests/unit/calibration/estimation/test_jit_cache.py",
    "tests/unit/calibration/selection/test_drift.py",
    "tests/unit/calibration/selection/test_model_terms.py",
    "tests/unit/calibration/selection/test_outliers.py",
    "tests/unit/calibration/verdict/test_assessment.py",
    "tests/unit/calibration/verdict/test_comparison.py",
    "tests/unit/calibration/verdict/test_observability.py",
    "tests/unit/calibration/verdict/test_yaml_text.py",
    "tests/unit/cli/test_aim.py",
    "tests/unit/cli/test_background.py",
    "tests/unit/cli/test_exit.py",
    "tests/unit/cli/test_fit.py",
    "tests/unit/cli/test_history.py",
    "tests/unit/cli/test_read_only.py",
    "tests/unit/cli/test_report.py",
    "tests/unit/cli/test_stdio.py",
    "tests/unit/cli/test_use.py",
    "tests/unit/cli/test_view.py",
    "tests/unit/corners/test_board.py",
    "tests/unit/devices/test_controller_line.py",
    "tests/unit/devices/test_guarded_lasers.py",
    "tests/unit/devices/test_opencv_camera.py",
    "tests/unit/devices/test_registry.py",
    "tests/unit/devices/test_serial_faults.py",
    "tests/unit/emulator/test_bench.py",
    "tests/unit/emulator/test_board.py",
    "tests/unit/emulator/test_camera.py",
    "tests/unit/emulator/test_spot.py",
    "tests/unit/figures/test_picture.py",
    "tests/unit/optics/test_triangulate.py",
    "tests/unit/procedure/capture/test_automatic.py",
    "tests/unit/procedure/engine/test_resume.py",
    "tests/unit/ranging/test_bad_input.py",
    "tests/unit/ranging/test_lines.py",
    "tests/unit/ranging/test_live.py",
    "tests/unit/ranging/test_mixture.py",
    "tests/unit/ranging/test_shape.py",
    "tests/unit/report/history/test_page.py",
    "tests/unit/report/test_board_page.py",
    "tests/unit/report/test_document_html.py",
    "tests/unit/report/test_document_pdf.py",
    "tests/unit/sensor/test_calibrated.py",
    "tests/unit/sensor/test_curves.py",
    "tests/unit/session/test_reference_session.py",
    "tests/unit/spots/test_fit.py",
    "tests/unit/spots/test_persistence.py",
    "tests/unit/steps/test_fit.py",
    "tests/unit/trials/repeatability/test_budget.py",
    "tests/unit/trials/statistics/test_control_chart.py",
    "tests/unit/trials/statistics/test_gauge_rr.py",
    "tests/unit/trials/statistics/test_repeatability.py",
    "tests/unit/trials/thesis/test_thesis_chain.py",
    "tests/unit/trials/verify/test_verdict.py",
    "tests/unit/viewer/test_blueprint.py",
    "tests/unit/viewer/test_compaction.py",
    "tests/unit/viewer/test_comparison.py",
    "tests/unit/viewer/test_fit.py",
    "tests/unit/viewer/test_notebook.py",
    "tests/unit/viewer/test_recording.py",
    "tests/unit/viewer/test_trial.py",
    "tests/unit/viewer/test_window.py",
}
"""Unit tests of processes or the viewer, or of more than 3 s of processor time; not in `make quick`."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests of these files, so that they can be chosen and left out.

    Of a slow test of several seeds, and of one marked `long_cases`, the first case is for every run, the
    others are for `make thorough`.
    """
    begun: dict[str, object] = {}
    for item in items:
        file = item.nodeid.partition("::")[0]
        if file in REAL_TIME:
            item.add_marker("real_time")
        if file in SLOW:
            item.add_marker("slow")
        if item.nodeid.startswith("tests/wheel/"):
            item.add_marker("wheel")
        if isinstance(item, pytest.Function) and hasattr(item, "callspec"):
            test = item.nodeid.partition("[")[0]
            if item.get_closest_marker("long_cases"):
                case: object = item.callspec.id
            elif file in SLOW:
                case = item.callspec.params.get("seed")
            else:
                continue
            if begun.setdefault(test, case) != case:
                item.add_marker("thorough")
