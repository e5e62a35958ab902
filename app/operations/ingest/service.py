"""A campaign folder into the store: recordings, plan, the motion of a struck plate's surface, and a
note on facts that training needs; and a new folder from a plan of the store."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import numpy as np
from sqlalchemy import select

from ....array_types import Floats
from ....doe.plans import StoredRun, read_plan
from ....ingest.errors import enumerated
from ....ingest.extraction.impact_speed import ImpactSpeed, StruckPlate
from ....ingest.folder.new_folder import KIND_OF_START, NewFolder, start_folder
from ....ingest.storing.report import DISCARDED
from ....schema.campaigns import Campaign
from ....schema.session import Store
from ....twin.contact.impacts import plate_impedance
from ....twin.contact.target_motion import with_plate_motion
from ...common.frames import frame_of, titled_table
from ...common.plan_tables import cells_of
from ..operation import Result
from .campaign_overview import missing_facts_words
from .request import FolderReading

if TYPE_CHECKING:
    import pandas as pd

    from ....ingest.storing.plan_link import PlanLinks
    from ....ingest.storing.report import IngestReport


#: What is said of the campaign once, with its words.
_SAID_WHOLE = (
    "added-facts",
    "missing-facts",
    "velocity-differs-throughout",
    "pressure-differs-throughout",
)


@dataclass(frozen=True, eq=False)
class IngestedCampaign(Result):
    """What an ingest did. `report` has the totals of the campaign and what was added, `links` the
    plan's runs.

    With `dry_run` nothing was stored, and the totals are those that the campaign would have.
    """

    report: IngestReport
    links: PlanLinks | None
    dry_run: bool
    folder: Path

    @property
    def campaign(self) -> str:
        """Its name."""
        return self.report.campaign

    @property
    def added(self) -> dict[str, int]:
        """What this ingest added: counts of recordings, impacts and shots."""
        return dict(self.report.added)

    @property
    def findings(self) -> list[dict[str, Any]]:
        """What the checks of the recordings and the comparison with the plan say, a row each."""
        return [
            *self.report.findings,
            *(self.links.as_findings() if self.links is not None else ()),
        ]

    def to_frame(self) -> pd.DataFrame:
        """Findings of the quality checks, recordings that were set aside and deviations from the
        plan, a row each."""
        set_aside = [
            {
                "recording": row["recording"],
                "check": "set-aside",
                "severity": "reject",
                "message": row["reason"],
            }
            for row in self.report.set_aside
        ]
        columns = ("recording", "channel", "check", "severity", "message")
        frame = frame_of([*set_aside, *self.findings], columns)
        return frame.reindex(columns=list(columns))

    def to_json(self) -> dict[str, Any]:
        """As `pyroshock ingest --json` prints it."""
        return {**self.report.as_json(), "findings": self.findings}

    def notes(self) -> Sequence[str]:
        """What was added, set aside and found, and what does not match the plan."""
        return (self._sentence(), *(f"  {line}" for line in self._remarks()))

    def summary(self) -> str:
        """What was added, in a few words."""
        aside = len(self.report.set_aside)
        return (
            f"{self.campaign}: added {self.report.added_words}"
            + (f"; {aside} recordings set aside" if aside else "")
            + (f"; plan {self.links.plan}: {self.links.done} runs done" if self.links else "")
        )

    def address(self) -> str:
        """The page of the campaign."""
        return f"/campaigns/{quote(self.campaign, safe='')}"

    def next_command(self) -> Sequence[str]:
        """A dataset of the campaign; a diagnosis where it has no impacts."""
        return self.next_command_with(())

    def next_command_with(self, _others: Sequence[IngestedCampaign]) -> Sequence[str]:
        """A dataset of all the campaigns."""
        campaigns = (self, *_others)
        if self.dry_run:
            return ("ingest", *(str(campaign.folder) for campaign in campaigns))
        if not any(campaign.report.impacts for campaign in campaigns):
            return ("diagnose", self.campaign)
        names = ",".join(campaign.campaign for campaign in campaigns)
        return ("dataset", "build", self.campaign, "--from", names)

    def _remarks(self) -> Iterator[str]:
        report = self.report
        if report.undeclared_factors:
            yield (
                f"free factors: {', '.join(report.undeclared_factors)} (not "
                "declared in [factors] of campaign.toml)"
            )
        for item in report.set_aside:
            yield f"set aside {item['recording']}: {item['reason']}"
        for item in report.findings:
            if item["check"] == DISCARDED:
                yield item["message"]
        yield from _findings_in_words(report.findings)
        if self.links is not None:
            links = self.links
            yield (f"plan {links.plan}: {links.linked} repetitions linked, {links.done} runs done")
            for mismatch in links.mismatches:
                yield f"not as planned: run {mismatch['run']}: {mismatch['reason']}"

    def __repr__(self) -> str:
        return f"<{self._sentence()}>"

    def _repr_html_(self) -> str:
        counts = (
            self.to_frame()
            .groupby(["severity", "check"], dropna=False)
            .size()
            .rename("findings")
            .reset_index()
        )
        return titled_table(self._sentence(), counts)

    def _sentence(self) -> str:
        report = self.report
        added, totals = report.added_words, report.total_words
        if self.dry_run:
            return (
                f"{report.campaign}: dry run, nothing is stored; would add "
                f"{added}; the campaign would hold {totals}"
            )
        return f"{report.campaign}: added {added}; the campaign holds {totals}"


def _findings_in_words(findings: Sequence[dict[str, Any]]) -> Iterator[str]:
    """Findings about the whole campaign, then how often each check found something."""
    by_check: dict[tuple[str, str], list[str | None]] = {}
    for finding in findings:
        if finding["check"] in _SAID_WHOLE:
            yield f"{finding['severity']}: {finding['check']}: {finding['message']}"
        elif finding["check"] != DISCARDED:
            key = (finding["severity"], finding["check"])
            by_check.setdefault(key, []).append(finding["channel"])
    for (severity, check), channels in sorted(by_check.items()):
        named = sorted({channel for channel in channels if channel is not None})
        of = f" of {enumerated(named)}" if named else ""
        yield f"{severity}: {check} ({len(channels)}){of}"


def ingest_into(
    target: Store,
    folder: Path,
    request: FolderReading,
    progress: Callable[[int, int, str], None] | None = None,
    *,
    processes: int | None = None,
    dry_run: bool = False,
) -> IngestedCampaign:
    """Read a campaign folder into a store, link the campaign to its plan, and look for facts that
    training needs.

    Parameters:
        target: The store; for a dry run, that of a rehearsal.
        folder: The campaign folder.
        request: How the folder is read: extraction, plan, and what is confirmed or read again.
        progress: Receives the recordings done, their number and what is being done; by default
            nobody is told.
        processes: The number of processes that read and extract; by default as many as pay.
        dry_run: Whether the result says that nothing was stored; by default False.

    Raises:
        IngestError: With nothing stored, for a campaign that is refused or holds nothing usable.
    """
    from ....ingest.load import ingest_folder
    from ....ingest.storing.plan_link import link_to_plan

    report = ingest_folder(
        target,
        folder,
        request.settings(),
        jobs=processes,
        progress=progress,
        free_factors=request.free_factors,
        confirmed=request.confirmed,
        again=request.again,
        target_motion=add_plate_motion if request.target_motion == "plate" else None,
    )
    links = link_to_plan(target, report.campaign, request.plan)
    report.findings += training_notes(target, report.campaign)
    return IngestedCampaign(report, links, dry_run, folder)


def add_plate_motion(speed: ImpactSpeed, force_n: Floats, plate: StruckPlate) -> ImpactSpeed:
    """A speed with its plate's motion, from the mobility of a plate without edges; its uncertainty
    grows by it.

    Parameters:
        speed: Velocity and uncertainty, integrated from the impactor's deceleration.
        force_n: The force (p,) at equal phases of the contact.
        plate: Elastic constants, density and thickness of the plate, and whether an anvil lies on
            it.
    """
    figures = (plate.youngs_modulus_pa, plate.poisson_ratio, plate.density_kg_m3, plate.thickness_m)
    impedance = float(plate_impedance(*(np.array([value]) for value in figures))[0])
    velocity, uncertainty = with_plate_motion(
        speed.velocity_m_s, speed.velocity_u_m_s, force_n, impedance, plate.anvil
    )
    return ImpactSpeed(velocity, uncertainty, "integrated with target motion")


CHECK = "missing-facts"


def training_notes(store: Store, campaign: str) -> list[dict[str, Any]]:
    """A note in the form of an ingest's findings, of the predictors that ship for the campaign's
    kind; none where nothing is missing.

    Parameters:
        store: The store of the campaign.
        campaign: The name of the campaign.
    """
    with store.reading() as session:
        words = missing_facts_words(
            session, session.scalars(select(Campaign).where(Campaign.name == campaign)).one()
        )
    note = {
        "recording": None,
        "channel": None,
        "check": CHECK,
        "severity": "note",
        "message": words,
    }
    return [note] if words else []


def start_campaign(
    store: Store | None, folder: Path, start: str, plan: str | None, recordings: str | None
) -> NewFolder:
    """Write campaign.toml and runs.csv into a folder.

    Parameters:
        store: The store of the plan; None is enough without a plan.
        folder: The folder of the new campaign.
        start: The kind of bench: "gun", "hammer" or "drop".
        plan: The name of the plan whose open runs become rows; None for a row for each recording.
        recordings: A pattern or a folder within `folder` where the recordings lie; None for the
            whole folder, or, with a plan, for no recordings.

    Returns:
        The content of both files, and notes on recordings that were left out.

    Raises:
        UnknownPlanError: For a plan that the store has not.
        IngestError: Where nothing is found to begin with, where the numbers of recordings and rows
            do not agree, and where one of the files is there already.
        OSError: Where the files cannot be written.
        ValueError: For a plan of another kind or without an open run.
    """
    rows = planned_rows(store, plan, start) if store is not None and plan is not None else []
    new = start_folder(folder, start, recordings, rows)
    new.write(folder)
    return new


def planned_rows(store: Store, name: str, start: str) -> list[dict[str, str]]:
    """A row of runs.csv for each missing repetition of the plan's open runs, in their order, with
    factors and settings.

    Parameters:
        store: The store of the plan.
        name: The name of the plan.
        start: The kind of bench of the campaign: "gun", "hammer" or "drop".

    Raises:
        UnknownPlanError: For a plan that the store has not.
        ValueError: For a plan of another kind or without an open run.
    """
    with store.reading() as session:
        plan = read_plan(session, name)
    if plan.space.kind != KIND_OF_START[start]:
        raise ValueError(f"plan {name!r} is one of a {plan.space.kind}, and --kind is {start!r}")
    rows = [
        {"run": str(run.run), "repetition": str(repetition), **cells_of(run)}
        for run in plan.runs
        if run.status == "planned"
        for repetition in _missing_repetitions(run)
    ]
    if not rows:
        raise ValueError(f"plan {name!r} has no run that is still to do")
    return rows


def _missing_repetitions(run: StoredRun) -> range:
    """Numbers for what is still to be recorded, rejected ones again; they go on from those that
    were recorded."""
    last = max((*run.accepted, *run.rejected), default=0)
    return range(last + 1, last + 1 + run.repetitions - len(run.accepted))
