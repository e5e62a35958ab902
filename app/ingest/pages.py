"""Campaigns: the list, one campaign's design coverage, settings achieved and findings with their charts, and ingest by
upload or by the path of a folder on the server's machine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from fastapi import APIRouter
from starlette.requests import Request
from starlette.responses import Response

from ..common.quantities import display_of
from ..plan.pages import coverage_figure
from ..web.dependencies import Name, OpenStore
from ..web.figures_base import Figure, figure, line, points
from ..web.rendering import cell, heading, page, query
from .campaign_overview import KINDS, campaign_overview, list_campaigns_page


def achieved_figure(rows: Sequence[Mapping[str, Any]], quantity: str) -> Figure:
    """Achieved (mean, least and largest of a run) over planned, of one quantity of `achieved.achieved_settings`."""
    quantity_rows = [row for row in rows if row["quantity"] == quantity]
    scale = display_of(quantity).scale
    planned = [row["planned"] * scale for row in quantity_rows]
    mean = [row["mean"] * scale for row in quantity_rows]
    bars = {
        "type": "data",
        "symmetric": False,
        "array": [row["largest"] * scale - m for row, m in zip(quantity_rows, mean, strict=True)],
        "arrayminus": [m - row["least"] * scale for row, m in zip(quantity_rows, mean, strict=True)],
        "color": "c0/0.5",
    }
    names = [f"{row['plan']}, run {row['run']}" for row in quantity_rows]
    ends = [min(planned + mean), max(planned + mean)]
    return figure(
        [
            line(ends, ends, "as planned", "quiet", dash="dash"),
            points(planned, mean, "runs", "c0", error_y=bars, text=names),
        ],
        f"planned {heading(quantity)}",
        "achieved",
        showlegend=False,
    )


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
