"""`workbench new`."""

from __future__ import annotations

import os
import re
import tomllib
from pathlib import Path

import pytest

from tests.support.command_line import Run, refused
from tests.support.terminal import at_terminal
from workbench.cli.new import PAGES

ROOT = Path(__file__).parents[3]


def test_new_folder_holds_the_procedures_rigs_and_firmware(workbench: Run, tmp_path: Path) -> None:
    folder = tmp_path / "our lab/bench 1"
    assert workbench("new", folder).code == 0
    for part in ("procedures", "rigs"):
        copied = {path.relative_to(folder): path.read_bytes() for path in (folder / part).rglob("*.*")}
        for path, content in copied.items():
            assert content == (ROOT / path).read_bytes()
    assert (folder / "procedures/calibrate-flat.yaml").is_file()
    assert (folder / "rigs/thesis-emulated.yaml").is_file()
    assert (folder / "rigs/firmware/laser_controller.c").is_file()


def test_new_folder_holds_the_pages_that_its_readme_names(workbench: Run, tmp_path: Path) -> None:
    assert workbench("new", tmp_path).code == 0
    pages = re.findall(r"\]\((docs/\S+\.md)\)", (tmp_path / "README.md").read_text())
    assert "docs/procedures.md" in pages
    assert sorted(pages) == sorted(f"docs/{path.name}" for path in (tmp_path / "docs").iterdir())
    for page in pages:
        assert (tmp_path / page).read_bytes() == (ROOT / page).read_bytes()


def test_the_wheel_carries_the_pages_of_a_new_folder() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    carried = project["tool"]["hatch"]["build"]["targets"]["wheel"]["force-include"]
    for page in PAGES:
        assert carried[f"docs/{page}"] == f"workbench/templates/docs/{page}"


def test_next_commands_are_printed_and_name_files_of_the_folder(workbench: Run, tmp_path: Path) -> None:
    *_, enter, run = workbench("new", tmp_path / "our lab").err.splitlines()
    assert enter == f"cd '{tmp_path}/our lab'"
    assert run.startswith("workbench run ")
    for word in run.split():
        assert not word.endswith(".yaml") or (tmp_path / "our lab" / word).is_file()


def test_laid_out_files_pass_check(workbench: Run, tmp_path: Path) -> None:
    workbench("new", tmp_path / "lab")
    files = [*tmp_path.glob("lab/procedures/*.yaml"), *tmp_path.glob("lab/rigs/*.yaml")]
    assert len(files) >= 8
    assert workbench("check", *files).code == 0


def test_an_existing_empty_folder_is_used(workbench: Run, tmp_path: Path) -> None:
    assert workbench("new", tmp_path).code == 0
    assert (tmp_path / "rigs").is_dir()


def test_a_folder_with_files_is_left_alone(workbench: Run, tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("ours")
    refused(workbench("new", tmp_path), 2, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


def test_a_second_call_overwrites_nothing(workbench: Run, tmp_path: Path) -> None:
    rig = tmp_path / "lab/rigs/thesis-emulated.yaml"
    workbench("new", tmp_path / "lab")
    rig.write_text("ours")
    refused(workbench("new", tmp_path / "lab"), 2, tmp_path / "lab")
    assert rig.read_text() == "ours"


@pytest.mark.parametrize("name", ["file", "file/lab", "n" * 300])
def test_a_path_that_cannot_be_a_folder_is_refused(workbench: Run, tmp_path: Path, name: str) -> None:
    (tmp_path / "file").write_text("")
    refused(workbench("new", tmp_path / name), 2, tmp_path / name)


def test_no_input_lays_the_folder_out_without_questions_at_a_terminal(tmp_path: Path) -> None:
    with at_terminal(tmp_path, "new", "lab", "--no-input") as terminal:
        assert terminal.end() == 0
    assert "?" not in terminal.text
    assert (tmp_path / "lab/procedures/calibrate-flat.yaml").is_file()


@pytest.mark.parametrize(("key", "code"), [(b"\x04", 6), (b"\x03", 5)])
def test_nothing_is_written_where_the_questions_end_early(tmp_path: Path, key: bytes, code: int) -> None:
    with at_terminal(tmp_path, "new", "lab") as terminal:
        terminal.type("three")
        terminal.wait_for("> ")
        os.write(terminal.master, key)
        assert terminal.end() == code
    assert "Traceback" not in terminal.text
    assert list((tmp_path / "lab").rglob("*")) == []
