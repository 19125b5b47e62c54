"""`workbench doctor`; the checks themselves are tested with `procedure.doctor`."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.command_line import Run, refused

RIG = (Path(__file__).parents[3] / "rigs/thesis-emulated.yaml").read_text()


@pytest.mark.parametrize(
    ("block", "code", "words"),
    [
        ("controller: {interlock_closed: false}", 4, ("interlock", "laser L1", "laser L4")),
        ("answers: false", 6, ("prompt safety",)),
    ],
)
def test_what_is_not_ready_has_its_exit_code(
    workbench: Run, tmp_path: Path, block: str, code: int, words: tuple[str, ...]
) -> None:
    rig = tmp_path / "rig.yaml"
    assert "seed: 2001" in RIG
    rig.write_text(RIG.replace("seed: 2001", f"seed: 2001\n  {block}"))
    refused(workbench("doctor", rig, "--no-input"), code, *words)
