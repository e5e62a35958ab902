"""Pages of tuning: ask for settings, and what the search has given."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter, Form, Query
from pydantic import BaseModel, Field
from sqlalchemy import select
from starlette.datastructures import UploadFile
from starlette.requests import Request
from starlette.responses import Response

from ...dataset.rows import stored_materials
from ...schema.campaigns import Campaign
from ...schema.listings import get_campaign_id
from ...schema.session import Store
from ...twin.contact.laws import LAWS
from ...twin.srs.standards import parse_tolerance
from ...twin.srs.target import Target
from ..common.model_registry import models_extra
from ..common.number_format import format_number, percent
from ..common.quantities import display_of
from ..doors.api.tune import Tuning, tune_job
from ..figures.plotly_base import COLOURS, Figure, band, figure, line
from ..jobs.job_kinds.tune import TUNE
from ..operations.faults import FieldError
from ..operations.impacts.figures import paper_lines
from ..operations.impacts.spectra import MOST_BYTES, target_from_upload
from ..operations.tune.verdict import answer_sentence, next_steps, verdict_text
from ..twins.building import PRIOR, check_contact
from ..web.dependencies import Configured, Key, OpenStore, Running, Word
from ..web.jobs import finished_result, followed
from ..web.rendering import page, query

router = APIRouter()


class TypedTarget(BaseModel):
    """What stands in the form before it is sent."""

    text: str = Field(max_length=MOST_BYTES)
    tolerance: Word = ""


def target_figure(target: Target) -> Figure:
    """A prescribed spectrum with its tolerance on four-coordinate paper: pseudo-velocity over
    frequency, with lines of constant acceleration in g and of constant displacement. A side without
    a limit reaches the edge of the paper."""
    lines = np.union1d(
        np.geomspace(target.frequency_hz[0], target.frequency_hz[-1], 200), target.frequency_hz
    )
    dense, display = (
        target.at(lines.clip(target.frequency_hz[0], target.frequency_hz[-1])),
        display_of("level_m_s2"),
    )
    velocity = dense.level_m_s2 / (2 * np.pi * lines)
    edges = [
        velocity * 10 ** (side.clip(-200, 200) / 20) for side in (-dense.lower_db, dense.upper_db)
    ]
    shown = [
        edge[np.isfinite(side)]
        for edge, side in zip(edges, (dense.lower_db, dense.upper_db), strict=True)
    ]
    finite_edges = np.concatenate([velocity, *shown])
    low, high = (
        10 ** np.floor(np.log10(finite_edges.min())),
        10 ** np.ceil(np.log10(finite_edges.max())),
    )
    paper, words = paper_lines(float(lines[0]), float(lines[-1]), float(low), float(high))
    levels = [f"{format_number(hz)} Hz: {format_number(level * display.scale, 3)} {display.unit}"
              for hz, level in zip(lines, dense.level_m_s2, strict=True)]  # fmt: skip
    prescribed = line(lines, velocity, "prescribed", "c0", text=levels, hoverinfo="text")
    traces = [*paper, *band(lines, edges[0], edges[1], "tolerance", "c7"), prescribed]
    chart = figure(
        traces,
        "natural frequency (Hz)",
        "pseudo-velocity (m/s)",
        log_x=True,
        log_y=True,
        annotations=words,
    )
    chart["layout"]["yaxis"]["range"] = [float(np.log10(low)), float(np.log10(high))]
    return chart


def target_sentence(target: Target) -> str:
    """`The specification reaches from 100 to 10000 Hz and from 30 to 300 g, with a tolerance of
    +6/−6 dB.`"""
    display = display_of("level_m_s2")
    ends = [format_number(end) for end in (target.frequency_hz[0], target.frequency_hz[-1])]
    levels = [
        format_number(end * display.scale, 3)
        for end in (target.level_m_s2.min(), target.level_m_s2.max())
    ]
    sides = list(
        dict.fromkeys(zip(target.upper_db.tolist(), target.lower_db.tolist(), strict=True))
    )
    tolerances = " and ".join(
        f"{_side('+', upper)}/{_side('−', lower)} dB" for upper, lower in sides[:3]
    )
    more = " and others" if len(sides) > 3 else ""
    return (
        f"The specification reaches from {ends[0]} to {ends[1]} Hz and from {levels[0]} to "
        f"{levels[1]} {display.unit}, with a tolerance of {tolerances}{more}."
    )


def _side(sign: str, value: float) -> str:
    return f"{sign}{format_number(value, 3)}" if np.isfinite(value) else "no limit"


def tuned_figure(tuning: Mapping[str, Any]) -> Figure:
    """The first proposals in the tolerance of what is prescribed (`tuning.tune_job`'s result)."""
    lines, display = tuning["frequency_hz"], display_of("level_m_s2")
    shown = {
        key: display.scale * np.asarray(tuning[key])
        for key in ("lower_m_s2", "upper_m_s2", "prescribed_m_s2")
    }
    traces = band(lines, shown["lower_m_s2"], shown["upper_m_s2"], "tolerance", "c7")
    traces.append(line(lines, shown["prescribed_m_s2"], "prescribed", "quiet", dash="dash"))
    for i, proposal in enumerate(tuning["proposals"][:3]):
        name = f"proposal {proposal['rank']}: {percent(proposal['probability_within'])}"
        low, high, expected = (
            display.scale * np.asarray(proposal[key])
            for key in ("lower_m_s2", "upper_m_s2", "expected_m_s2")
        )
        if i == 0:
            traces += band(lines, low, high, "90 % of the first", COLOURS[i])
        traces.append(line(lines, expected, name, COLOURS[i], dash="solid" if i == 0 else "dot"))
    return figure(
        traces, "natural frequency (Hz)", f"maximax SRS ({display.unit})", log_x=True, log_y=True
    )


def _check(
    store: Store, field: str, text: str, tolerance: str, names: list[str], campaign: str, plate: str
) -> None:
    """Raises `FieldError` at the field that cannot be used: the search would end without a
    result."""
    if not text.strip():
        raise FieldError(
            field, "There is no specification. Choose its CSV file, or paste its table."
        )
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
        if plate and plate.lower() not in (materials := stored_materials(session)):
            names_of = ", ".join(
                sorted({material.name for material in materials.values()}, key=str.lower)
            )
            raise FieldError("plate", f"There is no material {plate!r}; there are: {names_of}")
        for control, name in (*(("measured", name) for name in names), ("campaign", campaign)):
            try:
                if name:
                    get_campaign_id(session, name)
            except LookupError as error:
                raise FieldError(control, f"{control}: {error}") from error


@router.get("/tune")
def form(
    request: Request,
    store: OpenStore,
    campaign: Word = "",
    contact: Word = "",
    plate: Word = "",
    tolerance: Word = "",
    measured: Annotated[str, Query(max_length=1000)] = "",
    at_least: Word = "0.5",
    share: Word = "1",
    text: Annotated[str, Query(max_length=MOST_BYTES)] = "",
) -> Response:
    """The form, with the values of the address in its fields."""
    with store.reading() as session:
        newest_first = (
            select(Campaign.name)
            .where(Campaign.kind == "gun")
            .order_by(Campaign.date.desc(), Campaign.name)
        )
        benches = list(session.scalars(newest_first.limit(500)))
        plates = sorted(
            {material.name for material in stored_materials(session).values()}, key=str.lower
        )
    return page(
        request,
        "tune.html",
        benches=benches,
        plates=plates,
        contacts=list(dict.fromkeys([PRIOR, *LAWS, *([contact] if contact else [])])),
        campaign=campaign,
        contact=contact,
        plate=plate,
        tolerance=tolerance,
        measured=measured,
        at_least=at_least,
        share=share,
        text=text,
    )


@router.post("/tune/target")
def typed_target(typed: TypedTarget) -> dict[str, Any]:
    """The chart of a specification and its sentence, while it is typed. Raises `ValueError` as
    `target_from_upload`."""
    target = target_from_upload(typed.text, "the specification", typed.tolerance.strip() or None)
    return {"figure": target_figure(target), "sentence": target_sentence(target)}


@router.post("/tune")
async def tune(
    request: Request,
    store: OpenStore,
    running: Running,
    settings: Configured,
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
        text, field = (
            (await sent.read(MOST_BYTES + 1)).decode("utf-8-sig", "replace"),
            "specification",
        )
    names = [name for name in (text.strip() for text in measured.split(",")) if name]
    _check(store, field, text, tolerance.strip(), names, campaign, plate)
    if contact:
        try:
            with models_extra():
                check_contact(settings.db, contact)
        except LookupError as error:
            raise FieldError("contact", str(error)) from error
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
        answer=answer_sentence(data),
        verdict=verdict_text(data),
        steps=next_steps(data),
        links=links,
        figure=tuned_figure(data) if data["proposals"] else None,
    )


_SETTINGS = ("tank_pressure_pa", "bullet_mass_kg", "tip_material", "tip_radius_m", "anvil_material",
"insulator",
             "impact_position")  # fmt: skip
