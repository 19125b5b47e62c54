"""Certificate in the documentation: `python -m tests.viewer.certificate DOCS`, of a new run of the demo.

It writes `certificate-demo.pdf` and its first page as `images/certificate.png`. The laboratory is the example
of `certificate.md`.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pypdfium2

from tests.viewer.harness import write_png
from tests.viewer.manifest import record
from tests.viewer.pictures import COMMAND

DPI = 90
POINTS_PER_INCH = 72


def example_laboratory(docs: Path) -> str:
    """The example of `lab.yaml` in the documentation."""
    found = re.search(
        r"```yaml\n(format: 1\nlaboratory: .*?)```", (docs / "certificate.md").read_text(), re.DOTALL
    )
    assert found is not None
    return found[1]


def first_page(pdf: Path, png: Path) -> None:
    """Write the first page of a PDF file as a picture."""
    document = pypdfium2.PdfDocument(pdf)
    picture = document[0].render(scale=DPI / POINTS_PER_INCH).to_numpy()
    write_png(png, np.ascontiguousarray(picture))
    document.close()


def main(docs: Path) -> None:
    """Run the demo in a temporary folder, and print its certificate."""
    workbench = Path(sys.executable).with_name("workbench")
    pdf = docs.resolve() / "certificate-demo.pdf"
    with tempfile.TemporaryDirectory() as folder:
        for name in ("procedures", "rigs"):
            shutil.copytree(docs.parent / name, Path(folder) / name)
        sessions = Path(folder) / "sessions"  # as `make demo`: the certificate states the command
        sessions.mkdir()
        (sessions / "lab.yaml").write_text(example_laboratory(docs))
        account = os.environ | {"LOGNAME": "operator"}
        subprocess.run([workbench, "run", *COMMAND], cwd=folder, check=True, env=account)
        (session,) = (path for path in sessions.iterdir() if path.is_dir())
        report = ("report", session.name, "--no-input", "--pdf", str(pdf))
        subprocess.run([workbench, *report], cwd=folder, check=True)
    first_page(pdf, docs / "images/certificate.png")
    record("certificate.png", pdf.name)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
