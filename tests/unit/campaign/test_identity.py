"""Identity of results: whatever changes them changes it, and is named."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.campaigns import RIG, SIMULATE, as_worker, simulated_campaign
from workbench.campaign.identity import Identity, check_environment, difference, identity_of
from workbench.model.errors import BadInputError


@pytest.fixture
def identity(tmp_path: Path) -> Identity:
    return identity_of(simulated_campaign(tmp_path))


def test_equal_campaigns_have_equal_identities(tmp_path: Path, identity: Identity) -> None:
    commented = SIMULATE.replace("seed: 7", "seed: 7  # drawn")
    again = identity_of(simulated_campaign(tmp_path, commented))
    assert difference(identity, again) == ""
    assert again.sha256 == identity.sha256


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ("seed: 7", "seed: 8", "expected results of seed 8, got those of seed 7"),
        ("campaign: small", "campaign: other", "expected results of the campaign other, got those of small"),
        ("chunk: 16", "chunk: 8", "the file of the campaign small has changed"),
    ],
)
def test_a_changed_file_is_named(
    tmp_path: Path, identity: Identity, before: str, after: str, words: str
) -> None:
    changed = identity_of(simulated_campaign(tmp_path, SIMULATE.replace(before, after)))
    assert words in difference(identity, changed)
    assert changed.sha256 != identity.sha256


def test_a_changed_rig_file_is_named(tmp_path: Path) -> None:
    own = tmp_path / "rig.yaml"
    text = SIMULATE.replace(str(RIG), "rig.yaml")
    own.write_text(RIG.read_text())
    before = identity_of(simulated_campaign(tmp_path, text))
    own.write_text(RIG.read_text().replace("placement_sd_mm: 0.3", "placement_sd_mm: 0.4"))
    assert "work.rig" in difference(before, identity_of(simulated_campaign(tmp_path, text)))


def test_another_version_is_named(identity: Identity) -> None:
    code = identity.model_copy(update={"code_sha256": "f" * 64})
    assert "code ffffffffffff" in difference(code, identity)
    library = identity.model_copy(update={"versions": identity.versions | {"jax": "0.1"}})
    assert "got those of jax 0.1" in difference(library, identity)


@pytest.mark.parametrize("name", ["XLA_FLAGS", "OPENBLAS_NUM_THREADS"])
def test_a_worker_with_more_threads_is_refused(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    as_worker(monkeypatch)
    check_environment()
    monkeypatch.delenv(name)
    with pytest.raises(BadInputError, match=f"expected {name}=.*start workers by: env "):
        check_environment()
