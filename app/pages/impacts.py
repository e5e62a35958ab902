"""One impact: its facts, its channels on one axis of time, its spectrum and its pulse."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from fastapi import APIRouter, Depends
from sqlalchemy import select
from sqlalchemy.orm import Session
from starlette.requests import Request
from starlette.responses import Response

from ...ingest.storing.reextraction import preview_impacts
from ...schema.impacts import Impact
from ...schema.series import SeriesError
from ...schema.session import Store
from ..common.quantities import display_of_unit, velocities_of, velocity_with_uncertainty
from ..common.run_forecasts import rows_of_json, spectra_before
from ..figures.figure import Plot
from ..operations.faults import read
from ..operations.impacts.curves import PulseView, pulse_view
from ..operations.impacts.extraction import PulseExtraction
from ..operations.impacts.figures import segmentation_figure
from ..operations.impacts.finding_places import PlacedFinding, list_placed_findings
from ..operations.impacts.impact import PREDICTED, PREDICTION, get_impact
from ..operations.impacts.impact_links import impact_links
from ..operations.impacts.overlays import spectrum_overlay
from ..operations.impacts.record_strips import WINDOW_POINTS, RecordStrips, record_strips
from ..operations.impacts.showing import IMPACT_SHOW, NamedImpact
from ..operations.impacts.spectra_figures import impact_spectra_plot
from ..operations.ingest.request import ExtractionChoice
from ..operations.laboratory import Laboratory
from ..web.dependencies import Configured, Key, OpenStore
from ..web.page_sources import THE_STORE
from ..web.rendering import page

router = APIRouter()
#: What stands at the top of the page or has a place of its own below.
_ELSEWHERE = (
    *("id", "campaign", "quality", "run", "repetition", "shot"),
    *("impact_velocity_m_s", "impact_velocity_u_m_s"),
    *("velocity_source", "velocity_kind", "measured_velocity_m_s", "predicted_velocity_m_s"),
    *(PREDICTION, PREDICTED),
)
#: Q of the spectra of the page.
_Q = 10.0
_LISTS = ("pulses", "channel_figures", "findings", "channels")


@router.get("/impacts/{impact}", dependencies=[Depends(THE_STORE)])
def impact(
    request: Request, impact: Key, store: OpenStore, settings: Configured, preview: bool = False
) -> Response:
    laboratory = Laboratory(store, settings.db)
    shown = IMPACT_SHOW.answer(NamedImpact(impact=impact), laboratory, lambda *_: None)
    impact_view, signals = dict(shown.facts), shown.signals
    extraction = _extraction(impact_view, request.query_params)
    view, why_not = _viewed(store, extraction, preview)
    contact = _contact(impact_view)
    with store.reading() as session:
        findings = list_placed_findings(session, impact)
        strips = record_strips(session, signals, contact, contact_span(impact_view), findings)
        spectra, no_spectra = _spectra(session, impact, signals)
        links = impact_links(session, impact_view)
        before, after = neighbours(session, impact)
    facts = {key: value for key, value in impact_view.items() if key not in _LISTS}
    facts = velocity_with_uncertainty(facts) if "shot" in facts else facts
    with velocities_of([impact_view]):
        return page(
            request,
            "impact.html",
            impact=impact,
            links=links,
            facts={key: facts[key] for key in ("campaign", "quality")},
            settings={
                key: value
                for key, value in facts.items()
                if key not in _ELSEWHERE and value is not None
            },
            **{key: impact_view[key] for key in ("pulses", "channel_figures", "channels")},
            prediction=impact_view.get(PREDICTION),
            predicted=rows_of_json(impact_view.get(PREDICTED, [])),
            findings=[_finding_row(finding, strips) for finding in findings],
            signals=signals,
            strips=strips,
            charts=_chart_facts(strips, contact),
            spectra=spectra,
            no_spectra=no_spectra,
            before=before,
            after=after,
            segmentation=None if view is None else segmentation_figure(view),
            previewed=view.preview if view else None,
            used=next((version for version in view.versions if version.in_use), None)
            if view
            else None,
            why_not=why_not,
            asked=extraction,
            points=WINDOW_POINTS,
        )


def _contact(impact_view: Mapping[str, Any]) -> tuple[float, float] | None:
    """Begin and end of the contact of the pulse in use, in s of the recording."""
    pulses = impact_view["pulses"]
    used = next((pulse for pulse in pulses if pulse["in_use"] == "yes"), None)
    if used is None:
        return None
    return used["start_s"], used["start_s"] + used["contact_time_s"]


def contact_span(impact_view: Mapping[str, Any]) -> tuple[float, float] | None:
    """From a contact time before the pulse in use to two after it, in s of the recording; None
    without a pulse."""
    contact = _contact(impact_view)
    if contact is None:
        return None
    length = contact[1] - contact[0]
    return contact[0] - length, contact[0] + 3 * length


def neighbours(session: Session, impact: int) -> tuple[int | None, int | None]:
    """The impacts before and after this one in its campaign; None where there is none."""
    campaign = select(Impact.campaign_id).where(Impact.id == impact).scalar_subquery()
    of_campaign = select(Impact.id).where(Impact.campaign_id == campaign)
    before = of_campaign.where(Impact.id < impact).order_by(Impact.id.desc()).limit(1)
    after = of_campaign.where(Impact.id > impact).order_by(Impact.id).limit(1)
    return session.scalar(before), session.scalar(after)


def _finding_row(finding: PlacedFinding, strips: RecordStrips) -> dict[str, Any]:
    """A finding with the stretch of the record that shows it, in ms; None for the whole record."""
    row: dict[str, Any] = {**vars(finding), "view": None, "place": ""}
    if not finding.places or strips.figure is None:
        return row
    start_ms, stop_ms = 1e3 * finding.places[0].start_s, 1e3 * finding.places[-1].stop_s
    low, high = next(strips.figure.plots()).limits("x")
    room = max(3 * (stop_ms - start_ms), 0.002 * (high - low))
    return row | {
        "view": f"{max(low, start_ms - room):.9g}~{min(high, stop_ms + room):.9g}",
        "place": "the contact" if finding.extent == "contact" else f"{start_ms:.6g} ms",
    }


def _chart_facts(strips: RecordStrips, contact: tuple[float, float] | None) -> dict[str, Any]:
    """What `static/impact.js` needs beside the figure: how each channel is fetched, and the
    contact."""
    return {
        "contact_ms": None if contact is None else [1e3 * instant for instant in contact],
        "channels": [
            {
                "key": signal["key"],
                "name": signal["channel"],
                "scale": display_of_unit(signal["si_unit"]).scale,
                "bucket": bucket_ms,
                "exact": exact,
            }
            for signal, bucket_ms, exact in zip(
                strips.signals, strips.buckets_ms, strips.exact, strict=True
            )
        ],
    }


def _spectra(
    session: Session, impact: int, signals: Sequence[Mapping[str, Any]]
) -> tuple[Plot | None, str]:
    """The spectra of the impact's accelerations, or why there are none."""
    if not any(signal["quantity"] == "acceleration" for signal in signals):
        return None, "This recording has no acceleration, so that there is no spectrum."
    try:
        overlay = spectrum_overlay(session, [impact], q=_Q)
        predicted = spectra_before(session, impact)
        same_q = predicted is not None and predicted["q"] == _Q
        return impact_spectra_plot(overlay, predicted if same_q else None), ""
    except ValueError as error:  # no spectrum, or a damaged series
        return None, str(error)


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
