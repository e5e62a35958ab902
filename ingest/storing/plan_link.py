"""Recorded runs of a campaign and the planned ones: linked where they agree, told apart where they
do not.

A recorded run belongs to the planned run of its number when every setting agrees that the plan
made: words exactly, numbers within a twentieth (a tank is never filled to the digit). A plan's own
words that the campaign does not record, such as a velocity level, are left out of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from ...schema.campaigns import (
    Campaign,
    ConfigurationLevel,
    Factor,
    FactorLevel,
    Plan,
    PlannedRun,
    plan_turn,
)
from ...schema.impacts import Impact, Shot
from ...schema.known_factors import BY_NAME
from ...schema.run_states import done_runs, repetition_table
from ...schema.session import Store
from ...schema.transactions import take_advisory_lock
from ..errors import IngestError

#: Numbers agree within this share of the planned one.
TOLERANCE = 0.05

Levels = Mapping[str, tuple[str, float | None]]  # factor -> label, number


@dataclass(frozen=True)
class PlanLinks:
    """What of a campaign is planned: linked repetitions, runs that became done, and what does not
    match and why."""

    plan: str
    linked: int
    done: int
    mismatches: tuple[dict[str, object], ...]  # {"run", "reason"}

    def as_findings(self) -> list[dict[str, object]]:
        """The mismatches in the form of an ingest's findings."""
        return [
            {
                "recording": None,
                "channel": None,
                "check": "plan-mismatch",
                "severity": "warning",
                "message": f"run {item['run']} of plan {self.plan}: {item['reason']}",
            }
            for item in self.mismatches
        ]


def link_to_plan(store: Store, campaign: str, plan: str | None) -> PlanLinks | None:
    """`link_campaign` with a plan that may not be named.

    Parameters:
        store: The open store that holds both.
        campaign: The name of the campaign.
        plan: The name of the plan; None is the campaign's own, the plan of the same name.

    Returns:
        What was linked; None where no plan is named and the campaign has none of its own.

    Raises:
        IngestError: As `link_campaign`.
    """
    if plan is None:
        with store.reading() as session:
            if session.scalar(select(Plan.id).where(Plan.name == campaign)) is None:
                return None
    return link_campaign(store, campaign, plan or campaign)


def link_campaign(store: Store, campaign: str, plan: str) -> PlanLinks:
    """Point the campaign's impacts and shots to the runs of a plan, which makes those done that
    have enough of them.

    Safe to repeat: what is linked stays so.

    Parameters:
        store: The open store that holds both.
        campaign: The name of the campaign.
        plan: The name of the plan.

    Raises:
        IngestError: For an unknown campaign or plan, or another kind.
    """
    return store.write(lambda session: link_within(session, campaign, plan), idempotent=True)


def link_within(session: Session, campaign: str, plan: str) -> PlanLinks:
    """`link_campaign` in a transaction of the caller's.

    Parameters:
        session: A session that writes to the store.
        campaign: The name of the campaign.
        plan: The name of the plan.

    Raises:
        IngestError: As `link_campaign`.
    """
    take_advisory_lock(session, plan_turn(plan))
    campaign_row, plan_row = _rows(session, campaign, plan)
    planned = {
        row.run: row for row in session.scalars(select(PlannedRun).filter_by(plan_id=plan_row.id))
    }
    wanted = _levels(session, {row.configuration_id for row in planned.values()})
    keys = {row.id for row in planned.values()}
    done_before = done_runs(session, keys)
    linked, mismatches = 0, {}
    for table in (Impact, Shot):  # a gun's hit on a load cell is both
        counts = table is repetition_table(plan_row.kind)
        recorded = select(table.run, table.configuration_id, table.planned_run_id)
        for run, configuration, link in session.execute(
            recorded.where(table.campaign_id == campaign_row.id).distinct()
        ).all():
            reason = _mismatch(session, planned.get(run), configuration, wanted)
            if reason is not None:
                mismatches[run] = reason
            elif link is None:
                linked += counts * _link(
                    session, table, campaign_row, run, configuration, planned[run]
                )
    done = len(done_runs(session, keys) - done_before)
    reported = tuple({"run": run, "reason": reason} for run, reason in sorted(mismatches.items()))
    return PlanLinks(plan, linked, done, reported)


def _rows(session: Session, campaign: str, plan: str) -> tuple[Campaign, Plan]:
    campaign_row = session.scalars(select(Campaign).where(Campaign.name == campaign)).one_or_none()
    plan_row = session.scalars(select(Plan).where(Plan.name == plan)).one_or_none()
    if campaign_row is None:
        raise IngestError(f"no campaign {campaign!r} in the store")
    if plan_row is None:
        plan_names = ", ".join(session.scalars(select(Plan.name).order_by(Plan.name))) or "none"
        raise IngestError(f"no plan {plan!r} in the store; there: {plan_names}")
    if campaign_row.kind != plan_row.kind:
        raise IngestError(
            f"campaign {campaign!r} is one of a {campaign_row.kind}, plan "
            f"{plan!r} of a {plan_row.kind}"
        )
    return campaign_row, plan_row


def _levels(session: Session, configurations: set[int]) -> dict[int, Levels]:
    query = (
        select(
            ConfigurationLevel.configuration_id, Factor.name, FactorLevel.label, FactorLevel.number
        )
        .join(FactorLevel, ConfigurationLevel.level_id == FactorLevel.id)
        .join(Factor, ConfigurationLevel.factor_id == Factor.id)
        .where(ConfigurationLevel.configuration_id.in_(configurations))
    )
    recorded_by_run: dict[int, dict[str, tuple[str, float | None]]] = {}
    for configuration, factor, label, number in session.execute(query):
        recorded_by_run.setdefault(configuration, {})[factor] = (label, number)
    return dict(recorded_by_run)


def _mismatch(
    session: Session, planned: PlannedRun | None, configuration: int, wanted: Mapping[int, Levels]
) -> str | None:
    """Why a recorded configuration is not what was planned; None where it is."""
    if planned is None:
        return "the plan has no run of this number"
    if planned.status == "discarded":
        return f"the plan's run was discarded: {planned.reason}"
    if planned.configuration_id == configuration:
        return None
    recorded = _levels(session, {configuration}).get(configuration, {})
    wrong = []
    for factor, (label, number) in sorted(wanted[planned.configuration_id].items()):
        recorded_level = recorded.get(factor)
        if recorded_level is None:
            if factor in BY_NAME:
                wrong.append(f"{factor} is not recorded, planned {label}")
        elif not _agree(recorded_level, (label, number)):
            wrong.append(f"{factor} is {recorded_level[0]}, planned {label}")
    return "; ".join(wrong) or None


def _agree(level: tuple[str, float | None], planned: tuple[str, float | None]) -> bool:
    if level[1] is None or planned[1] is None:
        return level[0] == planned[0]
    return abs(level[1] - planned[1]) <= TOLERANCE * abs(planned[1])


def _link(
    session: Session,
    table: type[Impact] | type[Shot],
    campaign: Campaign,
    run: int,
    configuration: int,
    planned: PlannedRun,
) -> int:
    of_run = (
        table.campaign_id == campaign.id,
        table.run == run,
        table.configuration_id == configuration,
    )
    result = session.execute(update(table).where(*of_run).values(planned_run_id=planned.id))
    # SQLAlchemy types `execute` for rows only
    return int(result.rowcount)  # type: ignore[attr-defined]
