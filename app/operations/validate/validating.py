"""Validate the twin on a campaign: measured shots beside predictions that had not seen them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from ..faults import about_field
from ..fields import Presentation, Seed, request_field
from ..laboratory import Laboratory
from ..operation import FormPage, Operation, Output, Progress, Request
from ..twin_fields import Word, check_contact_field

if TYPE_CHECKING:
    from .service import TwinValidation


class ValidationRequest(Request):
    """A campaign and how it is divided. Effects that diagnoses left to the bench do not act in its
    scores: they may have been fitted to the shots that are to be predicted."""

    campaign: Word = request_field(
        min_length=1,
        help="Validate on the shots of this campaign.",
        presentation=Presentation(positional=True, completion="campaign_names"),
    )
    contact: Word | None = request_field(
        None,
        help="Choose the contact model as `predict` does. [default: the model in use, else prior]",
        presentation=Presentation(
            metavar="LAW|prior|registered|MODEL@VERSION", completion="contact_models"
        ),
    )
    folds: Annotated[int, Field(ge=2, le=1000)] = request_field(
        5, help="Set the number of folds; a fold leaves out whole configurations."
    )
    draws: Annotated[int, Field(ge=20, le=2000)] = request_field(
        64, help="Set the number of random draws that the bands are computed from."
    )
    seed: Seed = request_field(0, help="Set the seed: the same seed gives the same answer.")


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


VALIDATE = Operation(
    name="validate",
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
    steps="shots",
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
