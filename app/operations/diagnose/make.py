"""Diagnose a campaign: where the gap between twin and bench lies, what causes it, how far it
shrinks."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ....schema.person_roles import ENGINEER
from ..faults import UnknownValueError
from ..laboratory import Laboratory
from ..operation import FormPage, Operation, Output, Progress
from .request import IN_USE, MODELS, DiagnosisRequest, check_effects

if TYPE_CHECKING:
    from ....diagnosis.verdict import Verdict
    from .service import GapDiagnosis


@dataclass(frozen=True, eq=False)
class FinishedDiagnosis:
    """A diagnosis that is not stored yet, and what was asked."""

    verdict: Verdict
    request: DiagnosisRequest


def check(request: DiagnosisRequest, laboratory: Laboratory) -> None:
    """Raises `UnknownValueError` for effects that there are not, and over a network, where the work
    is not done at once, for a simulator that there is not, and for a campaign that is not in the
    store: a folder of the server's disk is nobody's to name.

    Raises `ValueError` where effects of a folder are to be adopted.
    """
    from .diagnosing import is_stored

    stored = is_stored(laboratory.store, request.campaign)
    if laboratory.folders is not None and not stored:
        raise UnknownValueError(
            "campaign", f"no campaign {request.campaign!r} in the store; ingest it first"
        )
    check_effects(request.with_effects, request.without_effects)
    if request.adopted is not None and not stored:
        raise ValueError(
            f"adopting {request.adopted} needs a campaign of the store; ingest it first: "
            f"pyroshock ingest {request.campaign}"
        )
    if laboratory.folders is not None:
        _check_simulator(request.simulator, laboratory.db)


def _check_simulator(text: str | None, db: str) -> None:
    name = (text or "nominal").removeprefix(MODELS)
    if name == "nominal" or name.partition("@")[0] == IN_USE:
        return
    from ....training.registry.listing import chosen
    from ...common.model_registry import models_extra, registry_of

    try:
        with models_extra():
            chosen(registry_of(db).versions(), name)
    except LookupError as error:
        raise UnknownValueError("simulator", str(error)) from error


def _run(
    request: DiagnosisRequest, laboratory: Laboratory, progress: Progress
) -> FinishedDiagnosis:
    from ...common.model_registry import models_extra
    from ...twins.adopted_effects import check_adoptable
    from . import diagnosing

    if laboratory.folders is not None:
        check(request, laboratory)  # what was stored may have left the store since it was asked for
    with models_extra():
        verdict = diagnosing.run_diagnosis(laboratory.store, laboratory.db, request, progress)
    if request.adopted is not None:
        check_adoptable(verdict, request.adopted)
    return FinishedDiagnosis(verdict, request)


def _keep(finished: FinishedDiagnosis, laboratory: Laboratory) -> GapDiagnosis:
    from ...twins.adopted_effects import adopt
    from . import diagnosing
    from .service import GapDiagnosis

    verdict, request, store = finished.verdict, finished.request, laboratory.store
    if not diagnosing.is_stored(store, request.campaign):
        return GapDiagnosis(verdict, folder=request.campaign)
    key = diagnosing.keep(store, verdict, request)
    version = None if request.adopted is None else adopt(store, verdict, request.adopted, key)
    return GapDiagnosis(verdict, key, version)


def _write_page(diagnosis: GapDiagnosis, path: Path) -> None:
    from .report import write_page

    write_page(diagnosis.verdict, path)


DIAGNOSE = Operation(
    name="diagnose",
    role=ENGINEER,
    request=DiagnosisRequest,
    run=_run,
    keep=_keep,
    check=check,
    help="Diagnose where the gap between measurement and twin lies, which effect causes it, and "
    "how far it shrinks with that effect.\n\nThe store keeps the diagnosis of a campaign that it "
    "holds. A folder is diagnosed without being stored.",
    example="pyroshock diagnose examples/first-shots --html gap.html\n"
    "pyroshock diagnose slow-valve --with gun.valve_flow,gun.blow_by",
    route=("POST", "/diagnoses"),
    long=True,
    steps="%",
    needs_store=False,
    outputs=(Output("html", "Write the result to FILE as a page.", _write_page),),
    label=lambda request: request.words,
    listed_by="list-diagnoses",
    form=FormPage("/diagnoses", "diagnose", "/diagnoses"),
)
