"""Predict the runs of a plan before they are shot, and store what was predicted."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Annotated, Any
from urllib.parse import quote

from pydantic import Field, field_validator

from ...common.number_format import format_interval, number_ranges
from ...common.quantities import display_of
from ..fields import Presentation, request_field
from ..laboratory import Laboratory
from ..operation import Operation, Progress, Result, ResultTable
from ..plan.status import NamedPlan
from ..twin_fields import TwinFields

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from ....array_types import Floats
    from ....doe.plans import StoredPlan
    from ....schema.session import Store
    from ....twin.prediction import Prediction
    from ...twins.building import BuiltTwin, TwinRequest
    from ..predict.batch import ShotRow

_RUNS = re.compile(r"\d{1,9}(-\d{1,9})?(,\d{1,9}(-\d{1,9})?)*")
#: A band of 90 % needs a draw beyond each end at least.
_FEWEST_DRAWS, _MOST_DRAWS = 20, 2000
#: Digits of a stored draw: far more than a twin knows.
_DIGITS = 7
#: Runs of one request.
_MOST_RUNS = 100_000


class PlanPredictionRequest(TwinFields, NamedPlan):
    """A plan, which of its runs, and the twin that predicts them."""

    runs: Annotated[str, Field(max_length=2000)] | None = request_field(
        None,
        help="Predict these runs alone, such as 3-7,12. [default: all that are not shot]",
        presentation=Presentation(metavar="3-7,12"),
    )
    draws: Annotated[int, Field(ge=_FEWEST_DRAWS, le=_MOST_DRAWS)] = request_field(
        64, help="Set the number of random shots that the bands are computed from."
    )
    seed: Annotated[int, Field(ge=0, le=2**31 - 1)] = request_field(
        0, help="Set the seed of the random shots."
    )

    @field_validator("runs")
    @classmethod
    def _are_numbers(cls, runs: str | None) -> str | None:
        """Raises `ValueError` for what is no list of numbers, and for very many."""
        if runs is None:
            return None
        listed = re.sub(r"\s+", "", runs).replace("–", "-")
        if not _RUNS.fullmatch(listed):
            raise ValueError(f"runs is {runs!r:.80}; expected numbers and ranges, such as 3-7,12")
        spans = list(_spans(listed))
        if any(low > high for low, high in spans):
            raise ValueError(f"runs is {runs!r:.80}; expected the smaller number of a range first")
        if sum(high - low + 1 for low, high in spans) > _MOST_RUNS:
            raise ValueError(f"runs is {runs!r:.80}; expected at most {_MOST_RUNS:,} runs")
        return listed

    def numbers(self) -> frozenset[int] | None:
        """The runs that are named; None where all are meant."""
        if self.runs is None:
            return None
        return frozenset(run for low, high in _spans(self.runs) for run in range(low, high + 1))


def _spans(runs: str) -> Iterator[tuple[int, int]]:
    for part in runs.split(","):
        low, _, high = part.partition("-")
        yield int(low), int(high or low)


@dataclass(frozen=True)
class ForecastOfRun:
    """What is stored of one run: values of the columns of `RunPrediction`."""

    run: int
    values: Mapping[str, Any]


@dataclass(frozen=True, eq=False)
class ForecastDraft:
    """Predictions of runs that are not stored yet; `refused` says of a run why it was not
    predicted."""

    plan: str
    forecasts: Sequence[ForecastOfRun]
    refused: Mapping[int, str]
    remarks: Sequence[str]


@dataclass(frozen=True)
class PredictedPlan(Result):
    """The predictions that were stored of a plan's runs, why others were not predicted, and what
    the twin rests on."""

    plan: str
    rows: Sequence[Mapping[str, Any]]
    refused: Mapping[int, str] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()

    def notes(self) -> Sequence[str]:
        """How many runs were predicted, what the twin rests on, and what was not predicted."""
        count = len(self.rows)
        stored = f"plan {self.plan}: {count} run{'s' * (count != 1)} predicted"
        when = f" at {self.rows[0]['made_at']}" if self.rows else ""
        return (
            f"{stored}{when}",
            *self.remarks,
            *(f"not predicted: {words}" for words in _grouped(self.refused)),
        )

    def tables(self) -> Sequence[ResultTable]:
        """A row for each predicted run."""
        return (ResultTable("", [_shown(row) for row in self.rows], "no run was predicted"),)

    def to_json(self) -> dict[str, Any]:
        """The same for programs, in SI."""
        return {
            "plan": self.plan,
            "predicted": [dict(row) for row in self.rows],
            "not_predicted": [
                {"run": run, "reason": reason} for run, reason in sorted(self.refused.items())
            ],
            "remarks": list(self.remarks),
        }

    def address(self) -> str:
        """The page of the plan, at its predictions."""
        return f"/plans/{quote(self.plan, safe='')}#predictions"

    def summary(self) -> str:
        """How many runs were predicted."""
        return f"{len(self.rows)} predicted, {len(self.refused)} not"

    def next_command(self) -> Sequence[str]:
        """The run sheet shows what is expected."""
        return ("plan", "sheet", self.plan, "--out", f"{self.plan}.html")


def _grouped(refused: Mapping[int, str]) -> Iterator[str]:
    """Reasons with the runs that they are of."""
    runs: dict[str, list[int]] = {}
    for run, reason in sorted(refused.items()):
        runs.setdefault(reason, []).append(run)
    for reason, numbers in runs.items():
        yield f"run{'s' * (len(numbers) > 1)} {number_ranges(numbers)}: {reason}"


def _shown(row: Mapping[str, Any]) -> dict[str, Any]:
    from ....schema.run_predictions import QUANTITIES, lower_of, upper_of

    cells: dict[str, Any] = {"run": row["run"]}
    for quantity in QUANTITIES:
        shown = display_of(quantity)
        if row[quantity] is None:
            cells |= {shown.heading: None, f"{shown.label} 90 %": None}
            continue
        numbers = (row[name] for name in (quantity, lower_of(quantity), upper_of(quantity)))
        median, lower, upper = format_interval(*(shown.scale * value for value in numbers))
        cells |= {shown.heading: median, f"{shown.label} 90 %": f"{lower} to {upper}"}
    return cells | {"warning": " ".join(row["warnings"])}


def _check(request: PlanPredictionRequest, laboratory: Laboratory) -> None:
    """Raises `LookupError` for names that there are not, and `ValueError` where nothing is left to
    predict."""
    request.check_names(laboratory)
    with laboratory.store.reading() as session:
        _runs_to_predict(session, request)


def _runs_to_predict(
    session: Session, request: PlanPredictionRequest
) -> tuple[StoredPlan, list[int], dict[int, str]]:
    """The plan, the runs that are open, and why others of those asked for are not predicted.

    Raises `ValueError` for a run that is named and is shot, discarded or not in the plan, and where
    no run is open.
    """
    from ....doe.plans import read_plan
    from ..faults import Fault, RequestError

    stored = read_plan(session, request.name)
    named = request.numbers()
    closed = _closed(session, stored)
    if named is not None:
        numbers = {run.run for run in stored.runs}
        wrong = {run: f"plan {stored.name!r} has no run {run}" for run in named - numbers}
        wrong |= {run: reason for run, reason in closed.items() if run in named}
        if wrong:
            message = "; ".join(f"run {run}: {wrong[run]}" for run in sorted(wrong)[:_MOST_NAMED])
            more = "; and more" if len(wrong) > _MOST_NAMED else ""
            raise RequestError(
                [
                    Fault(
                        "runs",
                        f"runs {message}{more}; leave them out: a prediction is made before "
                        "the shot",
                    )
                ]
            )
    chosen = [
        run.run
        for run in stored.runs
        if run.run not in closed and (named is None or run.run in named)
    ]
    if not chosen:
        raise ValueError(
            f"plan {stored.name!r} has no run to predict: each is shot or discarded; add runs to "
            f"the plan (pyroshock plan augment {stored.name})"
        )
    return stored, chosen, closed


#: Runs that one error names.
_MOST_NAMED = 4


def _closed(session: Session, plan: StoredPlan) -> dict[int, str]:
    """Runs that cannot be predicted any more, and why."""
    from ....schema.run_predictions import LONG_AGO, first_hits

    keys = _keys(session, plan.name)
    shot = first_hits(session, keys.values())
    reasons = {}
    for run in plan.runs:
        if run.status == "discarded":
            reasons[run.run] = "it is discarded"
        elif (first_hit := shot.get(keys[run.run])) is not None:
            when = "" if first_hit == LONG_AGO else f" (stored {first_hit:%Y-%m-%d %H:%M} UTC)"
            reasons[run.run] = f"it is shot{when}"
    return reasons


def _keys(session: Session, plan: str) -> dict[int, int]:
    """The keys of a plan's runs by their numbers."""
    from sqlalchemy import select

    from ....schema.campaigns import Plan, PlannedRun

    query = select(PlannedRun.run, PlannedRun.id).join(Plan, PlannedRun.plan_id == Plan.id)
    return dict(iter(session.execute(query.where(Plan.name == plan))))


def _bench_campaign(session: Session, plan: StoredPlan) -> str | None:
    """The campaign whose bench predicts a plan where none is named: the newest that works it off,
    else the newest of the plan's kind; None for a gun without a campaign.

    Raises `ValueError` for a hammer without a campaign.
    """
    from sqlalchemy import select

    from ....schema.campaigns import Campaign, Plan, PlannedRun
    from ....schema.run_states import repetition_table

    table = repetition_table(plan.space.kind)
    newest = select(Campaign.name).order_by(Campaign.date.desc(), Campaign.id.desc()).limit(1)
    own = (
        select(table.campaign_id)
        .join(PlannedRun, table.planned_run_id == PlannedRun.id)
        .join(Plan, PlannedRun.plan_id == Plan.id)
        .where(Plan.name == plan.name)
    )
    name = session.scalar(newest.where(Campaign.id.in_(own)))
    if name is None and plan.space.kind != "gun":
        name = session.scalar(newest.where(Campaign.kind == plan.space.kind))
        if name is None:
            raise ValueError(
                f"plan {plan.name!r} is of a {plan.space.kind}, and the store has no campaign of "
                "that kind: ingest one, or name the campaign whose bench is used"
            )
    return name


def _run(
    request: PlanPredictionRequest, laboratory: Laboratory, progress: Progress
) -> ForecastDraft:
    from ....parallel.map_tasks import run_all_tasks
    from ...common.plan_tables import cells_of
    from ..predict.factors import store_factors

    with laboratory.store.reading() as session:
        stored, chosen, _ = _runs_to_predict(session, request)
        campaign = request.campaign or _bench_campaign(session, stored)
    wanted = {run.run: run for run in stored.runs}
    cells = {run: {"run": str(run), **cells_of(wanted[run])} for run in chosen}
    refused: dict[int, str] = {}
    rows = dict(_rows(cells, stored.name, refused))
    progress(0, len(rows), "building the twin")
    with request.twin_request() as twin:
        twins = _twins(laboratory, replace(twin, campaign=campaign), rows, refused)
    of_store = store_factors(laboratory.store)
    shots = list(_with_factors(rows, twins, of_store, refused))
    context = ForecastContext(twins, request.draws, request.seed, request.contact is None)
    made: dict[int, ForecastOfRun | str] = {}
    for (run, _row), answer in run_all_tasks(
        laboratory.executor, _forecast_run, shots, shared=(context,)
    ):
        made[run] = answer
        progress(len(made), len(shots), f"run {run}")
    refused |= {run: answer for run, answer in made.items() if isinstance(answer, str)}
    common = {
        "adopted": _adopted(laboratory.store, request, twins),
        "options": _options(request),
        "draws": request.draws,
        "seed": request.seed,
    }
    forecasts = [
        replace(forecast, values={**forecast.values, **common, "settings": cells[run]})
        for run in chosen
        if isinstance(forecast := made.get(run), ForecastOfRun)
    ]
    notes = dict.fromkeys(note for built in twins.values() for note in built.notes)
    return ForecastDraft(stored.name, forecasts, refused, tuple(notes))


def _rows(
    cells: Mapping[int, Mapping[str, str]], plan: str, refused: dict[int, str]
) -> Iterator[tuple[int, ShotRow]]:
    """The runs as shots; what the twin cannot be asked is noted in `refused`."""
    from ..predict.batch import rows_of_table

    for run, row in cells.items():
        try:
            (shot,) = rows_of_table([row], f"plan {plan!r}")
        except ValueError as error:  # the other runs are predicted, and the result names this one
            refused[run] = str(error).removeprefix(f"plan {plan!r}, run {run}: ")
            continue
        yield run, shot


def _twins(
    laboratory: Laboratory,
    request: TwinRequest,
    rows: Mapping[int, ShotRow],
    refused: dict[int, str],
) -> dict[tuple[str | None, float], BuiltTwin]:
    """The twin of each plate and height; runs of a plate that there is none of are noted in
    `refused`.

    Raises the error where no plate has a twin.
    """
    twins: dict[tuple[str | None, float], BuiltTwin] = {}
    failure: Exception | None = None
    for plate, height in dict.fromkeys(row.twin for row in rows.values()):
        own = replace(request, plate=request.plate or plate, chain_height_m=height)
        try:
            twins[plate, height] = laboratory.twin(own)
        except (LookupError, ValueError) as error:  # raised below where no plate has a twin
            failure = error
            refused |= {run: str(error) for run, row in rows.items() if row.twin == (plate, height)}
    if failure is not None and not twins:
        raise failure
    return twins


def _with_factors(
    rows: Mapping[int, ShotRow],
    twins: Mapping[tuple[str | None, float], BuiltTwin],
    of_store: frozenset[str],
    refused: dict[int, str],
) -> Iterator[tuple[int, ShotRow]]:
    """The runs with the factors that the contact model asks for; a run with a factor that no stage
    uses is noted in `refused`."""
    from ..predict.batch import with_factors

    for run, row in rows.items():
        if row.twin not in twins:
            continue  # its plate has no twin, and that is noted
        try:
            yield run, with_factors(row, twins[row.twin], of_store)
        except ValueError as error:  # the other runs are predicted, and the result names this one
            refused[run] = str(error)


@dataclass(frozen=True, eq=False)
class ForecastContext:
    """What every worker has: the twins, how bands are drawn, and whether the model in use was asked
    for, without which the velocity alone is predicted."""

    twins: Mapping[tuple[str | None, float], BuiltTwin]
    draws: int
    seed: int
    by_model_in_use: bool


def _forecast_run(item: tuple[int, ShotRow], context: ForecastContext) -> ForecastOfRun | str:
    """The prediction of a run, or why there is none."""
    from ..predict.predicting import predict_shot

    run, row = item
    built = context.twins[row.twin]
    lacking = _lacking_model(built) if context.by_model_in_use else ""
    twin = _gun_alone(built) if lacking else built
    try:
        prediction = predict_shot(twin, row.shot, draws=context.draws, seed=context.seed)
    except (LookupError, ValueError) as error:  # the result says it of this run
        return str(error)
    is_set = row.shot.impact_velocity_m_s is not None
    values = forecast_values(prediction, lacking, is_set=is_set)
    if not values["drawn"]:
        return " ".join(values["remarks"])
    return ForecastOfRun(run, {**values, "campaign": built.bench.campaign})


def _lacking_model(built: BuiltTwin) -> str:
    """Why only the velocity is predicted; empty where a contact model is in use."""
    from ....twin.contact.prior import PriorContact

    if not isinstance(built.twin.contact, PriorContact):
        return ""
    return (
        "Contact time, force and acceleration are not predicted: no contact model is in use for "
        f"the {built.bench.kind}. Put one in use, or choose a contact law, such as prior."
    )


def _gun_alone(built: BuiltTwin) -> BuiltTwin:
    """The twin with a contact that costs nothing and no plate, of which the velocity alone is
    read."""
    from ....twin.contact.stage import LawContact
    from ....twin.plate.stage import PlateStage

    bare = replace(built.twin, contact=LawContact("hann"), plate=PlateStage({}), calibration=None)
    return replace(built, twin=bare)


def forecast_values(prediction: Prediction, lacking: str, *, is_set: bool) -> dict[str, Any]:
    """Values of the columns of a stored prediction.

    Parameters:
        prediction: The shot with its random draws.
        lacking: Why nothing behind the velocity is predicted; empty where all is.
        is_set: Whether the velocity is a setting of the run, and no prediction.
    """
    from ....schema.run_predictions import QUANTITIES
    from ...common.run_forecasts import band_of, key_of_peak
    from ..predict.validity import (
        bench_limit_sentences,
        extrapolation_sentence,
        extrapolations,
        warning_sentences,
    )

    draws = prediction.draws
    drawn: dict[str, Floats] = {} if is_set else {"velocity_m_s": draws.velocity_m_s}
    remarks = ["The impact velocity is a setting of the run, and is not predicted."] * is_set
    if lacking:
        remarks.append(lacking)
    else:
        drawn |= {"contact_time_s": draws.contact_time_s, "peak_force_n": draws.peak_force_n}
        for place, sensor in enumerate(prediction.sensors):
            drawn[key_of_peak(sensor)] = draws.peak_acceleration_m_s2[:, place]
    rounded_draws = {
        quantity: [float(f"{value:.{_DIGITS}g}") for value in sorted(map(float, values))]
        for quantity, values in drawn.items()
        if all(map(math.isfinite, map(float, values)))
    }
    columns = {
        name: value
        for quantity in QUANTITIES
        for name, value in _columns(
            quantity,
            band_of(quantity, rounded_draws[quantity]) if quantity in rounded_draws else None,
        )
    }
    warnings = (
        (
            *map(extrapolation_sentence, extrapolations(prediction)),
            *bench_limit_sentences(prediction),
        )
        if lacking  # of the stages behind the gun nothing is said
        else warning_sentences(prediction)
    )
    return {
        **columns,
        "models": _models(prediction, lacking),
        "drawn": rounded_draws,
        "spectra": None if lacking else _spectra(prediction),
        "warnings": list(map(str, warnings)),
        "remarks": remarks,
    }


def _columns(quantity: str, band: Any) -> Iterator[tuple[str, float | None]]:
    from ....schema.run_predictions import lower_of, upper_of

    yield quantity, None if band is None else band.median
    yield lower_of(quantity), None if band is None else band.lower
    yield upper_of(quantity), None if band is None else band.upper


def _models(prediction: Prediction, lacking: str) -> dict[str, str]:
    """What answered in each stage; stages that nothing is stored of are left out."""
    models = dict(prediction.models)
    return {"gun": models["gun"]} if lacking else models


def _spectra(prediction: Prediction) -> dict[str, Any] | None:
    """Median and band of the spectrum of each sensor; None without a plate."""
    import numpy as np

    if not prediction.sensors:
        return None
    medians = np.quantile(prediction.draws.spectra_m_s2, 0.5, axis=0, method="hazen")
    return {
        "q": float(prediction.q),
        "frequency_hz": [float(line) for line in prediction.frequency_hz],
        "sensors": {
            sensor: {
                "median": _rounded(medians[place]),
                "lower": _rounded(prediction.spectra_m_s2[sensor].lower),
                "upper": _rounded(prediction.spectra_m_s2[sensor].upper),
            }
            for place, sensor in enumerate(prediction.sensors)
        },
    }


def _rounded(values: Floats) -> list[float]:
    return [float(f"{value:.{_DIGITS}g}") for value in values]


def _adopted(
    store: Store,
    request: PlanPredictionRequest,
    twins: Mapping[tuple[str | None, float], BuiltTwin],
) -> list[dict[str, Any]]:
    """Versions of adopted effects that acted in the twin."""
    from ...twins.adopted_effects import adopted_for

    campaigns = {built.bench.campaign for built in twins.values()} - {None}
    if not request.adopted or request.bench is not None or not campaigns:
        return []
    with store.reading() as session:
        return [
            {
                "version": adopted.version,
                "campaign": adopted.campaign,
                "adopted_at": adopted.adopted_at.isoformat(),
                "effects": [effect.id for effect in adopted.effects],
                "parameters": [effect.as_json() for effect in adopted.effects],
            }
            for campaign in sorted(name for name in campaigns if name is not None)
            for adopted in adopted_for(session, campaign)
        ]


def _options(request: PlanPredictionRequest) -> dict[str, Any]:
    """What was asked for beside the runs, where it was not the usual."""
    from ..change_record import request_json

    own = ("name", "runs", "draws", "seed")
    return {name: value for name, value in request_json(request).items() if name not in own}


def _keep(draft: ForecastDraft, laboratory: Laboratory) -> PredictedPlan:
    """Store the predictions of the runs that are still not shot."""
    from ....schema.campaigns import plan_turn
    from ....schema.run_predictions import QUANTITIES, RunPrediction, lower_of, upper_of
    from ....schema.transactions import take_advisory_lock

    names = [
        name
        for quantity in QUANTITIES
        for name in (quantity, lower_of(quantity), upper_of(quantity))
    ]

    def work(session: Session) -> PredictedPlan:
        from ....doe.plans import read_plan

        take_advisory_lock(session, plan_turn(draft.plan))
        keys = _keys(session, draft.plan)
        closed = _closed(session, read_plan(session, draft.plan))
        made_at = datetime.now(UTC)
        refused, rows = dict(draft.refused), []
        for forecast in draft.forecasts:
            if forecast.run in closed or forecast.run not in keys:
                refused[forecast.run] = closed.get(forecast.run, "the plan has it no longer")
                continue
            session.add(
                RunPrediction(planned_run_id=keys[forecast.run], made_at=made_at, **forecast.values)
            )
            shown = {name: forecast.values[name] for name in (*names, "warnings", "remarks")}
            rows.append(
                {
                    "run": forecast.run,
                    "made_at": made_at.isoformat(timespec="seconds"),
                    **shown,
                    "models": forecast.values["models"],
                }
            )
        remarks = dict.fromkeys(
            (*draft.remarks, *(remark for row in rows for remark in row["remarks"]))
        )
        return PredictedPlan(draft.plan, rows, refused, tuple(remarks))

    return laboratory.store.write(work)


PLAN_PREDICT: Operation[PlanPredictionRequest, PredictedPlan] = Operation(
    name="plan-predict",
    request=PlanPredictionRequest,
    run=_run,
    keep=_keep,
    check=_check,
    help="""Predict the runs of a plan before they are shot, and store what was predicted.

Each run that is not shot gets its velocity, contact time, peak force, peak accelerations and
spectra, each with the median and the 90 % band. Without a contact model in use, the velocity alone
is predicted. A run that is shot or discarded is refused. Made again, further predictions are
stored, and the newest before the shot counts.""",
    example="pyroshock plan predict slow-valve --runs 3-7",
    command=("plan", "predict"),
    route=("POST", "/plans/{name}/predictions"),
    long=True,
    steps="runs",
    workers="Set the number of processes.",
)
