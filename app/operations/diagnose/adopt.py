"""Adopt effects of a stored diagnosis: predictions of its bench use them from then on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any
from urllib.parse import quote

from pydantic import Field

from ....schema.person_roles import ENGINEER
from ..fields import Presentation, request_field
from ..laboratory import Laboratory
from ..operation import FormPage, Operation, Progress, Request, Result
from .adoption_notes import adoption_notes
from .stored import kept_verdict

if TYPE_CHECKING:
    from ....diagnosis.verdict import Verdict
    from ....schema.diagnoses import TwinVersion

#: Numbers of diagnoses: what a database's integer holds.
DiagnosisNumber = Annotated[int, Field(ge=1, le=2**31 - 1)]


def diagnosis_field(help: str, default: Any = ...) -> Any:
    """The number of a diagnosis as a field."""
    return request_field(
        default,
        help=help,
        presentation=Presentation(positional=default is ..., completion="diagnosis_numbers"),
    )


class AdoptionRequest(Request):
    """Which effects of which diagnosis are adopted."""

    diagnosis: DiagnosisNumber = diagnosis_field("Take the diagnosis with this number.")
    effect: str | None = request_field(
        None,
        min_length=1,
        max_length=1000,
        help='Name an effect, a set as the report names it ("a+b"), the mean of effects that '
        'cannot be told apart ("a/b"), or none to go back. [default: what the diagnosis offers]',
        presentation=Presentation(metavar="EFFECT|none", completion="effect_ids"),
    )


@dataclass(frozen=True, eq=False)
class Adopted(Result):
    """The version of the bench's twin that has the effects."""

    verdict: Verdict
    version: TwinVersion

    def notes(self) -> Sequence[str]:
        """What predictions use from now on."""
        return tuple(adoption_notes(self.verdict, self.version))

    def to_json(self) -> dict[str, Any]:
        """The number of the version, and why it was made."""
        return {"version": self.version.version, "reason": self.version.reason}

    def address(self) -> str:
        """The diagnoses of the campaign, which say what was adopted."""
        return f"/diagnoses?campaign={quote(self.verdict.campaign, safe='')}"


def _run(request: AdoptionRequest, laboratory: Laboratory, _: Progress) -> Adopted:
    from ...twins.adopted_effects import adopt, offered

    with laboratory.store.reading() as session:
        verdict = kept_verdict(session, request.diagnosis)
    best = offered(verdict)
    wanted = request.effect or (verdict.first.effects[0] if best is None else best.name)
    return Adopted(verdict, adopt(laboratory.store, verdict, wanted, request.diagnosis))


ADOPT: Operation[AdoptionRequest, Adopted] = Operation(
    name="adopt",
    role=ENGINEER,
    request=AdoptionRequest,
    run=_run,
    help="Let predictions of a bench use effects of a stored diagnosis from now on.",
    example="pyroshock diagnoses adopt 1 --effect gun.valve_flow",
    command=("diagnoses", "adopt"),
    route=("POST", "/diagnoses/{diagnosis}/adopt"),
    label=lambda request: f"from diagnosis {request.diagnosis}",
    form=FormPage("/diagnoses/{diagnosis}", "adopt", "/diagnoses/{diagnosis}/adopt"),
)
