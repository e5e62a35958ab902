"""Plan the experiment that a diagnosis names: the runs that tell its causes apart."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pydantic import model_validator

from ....doe.plans import PlanExistsError, StoredPlan
from ....schema.person_roles import ENGINEER
from ...common.plan_tables import cells_of, plan_as_json, settings_in_si, write_table
from ..faults import FieldError
from ..fields import Presentation, Seed, request_field
from ..laboratory import Laboratory
from ..operation import (
    FormPage,
    NegativeAnswerError,
    Operation,
    Output,
    Progress,
    Request,
    ResultTable,
)
from ..plan.service import PlannedDesign
from . import diagnosing
from .adopt import DiagnosisNumber, diagnosis_field
from .discriminating_plan import no_setting, plan_name, store_experiment
from .request import DiagnosisRequest
from .stored import kept_report
from .wording import spell_sets


class NextRunsRequest(Request):
    """Of which diagnosis the runs are planned."""

    campaign: str | None = request_field(
        None,
        max_length=1000,
        help="Take the last diagnosis of all effects of this campaign; without one, the campaign "
        "is diagnosed.",
        presentation=Presentation(positional=True, completion="campaign_names"),
    )
    diagnosis: DiagnosisNumber | None = diagnosis_field(
        "Take the diagnosis with this number.", None
    )
    name: str | None = request_field(
        None, max_length=200, help="Name the plan. [default: CAMPAIGN-discriminate]"
    )
    anew: bool = request_field(False, help="Diagnose again, although the store has a diagnosis.")
    seed: Seed = request_field(0, help="Set the seed of a new diagnosis.")

    @model_validator(mode="after")
    def _of_one(self) -> NextRunsRequest:
        if (self.campaign is None) == (self.diagnosis is None):
            raise ValueError(
                "campaign and diagnosis: expected one of them, of which the runs are planned"
            )
        if self.diagnosis is not None and self.anew:
            raise ValueError("anew is true; expected false, or a campaign to diagnose again")
        return self


class DiscriminatingPlan(PlannedDesign):
    """A plan of the store whose runs tell causes apart. `reasons` are those of its runs, `left_out`
    the runs beyond the bench."""

    def __init__(
        self, stored: StoredPlan, reasons: Sequence[str] = (), left_out: Sequence[str] = ()
    ) -> None:
        super().__init__(stored)
        self.reasons, self.left_out = tuple(reasons), tuple(left_out)

    def notes(self) -> Sequence[str]:
        """Why these runs, which were left out, and how many there are."""
        why = map(spell_sets, (*self.reasons, *self.left_out))
        return (*why, f"plan {self.name}: {len(self)} runs")

    def tables(self) -> Sequence[ResultTable]:
        """The settings and repetitions of every run."""
        rows = (
            {"run": run.run, **settings_in_si(cells_of(run)), "repetitions": run.repetitions}
            for run in self.stored.runs
        )
        return (ResultTable("", tuple(rows), "no runs"),)

    def to_json(self) -> dict[str, Any]:
        """The plan, and which runs it lacks."""
        return {**plan_as_json(self.stored), "left_out": list(self.left_out)}


def _run(
    request: NextRunsRequest, laboratory: Laboratory, progress: Progress
) -> DiscriminatingPlan:
    report = _report(request, laboratory, progress)
    campaign, next_runs = report["campaign"], report["next_runs"]
    if not next_runs:
        raise NegativeAnswerError(no_setting(campaign))
    name = request.name or plan_name(campaign)
    try:
        stored, left_out = store_experiment(laboratory.store, campaign, next_runs, name)
    except PlanExistsError as error:
        raise FieldError("name", str(error)) from error
    return DiscriminatingPlan(stored, [run["why"] for run in next_runs], left_out)


def _report(request: NextRunsRequest, laboratory: Laboratory, progress: Progress) -> dict[str, Any]:
    with laboratory.store.reading() as session:
        if request.diagnosis is not None:
            return kept_report(session, request.diagnosis)
        assert request.campaign is not None
        report = None if request.anew else diagnosing.last_report(session, request.campaign)
    if report is None:
        new_request = DiagnosisRequest(campaign=request.campaign, seed=request.seed)
        verdict = diagnosing.run_diagnosis(laboratory.store, laboratory.db, new_request, progress)
        diagnosing.keep(laboratory.store, verdict, new_request)
        report = diagnosing.report_json(verdict)
    return report


DISCRIMINATE: Operation[NextRunsRequest, DiscriminatingPlan] = Operation(
    name="plan-next-runs",
    role=ENGINEER,
    request=NextRunsRequest,
    run=_run,
    help="Plan the runs that tell apart the causes which the last diagnosis of CAMPAIGN could not "
    "tell apart.",
    example="pyroshock plan discriminate slow-valve\n"
    "pyroshock plan sheet slow-valve-discriminate --out runs.html",
    command=("plan", "discriminate"),
    route=("POST", "/diagnoses/{diagnosis}/plan"),
    outputs=(
        Output(
            "out",
            "Write the table of runs to FILE as CSV.",
            lambda planned, path: write_table(planned.stored, path),
            (".csv",),
            in_place_of_tables=True,
        ),
    ),
    label=lambda request: request.campaign or f"of diagnosis {request.diagnosis}",
    form=FormPage("/diagnoses/{diagnosis}", "plan-next", "/diagnoses/{diagnosis}/plan"),
)
