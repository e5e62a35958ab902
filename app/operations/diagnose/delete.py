"""Delete a diagnosis from the store, as long as the twin does not rest on it."""

from __future__ import annotations

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from ....schema.diagnoses import Diagnosis, TwinVersion
from ..laboratory import Laboratory
from ..operation import FormPage, Operation, Outcome, Progress, Request
from .adopt import DiagnosisNumber, diagnosis_field
from .stored import get_diagnosis_row


class DiagnosisInUseError(ValueError):
    """A version of the twin was adopted from the diagnosis; the message names it."""


class DeletionRequest(Request):
    """Which diagnosis is deleted."""

    diagnosis: DiagnosisNumber = diagnosis_field("Delete the diagnosis with this number.")


def check_diagnosis_unused(session: Session, key: int) -> str:
    """The campaign of a diagnosis that may be deleted. Raises `LookupError`,
    `DiagnosisInUseError`."""
    campaign = get_diagnosis_row(session, key).campaign.name
    versions = session.scalars(
        select(TwinVersion.version).where(TwinVersion.diagnosis_id == key)
    ).all()
    if versions:
        raise DiagnosisInUseError(
            f"diagnosis {key} cannot be deleted: version {', '.join(map(str, sorted(versions)))} "
            "of the twin was adopted from it, and the record of the twin names it; it is deleted "
            f"with its campaign {campaign!r} only"
        )
    return campaign


def _lost(request: DeletionRequest, laboratory: Laboratory) -> str:
    with laboratory.store.reading() as session:
        campaign = check_diagnosis_unused(session, request.diagnosis)
    return f"diagnosis {request.diagnosis} of {campaign}"


def _run(request: DeletionRequest, laboratory: Laboratory, _: Progress) -> Outcome:
    def delete_row(session: Session) -> str:
        campaign = check_diagnosis_unused(session, request.diagnosis)
        session.execute(delete(Diagnosis).where(Diagnosis.id == request.diagnosis))
        return campaign

    number, campaign = request.diagnosis, laboratory.store.write(delete_row)
    line = f"diagnosis {number} of {campaign} is deleted"
    return Outcome((line,), {"diagnosis": number, "campaign": campaign}, "/diagnoses")


DELETE_DIAGNOSIS: Operation[DeletionRequest, Outcome] = Operation(
    name="delete-diagnosis",
    request=DeletionRequest,
    run=_run,
    deletes=_lost,
    help="Delete the diagnosis with number DIAGNOSIS. One from which an effect was adopted is "
    "refused.",
    example="pyroshock diagnoses delete 1 --yes",
    command=("diagnoses", "delete"),
    route=("POST", "/diagnoses/{diagnosis}/delete"),
    label=lambda request: str(request.diagnosis),
    form=FormPage("/diagnoses/{diagnosis}", "delete", "/diagnoses/{diagnosis}/delete"),
)
