"""One impact with its record and its pulse, and pulses and shock response spectra of many over each
other."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter, Depends, Query
from sqlalchemy import select
from sqlalchemy.orm import Session
from starlette.requests import Request
from starlette.responses import Response

from ...ingest.storing.reextraction import preview_impacts
from ...schema.campaigns import Campaign, Factor
from ...schema.conditions import QUALITY, Condition, list_campaign_names
from ...schema.impacts import Impact, Pulse
from ...schema.listings import list_pulses
from ...schema.series import SeriesError
from ...schema.session import Store
from ..common.filters import parse_where
from ..common.quantities import display_of_unit, velocities_of, velocity_with_uncertainty
from ..figures.figure import Plot
from ..operations.faults import read
from ..operations.impacts.compared_spectra import COMPARE_SPECTRA, SpectrumComparing
from ..operations.impacts.curves import PulseView, pulse_view
from ..operations.impacts.extraction import PulseExtraction
from ..operations.impacts.figures import (
    four_coordinate_figure,
    level_words,
    overlay_figure,
    segmentation_figure,
    signal_figure,
    spectra_figure,
)
from ..operations.impacts.impact import get_impact
from ..operations.impacts.overlays import PulseOverlay, pulse_overlay
from ..operations.impacts.showing import IMPACT_SHOW, NamedImpact
from ..operations.impacts.signals import channel_window
from ..operations.ingest.request import ExtractionChoice
from ..operations.laboratory import Laboratory
from ..web.dependencies import Configured, Key, OpenStore
from ..web.forms import status_of_fault
from ..web.page_sources import THE_STORE
from ..web.rendering import page, query

router = APIRouter()
#: Of a whole channel on a page; zooming in fetches the rest.
POINTS = 2000


@router.get("/impacts/{impact}", dependencies=[Depends(THE_STORE)])
def impact(
    request: Request, impact: Key, store: OpenStore, settings: Configured, preview: bool = False
) -> Response:
    laboratory = Laboratory(store, settings.db)
    shown = IMPACT_SHOW.answer(NamedImpact(impact=impact), laboratory, lambda *_: None)
    impact_view, signals = dict(shown.facts), shown.signals
    extraction = _extraction(impact_view, request.query_params)
    view, why_not = _viewed(store, extraction, preview)
    with store.reading() as session:
        contact = contact_span(impact_view)
        figures, damaged = _channel_charts(session, signals, contact)
        before, after = neighbours(session, impact)
    scales = {signal["key"]: display_of_unit(signal["unit"]).scale for signal in signals}
    lists = ("pulses", "channel_figures", "findings", "channels")
    with velocities_of([impact_view]):
        return page(
            request,
            "impact.html",
            impact=impact,
            facts=_facts({key: value for key, value in impact_view.items() if key not in lists}),
            **{key: impact_view[key] for key in lists},
            signals=signals,
            figures=figures,
            scales=scales,
            before=before,
            after=after,
            damaged=damaged,
            segmentation=None if view is None else segmentation_figure(view),
            previewed=view.preview if view else None,
            used=next((version for version in view.versions if version.in_use), None)
            if view
            else None,
            why_not=why_not,
            asked=extraction,
            points=POINTS,
        )


def _facts(facts: dict[str, Any]) -> dict[str, Any]:
    """The facts as the page lists them: a shot's velocity with its uncertainty."""
    return velocity_with_uncertainty(facts) if "shot" in facts else facts


def contact_span(impact_view: dict[str, Any]) -> tuple[float, float] | None:
    """From a contact time before the pulse in use to two after it, in s of the recording; None
    without a pulse."""
    used = next((pulse for pulse in impact_view["pulses"] if pulse["in_use"] == "yes"), None)
    if used is None:
        return None
    return used["start_s"] - used["contact_time_s"], used["start_s"] + 3 * used["contact_time_s"]


def neighbours(session: Session, impact: int) -> tuple[int | None, int | None]:
    """The impacts before and after this one in its campaign; None where there is none."""
    campaign = select(Impact.campaign_id).where(Impact.id == impact).scalar_subquery()
    of_campaign = select(Impact.id).where(Impact.campaign_id == campaign)
    before = of_campaign.where(Impact.id < impact).order_by(Impact.id.desc()).limit(1)
    after = of_campaign.where(Impact.id > impact).order_by(Impact.id).limit(1)
    return session.scalar(before), session.scalar(after)


def _channel_charts(
    session: Session, signals: Sequence[Mapping[str, Any]], contact: tuple[float, float] | None
) -> tuple[dict[int, tuple[Plot, Plot | None]], dict[int, str]]:
    """Channels as charts of the whole record and of the contact, and why one is none.

    A damaged series keeps no page from being shown.
    """
    figures: dict[int, tuple[Plot, Plot | None]] = {}
    damaged = {}
    for signal in signals:
        try:
            whole = signal_figure(channel_window(session, signal["key"], points=POINTS))
            near = None
            if contact is not None and signal["quantity"] in ("force", "acceleration"):
                near = signal_figure(
                    channel_window(session, signal["key"], *contact, points=POINTS)
                )
            figures[signal["key"]] = whole, near
        except SeriesError as error:
            damaged[signal["key"]] = str(error)
    return figures, damaged


def _extraction(impact_view: Mapping[str, Any], sent: Mapping[str, str]) -> PulseExtraction:
    """What the address asks for; what it leaves open is as the version in use was extracted."""
    pulses: Sequence[Mapping[str, Any]] = impact_view["pulses"]
    used = next((pulse for pulse in pulses if pulse["in_use"] == "yes"), {})
    stated = {name: text for name, text in sent.items() if text}
    values = {
        name: part
        for name, part in {**used, **stated}.items()
        if name in ExtractionChoice.model_fields
    }
    return read(PulseExtraction, {**values, "impact": impact_view["id"]}, "network")


def _viewed(
    store: Store, extraction: PulseExtraction, preview: bool
) -> tuple[PulseView | None, str]:
    """The segmentation, with the preview of other settings; and why there is none."""
    settings = extraction.settings()
    try:
        with store.reading() as session:
            recording = get_impact(session, extraction.impact).recording_id
        extracted = (
            preview_impacts(store, recording, settings)
            if preview and recording is not None
            else None
        )
        pulse = extracted.pulse_of(extraction.impact) if extracted is not None else None
        with store.reading() as session:
            view = pulse_view(
                session, extraction.impact, None if pulse is None else (pulse, settings)
            )
    except (LookupError, SeriesError) as error:
        return None, str(error)
    return view, (extracted.mismatch or "") if extracted is not None else ""


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
    where: Annotated[list[str], Query(max_length=20)] = [],  # noqa: B006
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
        for name in ("channel", "q", "specification", "tolerance")
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
        overlay=overlay,
        why_not=why_not,
        figure=spectra_figure(overlay, sides) if overlay else None,
        paper=four_coordinate_figure(overlay) if overlay else None,
        rows=compared.rows() if compared else [],
    )
