"""What notes, tags and attached files are about: a campaign, a run of a plan, an impact, a plan, a
version of a model, by the words that people use."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal
from urllib.parse import quote

from ....schema.person_roles import Person
from ..fields import Presentation, request_field

if TYPE_CHECKING:
    from sqlalchemy import ColumnElement
    from sqlalchemy.orm import Session

SubjectKind = Literal["campaign", "run", "impact", "model"]
_HIT = re.compile(r"(?P<name>.+)/(?P<run>\d{1,9})/(?P<repetition>\d{1,9})")
_RUN = re.compile(r"(?P<name>.+)/(?P<run>\d{1,9})")
_NO_NUMBER = -1


def kind_field() -> Any:
    """The field of a request that says what kind of thing a note or a tag is about."""
    return request_field(
        help="Say what it is about: campaign, run, impact or model.",
        presentation=Presentation(positional=True),
    )


def subject_field() -> Any:
    """The field of a request that names what a note or a tag is about."""
    return request_field(
        min_length=1,
        max_length=1000,
        help="Name it: the campaign; the run as PLAN/RUN; the impact by its number, or as "
        "CAMPAIGN/RUN/REPETITION; the model as NAME@VERSION.",
        presentation=Presentation(positional=True),
    )


@dataclass(frozen=True)
class Subject:
    """One thing of the laboratory. `run` and `repetition` are -1 where it has none."""

    kind: str
    name: str
    run: int = _NO_NUMBER
    repetition: int = _NO_NUMBER

    @property
    def text(self) -> str:
        """As a person writes it: "spring", "autumn/3", "spring/3/1", "autumn", "gp@1"."""
        numbers = [str(n) for n in (self.run, self.repetition) if n != _NO_NUMBER]
        return "/".join([self.name, *numbers])

    def columns(self) -> dict[str, Any]:
        """The columns of a row that is about it."""
        return {
            "subject_kind": self.kind,
            "subject": self.name,
            "run": self.run,
            "repetition": self.repetition,
        }

    def is_of(self, table: Any) -> ColumnElement[bool]:
        """The condition of the rows of a table that are about it (`schema.notes`)."""
        from sqlalchemy import and_

        return and_(*(getattr(table, name) == value for name, value in self.columns().items()))

    def page(self, session: Session) -> str:
        """The address of its page; empty of an impact that is not in the store now."""
        if self.kind == "campaign":
            return f"/campaigns/{quote(self.name, safe='')}"
        if self.kind == "plan":
            return f"/plans/{quote(self.name, safe='')}"
        if self.kind == "run":
            return f"/plans/{quote(self.name, safe='')}/sheet?run={self.run}"
        if self.kind == "model":
            name, _, version = self.name.rpartition("@")
            return f"/models/{quote(name, safe='')}/{version}"
        key = _impact_key(session, self)
        return "" if key is None else f"/impacts/{key}"


def find_subject(session: Session, kind: str, text: str) -> Subject:
    """What is meant, which must be there. Raises `LookupError`."""
    from sqlalchemy import select

    from ....schema.campaigns import Campaign, Plan, PlannedRun
    from ....schema.impacts import Impact

    def exists(query: Any) -> bool:
        return session.scalars(query.limit(1)).first() is not None

    if kind == "campaign":
        if exists(select(Campaign.id).where(Campaign.name == text)):
            return Subject(kind, text)
    elif kind == "plan":
        if exists(select(Plan.id).where(Plan.name == text)):
            return Subject(kind, text)
    elif kind == "run":
        if match := _RUN.fullmatch(text):
            subject = Subject(kind, match["name"], int(match["run"]))
            query = select(PlannedRun.id).join(Plan, PlannedRun.plan_id == Plan.id)
            if exists(query.where(Plan.name == subject.name, PlannedRun.run == subject.run)):
                return subject
    elif kind == "impact":
        hits = select(Campaign.name, Impact.run, Impact.repetition).join(
            Campaign, Impact.campaign_id == Campaign.id
        )
        row = None
        if text.isdecimal() and len(text) < 10:
            row = session.execute(hits.where(Impact.id == int(text))).one_or_none()
        elif match := _HIT.fullmatch(text):
            own = (
                Campaign.name == match["name"],
                Impact.run == int(match["run"]),
                Impact.repetition == int(match["repetition"]),
            )
            row = session.execute(hits.where(*own)).one_or_none()
        if row is not None:
            return Subject(kind, *row)
    elif _is_model(session, text):
        return Subject(kind, text)
    raise LookupError(f"no {kind} {text!r} in the store; {_HOW[kind]}")


_HOW = {
    "campaign": "pyroshock campaigns lists them",
    "run": "name it as PLAN/RUN, such as autumn/3; pyroshock plans show PLAN lists the runs",
    "plan": "pyroshock plans lists them",
    "impact": "give its number or CAMPAIGN/RUN/REPETITION; pyroshock impacts lists them",
    "model": "name it as NAME@VERSION; pyroshock models lists them",
}


def subject_of_impact(session: Session, key: int) -> Subject:
    """The impact of a key, as notes know it. Raises `LookupError`."""
    from sqlalchemy import select

    from ....schema.campaigns import Campaign
    from ....schema.impacts import Impact

    query = select(Campaign.name, Impact.run, Impact.repetition).join(
        Campaign, Impact.campaign_id == Campaign.id
    )
    row = session.execute(query.where(Impact.id == key)).one_or_none()
    if row is None:
        raise LookupError(f"no impact {key} in the store; {_HOW['impact']}")
    return Subject("impact", *row)


def _is_model(session: Session, text: str) -> bool:
    """Whether the store knows a version of this label, from its training."""
    from sqlalchemy import select

    from ....schema.registered_models import RegisteredVersion

    query = select(RegisteredVersion.id).where(RegisteredVersion.label == text).limit(1)
    return session.scalar(query) is not None


def _impact_key(session: Session, subject: Subject) -> int | None:
    from sqlalchemy import select

    from ....schema.campaigns import Campaign
    from ....schema.impacts import Impact

    own = (
        Campaign.name == subject.name,
        Impact.run == subject.run,
        Impact.repetition == subject.repetition,
    )
    query = select(Impact.id).join(Campaign, Impact.campaign_id == Campaign.id)
    return session.scalar(query.where(*own))


def author_columns(person: Person) -> dict[str, str]:
    """The columns of a row that a person writes."""
    return {"author": person.name, "author_kind": person.kind}
