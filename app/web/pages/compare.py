"""Pulses of many impacts over each other, and their shock response spectra."""

from __future__ import annotations

import re
from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter, Query
from sqlalchemy import select
from sqlalchemy.orm import Session
from starlette.requests import Request
from starlette.responses import Response

from ....schema.campaigns import Campaign, Factor
from ....schema.impacts import Pulse
from ....schema.listings import list_pulse_keys
from ...filters import parse_where
from ...pulses.overlays import PulseOverlay, pulse_overlay
from ...spectra.overlays import spectrum_overlay
from ...spectra.targets import target_from_upload
from ..dependencies import OpenStore
from ..figures.pulses import level_words, overlay_figure
from ..figures.spectra import four_coordinate_figure, spectra_figure
from ..rendering import page, query

router = APIRouter()
#: Pulses on the page, of all that match: enough for a mean, and drawn at once.
PULSES = 400
#: Spectra that are taken of a filter where no impacts are named.
SPECTRA = 6


@router.get("/compare")
def compare(
    request: Request,
    store: OpenStore,
    where: Annotated[list[str], Query(max_length=20)] = [],  # noqa: B006
    campaign: str = "",
    factor: str = "tip_material",
    normalised: bool = False,
) -> Response:
    where = [condition for condition in where if condition.strip()]
    with store.reading() as session:
        factors = list(session.scalars(select(Factor.name).order_by(Factor.name).limit(200)))
        campaigns = _campaigns(session)
        overlay = None
        if factors:
            conditions = parse_where(tuple(where))
            chosen = factor if factor in factors else factors[0]
            overlay = pulse_overlay(session, campaign or None, conditions, chosen, normalised=normalised, most=PULSES)
        spectra = _some_of(overlay) if overlay is not None else _some_impacts(session, campaign, where)
    return page(
        request,
        "compare.html",
        campaigns=campaigns,
        campaign=campaign,
        where=where,
        factors=factors,
        factor=factor,
        normalised=normalised,
        overlay=overlay,
        figure=overlay_figure(overlay) if overlay and overlay.groups else None,
        groups=_groups(overlay) if overlay else [],
        spectra_address="/compare/spectra" + query({"impacts": ",".join(map(str, spectra))}) if spectra else "",
    )


def _campaigns(session: Session) -> list[str]:
    return list(session.scalars(select(Campaign.name).order_by(Campaign.date.desc(), Campaign.name).limit(500)))


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
    """Impacts of the picture, taken evenly: asking the database again doubles what the page takes."""
    impacts = sorted(impact for group in overlay.groups for impact in group.impacts)
    return impacts[:: max(1, -(-len(impacts) // SPECTRA))]


def _some_impacts(session: Session, campaign: str, where: list[str]) -> list[int]:
    keys, _ = list_pulse_keys(session, campaign or None, parse_where(tuple(where)), SPECTRA)
    return list(session.scalars(select(Pulse.impact_id).where(Pulse.id.in_(keys)).order_by(Pulse.impact_id)))


@router.get("/compare/spectra")
def spectra(
    request: Request,
    store: OpenStore,
    impacts: Annotated[str, Query(max_length=2000)] = "",
    channel: Annotated[str, Query(max_length=200)] = "",
    q: Annotated[float, Query(gt=0.5, le=1000)] = 10.0,
    sides: bool = False,
    specification: Annotated[str, Query(max_length=20_000)] = "",
    tolerance: Annotated[str, Query(max_length=100)] = "",
) -> Response:
    keys = [int(word) for word in re.findall(r"\d{1,9}", impacts)]
    overlay, why_not = None, ""
    if keys:
        wanted = (
            target_from_upload(specification, "specification", tolerance or None) if specification.strip() else None
        )
        try:
            with store.reading() as session:
                overlay = spectrum_overlay(session, keys, channel or None, q=q, specification=wanted)
        except ValueError as error:
            why_not = str(error)
    return page(
        request,
        "spectra.html",
        impacts=impacts,
        channel=channel,
        q=q,
        sides=sides,
        specification=specification,
        tolerance=tolerance,
        overlay=overlay,
        why_not=why_not,
        figure=spectra_figure(overlay, sides) if overlay else None,
        paper=four_coordinate_figure(overlay) if overlay else None,
        rows=[
            {
                "impact": overlaid.impact,
                "channel": overlaid.channel,
                "share_within": f"{overlay.comparison.share_within[i]:.0%}",
                "worst_margin_db": float(overlay.comparison.worst_margin_db[i]),
                "worst_frequency_hz": float(overlay.comparison.worst_frequency_hz[i]),
            }
            for i, overlaid in enumerate(overlay.spectra)
        ]
        if overlay
        else [],
    )
