"""Campaigns: the list, and one campaign's design coverage, settings achieved and findings."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter
from starlette.requests import Request
from starlette.responses import Response

from ...campaigns.listing import KINDS, list_campaigns_page
from ...campaigns.overview import campaign_overview
from ..dependencies import Name, OpenStore
from ..figures.campaigns import achieved_figure
from ..figures.plans import coverage_figure
from ..rendering import page, query
from ..table_format import cell, heading

router = APIRouter()
PAGE = 50


@router.get("/campaigns")
def campaigns(request: Request, store: OpenStore, kind: str = "", name: str = "", after: str = "") -> Response:
    with store.reading() as session:
        rows, following = list_campaigns_page(session, kind=kind or None, text=name, after=after or None, limit=PAGE)
    filters = {"kind": kind, "name": name}
    return page(
        request,
        "campaigns.html",
        rows=rows,
        kinds=KINDS,
        kind=kind,
        name=name,
        following=query({**filters, "after": following}) if following else "",
        beginning=(query(filters) or "/campaigns") if after else "",
    )


@router.get("/campaigns/{name}")
def campaign(request: Request, name: Name, store: OpenStore) -> Response:
    with store.reading() as session:
        overview = campaign_overview(session, name)
    levels, achieved = overview["levels"], overview["achieved"]
    factors = dict.fromkeys(row["factor"] for row in levels) if overview["plans"] else {}
    quantities = [summary["quantity"] for summary in overview["achieved_summary"]]
    return page(
        request,
        "campaign.html",
        **overview,
        coverage={factor: coverage_figure(levels, factor) for factor in factors},
        achieved_figures={quantity: achieved_figure(achieved, quantity) for quantity in quantities},
        levels_shown=[_level(row) for row in levels],
        achieved_shown=[_deviation(row) for row in overview["achieved_summary"]],
        bench=list(_bench(overview["campaign"]["bench"])),
    )


def _level(row: dict[str, Any]) -> dict[str, Any]:
    return {**row, "factor": heading(row["factor"]), "level": cell(row["factor"], row["level"])}


def _deviation(row: dict[str, Any]) -> dict[str, Any]:
    shares = ("mean_deviation", "mean_magnitude", "worst_deviation")
    return {**row, "quantity": heading(row["quantity"]), **{key: f"{row[key]:+.1%}" for key in shares}}


def _bench(parts: dict[str, dict[str, Any]]) -> list[tuple[str, str, Any]]:
    every = [(part, key, value) for part, figures in parts.items() for key, value in figures.items()]
    return [entry for entry in every if entry[2] is not None]
