"""Pages of tuning: ask for settings, and what the search has given."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from fastapi import APIRouter, Depends
from pydantic import BaseModel, Field
from sqlalchemy import select
from starlette.requests import Request
from starlette.responses import Response

from ...dataset.rows import stored_materials
from ...schema.campaigns import Campaign
from ..figures.page_renderer import figure_data
from ..operations.form import controls
from ..operations.impacts.spectra import MOST_BYTES, target_from_upload
from ..operations.sentence import REACHES
from ..operations.tune.figures import choices_figure, target_figure, tuned_figure
from ..operations.tune.target_words import TOLERANCE, AddressedTarget, target_sentence
from ..operations.tune.tuning import TUNE
from ..operations.tune.verdict import (
    answer_sentences,
    best_sentences,
    choice_sentences,
    next_steps,
    setting_words,
    tuning_tables,
)
from ..twins.contact_names import list_contact_names
from ..web.dependencies import Key, OpenStore, Running, Word
from ..web.jobs import finished_result
from ..web.rendering import page, query
from ..web.role_needs import role_of

router = APIRouter()


class TypedTarget(BaseModel):
    """What stands in the form before it is sent."""

    text: str = Field(max_length=MOST_BYTES)
    tolerance: Word = ""


@router.get("/tune")
def form(request: Request, store: OpenStore) -> Response:
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
        contacts = list_contact_names(session)
    values = {name: text[:MOST_BYTES] for name, text in request.query_params.items()}
    return page(
        request,
        "tune.html",
        benches=benches,
        target=values.get("target", values.get("text", "")),
        controls={
            control.name: control
            for control in controls(
                TUNE,
                values,
                suggestions={"measured": benches},
                choices={
                    "campaign": ["", *benches],
                    "plate": ["", *plates],
                    "contact": ["", *contacts],
                },
            )
        },
    )


@router.post("/tune/target", dependencies=[Depends(role_of(TUNE))])
def typed_target(typed: TypedTarget) -> dict[str, Any]:
    """The chart of a specification and its sentence, while it is typed. Raises `ValueError` as
    `target_from_upload`."""
    target = target_from_upload(typed.text, "the specification", typed.tolerance.strip() or None)
    return {"figure": figure_data(target_figure(target)), "sentence": target_sentence(target)}


@router.get("/tune/{job}")
def tuned(request: Request, job: Key, running: Running) -> Response:
    data = finished_result(running, job, TUNE.name, "tuning")
    twin = {key: value for key, value in data["twin"].items() if value}
    asked_form = running.form_of(job)[0]
    sent = {} if asked_form is None else dict(asked_form.fields)
    texts = {name: str(sent.get(name) or "") for name in ("target", TOLERANCE)}
    twin |= AddressedTarget(texts["target"], texts[TOLERANCE]).fields
    links = [
        "/twin" + query({**twin, **{name: proposal["settings"][name] for name in _SETTINGS}})
        for proposal in data["proposals"]
    ]
    answers = answer_sentences(data)
    return page(
        request,
        "tuned.html",
        found=data,
        answer=" ".join(map(str, answers)),
        verdict=" ".join(map(str, best_sentences(data))),
        met=bool(answers) and answers[0].rule is REACHES,
        tables=[
            replace(table, rows=_with_alternatives(table.rows, data))
            if "rank" in table.rows[0]
            else table
            for table in tuning_tables(data)
        ],
        steps=next_steps(data),
        links=links,
        choices=list(map(str, choice_sentences(data))),
        figure=tuned_figure(data) if data["proposals"] else None,
        chosen=choices_figure(data) if data["proposals"] else None,
    )


def _with_alternatives(
    rows: Sequence[Mapping[str, Any]], data: Mapping[str, Any]
) -> list[dict[str, Any]]:
    """The proposals with where they lie outside of the model, and what serves as well."""
    return [
        {
            **row,
            "outside of the model's range": "; ".join(proposal["outside_domain"]),
            "alternatives": "; ".join(
                setting_words(settings)[0] for settings in proposal["alternatives"]
            ),
        }
        for row, proposal in zip(rows, data["proposals"], strict=True)
    ]


_SETTINGS = ("tank_pressure_pa", "bullet_mass_kg", "tip_material", "tip_radius_m", "anvil_material",
"insulator",
             "impact_position")  # fmt: skip
