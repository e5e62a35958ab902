"""Pages of tuning: ask for settings, and what the search has given."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter, Form
from starlette.datastructures import UploadFile
from starlette.requests import Request
from starlette.responses import Response

from ...schema.listings import get_campaign_id
from ...schema.session import Store
from ...twin.srs.target import parse_tolerance
from ..common.quantities import display_of
from ..impacts.spectra import MOST_BYTES, target_from_upload
from ..web.dependencies import Key, OpenStore, Running
from ..web.figures_base import COLOURS, Figure, band, figure, line
from ..web.forms import FieldError
from ..web.jobs_pages import finished_result, followed
from ..web.rendering import page, query
from .api import Tuning, tune_job
from .job import TUNE
from .verdict import next_steps, verdict_text

router = APIRouter()


def tuned_figure(tuning: Mapping[str, Any]) -> Figure:
    """The first proposals in the tolerance of what is prescribed (`tuning.tune_job`'s result)."""
    lines, display = tuning["frequency_hz"], display_of("level_m_s2")
    shown = {key: display.scale * np.asarray(tuning[key]) for key in ("lower_m_s2", "upper_m_s2", "prescribed_m_s2")}
    traces = band(lines, shown["lower_m_s2"], shown["upper_m_s2"], "tolerance", "c7")
    traces.append(line(lines, shown["prescribed_m_s2"], "prescribed", "quiet", dash="dash"))
    for i, proposal in enumerate(tuning["proposals"][:3]):
        name = f"proposal {proposal['rank']}: {proposal['probability_within']:.0%}"
        low, high, expected = (
            display.scale * np.asarray(proposal[key]) for key in ("lower_m_s2", "upper_m_s2", "expected_m_s2")
        )
        if i == 0:
            traces += band(lines, low, high, "90 % of the first", COLOURS[i])
        traces.append(line(lines, expected, name, COLOURS[i], dash="solid" if i == 0 else "dot"))
    return figure(traces, "natural frequency (Hz)", f"maximax SRS ({display.unit})", log_x=True, log_y=True)


def _check(store: Store, field: str, text: str, tolerance: str, names: list[str], campaign: str) -> None:
    """Raises `FieldError` at the field that cannot be used: the search would end without a result."""
    if not text.strip():
        raise FieldError(field, "There is no specification. Choose its CSV file, or paste its table.")
    try:
        if tolerance:
            parse_tolerance(tolerance)
    except ValueError as error:
        raise FieldError("tolerance", str(error)) from error
    try:
        target_from_upload(text, "the specification", tolerance or None)
    except ValueError as error:
        raise FieldError(field, str(error)) from error
    with store.reading() as session:
        for control, name in (*(("measured", name) for name in names), ("campaign", campaign)):
            try:
                if name:
                    get_campaign_id(session, name)
            except LookupError as error:
                raise FieldError(control, f"{control}: {error}") from error


@router.post("/tune")
async def tune(
    request: Request,
    store: OpenStore,
    running: Running,
    campaign: Annotated[str, Form(max_length=200)] = "",
    contact: Annotated[str, Form(max_length=200)] = "",
    plate: Annotated[str, Form(max_length=200)] = "",
    tolerance: Annotated[str, Form(max_length=200)] = "",
    measured: Annotated[str, Form(max_length=1000)] = "",
    at_least: Annotated[float, Form(gt=0, le=1)] = 0.5,
    share: Annotated[float, Form(gt=0, le=1)] = 1.0,
    text: Annotated[str, Form(max_length=MOST_BYTES)] = "",
) -> Response:
    form = await request.form()
    sent, field = form.get("specification"), "text"
    if isinstance(sent, UploadFile) and sent.filename:
        text, field = (await sent.read(MOST_BYTES + 1)).decode("utf-8-sig", "replace"), "specification"
    names = [name for name in (text.strip() for text in measured.split(",")) if name]
    _check(store, field, text, tolerance.strip(), names, campaign)
    tuning = Tuning(
        target=text,
        tolerance=tolerance.strip(),
        campaign=campaign or None,
        contact=contact or None,
        plate=plate or None,
        measured=names,
        at_least=at_least,
        share=share,
    )
    return followed(tune_job(running, store, tuning))


@router.get("/tune/{job}")
def tuned(request: Request, job: Key, running: Running) -> Response:
    data = finished_result(running, job, TUNE.name, "tuning")
    twin = {key: value for key, value in data["twin"].items() if value}
    links = [
        "/twin" + query({**twin, **{name: proposal["settings"][name] for name in _SETTINGS}})
        for proposal in data["proposals"]
    ]
    return page(
        request,
        "tuned.html",
        found=data,
        verdict=verdict_text(data),
        steps=next_steps(data),
        links=links,
        figure=tuned_figure(data) if data["proposals"] else None,
    )


_SETTINGS = ("tank_pressure_pa", "bullet_mass_kg", "tip_material", "tip_radius_m", "anvil_material", "insulator",
             "impact_position")  # fmt: skip
