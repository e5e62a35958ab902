"""A campaign as a report: how good its recordings are and what to do about them, what was planned
and achieved, and what the pulses and the shots are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from ....schema.campaigns import Campaign, Plan, PlannedRun, stated_day
from ....schema.impacts import Impact, Shot
from ....schema.listings import get_campaign_id
from ....schema.recordings import SET_ASIDE, Recording
from ...common.number_format import number_ranges
from ...common.quantities import display_of
from ...documents.document import (
    Block,
    Bullets,
    Cell,
    ChartRow,
    Document,
    Paragraph,
    Section,
    Table,
)
from ...figures.agreement import agreement_plot
from ...figures.figure import DIMENSIONLESS, Plot, PlotAxis, PointSeries
from ..ingest.campaign_overview import count_findings
from ..ingest.design_coverage import (
    achieved_settings,
    level_coverage,
    plan_coverage,
    worked_off,
)
from ..ingest.planned_achieved import constant_settings, planned_achieved_rows
from ..ingest.recording_quality import (
    FindingRow,
    list_finding_rows,
    recording_quality,
    worst_finding,
)
from .attached import attached_section
from .campaign_pulses import pulses_of, pulses_section, shots_of, shots_section

Rows = Sequence[Mapping[str, Any]]


def campaign_document(session: Session, name: str) -> Document:
    """The report on a campaign of the store. Raises `LookupError` naming those there are."""
    key = get_campaign_id(session, name)
    campaign = session.get_one(Campaign, key)
    recordings, impacts, shots = (
        _count(session, table, key) for table in (Recording, Impact, Shot)
    )
    quality = recording_quality(session, [key])[key]
    findings = list_finding_rows(session, key, count_findings(session, key))
    sections = [
        *([quality_section(session, key, findings, impacts)] if recordings else []),
        planned_section(session, key, name),
        *([pulses_section(pulses_of(session, name), name)] if impacts else []),
        *([shots_section(shots_of(session, name), name)] if shots else []),
        attached_section(session, key),
    ]
    facts = {
        "Kind": campaign.kind,
        "Date": stated_day(campaign.date) or "not known",
        "Operator": campaign.operator or "",
        "Recordings": str(recordings or ""),
        "Impacts": str(impacts or ""),
        "Shots": str(shots or ""),
        "Description": campaign.description or "",
    }
    return Document(
        kind="Campaign",
        title=name,
        lead=f"{quality.sentence} {_advice(findings, quality.stored)}".rstrip(),
        facts={key: value for key, value in facts.items() if value},
        sections=[section for section in sections if section.blocks],
        date=None if stated_day(campaign.date) is None else campaign.date,
    )


def _count(
    session: Session, table: type[Recording] | type[Impact] | type[Shot], campaign_id: int
) -> int:
    return (
        session.scalar(
            select(func.count()).select_from(table).where(table.campaign_id == campaign_id)
        )
        or 0
    )


def _advice(findings: Sequence[FindingRow], recordings: int) -> str:
    """What to do about the worst cause; "" where no recording was checked."""
    doubts = [row for row in findings if row.severity != "note"]
    if not doubts:
        return "No recording has to be repeated." if recordings else ""
    worst = doubts[0]
    runs = (
        f" (run{'' if len(worst.runs) == 1 else 's'} {number_ranges(worst.runs)})"
        if worst.runs
        else ""
    )
    return (
        f"The most serious cause: {worst.cause[0].lower()}{worst.cause[1:]}{runs}. {worst.action}"
    )


def quality_section(
    session: Session, campaign_id: int, findings: Sequence[FindingRow], impacts: int
) -> Section:
    """Findings by their cause, each with the one that goes furthest, and recordings that were set
    aside."""
    rows: list[list[Cell]] = [
        [
            row.cause,
            row.severity,
            row.findings,
            row.channels or None,
            "all" if len(row.impacts) == impacts > 1 else number_ranges(row.impacts) or None,
            worst_finding(session, campaign_id, row),
            row.action,
        ]
        for row in findings
    ]
    heads = ("cause", "severity", "findings", "channels", "impacts", "worst example", "what to do")
    main = ("cause", "severity", "impacts")
    caption = "Findings of the quality checks by cause, the most serious first."
    blocks: list[Block] = [Table(caption, heads, rows, "The quality checks found nothing.", main)]
    query = select(Recording.path, Recording.reason).where(
        Recording.campaign_id == campaign_id, Recording.status == SET_ASIDE
    )
    if aside := [list(row) for row in session.execute(query.order_by(Recording.path))]:
        blocks.append(
            Table(
                "Recordings that could not be read and were set aside.",
                ("recording", "reason"),
                aside,
            )
        )
    return Section("Quality", blocks)


#: Keys of `planned_achieved_rows` -> their headings.
_HEADINGS = {"planned": "to do", "mean_deviation": "mean deviation", "worst": "largest deviation"}
_PLANNED = (
    "Runs and recordings at each level. A deviation is that of the recorded "
    "from the planned setting, as a share of "
    "the planned one: its mean over the runs, and the run where it is largest."
)
_RECORDED = "Recordings at each level; the campaign has no plan."


def planned_section(session: Session, campaign_id: int, name: str) -> Section:
    """The plans and what became of them, the settings planned and achieved in one table, and a
    chart of each that differs."""
    plans = plan_coverage(session, campaign_id, name)
    levels, achieved = (
        level_coverage(session, campaign_id, name),
        achieved_settings(session, campaign_id),
    )
    blocks: list[Block] = [Paragraph(_plan_sentence(plan)) for plan in plans]
    if discarded := _discarded(session, campaign_id, name):
        blocks.append(Bullets(discarded, ""))
    rows = planned_achieved_rows(levels, achieved.rows)
    keys = [
        key for key in (rows[0] if rows else ()) if any(row[key] not in (None, 0) for row in rows)
    ]
    if rows:
        blocks.append(
            Table(
                _PLANNED if plans else _RECORDED,
                [_HEADINGS.get(key, key) for key in keys],
                [[row[key] for key in keys] for row in rows],
                main=("setting", "level", "done", _HEADINGS["mean_deviation"]),
            )
        )
    if constant := constant_settings(levels):
        blocks.append(Paragraph(f"The same in all runs: {', '.join(constant)}.", quiet=True))
    differing = [row["quantity"] for row in achieved.summary if row["mean_magnitude"] > 1e-9]
    if differing:
        blocks.append(
            ChartRow([_achieved_figure(achieved.rows, quantity) for quantity in differing])
        )
    return Section("Planned against achieved" if plans else "Settings", blocks)


def _plan_sentence(plan: Mapping[str, Any]) -> str:
    done, to_do, discarded = plan["done"], plan["planned"], plan["discarded"]
    rest = [
        text
        for count, text in ((to_do, f"{to_do} still to do"), (discarded, f"{discarded} discarded"))
        if count
    ]
    return (
        f"Plan {plan['plan']} ({plan['method']}): {done} of {plan['runs']} runs are "
        f"done{''.join(f', {text}' for text in rest)}; {plan['recorded']} of {plan['repetitions']} "
        "repetitions are recorded."
    )


def _discarded(session: Session, campaign_id: int, name: str) -> list[str]:
    query = (
        select(Plan.name, PlannedRun.run, PlannedRun.reason)
        .join(Plan, PlannedRun.plan_id == Plan.id)
        .where(worked_off(campaign_id, name), PlannedRun.status == "discarded")
        .order_by(Plan.name, PlannedRun.run)
    )
    return [
        f"Run {run} of plan {plan} is discarded: {reason or 'no reason is given'}."
        for plan, run, reason in session.execute(query)
    ]


def _achieved_figure(rows: Rows, quantity: str) -> Plot:
    of_quantity, display = (
        [row for row in rows if row["quantity"] == quantity],
        display_of(quantity),
    )
    planned, achieved = (
        display.scale * np.array([row[key] for row in of_quantity]) for key in ("planned", "mean")
    )
    label = f"{display.label[0].upper()}{display.label[1:]}, achieved against planned"
    runs = tuple(f"{row['plan']}, run {row['run']}" for row in of_quantity)
    points = PointSeries(x=planned, y=achieved, labels=runs, opacity=0.8)
    x, y = (PlotAxis(name, display.unit or DIMENSIONLESS) for name in ("planned", "achieved"))
    return agreement_plot(label, [points], x, y)
