"""What of a campaign's design was recorded: runs by state, level by level, and how near the settings came."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from ...doe.plans import StoredPlan, read_plan
from ...schema.campaigns import STATUSES, Campaign, Plan
from ..campaigns.coverage import worked_off
from .campaign_settings import AchievedSetting
from .curves import Cloud, agreement_chart
from .document import Block, Cell, ChartRow, Figure, Paragraph, Section, Table
from .labels import column_heading, setting


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
        blocks.append(Table(f"Levels of plan {plan.name}, in runs.", ("factor", "level", *_STATES), rows))
        if lost := [[run.run, run.reason] for run in plan.runs if run.status == "discarded"]:
            blocks.append(Table(f"Discarded from plan {plan.name}.", ("run", "reason"), lost))
    return Section("Design coverage", blocks)


_STATES = ("runs", "done", "to do", "discarded")
_HEADS = (*_STATES, "repetitions recorded", "repetitions planned")


def _states(found: dict[str, int]) -> list[Cell]:
    return [sum(found.values()), found["done"], found["planned"], found["discarded"]]


def _plan_row(plan: StoredPlan) -> list[Cell]:
    wanted = sum(run.repetitions for run in plan.runs if run.status != "discarded")
    recorded = sum(run.recorded for run in plan.runs if run.status != "discarded")
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


def _row(found: AchievedSetting) -> list[Any]:
    off = 100 * found.off
    at = int(np.argmax(np.abs(off)))
    exact = abs(off[at]) < 1e-7
    figures = [float(off.mean()), float(np.sqrt(np.mean(off**2))), float(off[at])]
    cells = [0.0, 0.0, 0.0, None] if exact else [*(round(figure, 3) for figure in figures), found.where[at]]
    return [setting(found.key).name, found.source, off.size, *cells]


def _figure(found: AchievedSetting) -> Figure:
    kind = setting(found.key)
    x, y = kind.per_si * found.planned, kind.per_si * found.achieved
    unit = f" ({kind.unit})" if kind.unit else ""
    label = f"{kind.name}, {found.source}"
    cloud = Cloud(label, x, y, found.where)
    return Figure(label, agreement_chart(label, [cloud], f"planned{unit}", f"achieved{unit}"))
