"""Pulses of many impacts over each other, and their shock response spectra beside a reference."""

from __future__ import annotations

import re
from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter, Depends, Query
from sqlalchemy import select
from sqlalchemy.orm import Session
from starlette.requests import Request
from starlette.responses import Response

from ...schema.campaigns import Campaign, Factor
from ...schema.conditions import QUALITY, Condition, list_campaign_names
from ...schema.impacts import Impact, Pulse
from ...schema.listings import list_pulses
from ..common.filters import parse_where
from ..operations.faults import read
from ..operations.impacts.compared_spectra import COMPARE_SPECTRA, SpectrumComparing
from ..operations.impacts.figures import level_words, overlay_figure
from ..operations.impacts.overlays import PulseOverlay, pulse_overlay
from ..operations.impacts.spectra_figures import compared_figure, four_coordinate_figure
from ..operations.laboratory import Laboratory
from ..web.dependencies import Configured, OpenStore
from ..web.forms import status_of_fault
from ..web.page_sources import THE_STORE
from ..web.rendering import page, query

router = APIRouter()
#: Stands in the address for all campaigns together.
EVERY = "*"
#: Pulses on the page, of all that match: enough for a mean, and drawn at once.
PULSES = 400
#: Spectra that are taken of a filter where no impacts are named.
SPECTRA = 6


@router.get("/compare", dependencies=[Depends(THE_STORE)])
def compare(
    request: Request,
    store: OpenStore,
    where: Annotated[list[str], Query(max_length=20)] = [],  # noqa: B006  FastAPI copies it
    campaign: str | None = None,
    factor: str = "tip_material",
    normalised: bool = False,
    rejected: bool = False,
) -> Response:
    where, overlay, spectra, error = (
        [condition for condition in where if condition.strip()],
        None,
        [],
        "",
    )
    status = 200
    with store.reading() as session:
        factors = list(session.scalars(select(Factor.name).order_by(Factor.name).limit(200)))
        campaigns = list_campaign_names(session)
        if (
            campaign is None
        ):  # pulses of several campaigns are compared only where somebody asks for it
            campaign = EVERY if where else _newest_with_pulses(session)
        of_campaign = None if campaign in ("", EVERY) else campaign
        try:
            conditions = parse_where(tuple(where)) + (
                () if rejected else (Condition(QUALITY, "!=", "reject"),)
            )
            if factors:
                chosen = factor if factor in factors else factors[0]
                overlay = pulse_overlay(
                    session, of_campaign, conditions, chosen, normalised=normalised, most=PULSES
                )
            spectra = (
                _some_of(overlay)
                if overlay is not None
                else _some_impacts(session, of_campaign, conditions)
            )
        except (ValueError, LookupError) as why:
            error, status = str(why), status_of_fault(why)
    return page(
        request,
        "compare.html",
        status=status,
        error=error,
        rejected=rejected,
        campaigns=campaigns,
        campaign=campaign,
        where=where,
        factors=factors,
        factor=factor,
        normalised=normalised,
        overlay=overlay,
        figure=overlay_figure(overlay) if overlay and overlay.groups else None,
        groups=_groups(overlay) if overlay else [],
        spectra_address="/compare/spectra" + query({"impacts": ",".join(map(str, spectra))})
        if spectra
        else "",
    )


def _groups(overlay: PulseOverlay) -> list[dict[str, Any]]:
    """A row for each level: pulses, and mean and standard deviation of peak and contact time."""
    rows = []
    for group in overlay.groups:
        peaks = group.force_n.max(axis=1)
        single = group.count < 2
        rows.append(
            {
                "level": level_words(overlay.factor, group.level),
                "pulses": group.count,
                "mean_peak_n": float(peaks.mean()),
                "deviation_n": None if single else float(peaks.std(ddof=1)),
                "contact_time_s": float(group.contact_time_s.mean()),
                "deviation_s": None if single else float(np.std(group.contact_time_s, ddof=1)),
            }
        )
    return rows


def _some_of(overlay: PulseOverlay) -> list[int]:
    """Impacts of the picture, taken evenly: asking the database again doubles what the page
    takes."""
    impacts = sorted(impact for group in overlay.groups for impact in group.impacts)
    return impacts[:: max(1, -(-len(impacts) // SPECTRA))]


def _newest_with_pulses(session: Session) -> str:
    """The newest campaign with a pulse in use; empty where no pulse was extracted."""
    newest = (
        select(Pulse.impact_id)
        .where(Pulse.current)
        .order_by(Pulse.impact_id.desc())
        .limit(1)
        .scalar_subquery()
    )
    campaign = (
        select(Campaign.name)
        .join(Impact, Impact.campaign_id == Campaign.id)
        .where(Impact.id == newest)
    )
    return session.scalar(campaign) or ""


def _some_impacts(
    session: Session, campaign: str | None, conditions: tuple[Condition, ...]
) -> list[int]:
    rows, _ = list_pulses(session, campaign, conditions, SPECTRA, (Pulse.impact_id,))
    return [impact for (impact,) in rows]


@router.get("/compare/spectra", dependencies=[Depends(THE_STORE)])
def spectra(
    request: Request,
    store: OpenStore,
    settings: Configured,
    impacts: Annotated[str, Query(max_length=2000)] = "",
    sides: bool = False,
) -> Response:
    sent: dict[str, Any] = {
        name: request.query_params.get(name, "")
        for name in ("channel", "q", "specification", "tolerance", "reference")
    }
    keys = re.findall(r"\d{1,9}", impacts)
    compared, why_not = None, ""
    if keys:
        stated = {name: text for name, text in sent.items() if text.strip()}
        comparing = read(SpectrumComparing, {**stated, "impact": keys}, "network")
        comparing.target()  # a specification that cannot be read is no lack of spectra
        try:
            compared = COMPARE_SPECTRA.answer(
                comparing, Laboratory(store, settings.db), lambda *_: None
            )
        except ValueError as error:
            why_not = str(error)
    overlay = compared.overlay if compared else None
    return page(
        request,
        "spectra.html",
        impacts=impacts,
        **{**sent, "q": sent["q"] or 10.0},
        sides=sides,
        keys=keys,
        overlay=overlay,
        why_not=why_not,
        figure=compared_figure(overlay, sides) if overlay else None,
        paper=four_coordinate_figure(overlay) if overlay else None,
        rows=compared.rows() if compared else [],
    )
