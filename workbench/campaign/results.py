"""Results of a campaign in its folder: tables as CSV and Parquet, and a page."""

from __future__ import annotations

from pathlib import Path

from workbench.campaign.folder import PAGE, TABLES, CampaignFolder
from workbench.campaign.kind import Summary
from workbench.model.errors import BadInputError
from workbench.report.document import Document, Fact, Section, Verdict
from workbench.report.document_files import write_document
from workbench.report.frames import frame_of_table
from workbench.session.files import write_atomically


def summarise(folder: CampaignFolder) -> Summary:
    """Summary of all chunks, read one after another.

    Raises:
        BadInputError: a chunk is missing or damaged.
    """
    return folder.campaign.file.work.summarise(folder.campaign.inputs, folder.frames())


def write_results(folder: CampaignFolder, summary: Summary) -> None:
    """Write tables and page.

    Raises:
        BadInputError: a file cannot be written.
    """
    tables = folder.path / TABLES
    try:
        tables.mkdir(exist_ok=True)
        for table in summary.tables:
            write_atomically(tables / f"{table.name}.csv", table.to_csv().encode())
            write_atomically(tables / f"{table.name}.parquet", frame_of_table(table).to_parquet(index=False))
    except OSError as error:
        raise BadInputError(f"{tables}: cannot be written: {error.strerror or error}") from None
    write_document(campaign_document(folder, summary), html=folder.path / PAGE)


def campaign_document(folder: CampaignFolder, summary: Summary) -> Document:
    """Page of a campaign: result, tables, charts, and what the results depend on."""
    identity, work = folder.identity, folder.campaign.file.work
    count = work.count(folder.campaign.inputs)
    head = (
        Fact("Campaign", folder.campaign.file.title),
        Fact("Kind", folder.campaign.file.work.kind),
        Fact("Items", f"{count} ({work.thing}), in {len(folder.campaign.chunks)} chunks"),
        Fact("Seed", str(identity.seed)),
    )
    origin = (
        Fact("Campaign file (SHA-256)", identity.file_sha256),
        *(Fact(f"{key} (SHA-256)", sha256) for key, sha256 in identity.inputs_sha256.items()),
        Fact("Sources of the workbench (SHA-256)", identity.code_sha256),
        Fact("Versions", ", ".join(f"{name} {version}" for name, version in identity.versions.items())),
    )
    sections = (
        Section("results", "Results", tables=summary.tables, charts=summary.charts),
        Section("origin", "Origin", facts=origin),
    )
    verdict = Verdict("open", summary.headline, summary.notes)
    title = f"Campaign {identity.campaign}"
    return Document(title, "", "", head, verdict, (), sections, colors=summary.colors)


def page_path(folder: CampaignFolder) -> Path:
    """File of the page."""
    return folder.path / PAGE
