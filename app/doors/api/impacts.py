"""Impacts, shots, their channels and pulses; shock response spectra of them, and of a series that
is uploaded."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from fastapi import APIRouter, Query
from pydantic import BaseModel, Field

from ....ingest.extraction.settings import ExtractionSettings
from ....ingest.storing.reextraction import preview_impacts, reextract_recording
from ....schema.listings import list_impacts_page, list_shots_page
from ....signals.record_rest import without_rest
from ....signals.srs.spectrum import shock_response_spectrum
from ...common.filters import parse_where
from ...common.nominal_velocity import with_predictions
from ...common.number_format import finite
from ...operations.impacts.curves import preview_curve
from ...operations.impacts.impact import get_impact, impact_page
from ...operations.impacts.overlays import spectrum_overlay
from ...operations.impacts.record_choice import chosen_part, parse_rest
from ...operations.impacts.signals import channel_window, list_signals
from ...operations.impacts.spectra import target_from_upload
from ...web.dependencies import Key, OpenStore

router = APIRouter(tags=["impacts"])

Where = Annotated[list[Annotated[str, Field(max_length=300)]], Query(max_length=20)]
After = Annotated[int | None, Query(ge=1, le=2**31 - 1)]
Limit = Annotated[int, Query(ge=1, le=2000)]


class ExtractionOptions(BaseModel):
    """Settings of an extraction, as the options of `pyroshock extract`."""

    segmentation: Literal["walk", "mask"] = "walk"
    threshold: float = 0.005
    smoothing: float = 0.99

    def settings(self) -> ExtractionSettings:
        return ExtractionSettings(**self.model_dump())


@router.get("/impacts")
def impacts(
    store: OpenStore,
    where: Where = [],  # noqa: B006 - FastAPI copies it
    campaign: str | None = None,
    after: After = None,
    limit: Limit = 100,
) -> list[dict[str, Any]]:
    """Impacts with their factors; the next page begins `after` the last `id` of this one. `where`:
    FIELD=VALUE."""
    with store.reading() as session:
        return list_impacts_page(session, campaign, parse_where(tuple(where)), after, limit)[0]


@router.get("/shots")
def shots(
    store: OpenStore,
    where: Where = [],  # noqa: B006
    campaign: str | None = None,
    after: After = None,
    limit: Limit = 100,
) -> list[dict[str, Any]]:
    """Shots of the gun beside the nominal model's velocity."""
    with store.reading() as session:
        shots, _ = list_shots_page(session, campaign, parse_where(tuple(where)), after, limit)
        return list(with_predictions(session, shots))


@router.get("/impacts/{impact}")
def impact(impact: Key, store: OpenStore) -> Any:
    """One impact: figures, versions of its pulse, findings, and channels with the keys of
    `/channels`."""
    with store.reading() as session:
        page = impact_page(session, impact)
        recording = get_impact(session, impact).recording_id
        return finite(
            {**page, "signals": [] if recording is None else list_signals(session, recording)}
        )


@router.get("/channels/{channel}")
def channel(
    channel: Key,
    store: OpenStore,
    start_s: float | None = None,
    stop_s: float | None = None,
    points: Annotated[int, Query(ge=4, le=200_000)] = 2000,
) -> Any:
    """A channel between two instants in SI: every sample where they fit into `points`, else the
    extremes of buckets."""
    with store.reading() as session:
        window = channel_window(session, channel, start_s, stop_s, points)
    return finite(
        {**vars(window), "time_s": window.time_s.tolist(), "values": window.values.tolist()}
    )


@router.post("/impacts/{impact}/preview")
def preview(impact: Key, extraction: ExtractionOptions, store: OpenStore) -> Any:
    """The pulse that other settings give; nothing is stored."""
    settings = extraction.settings()
    pulse = preview_impacts(store, _recording(store, impact), settings).pulse_of(impact)
    if pulse is None:
        raise ValueError("these settings find another number of impacts in the recording")
    curve = preview_curve(pulse, settings)
    arrays = ("time_s", "force_n", "points_time_s", "points_n")
    return finite({**vars(curve), **{name: getattr(curve, name).tolist() for name in arrays}})


@router.post("/impacts/{impact}/extract")
def extract(impact: Key, extraction: ExtractionOptions, store: OpenStore) -> dict[str, object]:
    """Cut the recording of an impact anew and use that version; the old ones stay."""
    return reextract_recording(store, _recording(store, impact), extraction.settings()).as_json()


def _recording(store: OpenStore, impact: int) -> int:
    with store.reading() as session:
        recording = get_impact(session, impact).recording_id
    if recording is None:
        raise LookupError(f"impact {impact} has no recording")
    return recording


_SIDES = ("maximax", "positive", "negative", "primary", "residual", "pseudo_velocity_m_s")
Number = Annotated[float, Field(ge=-1e12, le=1e12)]


class AccelerationSeries(BaseModel):
    """An acceleration in m/s2 at a constant rate."""

    acceleration_m_s2: Annotated[list[Number], Field(min_length=2, max_length=50_000)]
    sampling_rate_hz: Annotated[float, Field(ge=1e-3, le=1e9)]
    frequency_hz: Annotated[
        list[Annotated[float, Field(ge=1e-6, le=1e9)]], Field(min_length=1, max_length=1000)
    ]
    q: Annotated[float, Field(gt=0.5, le=1000)] = 10.0
    rest: Annotated[str, Field(max_length=60)] = Field(
        "",
        description="Zero of the record: none, or two times as 0ms:5ms. [default: the "
        "rest before the shock]",
    )
    hit: Annotated[str, Field(max_length=20)] = Field(
        "", description="Number of the hit of a record that holds several, or whole."
    )


@router.post("/srs")
def srs(series: AccelerationSeries) -> Any:
    """The spectrum of a series, in the form of `pyroshock srs --json` without its checks."""
    record = np.asarray(series.acceleration_m_s2, dtype=np.float64)
    lines = np.asarray(series.frequency_hz, dtype=np.float64)
    taken, part = chosen_part(record, series.sampling_rate_hz, 0.0, series.hit or None, "hit")
    choice = parse_rest(series.rest, "rest")
    shock, removed = without_rest(
        record[taken], series.sampling_rate_hz, taken.start / series.sampling_rate_hz, choice
    )
    spectrum = shock_response_spectrum(shock, series.sampling_rate_hz, lines, q=series.q)
    sides = {name: getattr(spectrum, name).tolist() for name in (*_SIDES, "sampling_error")}
    return finite(
        {
            "unit": "m/s2",
            "frequency_hz": lines.tolist(),
            **sides,
            "part": part,
            "rest": vars(removed),
        }
    )


@router.get("/spectra")
def spectra(
    store: OpenStore,
    impact: Annotated[
        list[Annotated[int, Field(ge=1, le=2**31 - 1)]], Query(min_length=1, max_length=50)
    ],
    channel: str | None = None,
    q: Annotated[float, Query(gt=0.5, le=1000)] = 10.0,
    specification: Annotated[str, Query(max_length=20_000)] = "",
    tolerance: Annotated[str, Query(max_length=100)] = "",
) -> Any:
    """Spectra of stored impacts, held against a specification (text of its CSV), else their
    mean."""
    wanted = (
        target_from_upload(specification, "specification", tolerance or None)
        if specification
        else None
    )
    with store.reading() as session:
        overlay = spectrum_overlay(session, impact, channel, q=q, specification=wanted)
    rows = [
        {**row, **{name: getattr(overlaid.spectrum, name).tolist() for name in _SIDES}}
        for row, overlaid in zip(overlay.rows(), overlay.spectra, strict=True)
    ]
    reference = {
        "frequency_hz": overlay.reference.frequency_hz.tolist(),
        "level_m_s2": overlay.reference.level_m_s2.tolist(),
    }
    return finite(
        {"frequency_hz": overlay.frequency_hz.tolist(), "spectra": rows, "reference": reference}
    )
