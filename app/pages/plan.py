"""Plans: made, judged with charts of their balance and coverage, printed, and ticked off at the
bench."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Depends, HTTPException, Query
from starlette.requests import Request
from starlette.responses import Response

from ...doe.designs.methods import METHODS
from ...doe.factors import DesignFactor
from ...doe.plans import StoredPlan, list_plans, read_plan
from ...doe.sheet import boxes, sheet_of, write_sheet
from ...doe.space import shipped_factors, space_from_text
from ...files.spreadsheet_guard import guarding
from ..common.plan_tables import run_counts
from ..common.quantities import heading
from ..figures.figure import as_floats
from ..operations.form import controls
from ..operations.plan.figures import balance_figure, correlation_figure, pairs_figure
from ..operations.plan.make import PLAN
from ..operations.plan.quality import plan_page
from ..operations.shot_predictions.predicted_runs import plan_forecasts
from ..web.dependencies import Name, OpenStore
from ..web.page_sources import THE_STORE
from ..web.rendering import named_file, number, page

router = APIRouter()
ShownRun = Annotated[int | None, Query(ge=0, le=2**31 - 1)]
#: A list of plans is cut so; a lab has tens.
_MOST = 500
_FORMATS = {
    "html": "text/html; charset=utf-8",
    "csv": "text/csv; charset=utf-8",
    "xlsx": "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet",
}


@router.get("/plans", dependencies=[Depends(THE_STORE)])
def plans(request: Request, store: OpenStore) -> Response:
    with store.reading() as session:
        rows = list_plans(session)
    return page(request, "plans.html", rows=rows[:_MOST], left_out=max(0, len(rows) - _MOST))


#: The factors have a place of their own above the form.
_CONTROLS = {name for request in PLAN.variants for name in request.model_fields} - {
    "kind",
    "factors",
    "gun",
}


@router.get("/plans/new")
def new(request: Request, kind: Literal["gun", "hammer"] = "gun") -> Response:
    factors = shipped_factors(kind)
    return page(
        request,
        "plan_new.html",
        kind=kind,
        factors=factors,
        factor_rows=[_factor_row(factor) for factor in space_from_text(factors).factors],
        methods=METHODS,
        controls=controls(PLAN, names=_CONTROLS),
    )


def _factor_row(factor: DesignFactor) -> dict[str, Any]:
    effort = "easy" if factor.change == 0 else "heavy: changed seldom"
    levels = factor.level_text
    if factor.values is not None:
        pairs = zip(factor.levels, factor.values, strict=True)
        levels = ", ".join(f"{level} ({value:g} {factor.unit})" for level, value in pairs)
    return {"factor": heading(factor.column), "levels": levels, "change": effort}


@router.get("/plans/{name}", dependencies=[Depends(THE_STORE)])
def plan(request: Request, name: Name, store: OpenStore) -> Response:
    with store.reading() as session:
        plan = read_plan(session, name)
    judged = plan_page(plan)
    predictions = plan_forecasts(store, name)
    shares = {
        factor: f"{row['share']:.2f}"
        for row in judged["time"]
        for factor in [*row["axis"].split("+")]
    }
    return page(
        request,
        "plan.html",
        plan=plan,
        judged=judged,
        sheet=sheet_of(plan),
        predictions=predictions,
        band_figures=predictions.plots(),
        counts_open=any(run.state == "planned" for run in plan.runs),
        figures=[_figure_row(row) for row in judged["figures"]],
        power=[_power_row(term) for term in judged["power"]],
        changes=[
            {
                "factor": row["factor"].replace("_", " "),
                "changes": row["changes"],
                "work": row["work"],
            }
            | {"share of variance with time": shares.get(row["factor"], "")}
            for row in judged["changes"]
        ],
        pairs=pairs_figure(judged["pair_labels"], as_floats(judged["pairs"]))
        if judged["pairs"]
        else None,
        correlations=correlation_figure(judged["terms"], as_floats(judged["correlations"]))
        if judged["terms"]
        else None,
        balance={axis["axis"]: balance_figure(axis) for axis in judged["levels"]},
    )


def _figure_row(row: Mapping[str, Any]) -> dict[str, Any]:
    """A figure of `quality.plan_page`, with what is better where no bound says so."""
    direction = (
        "" if row["best_possible"] or row["better"] == "neither" else f", {row['better']} is better"
    )
    return {
        "figure": f"{row['words']}{direction}",
        "this plan": row["text"],
        "best possible": row["best_possible"],
        "random plan": row["random_plan"],
    }


def _power_row(term: Mapping[str, Any]) -> dict[str, Any]:
    """A main effect of `quality.plan_page`; what cannot be estimated has neither a size nor an
    inflation."""
    return {
        "factor": term["term"].replace("_", " ").replace("+", " and "),
        "levels": term["levels"],
        "power": f"{100 * term['power']:.0f} %",
        "seen with 80 %": "none"
        if term["smallest_effect"] is None
        else number(term["smallest_effect"], 2),
        "variance inflation": "infinite"
        if term["variance_inflation"] is None
        else number(term["variance_inflation"], 3),
    }


@router.get("/plans/{name}/sheet", dependencies=[Depends(THE_STORE)])
def sheet(request: Request, name: Name, store: OpenStore, run: ShownRun = None) -> Response:
    """The run sheet at the bench: one run large, which is the next one unless another is named; the
    others small."""
    with store.reading() as session:
        plan = read_plan(session, name)
    numbers = [planned.run for planned in plan.runs]
    if run is not None and run not in numbers:
        raise HTTPException(404, f"plan {name!r} has no run {run}")
    following = next((planned.run for planned in plan.runs if planned.status == "planned"), None)
    wanted = next(
        (number for number in (run, following, *numbers[-1:]) if number is not None), None
    )
    place = None if wanted is None else numbers.index(wanted)
    sheet = sheet_of(plan)
    rows = list(zip(plan.runs, sheet.rows, strict=True))
    return page(
        request,
        "sheet.html",
        plan=plan,
        sheet=sheet,
        rows=rows,
        boxes=boxes,
        counts=run_counts(plan),
        following=following,
        shown=None if place is None else rows[place],
        before_run=_run_before(plan, place),
        earlier=numbers[place - 1] if place else None,
        later=numbers[place + 1] if place is not None and place + 1 < len(numbers) else None,
    )


def _run_before(plan: StoredPlan, place: int | None) -> int | None:
    """The run that the bench is still set up for: the one before that is not discarded."""
    before = [run.run for run in plan.runs[:place] if run.status != "discarded"]
    return before[-1] if before else None


@router.get("/plans/{name}/sheet.{ending}")
def sheet_file(
    name: Name, ending: str, store: OpenStore, spreadsheet_guard: bool = True
) -> Response:
    """The sheet as a file; in CSV, texts that begin with = + - @ get an apostrophe unless
    `spreadsheet_guard=false`."""
    if ending not in _FORMATS:
        raise HTTPException(404, f"no sheet of format {ending!r}; known: {', '.join(_FORMATS)}")
    with store.reading() as session:
        plan = read_plan(session, name)
    with tempfile.TemporaryDirectory(prefix="pyroshock-sheet-") as scratch:
        path = Path(scratch) / f"sheet.{ending}"
        with guarding(spreadsheet_guard):
            write_sheet(plan, path)
        return named_file(path.read_bytes(), plan.name, ending, _FORMATS[ending])
