"""Pages of tuning: ask for settings, and what the search has given."""

from __future__ import annotations

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
from ..common.number_format import format_number
from ..common.quantities import display_of
from ..figures.page_renderer import figure_data
from ..impacts.spectra import MOST_BYTES, target_from_upload
from ..twins.building import PRIOR, check_contact
from ..web.dependencies import Configured, Key, OpenStore, Running, Word
from ..web.forms import FieldError
from ..web.jobs_pages import finished_result, followed
from ..web.rendering import page, query
from .api import Tuning, tune_job
from .figures import target_figure, tuned_figure
from .job import TUNE
from .verdict import answer_sentence, next_steps, verdict_text

router = APIRouter()


class TypedTarget(BaseModel):
    """What stands in the form before it is sent."""

    text: str = Field(max_length=MOST_BYTES)
    tolerance: Word = ""


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
        f"The specification reaches from {ends[0]} to {ends[1]} Hz and from "
        f"{levels[0]} to {levels[1]} {display.unit}, "
        f"with a tolerance of {tolerances}{more}."
    )


def _side(sign: str, value: float) -> str:
    return f"{sign}{format_number(value, 3)}" if np.isfinite(value) else "no limit"


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
    return {"figure": figure_data(target_figure(target)), "sentence": target_sentence(target)}


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
