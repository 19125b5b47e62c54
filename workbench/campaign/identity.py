"""Identity of a campaign's results: file, inputs, program. Results of two identities are never mixed."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator
from functools import cache
from importlib.metadata import version
from pathlib import Path

from workbench.campaign.campaign_file import Campaign
from workbench.model.errors import BadInputError
from workbench.model.yamlfile import FileModel
from workbench.session.manifest import recorded_versions

PACKAGE = Path(__file__).parents[1]
"""Folder of the sources."""
LIBRARIES = ("jaxlib", "pandas", "scipy")
"""Libraries that determine results, beside those that sessions record."""
ENVIRONMENT = {
    "OPENBLAS_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "NPROC": "1",
    "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false",
}
"""Environment of a worker: one thread. The number of threads changes the last bits of sums."""


class Identity(FileModel):
    """Everything that determines the results of a campaign."""

    campaign: str
    """Name in the file."""
    seed: int
    file_sha256: str
    """Of the values in the file, without comments."""
    inputs_sha256: dict[str, str]
    """Of the texts of the files that the campaign names, by key."""
    code_sha256: str
    """Of the sources of the workbench."""
    versions: dict[str, str]
    """Python and libraries."""

    @property
    def sha256(self) -> str:
        """One hash of everything."""
        return _sha256(self.model_dump_json())


def identity_of(campaign: Campaign) -> Identity:
    """Identity of a campaign that this program runs."""
    return Identity(
        campaign=campaign.file.campaign,
        seed=campaign.file.seed,
        file_sha256=_sha256(campaign.file.model_dump_json()),
        inputs_sha256={key: _sha256(text) for key, text in campaign.inputs.items()},
        code_sha256=code_sha256(),
        versions=recorded_versions() | {name: version(name) for name in LIBRARIES},
    )


def difference(found: Identity, wanted: Identity) -> str:
    """First difference of two identities in words; empty if there is none."""
    return next(_differences(found, wanted), "")


def check_environment() -> None:
    """Check that this process computes with one thread.

    Raises:
        BadInputError: a variable of the environment differs.
    """
    for name, value in ENVIRONMENT.items():
        if os.environ.get(name) != value:
            wanted = " ".join(f"{key}={one}" for key, one in ENVIRONMENT.items())
            raise BadInputError(
                f"worker {os.uname().nodename}: expected {name}={value} in its environment, got"
                f" {os.environ.get(name) or 'nothing'}; start workers by: env {wanted} dask worker ..."
            )


@cache
def code_sha256() -> str:
    """Hash of all sources of the workbench, with their names."""
    digest = hashlib.sha256()
    for path in sorted(PACKAGE.rglob("*.py")):
        digest.update(json.dumps([path.relative_to(PACKAGE).as_posix(), path.stat().st_size]).encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _differences(found: Identity, wanted: Identity) -> Iterator[str]:
    if found.campaign != wanted.campaign:
        yield f"expected results of the campaign {wanted.campaign}, got those of {found.campaign}"
    if found.seed != wanted.seed:
        yield f"expected results of seed {wanted.seed}, got those of seed {found.seed}"
    if found.file_sha256 != wanted.file_sha256:
        yield f"the file of the campaign {wanted.campaign} has changed since"
    for key in sorted({*found.inputs_sha256, *wanted.inputs_sha256}):
        if found.inputs_sha256.get(key) != wanted.inputs_sha256.get(key):
            yield f"what work.{key} names has changed since"
    for key in sorted({*found.versions, *wanted.versions}):
        a, b = found.versions.get(key, "none"), wanted.versions.get(key, "none")
        if a != b:
            yield f"expected results of {key} {b}, got those of {key} {a}"
    if found.code_sha256 != wanted.code_sha256:
        yield (
            f"expected results of this version of the workbench (code {wanted.code_sha256[:12]}), got those"
            f" of another (code {found.code_sha256[:12]})"
        )


def _sha256(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
