"""Impacts and shots: lists that are paged in the database, one impact with its record and its pulse, and pulses and
shock response spectra of many over each other."""

from __future__ import annotations

import re
from dataclasses import fields, replace
from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter, Form, Query
from sqlalchemy import select
from sqlalchemy.orm import Session
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response

from ...ingest.reextraction import preview_impacts, reextract_recording
from ...ingest.settings import ExtractionSettings
from ...schema.campaigns import Factor
from ...schema.conditions import list_campaign_names
from ...schema.impacts import Pulse
from ...schema.listings import list_impacts_page, list_pulse_keys, list_shots_page
from ...schema.series import SeriesError
from ...schema.session import Store
from ..common.filters import parse_where
from ..common.nominal_velocity import with_predictions
from ..web.dependencies import Key, OpenStore
from ..web.figures_base import Figure
from ..web.rendering import page, query
from .curves import PulseView, pulse_view
from .figures import (
    four_coordinate_figure,
    level_words,
    overlay_figure,
    segmentation_figure,
    signal_figure,
    spectra_figure,
)
from .impact import get_impact, impact_page, without_empty_figures
from .overlays import PulseOverlay, pulse_overlay, spectrum_overlay
from .signals import channel_window, list_signals
from .spectra import target_from_upload

router = APIRouter()
PAGE = 100
#: Of a whole channel on a page; zooming in fetches the rest.
POINTS = 2000
Where = Annotated[list[str], Query(max_length=20)]
After = Annotated[int | None, Query(ge=1, le=2**31 - 1)]


@router.get("/impacts")
def impacts(request: Request, store: OpenStore, where: Where = [], campaign: str = "", after: After = None) -> Response:  # noqa: B006
    where = [condition for condition in where if condition.strip()]
    with store.reading() as session:
        rows, following = list_impacts_page(session, campaign or None, parse_where(tuple(where)), after, PAGE)
    return _listed(
        request, "impacts", without_empty_figures(rows), {"campaign": campaign, "where": where}, following, after
    )


@router.get("/shots")
def shots(request: Request, store: OpenStore, where: Where = [], campaign: str = "", after: After = None) -> Response:  # noqa: B006
    where = [condition for condition in where if condition.strip()]
    with store.reading() as session:
        shots, following = list_shots_page(session, campaign or None, parse_where(tuple(where)), after, PAGE)
        rows = list(with_predictions(session, shots))
    return _listed(request, "shots", rows, {"campaign": campaign, "where": where}, following, after)


def _listed(
    request: Request,
    what: str,
    rows: list[dict[str, Any]],
    parameters: dict[str, Any],
    following: int | None,
    after: int | None,
) -> Response:
    columns: dict[str, None] = {}
    for row in rows:
        columns |= dict.fromkeys(row)
    return page(
        request,
        "impacts.html",
        what=what,
        rows=rows,
        columns=list(columns),
        **parameters,
        following=query({**parameters, "after": following}) if following else "",
        beginning=(query(parameters) or f"/{what}") if after else "",
        compared=query({"campaign": parameters["campaign"], "where": parameters["where"]}),
    )


@router.get("/impacts/{impact}")
def impact(
    request: Request,
    impact: Key,
    store: OpenStore,
    preview: bool = False,
    segmentation: str = "",
    threshold: float | None = None,
    smoothing: float | None = None,
) -> Response:
    with store.reading() as session:
        impact_view = impact_page(session, impact)
        recording = get_impact(session, impact).recording_id
    settings = _settings(impact_view, segmentation, threshold, smoothing)
    view, why_not = _viewed(store, impact, recording, settings if preview else None)
    with store.reading() as session:
        signals = [] if recording is None else list_signals(session, recording)
        figures, damaged = _channel_charts(session, signals)
    lists = ("pulses", "channel_figures", "findings", "channels")
    return page(
        request,
        "impact.html",
        impact=impact,
        facts={key: value for key, value in impact_view.items() if key not in lists},
        **{key: impact_view[key] for key in lists},
        signals=signals,
        figures=figures,
        damaged=damaged,
        segmentation=None if view is None else segmentation_figure(view),
        previewed=view.preview if view else None,
        used=next((version for version in view.versions if version.in_use), None) if view else None,
        why_not=why_not,
        asked=settings,
        points=POINTS,
    )


def _channel_charts(session: Session, signals: list[dict[str, Any]]) -> tuple[dict[int, Figure], dict[int, str]]:
    """Channels as charts, and why one is none: a damaged series keeps no page from being shown."""
    figures, damaged = {}, {}
    for signal in signals:
        try:
            figures[signal["key"]] = signal_figure(channel_window(session, signal["key"], points=POINTS))
        except SeriesError as error:
            damaged[signal["key"]] = str(error)
    return figures, damaged


def _settings(
    version: dict[str, Any], segmentation: str, threshold: float | None, smoothing: float | None
) -> ExtractionSettings:
    """What the form asks for; what it leaves open is as the version in use was cut."""
    used: dict[str, Any] = next((pulse for pulse in version["pulses"] if pulse["in_use"] == "yes"), {})
    setting_names = {field.name for field in fields(ExtractionSettings)}
    settings = replace(ExtractionSettings(), **{key: value for key, value in used.items() if key in setting_names})
    given = {"segmentation": segmentation or None, "threshold": threshold, "smoothing": smoothing}
    return replace(settings, **{key: value for key, value in given.items() if value is not None})  # type: ignore[arg-type]


def _viewed(
    store: Store, impact: int, recording: int | None, settings: ExtractionSettings | None
) -> tuple[PulseView | None, str]:
    """The segmentation, with the preview of other settings; and why there is none."""
    try:
        cut = preview_impacts(store, recording, settings) if settings is not None and recording is not None else None
        pulse = cut.pulse_of(impact) if cut is not None else None
        with store.reading() as session:
            view = pulse_view(
                session, impact, (pulse, settings) if pulse is not None and settings is not None else None
            )
    except (LookupError, SeriesError) as error:
        return None, str(error)
    return view, (cut.mismatch or "") if cut is not None else ""


@router.post("/impacts/{impact}/extract")
def extract(
    impact: Key,
    store: OpenStore,
    segmentation: Annotated[str, Form()],
    threshold: Annotated[float, Form()],
    smoothing: Annotated[float, Form()],
) -> Response:
    """Store what was previewed, of the whole recording: its hits are told apart together."""
    with store.reading() as session:
        page = impact_page(session, impact)
        recording = get_impact(session, impact).recording_id
    if recording is None:
        raise LookupError(f"impact {impact} has no recording to cut")
    settings = _settings(page, segmentation, threshold, smoothing)
    report = reextract_recording(store, recording, settings)
    if report.skipped:
        raise ValueError(f"left as it was: {report.skipped[0]['reason']}")
    return RedirectResponse(f"/impacts/{impact}", 303)


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
        campaigns = list_campaign_names(session)
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
        rows=[{**row, "share_within": f"{row['share_within']:.0%}"} for row in overlay.rows()] if overlay else [],
    )
