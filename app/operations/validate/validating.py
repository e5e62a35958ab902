"""Validate the twin on a campaign: measured shots beside predictions that had not seen them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ....schema.person_roles import OPERATOR
from ..faults import about_field
from ..laboratory import Laboratory
from ..operation import FormPage, Operation, Output, Progress
from ..twin_fields import check_contact_field
from .request import ValidationRequest

if TYPE_CHECKING:
    from .service import TwinValidation


def check(request: ValidationRequest, laboratory: Laboratory) -> None:
    """Raises `LookupError` for a campaign or a contact model that there is not."""
    from ....schema.listings import get_campaign_id

    with laboratory.store.reading() as session, about_field("campaign"):
        get_campaign_id(session, request.campaign)
    check_contact_field(request.contact, laboratory)


def _run(request: ValidationRequest, laboratory: Laboratory, progress: Progress) -> TwinValidation:
    from .service import validate_twin

    return validate_twin(laboratory.store, laboratory.db, request, progress)


def _check_report(path: Path) -> None:
    from ...documents.write import check_ending

    check_ending(path)


def _write_report(validation: TwinValidation, path: Path) -> None:
    from ...documents.write import write_report
    from .report import validation_document

    write_report(validation_document(validation.to_json()), path)


VALIDATE: Operation[ValidationRequest, TwinValidation] = Operation(
    name="validate",
    role=OPERATOR,
    request=ValidationRequest,
    run=_run,
    check=check,
    help="Show how far predictions can be trusted: measured shots beside predictions that had not "
    "seen them.\n\n"
    "The configurations of a campaign are divided into folds. The twin predicts the shots of each "
    "fold after it has learned from all other shots. The exit code is 1 if the 90 % bands are too "
    'narrow ("Not calibrated").',
    example="pyroshock validate rehearsal --folds 2 --draws 20 --out validation.html",
    route=("POST", "/validate"),
    long=True,
    steps="%",
    outputs=(
        Output(
            "out",
            "Write the report to FILE.html or FILE.pdf.",
            _write_report,
            (".html", ".pdf"),
            check=_check_report,
        ),
    ),
    form=FormPage("/validations", "validate", "/validations"),
    result_page="/validations/{job}",
)
