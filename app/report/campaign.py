"""A campaign as a report: what was planned and recorded, how near the settings came, how good the recordings are, what
the pulses and the shots are."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from ...array_types import Floats
from ...doe.plans import StoredPlan, read_plan
from ...schema.campaigns import STATUSES, Campaign, Plan, PlannedRun
from ...schema.configurations import iter_levels
from ...schema.impacts import Impact, Shot
from ...schema.listings import get_campaign_id, listing_key
from ...schema.recordings import SET_ASIDE, SEVERITIES, QualityFinding, RecordedChannel, Recording
from ..documents.document import (
    Block,
    Cell,
    ChartRow,
    Document,
    Figure,
    Paragraph,
    Section,
    Table,
    column_heading,
    setting,
)
from ..documents.svg import Cloud, agreement_chart
from ..ingest.campaign_overview import count_findings
from ..ingest.design_coverage import worked_off
from .campaign_pulses import pulses_of, pulses_section, shots_of, shots_section

PRESSURE, VELOCITY = "tank_pressure_pa", "velocity_m_s"
WRITTEN, TRANSDUCER, MEASURED = "as written down", "transducer", "measured"


@dataclass(frozen=True, eq=False)
class AchievedSetting:
    """A setting, `planned` and `achieved` (n,), of the repetitions that `where` names. `source` tells who says so."""

    key: str
    source: str
    planned: Floats
    achieved: Floats
    where: tuple[str, ...]

    @property
    def off(self) -> Floats:
        """Achieved less planned, as a share of planned (n,)."""
        return self.achieved / self.planned - 1


_Found = defaultdict[tuple[str, str], list[tuple[float, float, str]]]


def achieved_settings(session: Session, campaign: Campaign, plans: Sequence[StoredPlan]) -> list[AchievedSetting]:
    """Every numeric setting of the planned runs beside what was recorded.

    Pressures are the transducer's too, where there was one, of a shot without a plan beside the one that was set.
    """
    values: _Found = defaultdict(list)
    table: type[Impact] | type[Shot] = Shot if campaign.kind == "gun" else Impact
    velocity = Shot.measured_velocity_m_s if campaign.kind == "gun" else Impact.impact_velocity_m_s
    wanted = {(p.name, run.run): speed for p in plans for run in p.runs if (speed := p.space.velocity_m_s(run.row))}
    columns = (table.run, table.repetition, velocity, table.configuration_id, PlannedRun.configuration_id, Plan.name)
    query = (
        select(*columns)
        .join(PlannedRun, table.planned_run_id == PlannedRun.id)
        .join(Plan, PlannedRun.plan_id == Plan.id)
        .where(table.campaign_id == campaign.id)
        .order_by(table.run, table.repetition)
    )
    rows = session.execute(query).all()
    numbers = _numbers(session, {key for row in rows for key in row[3:5]})
    for run, repetition, speed, recorded, planned, plan in rows:
        where = f"run {run}, repetition {repetition}"
        for key, value in numbers[planned].items():
            if key in numbers[recorded] and value != 0:  # no deviation is a share of nothing
                values[key, WRITTEN].append((value, numbers[recorded][key], where))
        if speed is not None and (plan, run) in wanted:
            values[VELOCITY, MEASURED].append((wanted[plan, run], speed, where))
    _pressures(session, campaign, numbers, values)
    return [_achieved(key, source, pairs) for (key, source), pairs in values.items()]


def _achieved(key: str, source: str, pairs: Sequence[tuple[float, float, str]]) -> AchievedSetting:
    planned, achieved, where = zip(*pairs, strict=True)
    return AchievedSetting(
        key, source, np.array(planned, dtype=np.float64), np.array(achieved, dtype=np.float64), where
    )


def _pressures(
    session: Session, campaign: Campaign, numbers: Mapping[int, Mapping[str, float]], achieved: _Found
) -> None:
    query = (
        select(Shot.run, Shot.repetition, Shot.tank_pressure_pa, Shot.recorded_pressure_pa, PlannedRun.configuration_id)
        .outerjoin(PlannedRun, Shot.planned_run_id == PlannedRun.id)
        .where(Shot.campaign_id == campaign.id, Shot.recorded_pressure_pa.is_not(None))
        .order_by(Shot.id)
    )
    for run, repetition, given, recorded, planned in session.execute(query):
        assert recorded is not None
        wanted = numbers.get(planned, {}).get(PRESSURE, given)
        achieved[PRESSURE, TRANSDUCER].append((wanted, recorded, f"run {run}, repetition {repetition}"))


def _numbers(session: Session, configurations: set[int]) -> dict[int, dict[str, float]]:
    """The numeric levels of configurations, by the keys of listings."""
    numbers: dict[int, dict[str, float]] = {key: {} for key in configurations}
    for row in iter_levels(session, sorted(configurations)):
        if isinstance(row.level, float):
            numbers[row.configuration][listing_key(row.factor, row.si_unit)] = row.level
    return numbers


def plans_of(session: Session, campaign: Campaign) -> tuple[StoredPlan, ...]:
    """The plans that a campaign works off: those its repetitions are linked to, and the one of its own name."""
    query = select(Plan.name).where(worked_off(campaign.id, campaign.name))
    return tuple(read_plan(session, name) for name in session.scalars(query.order_by(Plan.name)))


def status_counts(plan: StoredPlan) -> dict[str, int]:
    """Runs by state: "planned" (still to do), "done", "discarded"."""
    return {status: sum(run.status == status for run in plan.runs) for status in STATUSES}


def level_counts(plan: StoredPlan) -> dict[tuple[str, str], dict[str, int]]:
    """(column, level) as the plan's table writes them -> runs by state; a level without runs has its row too.

    A continuous factor has the parts of its range for levels.
    """
    space = plan.space.stratified
    counts = {(f.column, level): dict.fromkeys(STATUSES, 0) for f in space.factors for level in f.levels}
    for run, row in zip(plan.runs, space.rows(plan.space.in_strata(plan.treatments())), strict=True):
        for column, level in row.items():
            counts[column, level][run.status] += 1
    return counts


def coverage_section(plans: Sequence[StoredPlan]) -> Section:
    """Design coverage."""
    if not plans:
        caption = "The campaign has no plan: what it holds is what was recorded, below."
        return Section("Design coverage", (Paragraph(caption, quiet=True),))
    blocks: list[Block] = [Table("Runs by state.", ("plan", "method", *_HEADS), [_plan_row(plan) for plan in plans])]
    for plan in plans:
        rows = [
            [column_heading(column), level, *_states(states)] for (column, level), states in level_counts(plan).items()
        ]
        blocks.append(
            Table(f"Levels of plan {plan.name}, in runs.", ("factor", "level", *_CAMPAIGN_DESIGN_STATES), rows)
        )
        if lost := [[run.run, run.reason] for run in plan.runs if run.status == "discarded"]:
            blocks.append(Table(f"Discarded from plan {plan.name}.", ("run", "reason"), lost))
    return Section("Design coverage", blocks)


_CAMPAIGN_DESIGN_STATES = ("runs", "done", "to do", "discarded")
_HEADS = (*_CAMPAIGN_DESIGN_STATES, "repetitions recorded", "repetitions planned")


def _states(counts: dict[str, int]) -> list[Cell]:
    return [sum(counts.values()), counts["done"], counts["planned"], counts["discarded"]]


def _plan_row(plan: StoredPlan) -> list[Cell]:
    wanted = sum(run.repetitions for run in plan.runs if run.status != "discarded")
    recorded = sum(len(run.accepted) for run in plan.runs if run.status != "discarded")
    return [plan.name, plan.method, *_states(status_counts(plan)), recorded, wanted]


def settings_section(achieved: Sequence[AchievedSetting]) -> Section:
    """Achieved against planned settings."""
    title = "Achieved against planned settings"
    if not achieved:
        return Section(
            title, (Paragraph("Nothing was planned in numbers, and no transducer recorded a setting.", True),)
        )
    blocks: list[Block] = [
        Table("Deviations are shares of the planned value.", _COLUMNS, [_row(setting) for setting in achieved])
    ]
    if differing := [setting for setting in achieved if np.any(np.abs(setting.off) > 1e-9)]:
        blocks.append(ChartRow([_figure(setting) for setting in differing]))
    return Section(title, blocks)


_COLUMNS = ("setting", "by", "repetitions", "mean deviation (%)", "rms (%)", "largest (%)", "there")


def _row(achieved: AchievedSetting) -> list[Any]:
    off = 100 * achieved.off
    at = int(np.argmax(np.abs(off)))
    exact = abs(off[at]) < 1e-7
    figures = [float(off.mean()), float(np.sqrt(np.mean(off**2))), float(off[at])]
    cells = [0.0, 0.0, 0.0, None] if exact else [*(round(figure, 3) for figure in figures), achieved.where[at]]
    return [setting(achieved.key).name, achieved.source, off.size, *cells]


def _figure(achieved: AchievedSetting) -> Figure:
    kind = setting(achieved.key)
    x, y = kind.per_si * achieved.planned, kind.per_si * achieved.achieved
    unit = f" ({kind.unit})" if kind.unit else ""
    label = f"{kind.name}, {achieved.source}"
    cloud = Cloud(label, x, y, achieved.where)
    return Figure(label, agreement_chart(label, [cloud], f"planned{unit}", f"achieved{unit}"))


#: Findings that are listed one by one.
_MOST = 100


def quality_section(session: Session, campaign_id: int) -> Section:
    """Findings by check and severity, doubts one by one, recordings that were set aside with their reasons."""
    heads = ("severity", "check", "channels", "findings")
    counts = [[row[head] for head in heads] for row in count_findings(session, campaign_id)]
    blocks: list[Block] = [Table("Findings by check.", heads, counts, "No findings.")]
    doubts = _doubts(session, campaign_id)
    if doubts:
        blocks.append(_listed(doubts[:_MOST]))
    if len(doubts) > _MOST:
        blocks.append(Paragraph(f"The first {_MOST}; pyroshock show IMPACT has those of an impact.", quiet=True))
    if aside := _set_aside(session, campaign_id):
        blocks.append(Table("Recordings that were set aside.", ("recording", "reason"), aside))
    return Section("Quality", blocks)


def _listed(doubts: list[list[Any]]) -> Table:
    """Without the columns that say nothing: most findings are of a whole recording."""
    heads = ("severity", "check", "recording", "run", "repetition", "channel", "message")
    columns = [i for i in range(len(heads)) if any(row[i] is not None for row in doubts)]
    return Table("Rejects and warnings.", [heads[i] for i in columns], [[row[i] for i in columns] for row in doubts])


def _doubts(session: Session, campaign_id: int) -> list[list[Any]]:
    """One more than are listed, rejects first."""
    rows: list[list[Any]] = []
    columns = (Recording.path, Impact.run, Impact.repetition, RecordedChannel.name)
    for severity in reversed(SEVERITIES[1:]):
        query = (
            select(QualityFinding.severity, QualityFinding.check, *columns, QualityFinding.message)
            .join(Recording, QualityFinding.recording_id == Recording.id)
            .outerjoin(Impact, QualityFinding.impact_id == Impact.id)
            .outerjoin(RecordedChannel, QualityFinding.channel_id == RecordedChannel.id)
            .where(Recording.campaign_id == campaign_id, QualityFinding.severity == severity)
            .order_by(QualityFinding.id)
            .limit(_MOST + 1 - len(rows))
        )
        rows += [list(row) for row in session.execute(query)]
    return rows


def _set_aside(session: Session, campaign_id: int) -> list[list[Any]]:
    query = select(Recording.path, Recording.reason).where(
        Recording.campaign_id == campaign_id, Recording.status == SET_ASIDE
    )
    return [list(row) for row in session.execute(query.order_by(Recording.path))]


def campaign_document(session: Session, name: str) -> Document:
    """The report on a campaign of the store. Raises `LookupError` naming those there are."""
    campaign = session.get_one(Campaign, get_campaign_id(session, name))
    recordings, impacts, shots = (_count(session, table, campaign.id) for table in (Recording, Impact, Shot))
    plans = plans_of(session, campaign)
    sections = [
        coverage_section(plans),
        settings_section(achieved_settings(session, campaign, plans)),
        *([pulses_section(pulses_of(session, name))] if impacts else []),
        quality_section(session, campaign.id),
        *([shots_section(shots_of(session, name))] if shots else []),
    ]
    states = [status_counts(plan) for plan in plans]
    runs = ", ".join(f"{sum(plan[state] for plan in states)} {word}" for state, word in _STATES) if plans else "none"
    facts = {
        "Kind": campaign.kind,
        "Date": campaign.date.isoformat(),
        "Operator": campaign.operator or "",
        "Planned runs": runs,
        "Recordings": str(recordings or ""),
        "Impacts": str(impacts or ""),
        "Shots": str(shots or ""),
    }
    return Document(
        kind="Campaign",
        title=name,
        lead=campaign.description or "",
        facts={key: value for key, value in facts.items() if value},
        sections=sections,
        date=campaign.date,
    )


_STATES = (("done", "done"), ("planned", "to do"), ("discarded", "discarded"))


def _count(session: Session, table: type[Recording] | type[Impact] | type[Shot], campaign_id: int) -> int:
    return session.scalar(select(func.count()).select_from(table).where(table.campaign_id == campaign_id)) or 0
