"""Pages of tuning: ask for settings, and what the search has given."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter, Form
from starlette.datastructures import UploadFile
from starlette.requests import Request
from starlette.responses import Response

from ..impacts.spectra import MOST_BYTES
from ..web.dependencies import Key, OpenStore, Running
from ..web.figures_base import COLOURS, Figure, band, figure, line
from ..web.jobs_pages import finished_result, followed
from ..web.rendering import page, query
from .api import Tuning, tune_job
from .job import TUNE

router = APIRouter()


def tuned_figure(tuning: Mapping[str, Any]) -> Figure:
    """The first proposals in the tolerance of what is prescribed (`tuning.tune_job`'s result)."""
    lines = tuning["frequency_hz"]
    low, high = (np.asarray(tuning[key]) for key in ("lower_m_s2", "upper_m_s2"))
    traces = band(lines, low, high, "tolerance", "c7")
    traces.append(line(lines, tuning["prescribed_m_s2"], "prescribed", "quiet", dash="dash"))
    for i, proposal in enumerate(tuning["proposals"][:3]):
        name = f"proposal {proposal['rank']}: {proposal['probability_within']:.0%}"
        if i == 0:
            traces += band(lines, proposal["lower_m_s2"], proposal["upper_m_s2"], "90 % of the first", COLOURS[i])
        traces.append(line(lines, proposal["expected_m_s2"], name, COLOURS[i], dash="solid" if i == 0 else "dot"))
    return figure(traces, "frequency (Hz)", "maximax (m/s²)", log_x=True, log_y=True)


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
    sent = form.get("specification")
    if isinstance(sent, UploadFile) and sent.filename:
        text = (await sent.read(MOST_BYTES + 1)).decode("utf-8-sig", "replace")
    if not text.strip():
        raise ValueError("no specification; choose its CSV, or paste it")
    names = [name for name in (text.strip() for text in measured.split(",")) if name]
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
        request, "tuned.html", found=data, links=links, figure=tuned_figure(data) if data["proposals"] else None
    )


_SETTINGS = ("tank_pressure_pa", "bullet_mass_kg", "tip_material", "tip_radius_m", "anvil_material", "insulator",
             "impact_position")  # fmt: skip
