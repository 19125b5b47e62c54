"""`workbench check`: checks of files before a session."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console

from workbench.model.errors import BadInputError
from workbench.model.yamlfile import read_document
from workbench.procedure.engine.check import check_file


def check_files(files: list[Path]) -> None:
    """Check files and print the notes on each; the mistakes of all files are one error.

    Raises:
        BadInputError: a file is wrong.
    """
    console = Console(stderr=True, highlight=False, soft_wrap=True, markup=False)
    mistakes: list[str] = []
    for path in files:
        try:
            if _is_campaign(path):
                # Imported here: only campaigns need pandas and JAX, which take seconds to load.
                from workbench.campaign.campaign_file import load_campaign

                load_campaign(path)
                console.print(f"{path}: good")
                continue
            result = check_file(path)
        except BadInputError as error:
            mistakes.append(str(error))
            continue
        for note in result.notes:
            console.print(f"note: {note}")
        if not result.mistakes:
            console.print(f"{path}: good")
        mistakes += result.mistakes
    if mistakes:
        raise BadInputError("\n".join(mistakes))


def _is_campaign(path: Path) -> bool:
    """Whether a YAML file is a campaign, by its keys.

    Raises:
        BadInputError: the file cannot be read.
    """
    data = read_document(path).data
    return isinstance(data, dict) and "campaign" in data
