"""Pages of tuning: ask for settings, and what the search has given."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from fastapi import APIRouter
from pydantic import BaseModel, Field
from sqlalchemy import select
from starlette.requests import Request
from starlette.responses import Response

from ...dataset.rows import stored_materials
from ...schema.campaigns import Campaign
from ...twin.contact.laws import LAWS
from ...twin.srs.target import Target
from ..common.number_format import format_number, percent
from ..common.quantities import display_of
from ..figures.plotly_base import COLOURS, Figure, band, figure, line
from ..operations.form import controls
from ..operations.impacts.figures import paper_lines
from ..operations.impacts.spectra import MOST_BYTES, target_from_upload
from ..operations.sentence import REACHES
from ..operations.tune.tuning import TUNE
from ..operations.tune.verdict import (
    answer_sentences,
    best_sentences,
    drawn_share,
    next_steps,
    proposal_row,
)
from ..twins.building import PRIOR
from ..web.dependencies import Key, OpenStore, Running, Word
from ..web.jobs import finished_result
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
    """The first proposals in the tolerance of what is prescribed (`TunedSettings.job_data`)."""
    lines, display = tuning["frequency_hz"], display_of("level_m_s2")
    shown = {
        key: display.scale * np.asarray(tuning[key])
        for key in ("lower_m_s2", "upper_m_s2", "prescribed_m_s2")
    }
    traces = band(lines, shown["lower_m_s2"], shown["upper_m_s2"], "tolerance", "c7")
    traces.append(line(lines, shown["prescribed_m_s2"], "prescribed", "quiet", dash="dash"))
    for i, proposal in enumerate(tuning["proposals"][:3]):
        likely = percent(drawn_share(proposal["probability_within"]))
        name = f"proposal {proposal['rank']}: {likely}"
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
    values = {name: text[:MOST_BYTES] for name, text in request.query_params.items()}
    suggestions = {
        "campaign": benches,
        "measured": benches,
        "plate": plates,
        "contact": [PRIOR, *LAWS],
    }
    return page(
        request,
        "tune.html",
        benches=benches,
        target=values.get("target", values.get("text", "")),
        controls={
            control.name: control for control in controls(TUNE, values, suggestions=suggestions)
        },
    )


@router.post("/tune/target")
def typed_target(typed: TypedTarget) -> dict[str, Any]:
    """The chart of a specification and its sentence, while it is typed. Raises `ValueError` as
    `target_from_upload`."""
    target = target_from_upload(typed.text, "the specification", typed.tolerance.strip() or None)
    return {"figure": target_figure(target), "sentence": target_sentence(target)}


@router.get("/tune/{job}")
def tuned(request: Request, job: Key, running: Running) -> Response:
    data = finished_result(running, job, TUNE.name, "tuning")
    twin = {key: value for key, value in data["twin"].items() if value}
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
        rows=[proposal_row(row, data) for row in data["proposals"]],
        steps=next_steps(data),
        links=links,
        figure=tuned_figure(data) if data["proposals"] else None,
    )


_SETTINGS = ("tank_pressure_pa", "bullet_mass_kg", "tip_material", "tip_radius_m", "anvil_material",
"insulator",
             "impact_position")  # fmt: skip
