"""Promoting a version of a model: it is put in use, or refused with the reason."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field, model_validator

from ....schema.person_roles import ENGINEER, USER
from ..faults import about
from ..fields import Presentation, request_field
from ..laboratory import Laboratory
from ..operation import FormPage, Operation, Progress, Request

if TYPE_CHECKING:
    from .service import PromotionDecision


class NamedVersion(Request):
    """One registered version."""

    model: str = request_field(
        min_length=1,
        max_length=1000,
        help="Name the version, as MODEL@VERSION.",
        presentation=Presentation(
            positional=True, metavar="MODEL@VERSION", completion="model_versions"
        ),
    )
    version: Annotated[int, Field(ge=1, le=2**31 - 1)] | None = request_field(
        None,
        help="Give the number of the version, where MODEL is without it.",
        presentation=Presentation(positional=True, metavar="[VERSION]"),
    )

    @property
    def label(self) -> str:
        """ "hybrid@3"."""
        return f"{self.model}@{self.version}"

    @model_validator(mode="before")
    @classmethod
    def _named(cls, values: Any) -> Any:
        """ "hybrid@3" is version 3 of hybrid."""
        if not isinstance(values, Mapping) or not isinstance(values.get("model"), str):
            return values
        name, at, number = values["model"].partition("@")
        stated = values.get("version") not in (None, "")
        if not at and stated:
            return values
        if not number.isdecimal() or stated:
            given = values["model"] if not stated else f"{values['model']}@{values['version']}"
            raise ValueError(f"model is {given!r}; expected MODEL@VERSION, such as hybrid@3")
        return {**values, "model": name, "version": int(number)}


class Promoting(NamedVersion):
    """A version to put in use."""

    on: str | None = request_field(
        None,
        max_length=1000,
        help="Judge both models on the pulses of this dataset or campaign instead.",
        presentation=Presentation(metavar="DATASET|CAMPAIGN"),
    )
    force: bool = request_field(
        False, help="Promote the model although it does not pass. This needs --reason."
    )
    reason: str = request_field(
        "",
        max_length=4000,
        help="Say why. The registry keeps the reason beside the figures.",
        presentation=Presentation(metavar="TEXT"),
    )


def _run(request: Promoting, laboratory: Laboratory, _: Progress) -> PromotionDecision:
    from ...common.model_registry import models_extra, needed, pulses_on, reader_of

    store, person = laboratory.store, laboratory.person
    with models_extra():
        from ....training.registry.listing import chosen

        registry = needed(laboratory.db)
        candidate = chosen(registry.versions(), request.label)
        with about("on"):
            other = (
                None
                if request.on is None
                else (request.on, pulses_on(store, request.on, candidate))
            )
        # nothing heavy is imported before it is known what to judge
        from ....training.registry.promotion import promote
        from .service import PromotionDecision

        decision = promote(
            registry,
            request.model,
            int(request.version or 0),
            reader_of(store),
            other=other,
            forced=request.force,
            reason=request.reason,
            who=person.name if person.kind == USER else None,
        )
    return PromotionDecision(decision)


PROMOTE: Operation[Promoting, PromotionDecision] = Operation(
    name="promote",
    role=ENGINEER,
    changes_elsewhere=True,
    request=Promoting,
    run=_run,
    help="""Put a model in use: predictions on benches of its kind (gun or hammer) take it from then
    on.

    The kind is that of the campaigns that the predictors of the model are for. If there are several
    sets of predictors for one kind, the model that was promoted last is in use. A model is promoted
    if, on configurations that it has not seen, its 90 % bands hold 85 to 97 % of the measured peak
    forces, contact times and impulses, and it predicts these better than the model in use, beyond
    chance. The first model must predict them better than the contact law updated by the measured
    shots, which answers without a model. The measure is the mean CRPS. Another model is refused,
    with exit code 1; exit code 3 means that there are too few configurations to judge it.
    `pyroshock models --promotions` lists refusals, too.""",
    example="""pyroshock promote gp@1
pyroshock promote gp@1 --on slow-valve --reason "new tips\"""",
    route=("POST", "/models/{model}/{version}/promote"),
    label=lambda request: str(request.label),
    form=FormPage(
        "/models/{model}/{version}",
        "promote",
        "/models/{model}/{version}/promote",
        required=("reason",),
    ),
)
