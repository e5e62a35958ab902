"""What is asked of a validation."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from ..fields import Presentation, Seed, request_field
from ..operation import Request
from ..twin_fields import Word


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
        help="Choose the contact model of the predictions. [default: the model in use, else prior]",
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
