"""Explore the store: any quantity against any other, the rows of a rectangle below it, and views by
name."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from fastapi import APIRouter, Depends
from starlette.requests import Request as HttpRequest
from starlette.responses import Response

from ...schema.conditions import ConditionError, list_campaign_names
from ..common.quantities import display_of, velocities_of
from ..doors.json_route import read_pairs
from ..operations.explore.explore import EXPLORE, with_view
from ..operations.explore.request import Exploration, ends_of
from ..operations.explore.result import Explored
from ..operations.explore.rows import QuantityChoice, list_quantities
from ..operations.explore.saved_views import get_view, list_view_rows
from ..operations.explore.selection import conditions_of_selection, is_listed
from ..operations.explore.views import view_address, view_row
from ..operations.faults import RequestError
from ..operations.form import texts_of
from ..operations.laboratory import Laboratory
from ..web.dependencies import InLaboratory, Name
from ..web.forms import status_of_fault
from ..web.page_sources import STORE_AND_MODELS
from ..web.rendering import page, query

router = APIRouter()
#: Impacts whose spectra are opened together.
_MOST_SPECTRA = 40
_SUBJECTS = {
    "impacts": "impacts",
    "shots": "shots of the gun",
    "channels": "records of acceleration channels",
    "models": "versions of models",
}
_KINDS = {
    "scatter": "scatter",
    "distribution": "distribution",
    "levels": "levels of a factor",
    "control": "control chart",
}
#: The axes that each kind of chart asks for.
_AXES = {
    "scatter": ("x", "y", "colour"),
    "distribution": ("x", "colour"),
    "levels": ("x", "y", "colour"),
    "control": ("y", "colour"),
}
_LABELS = {"x": "Along x", "y": "Along y", "colour": "Colour by"}


@router.get("/explore", dependencies=[Depends(STORE_AND_MODELS)])
def explore(request: HttpRequest, laboratory: InLaboratory) -> Response:
    exploration, explored, faults, status = _answer(request, laboratory)
    choices = list_quantities(laboratory, exploration.subject)
    with laboratory.store.reading() as session:
        campaigns = list_campaign_names(session)
        views = [view_row(view) for view in list_view_rows(session)]
        deleted = [view_row(view) for view in list_view_rows(session, deleted=True)]
    with velocities_of([]):
        return page(
            request,
            "explore.html",
            status,
            exploration=exploration,
            explored=explored,
            faults=faults,
            subjects=_SUBJECTS,
            kinds=_KINDS,
            axes=_axes(exploration, explored, choices),
            campaigns=campaigns,
            shown=texts_of(exploration.model_copy(update={"view": None})),
            address=_address(exploration),
            scales=_scales(explored),
            views=[view | {"address": view_address(view["name"])} for view in views],
            deleted=deleted,
            open_view=exploration.view,
            **_selection(exploration, explored),
        )


@router.get("/explore/selection", dependencies=[Depends(STORE_AND_MODELS)])
def selection(request: HttpRequest, laboratory: InLaboratory) -> Response:
    """The selected rows alone, which the script of the page puts below its chart."""
    exploration = with_view(read_pairs(Exploration, request.query_params.multi_items()), laboratory)
    explored = EXPLORE.answer(exploration, laboratory, lambda *_: None)
    values = _selection(exploration, explored)
    return page(
        request, "explore_selection.html", exploration=exploration, explored=explored, **values
    )


@router.get("/explore/views/{name}/delete")
def ask_deletion(request: HttpRequest, name: Name, laboratory: InLaboratory) -> Response:
    """What would be deleted, and what stays."""
    with laboratory.store.reading() as session:
        view = view_row(get_view(session, name, "name"))
    saved = f"saved {view['saved_at'][:10]}"
    return page(
        request,
        "delete.html",
        what=f"the view {name}",
        users={},
        lost=[f"The name and the question: {view['shows']} ({saved})."],
        kept=["All stored rows.", "The deleted view, which the page Explore can restore."],
        address=f"/explore/views/{request.path_params['name']}",
    )


def _answer(
    request: HttpRequest, laboratory: Laboratory
) -> tuple[Exploration, Explored | None, dict[str, str], int]:
    """What is exploration, the answer, what is wrong by field, and the status of HTTP."""
    exploration = Exploration()
    try:
        exploration = _without_empty(request)
        exploration = with_view(exploration, laboratory)
        return exploration, EXPLORE.answer(exploration, laboratory, lambda *_: None), {}, 200
    except RequestError as error:
        return exploration, None, {fault.field: fault.message for fault in error.faults}, 422
    except (ValueError, LookupError) as error:
        field = "where" if isinstance(error, ConditionError) else getattr(error, "field", "")
        return exploration, None, {field or "where": str(error)}, status_of_fault(error)


def _without_empty(request: HttpRequest) -> Exploration:
    """The request of the address; a control that was left empty is none."""
    pairs = [(name, text) for name, text in request.query_params.multi_items() if text.strip()]
    return read_pairs(Exploration, pairs)


def _address(exploration: Exploration, **changes: Any) -> str:
    """The page with the fields of a request that are not the default."""
    fields = exploration.model_copy(update={"view": None, **changes})
    stated = texts_of(fields).keys()
    values = {
        name: list(value) if isinstance(value, tuple) else value
        for name, value in fields.model_dump(mode="json").items()
        if name in stated and value is not None
    }
    return "/explore" + query(
        {name: "true" if value is True else value for name, value in values.items()}
    )


def _axes(
    exploration: Exploration, explored: Explored | None, choices: Sequence[QuantityChoice]
) -> list[dict[str, Any]]:
    """A menu for each axis of the chart, with the quantity that it has now."""
    now = {
        "x": explored.data.x.key if explored else exploration.x,
        "y": explored.data.y.key if explored and explored.data.y else exploration.y,
        "colour": exploration.colour,
    }
    if explored and explored.data.colour:
        now["colour"] = explored.data.colour.key
    groups: dict[str, list[QuantityChoice]] = {}
    for choice in choices:
        groups.setdefault(choice.group, []).append(choice)
    return [
        {"name": name, "label": _LABELS[name], "now": now[name], "groups": groups}
        for name in _AXES[exploration.kind]
    ]


def _scales(explored: Explored | None) -> dict[str, float]:
    """Shown value = scale times the value in SI, of both axes; places have no unit."""
    if explored is None:
        return {"x": 1.0, "y": 1.0}
    data = explored.data
    in_units = data.kind in ("scatter", "distribution")
    return {
        "x": data.x.scale if in_units else 1.0,
        "y": 1.0 if data.y is None else data.y.scale,
    }


def _selection(exploration: Exploration, explored: Explored | None) -> dict[str, Any]:
    """What the table of selected rows and the links below it need."""
    if explored is None or not exploration.has_selection:
        return {"selected": None}
    conditions = conditions_of_selection(explored)
    impacts = explored.selected_impacts(_MOST_SPECTRA)
    rows = explored.selected_rows()
    narrowed = [*exploration.where, *conditions] if conditions is not None else None
    pulses = ""
    if narrowed is not None and is_listed(explored):
        pulses = "/compare" + query({"campaign": exploration.campaign or "*", "where": narrowed})
    return {
        "selected": len(explored.selected),
        "rows": rows,
        "addresses": [explored.rows.address(row) for row in explored.listed],
        "spectra": "/compare/spectra" + query({"impacts": ",".join(map(str, impacts))})
        if impacts
        else "",
        "spectra_count": len(impacts),
        "pulses": pulses,
        "narrowed": ""
        if narrowed is None
        else _address(exploration, where=tuple(narrowed), select_x=None, select_y=None),
        "cleared": _address(exploration, select_x=None, select_y=None),
        "words": _selection_words(exploration, explored),
    }


def _selection_words(exploration: Exploration, explored: Explored) -> str:
    """The selection in shown units: `contact time 0.2 to 0.4 ms`."""
    data = explored.data
    parts = []
    for text, column, is_place in (
        (exploration.select_x, data.x, data.kind in ("levels", "control")),
        (exploration.select_y, data.y, False),
    ):
        if text is None or column is None:
            continue
        low, high = ends_of(text)
        display = display_of(column.key)
        scale, unit = (1.0, "") if is_place else (display.scale, display.unit)
        parts.append(f"{display.label} {low * scale:.4g} to {high * scale:.4g} {unit}".rstrip())
    return ", ".join(parts)
