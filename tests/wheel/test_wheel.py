"""The wheel, installed with the run-time dependencies alone, works in any folder."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
MINUTES = 60.0
PROCEDURE = """\
format: 1
procedure: short
title: Calibration at few standoffs
steps:
  - {step: capture_grid, standoffs_mm: [200, 350, 600, 1000, 2000], repeats: 2}
  - {step: fit}
  - {step: export}
"""


def run(*command: object, cwd: Path) -> str:
    """Standard output of a command that ends without an error."""
    surroundings = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    done = subprocess.run(
        [str(word) for word in command],
        cwd=cwd,
        env=surroundings,
        capture_output=True,
        text=True,
        timeout=5 * MINUTES,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    build = ("wheel", "--quiet", "--no-deps", "--no-build-isolation", "--wheel-dir", folder)
    run(sys.executable, "-m", "pip", *build, ROOT, cwd=folder)
    (built,) = folder.iterdir()
    return built


@pytest.fixture(scope="module")
def scripts(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of the commands of a fresh environment."""
    folder = tmp_path_factory.mktemp("environment")
    run(sys.executable, "-m", "venv", folder, cwd=folder)
    pip = (folder / "bin/python", "-m", "pip", "install", "--quiet")
    run(*pip, "--require-hashes", "--requirement", ROOT / "requirements-run.lock", cwd=folder)
    run(*pip, "--no-deps", wheel, cwd=folder)
    return folder / "bin"


def test_wheel_carries_procedures_rigs_types_and_licence(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    ours = [*ROOT.glob("procedures/*.yaml"), *ROOT.glob("rigs/*.yaml"), *ROOT.glob("rigs/firmware/*.[ch]")]
    assert len(ours) > 8
    assert {f"workbench/templates/{path.relative_to(ROOT)}" for path in ours} <= names
    assert "workbench/py.typed" in names
    assert any(name.endswith("dist-info/licenses/LICENSE") for name in names)
    assert not any("__pycache__" in name or "/build/" in name for name in names)


def test_installed_dependencies_are_complete(scripts: Path) -> None:
    run(scripts / "python", "-m", "pip", "check", cwd=scripts)


def test_installed_workbench_calibrates_in_a_folder_of_its_own(scripts: Path, tmp_path: Path) -> None:
    run(scripts / "workbench", "new", "lab", cwd=tmp_path)
    lab = tmp_path / "lab"
    (lab / "procedures/short.yaml").write_text(PROCEDURE)
    run(scripts / "workbench", "run", "procedures/short.yaml", "--rig", "rigs/thesis-emulated.yaml", cwd=lab)
    (session,) = (path for path in (lab / "sessions").iterdir() if path.is_dir())
    assert (session / "calibration.yaml").is_file()
    code = f"import workbench as wb; print(wb.open_session({str(session)!r}).calibration.verdict)"
    assert run(scripts / "python", "-c", code, cwd=lab) == "accepted\n"


def test_script_of_a_user_passes_strict_type_checks(scripts: Path, tmp_path: Path) -> None:
    """Types are those of the installed package (`py.typed`), not of the repository."""
    script = shutil.copy(ROOT / "examples/analysis/residuals.py", tmp_path)
    options = ("--strict", "--cache-dir", tmp_path / "cache", "--python-executable", scripts / "python")
    run(sys.executable, "-m", "mypy", *options, script, cwd=tmp_path)
    wrong = tmp_path / "wrong.py"
    wrong.write_text('import workbench as wb\n\nwb.load_calibration("c.yaml").no_such_name\n')
    with pytest.raises(AssertionError):
        run(sys.executable, "-m", "mypy", *options, wrong, cwd=tmp_path)


def test_installed_package_is_imported_not_the_repository(scripts: Path, tmp_path: Path) -> None:
    imported = run(scripts / "python", "-c", "import workbench; print(workbench.__file__)", cwd=tmp_path)
    assert Path(imported.strip()).is_relative_to(scripts.parent)
