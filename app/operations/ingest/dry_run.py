"""The dry run of a campaign folder, as the pages show it: what would be stored, and everything that
is wrong."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from ....ingest.errors import IngestError
from ....ingest.folder.column_names import RUNS_FILE
from ....schema.campaigns import Campaign, stated_day
from ....schema.conditions import get_campaign_id
from ....schema.impacts import Impact, Shot
from ....schema.recordings import SEVERITIES, STORED, QualityFinding, Recording
from ....schema.rehearsal import run_rehearsal
from ....schema.session import Store
from ..machine_paths import CARD
from ..operation import Result
from .request import FolderReading
from .service import ingest_into

#: Rows of recordings and of findings that are kept with the job; a page shows no more.
_MOST = 2000


@dataclass(frozen=True)
class DryRun(Result):
    """What an ingest would store. With `faults` the folder is refused as a whole, and the rest is
    empty.

    `report` is the JSON of `pyroshock ingest --json`, `added` what the store lacks. `recordings`
    has a row for each recording of the campaign with its impacts and its worst finding. `written`
    are the texts of campaign.toml and runs.csv, where a form has written them.
    """

    faults: list[str] = field(default_factory=list)
    campaign: str = ""
    kind: str = ""
    date: str = ""
    runs: int = 0
    added: dict[str, int] = field(default_factory=dict)
    report: dict[str, Any] = field(default_factory=dict)
    recordings: list[dict[str, Any]] = field(default_factory=list)
    plan: dict[str, Any] | None = None
    undeclared_factors: list[str] = field(default_factory=list)
    written: dict[str, str] = field(default_factory=dict)

    def summary(self) -> str:
        """One sentence for the list of jobs."""
        if self.faults:
            number = len(self.faults)
            return (
                f"The folder has {number} fault{'s' if number > 1 else ''}; "
                f"nothing of it can be stored."
            )
        words = (
            ", ".join(f"{count} {noun}" for noun, count in self.added.items() if count)
            or "nothing new"
        )
        return f"{self.campaign}: {words} would be stored."

    def to_json(self) -> dict[str, Any]:
        """Plain data for the row of the job."""
        return asdict(self)


def dry_run(
    store: Store,
    folder: Path,
    request: FolderReading,
    progress: Callable[[int, int, str], None] | None = None,
    *,
    processes: int | None = None,
) -> DryRun:
    """Ingest `folder` within a transaction that is rolled back, and tell what was in it. Nothing is
    stored."""
    try:
        with run_rehearsal(store) as target:
            ingested = ingest_into(
                target, folder, request, progress, processes=processes, dry_run=True
            )
            with target.reading() as session:
                facts, recordings = (
                    _facts(session, ingested.campaign),
                    _recordings(session, ingested.campaign),
                )
    except IngestError as error:
        return DryRun(faults=[" ".join(fault.split()) for fault in error.faults])
    stored = store.read(lambda session: _stored_paths(session, ingested.campaign))
    links, report = ingested.links, ingested.to_json()
    for row in recordings:
        row["state"] = (
            "set aside"
            if row["state"] == "set aside"
            else "stored already"
            if row["recording"] in stored
            else "new"
        )
    return DryRun(
        campaign=ingested.campaign,
        **facts,
        added=ingested.added,
        report={**report, "findings": report["findings"][:_MOST]},
        recordings=recordings[:_MOST],
        plan=None
        if links is None
        else {"plan": links.plan, "linked": links.linked, "done": links.done},
        undeclared_factors=ingested.report.undeclared_factors,
    )


def written_texts(folder: Path) -> dict[str, str]:
    """The texts of a folder's campaign.toml and runs.csv, by the names of the files.

    Parameters:
        folder: The campaign folder; a file that is missing is left out.
    """
    names = (CARD, RUNS_FILE)
    return {
        name: (folder / name).read_text(encoding="utf-8")
        for name in names
        if (folder / name).is_file()
    }


def _facts(session: Session, campaign: str) -> dict[str, Any]:
    row = session.scalars(select(Campaign).where(Campaign.name == campaign)).one()
    runs = set()
    for table in (Impact, Shot):
        runs |= set(
            session.scalars(select(table.run).where(table.campaign_id == row.id).distinct())
        )
    return {"kind": row.kind, "date": stated_day(row.date) or "", "runs": len(runs)}


def _recordings(session: Session, campaign: str) -> list[dict[str, Any]]:
    """Those that would be in the store, in their order."""
    key = get_campaign_id(session, campaign)
    of_recordings = select(Impact.recording_id, func.count()).where(Impact.campaign_id == key)
    impacts: dict[int | None, int] = dict(
        iter(session.execute(of_recordings.group_by(Impact.recording_id)))
    )
    counted = (
        select(QualityFinding.recording_id, QualityFinding.severity, func.count())
        .join(Recording, QualityFinding.recording_id == Recording.id)
        .where(Recording.campaign_id == key)
        .group_by(QualityFinding.recording_id, QualityFinding.severity)
    )
    findings: dict[int, dict[str, int]] = {}
    for recording, severity, count in session.execute(counted):
        findings.setdefault(recording, {})[severity] = count
    rows = session.execute(
        select(Recording.id, Recording.path, Recording.format, Recording.status, Recording.reason)
        .where(Recording.campaign_id == key)
        .order_by(Recording.id)
    )
    return [
        {
            "recording": path,
            "format": kind,
            "state": status,
            "impacts": impacts.get(recording, 0),
            "quality": _quality(status, reason, findings.get(recording, {})),
        }
        for recording, path, kind, status, reason in rows
    ]


def _quality(status: str, reason: str | None, findings: dict[str, int]) -> str:
    if status != STORED:
        return f"set aside: {reason}"
    words = [
        f"{findings[severity]} {severity}"
        for severity in reversed(SEVERITIES)
        if severity in findings
    ]
    return ", ".join(words) or "no findings"


def _stored_paths(session: Session, campaign: str) -> set[str]:
    query = select(Recording.path).join(Campaign, Recording.campaign_id == Campaign.id)
    return set(session.scalars(query.where(Campaign.name == campaign, Recording.status == STORED)))
