"""Shock response spectra of an uploaded time series, and of stored impacts."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter, Query
from pydantic import BaseModel, Field

from ....signals.srs.spectrum import shock_response_spectrum
from ...finite import finite
from ...spectra.overlays import spectrum_overlay
from ...spectra.targets import target_from_upload
from ..dependencies import OpenStore

router = APIRouter(tags=["spectra"])
_SIDES = ("maximax", "positive", "negative", "primary", "residual", "pseudo_velocity_m_s")
Number = Annotated[float, Field(ge=-1e12, le=1e12)]


class AccelerationSeries(BaseModel):
    """An acceleration in m/s2 at a constant rate."""

    acceleration_m_s2: Annotated[list[Number], Field(min_length=2, max_length=50_000)]
    sampling_rate_hz: Annotated[float, Field(ge=1e-3, le=1e9)]
    frequency_hz: Annotated[list[Annotated[float, Field(ge=1e-6, le=1e9)]], Field(min_length=1, max_length=1000)]
    q: Annotated[float, Field(gt=0.5, le=1000)] = 10.0


@router.post("/srs")
def srs(series: AccelerationSeries) -> Any:
    """The spectrum of a series, in the form of `pyroshock srs --json` without its checks."""
    record = np.asarray(series.acceleration_m_s2, dtype=np.float64)
    lines = np.asarray(series.frequency_hz, dtype=np.float64)
    spectrum = shock_response_spectrum(record, series.sampling_rate_hz, lines, q=series.q)
    sides = {name: getattr(spectrum, name).tolist() for name in _SIDES}
    return finite({"unit": "m/s2", "frequency_hz": lines.tolist(), **sides})


@router.get("/spectra")
def spectra(
    store: OpenStore,
    impact: Annotated[list[Annotated[int, Field(ge=1, le=2**31 - 1)]], Query(min_length=1, max_length=50)],
    channel: str | None = None,
    q: Annotated[float, Query(gt=0.5, le=1000)] = 10.0,
    specification: Annotated[str, Query(max_length=20_000)] = "",
    tolerance: Annotated[str, Query(max_length=100)] = "",
) -> Any:
    """Spectra of stored impacts, held against a specification (text of its CSV), else their mean."""
    wanted = target_from_upload(specification, "specification", tolerance or None) if specification else None
    with store.reading() as session:
        overlay = spectrum_overlay(session, impact, channel, q=q, specification=wanted)
    rows = [
        {
            "impact": overlaid.impact,
            "channel": overlaid.channel,
            **{name: getattr(overlaid.spectrum, name).tolist() for name in _SIDES},
            "share_within": float(overlay.comparison.share_within[i]),
            "worst_margin_db": float(overlay.comparison.worst_margin_db[i]),
            "worst_frequency_hz": float(overlay.comparison.worst_frequency_hz[i]),
        }
        for i, overlaid in enumerate(overlay.spectra)
    ]
    reference = {
        "frequency_hz": overlay.reference.frequency_hz.tolist(),
        "level_m_s2": overlay.reference.level_m_s2.tolist(),
    }
    return finite({"frequency_hz": overlay.frequency_hz.tolist(), "spectra": rows, "reference": reference})
