"""Campaign file: its schema, and the campaign with what it takes from other files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from workbench.campaign.design import Design
from workbench.campaign.kind import Chunk, Inputs
from workbench.campaign.refit import Refit
from workbench.campaign.sessions import Sessions
from workbench.campaign.simulate import Simulate
from workbench.model.errors import BadInputError
from workbench.model.yamlfile import FileModel, line_of, load_yaml_model, read_document

AnyWork = Annotated[Design | Refit | Sessions | Simulate, Field(discriminator="kind")]
Seed = Annotated[int, Field(ge=0, lt=2**63)]


class CampaignFile(FileModel):
    """A campaign file, format 1."""

    kind_key = "campaign"

    format: Literal[1]
    campaign: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+$")]
    title: str
    seed: Seed = 1
    """Seed of all random numbers."""
    work: AnyWork


@dataclass(frozen=True)
class Campaign:
    """A campaign: everything that its results depend on, beside the program itself."""

    file: CampaignFile
    inputs: Inputs
    """Texts of the files that it names."""

    @property
    def chunks(self) -> list[Chunk]:
        """All chunks of the work."""
        return self.file.work.chunks(self.inputs, self.file.seed)

    def chunk_at(self, index: int) -> Chunk:
        """The chunk with an index."""
        return self.file.work.chunk_at(self.inputs, self.file.seed, index)


def load_campaign(path: Path) -> Campaign:
    """Read a campaign file, and the files that it names.

    Raises:
        BadInputError: a file is missing or wrong; names file and line.
    """
    file = load_yaml_model(path, CampaignFile)
    inputs = {}
    for key in file.work.input_keys:
        try:
            inputs[key] = file.work.read_input(key, path.parent)
        except BadInputError as error:
            line = line_of(read_document(path).data, ("work", key))
            raise BadInputError(f"{path}:{line}: work.{key}: {error}") from None
    return Campaign(file, inputs)
