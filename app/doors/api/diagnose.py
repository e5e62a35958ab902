"""Diagnoses of the gap: run one as a job, read what is kept, plan what tells causes apart, adopt an
effect."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Query
from pydantic import BaseModel, Field

from ....schema.session import Store
from ...common.plan_tables import plan_as_json
from ...jobs.job_kinds.diagnose import DIAGNOSE
from ...jobs.queue import JobView
from ...operations.diagnose.diagnosing import is_stored
from ...operations.diagnose.discriminating_plan import store_experiment_of
from ...operations.diagnose.request import DiagnoseArguments, check_effects
from ...operations.diagnose.stored import kept_report, kept_verdict, list_diagnoses
from ...twins.adopted_effects import adopt
from ...web.dependencies import Key, OpenStore, Running, Text
from ...web.jobs import Jobs


def diagnose_job(jobs: Jobs, store: Store, arguments: DiagnoseArguments) -> JobView:
    """Queue a diagnosis; its result is the report (`diagnosis-report.md`).

    Raises `LookupError` for a campaign that is not in the store, for a path of the server's disk is
    nobody's to name, and for an effect that the catalogue does not have.
    """
    if not is_stored(store, arguments.target):
        raise LookupError(f"no campaign {arguments.target!r} in the store; ingest it first")
    check_effects(arguments.with_effects, arguments.without_effects)
    return jobs.ask(store, DIAGNOSE, _title(arguments), arguments)


def _title(arguments: DiagnoseArguments) -> str:
    parts = [f"Diagnosis of {arguments.target}"]
    parts += [f"with {', '.join(arguments.with_effects)}"] if arguments.with_effects else []
    parts += (
        [f"without {', '.join(arguments.without_effects)}"] if arguments.without_effects else []
    )
    return " ".join(parts)


router = APIRouter(tags=["diagnoses"])
EffectId = Annotated[Text, Field(max_length=200)]


class DiagnosisOptions(BaseModel):
    """As the options of `pyroshock diagnose`; `tolerances` are shares for gun and contact, dB for
    the plate. `with`: ids of the effects that alone are considered, `without`: of those that are
    not."""

    campaign: Text = Field(max_length=1000)
    simulator: Text | None = Field(None, max_length=300)
    tolerances: dict[str, Annotated[float, Field(gt=0, lt=100)]] = {}
    uncertain: dict[str, Annotated[float, Field(gt=0)]] = {}
    seed: Annotated[int, Field(ge=0, le=2**31 - 1)] = 0
    with_effects: list[EffectId] = Field([], alias="with", max_length=100)
    without: list[EffectId] = Field([], max_length=100)

    def asked(self) -> DiagnoseArguments:
        same = self.model_dump(exclude={"campaign", "without"})
        return DiagnoseArguments(self.campaign, without_effects=self.without, **same)


class PlanName(BaseModel):
    name: Text | None = Field(None, max_length=200)


class EffectName(BaseModel):
    """`effect` as the report names it: a fitted set ("a+b+c"), an effect of one, or "none" to go
    back."""

    effect: Text = Field(max_length=200)


@router.get("/diagnoses")
def diagnoses(
    store: OpenStore,
    campaign: str | None = None,
    after: Annotated[int | None, Query(ge=1, le=2**31 - 1)] = None,
    limit: Annotated[int, Query(ge=1, le=500)] = 50,
) -> list[dict[str, Any]]:
    """Kept diagnoses, the newest first; the next page begins `after` the last `id` of this one."""
    with store.reading() as session:
        return list_diagnoses(session, campaign, limit, after)


@router.post("/diagnoses")
def diagnose(question: DiagnosisOptions, store: OpenStore, running: Running) -> dict[str, Any]:
    """Diagnose a campaign of the store; answers with the job, whose result is the report."""
    return diagnose_job(running, store, question.asked()).as_json()


@router.get("/diagnoses/{diagnosis}")
def diagnosis(diagnosis: Key, store: OpenStore) -> dict[str, Any]:
    """The report of a kept diagnosis (diagnosis-report.md)."""
    with store.reading() as session:
        return kept_report(session, diagnosis)


@router.post("/diagnoses/{diagnosis}/plan")
def plan(diagnosis: Key, plan_name: PlanName, store: OpenStore) -> dict[str, Any]:
    """Write the next experiment that the diagnosis names into the store, as a plan."""
    stored, left_out = store_experiment_of(store, diagnosis, plan_name.name)
    return {**plan_as_json(stored), "left_out": list(left_out)}


@router.post("/diagnoses/{diagnosis}/adopt")
def adopted(diagnosis: Key, effect_name: EffectName, store: OpenStore) -> dict[str, Any]:
    """Store effects as they were fitted as a new version of the twin: predictions use it from then
    on."""
    with store.reading() as session:
        verdict = kept_verdict(session, diagnosis)
    row = adopt(store, verdict, effect_name.effect, diagnosis)
    return {"version": row.version, "reason": row.reason}
