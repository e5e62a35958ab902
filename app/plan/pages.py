"""Plans: made, judged with charts of their balance and coverage, printed, and ticked off at the
bench."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Depends, Form, HTTPException, Query
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response

from ...doe.designs.methods import METHODS, get_method
from ...doe.factors import DesignFactor
from ...doe.order import RunOrder
from ...doe.plans import StoredPlan, list_plans, read_plan, tick_run
from ...doe.sheet import boxes, sheet_of, write_sheet
from ...doe.space import shipped_factors, space_from_text
from ...files.spreadsheet_guard import guarding
from ..common.plan_tables import run_counts
from ..common.quantities import heading
from ..figures.figure import as_floats
from ..web.dependencies import Key, Name, OpenStore, Running
from ..web.forms import FieldError
from ..web.jobs_pages import followed
from ..web.rendering import named_file, number, page, part
from .api import plan_job
from .figures import balance_figure, correlation_figure, pairs_figure
from .job import PlanArguments
from .quality import plan_page

router = APIRouter()
ShownRun = Annotated[int | None, Query(ge=0, le=2**31 - 1)]
#: A list of plans is cut so; a lab has tens.
_MOST = 500
_FORMATS = {
    "html": "text/html; charset=utf-8",
    "csv": "text/csv; charset=utf-8",
    "xlsx": "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet",
}


@router.get("/plans")
def plans(request: Request, store: OpenStore) -> Response:
    with store.reading() as session:
        rows = list_plans(session)
    return page(request, "plans.html", rows=rows[:_MOST], left_out=max(0, len(rows) - _MOST))


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
        with_runs=[name for name, method in METHODS.items() if "runs" in method.takes],
        made_here=[name for name, method in METHODS.items() if "table" not in method.takes],
        with_centre=[name for name, method in METHODS.items() if method.centre_points],
    )


def _factor_row(factor: DesignFactor) -> dict[str, Any]:
    effort = "easy" if factor.change == 0 else "heavy: changed seldom"
    levels = factor.level_text
    if factor.values is not None:
        pairs = zip(factor.levels, factor.values, strict=True)
        levels = ", ".join(f"{level} ({value:g} {factor.unit})" for level, value in pairs)
    return {"factor": heading(factor.column), "levels": levels, "change": effort}


async def _options(request: Request) -> dict[str, str]:
    """What the form says of the method's options: fields such as "lhs.criterion"."""
    form = await request.form()
    prefix = f"{form.get('method', 'lhs')}."
    return {
        name.removeprefix(prefix): str(value)
        for name, value in form.items()
        if name.startswith(prefix) and value
    }


@router.post("/plans")
def make(
    store: OpenStore,
    jobs: Running,
    name: Annotated[str, Form(min_length=1, max_length=200)],
    options: Annotated[dict[str, str], Depends(_options)],
    method: Annotated[str, Form(max_length=60)] = "lhs",
    kind: Annotated[Literal["gun", "hammer"], Form()] = "gun",
    runs: Annotated[int, Form(ge=1)] = 105,
    repetitions: Annotated[int, Form(ge=1, le=1000)] = 10,
    seed: Annotated[str, Form(max_length=12)] = "",
    factors: Annotated[str, Form(max_length=200_000)] = "",
    table: Annotated[str, Form(max_length=800_000)] = "",
    description: Annotated[str, Form(max_length=10_000)] = "",
    replicates: Annotated[int, Form(ge=1, le=100)] = 1,
    centre_points: Annotated[int, Form(ge=0, le=200)] = 0,
    order: Annotated[RunOrder, Form()] = "split-plot",
    blocks: Annotated[int, Form(ge=1, le=100)] = 1,
) -> Response:
    if seed and not seed.isdecimal():
        raise FieldError("seed", f"seed {seed!r} is no whole number; leave it empty to draw one")
    if order == "random" and blocks > 1:
        raise FieldError(
            "blocks",
            f"{blocks} blocks in random order; expected one block, or the order of a split plot",
        )
    if method == "import" and not table.strip():
        raise FieldError(
            "table",
            "no table is given; paste one with a column for each factor and a row for each run",
        )
    wanted = PlanArguments(
        name=name.strip(),
        method=method,
        kind=kind,
        runs=runs,
        repetitions=repetitions,
        seed=int(seed) if seed else None,
        factors=factors,
        table=table,
        description=description,
        options=options,
        replicates=replicates,
        centre_points=centre_points if get_method(method).centre_points else 0,
        order=order,
        blocks=blocks,
    )
    return followed(plan_job(jobs, store, wanted))


@router.get("/plans/{name}")
def plan(request: Request, name: Name, store: OpenStore) -> Response:
    with store.reading() as session:
        plan = read_plan(session, name)
    judged = plan_page(plan)
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
        pairs=pairs_figure(judged["pair_labels"], as_floats(judged["pairs"])),
        correlations=correlation_figure(judged["terms"], as_floats(judged["correlations"])),
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


@router.get("/plans/{name}/sheet")
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


@router.post("/plans/{name}/runs/{run}")
def tick(
    name: Name,
    run: Key,
    store: OpenStore,
    status: Annotated[Literal["planned", "done", "discarded"], Form()],
    note: Annotated[str, Form(max_length=2000)] = "",
) -> Response:
    tick_run(store, name, run, status=status, note=note or None)
    return RedirectResponse(
        f"/plans/{part(name)}/sheet{f'?run={run}' if status == 'planned' else ''}", 303
    )
