"""Campaigns: the list, and one campaign with its quality, planned against achieved settings, and
charts."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query
from starlette.requests import Request
from starlette.responses import Response

from ...schema.conditions import get_campaign_id
from ...schema.corrected_facts import list_corrections
from ...schema.known_facts import facts_from_json
from ..common.quantities import display_of, velocities_of, velocity_with_uncertainty
from ..figures.figure import DIMENSIONLESS, Plot, PlotAxis, PointSeries, as_floats, equal_line
from ..operations.ingest.campaign_overview import (
    KINDS,
    campaign_overview,
    list_campaigns_page,
    missing_facts_of,
)
from ..operations.ingest.discarded import can_restore
from ..operations.ingest.planned_achieved import (
    bench_facts,
    constant_settings,
    planned_achieved_rows,
    several_levels,
)
from ..operations.ingest.recording_quality import list_finding_rows, recording_quality
from ..operations.ingest.removal import list_tombstones
from ..operations.people.stored_notes import tags_in_use
from ..operations.plan.figures import coverage_figure
from ..web.dependencies import Configured, Name, OpenStore
from ..web.page_sources import THE_STORE
from ..web.rendering import page, query


def achieved_figure(rows: Sequence[Mapping[str, Any]], quantity: str) -> Plot:
    """Achieved (mean, least and largest of a run) over planned, of one quantity of
    `planned_achieved.planned_achieved_rows`."""
    quantity_rows = [row for row in rows if row["quantity"] == quantity]
    display = display_of(quantity)
    planned, mean, least, largest = (
        display.scale * as_floats([row[key] for row in quantity_rows])
        for key in ("planned", "mean", "least", "largest")
    )
    runs = PointSeries(
        planned,
        mean,
        y_low=least,
        y_high=largest,
        labels=tuple(f"{row['plan']}, run {row['run']}" for row in quantity_rows),
        detail="runs",
    )
    x, y = (
        PlotAxis(f"{word} {display.label}", display.unit or DIMENSIONLESS)
        for word in ("planned", "achieved")
    )
    equal = equal_line("as planned", planned, mean)
    return Plot(f"Achieved {display.label}", x, y, (equal, runs))


router = APIRouter()
PAGE = 50


@router.get("/campaigns", dependencies=[Depends(THE_STORE)])
def campaigns(
    request: Request,
    store: OpenStore,
    kind: str = "",
    name: str = "",
    tag: str = "",
    after: str = "",
) -> Response:
    rows: list[dict[str, Any]] = []
    fault, status, following = "", 200, None
    with store.reading() as session:
        try:
            rows, following = list_campaigns_page(
                session,
                kind=kind or None,
                text=name,
                tag=tag.strip() or None,
                after=after or None,
                limit=PAGE,
            )
        except (ValueError, LookupError) as error:
            fault, status = str(error), 404 if isinstance(error, LookupError) else 422
        keys = {row["name"]: get_campaign_id(session, row["name"]) for row in rows}
        quality = recording_quality(session, list(keys.values()))
        words = tags_in_use(session, "campaign")
    filters = {"kind": kind, "name": name, "tag": tag}
    return page(
        request,
        "campaigns.html",
        status=status,
        rows=[{**row, "quality": quality[keys[row["name"]]].words} for row in rows],
        kinds=KINDS,
        kind=kind,
        name=name,
        tag=tag,
        tags=words,
        fault=fault,
        following=query({**filters, "after": following}) if following else "",
        beginning=(query(filters) or "/campaigns") if after else "",
    )


@router.get("/campaigns/{name}", dependencies=[Depends(THE_STORE)])
def campaign(
    request: Request,
    name: Name,
    store: OpenStore,
    settings: Configured,
    discarded: Annotated[int, Query(ge=0, le=2**31 - 1)] = 0,
) -> Response:
    with store.reading() as session:
        overview = campaign_overview(session, name)
        key = get_campaign_id(session, name)
        quality = recording_quality(session, [key])[key]
        missing = missing_facts_of(session, name)
        corrections = list_corrections(session, [name])
        stones = list_tombstones(session, name) if discarded else []
        findings = list_finding_rows(session, key, overview["findings"])
    levels, achieved = overview["levels"], overview["achieved"]
    several = several_levels(levels)
    factors = (
        dict.fromkeys(row["factor"] for row in levels if row["factor"] in several)
        if overview["plans"]
        else {}
    )
    quantities = [summary["quantity"] for summary in overview["achieved_summary"]]
    shown = {
        **overview,
        "findings": findings,
        "first_impacts": _short(overview["first_impacts"], several),
        "first_shots": [velocity_with_uncertainty(row) for row in overview["first_shots"]],
    }
    with velocities_of(overview["first_impacts"]):
        return page(
            request,
            "campaign.html",
            **shown,
            quality_words=quality.sentence,
            missing=missing,
            discarded=_discarded(stones, settings.db, discarded),
            corrections=corrections,
            poor=bool(quality.rejected or quality.set_aside),
            coverage={factor: coverage_figure(levels, factor) for factor in factors},
            achieved_figures={
                quantity: achieved_figure(achieved, quantity) for quantity in quantities
            },
            planned_achieved=planned_achieved_rows(levels, achieved),
            constant=constant_settings(levels),
            bench=list(bench_facts(overview["campaign"]["bench"])),
            known_facts=[
                (fact.name, fact.words) for fact in facts_from_json(overview["campaign"]["known"])
            ],
        )


def _discarded(stones: Sequence[dict[str, Any]], db: str, key: int) -> dict[str, Any] | None:
    """The recording of the campaign that was discarded just now, while it can be brought back."""
    stone = next((item for item in stones if item["id"] == key), None)
    return stone if stone is not None and can_restore(db, stone) else None


#: What the table of the first impacts has beside the factors that change.
_IMPACT_COLUMNS = (
    "impact_velocity_m_s",
    "peak_force_n",
    "contact_time_s",
    "peak_acceleration_m_s2",
    "quality",
)
_FIRST_IMPACTS = 8


def _short(impacts: Sequence[Mapping[str, Any]], several: Collection[str]) -> list[dict[str, Any]]:
    """The first impacts with run, the factors that change, and the figures that any of them has."""
    rows = impacts[:_FIRST_IMPACTS]
    wanted = ("id", "run", "repetition", *several, *_IMPACT_COLUMNS)
    columns = [name for name in wanted if any(row.get(name) is not None for row in rows)]
    return [{name: row.get(name) for name in columns} for row in rows]
