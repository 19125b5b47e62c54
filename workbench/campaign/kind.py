"""Base class of the kinds of campaigns: items, work on a chunk of them, summary."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from math import ceil
from pathlib import Path
from typing import Annotated, ClassVar

import numpy as np
import pandas as pd
from pydantic import Field

from workbench.model.chart import Chart
from workbench.model.table import Table
from workbench.model.yamlfile import FileModel

Inputs = Mapping[str, str]
"""Texts of what a campaign takes from other files, by the key that names them: `rig`."""
ChunkSize = Annotated[int, Field(ge=1, le=100_000)]


@dataclass(frozen=True)
class Chunk:
    """A range of items that one worker computes at once."""

    index: int
    """From 0."""
    items: range
    """Numbers of the items, from 0."""
    seed: int
    """Seed of the campaign."""

    def rng(self) -> np.random.Generator:
        """Random numbers of this chunk alone, whichever worker computes it, and when."""
        return np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=(self.index,)))


@dataclass(frozen=True)
class Summary:
    """Result of a campaign as data."""

    headline: str
    """The result in one sentence."""
    tables: tuple[Table, ...]
    charts: tuple[Chart, ...]
    notes: tuple[str, ...] = ()
    colors: Mapping[str, str] = field(default_factory=dict)
    """Colours (`#rrggbb`) by the name of a series."""


class Work(FileModel, ABC):
    """Work of a campaign; a subclass for each kind, with a field `kind: Literal[...]`."""

    thing: ClassVar[str]
    """An item, for messages: `calibration`."""
    chunk: ChunkSize
    """Number of items of a chunk; part of the campaign, because the random numbers are drawn by chunk."""

    @property
    @abstractmethod
    def input_keys(self) -> tuple[str, ...]:
        """Keys whose values name files or folders."""

    @abstractmethod
    def read_input(self, key: str, base: Path) -> str:
        """Text of the file or folder that a key names.

        Args:
            key: one of `input_keys`.
            base: folder of the campaign file, to which paths are relative.

        Raises:
            BadInputError: it is missing or wrong.
        """

    @abstractmethod
    def count(self, inputs: Inputs) -> int:
        """Number of items."""

    @abstractmethod
    def run(self, inputs: Inputs, chunk: Chunk, folder: Path) -> pd.DataFrame:
        """Results of a chunk, one row per item; the same on every call.

        Args:
            inputs: texts of `input_keys`.
            chunk: the chunk.
            folder: folder of the campaign, for a kind that keeps more than rows.

        Raises:
            BadInputError: the work cannot be done.
            StoppedError: an external cause stopped an item; the chunk is not finished.
        """

    @abstractmethod
    def summarise(self, inputs: Inputs, frames: Iterable[pd.DataFrame]) -> Summary:
        """Summary of the results of all chunks, in their order; `frames` is read once."""

    def chunk_at(self, inputs: Inputs, seed: int, index: int) -> Chunk:
        """The chunk with an index."""
        first = index * self.chunk
        return Chunk(index, range(first, min(first + self.chunk, self.count(inputs))), seed)

    def chunks(self, inputs: Inputs, seed: int) -> list[Chunk]:
        """All chunks."""
        return [self.chunk_at(inputs, seed, n) for n in range(ceil(self.count(inputs) / self.chunk))]
