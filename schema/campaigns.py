"""Campaigns, the configurations that they test (factors are data, so a lab adds its own), plans,
and what became of each planned run."""

from __future__ import annotations

import datetime as dt
from typing import Any

from sqlalchemy import CheckConstraint, ColumnElement, Date, ForeignKey, Index, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column, relationship

from .base import Base, HasId, PlainJson, WithProvenance, names_row, one_of
from .benches import Gun, Hammer, Material, Plate

KINDS = ("hammer", "gun")
#: What campaign.toml states where nobody knows the day: the column takes no NULL, and no laboratory
#: has shot on it. It is shown as "date not known", and lists have it last.
UNKNOWN_DATE = dt.date(1970, 1, 1)


def stated_day(date: dt.date) -> str | None:
    """The ISO day of a campaign; None where the day is not known.

    Parameters:
        date: The date as it is stored.
    """
    return None if date == UNKNOWN_DATE else date.isoformat()


def is_day_unknown() -> ColumnElement[bool]:
    """Whether the date of a campaign is not known, for an order that has such campaigns last."""
    return Campaign.date == UNKNOWN_DATE


class Campaign(HasId, WithProvenance, Base):
    """A campaign folder: who, what, with which bench."""

    __tablename__ = "campaigns"
    __table_args__ = (CheckConstraint(one_of("kind", KINDS), "kind_known"),)

    name: Mapped[str] = mapped_column(unique=True, info=names_row("campaign"))
    kind: Mapped[str]
    date: Mapped[dt.date] = mapped_column(Date)
    description: Mapped[str | None]
    operator: Mapped[str | None]
    gun_id: Mapped[int | None] = mapped_column(ForeignKey("guns.id"))
    hammer_id: Mapped[int | None] = mapped_column(ForeignKey("hammers.id"))
    plate_id: Mapped[int | None] = mapped_column(ForeignKey("plates.id"))
    #: Hash of campaign.toml's content: a folder that changed under the same name is refused, not
    #: mixed.
    fingerprint: Mapped[str]
    #: `[known]` of campaign.toml, as `known_facts.facts_to_json` has it; NULL where it states none.
    known_facts: Mapped[dict[str, Any] | None] = mapped_column(PlainJson(none_as_null=True))
    gun: Mapped[Gun | None] = relationship()
    hammer: Mapped[Hammer | None] = relationship()
    plate: Mapped[Plate | None] = relationship()


class Factor(HasId, WithProvenance, Base):
    """A variable of the design. `name` has no unit in it; numbers of its levels are in
    `si_unit`."""

    __tablename__ = "factors"

    name: Mapped[str] = mapped_column(unique=True, info=names_row("factor"))
    si_unit: Mapped[str | None]
    description: Mapped[str | None]


class FactorLevel(HasId, WithProvenance, Base):
    """One setting of a factor: a word, a number in SI, or a material."""

    __tablename__ = "factor_levels"
    __table_args__ = (UniqueConstraint("factor_id", "label"),)

    factor_id: Mapped[int] = mapped_column(ForeignKey("factors.id"))
    label: Mapped[str] = mapped_column(
        info=names_row("level")
    )  # the number's shortest text where the level is a number
    number: Mapped[float | None]
    material_id: Mapped[int | None] = mapped_column(ForeignKey("materials.id"))
    factor: Mapped[Factor] = relationship()
    material: Mapped[Material | None] = relationship()


class Configuration(HasId, WithProvenance, Base):
    """A combination of levels, stored once: repetitions, plans and campaigns all point at it."""

    __tablename__ = "configurations"

    fingerprint: Mapped[str] = mapped_column(unique=True)
    levels: Mapped[list[FactorLevel]] = relationship(
        secondary="configuration_levels", viewonly=True
    )


class ConfigurationLevel(WithProvenance, Base):
    """A configuration has one level of each factor that it sets."""

    __tablename__ = "configuration_levels"
    __table_args__ = (
        UniqueConstraint("configuration_id", "factor_id"),
        # "which configurations have tip_material = steel": the filter of every listing
        Index("ix_configuration_levels_level_id", "level_id"),
    )

    configuration_id: Mapped[int] = mapped_column(ForeignKey("configurations.id"), primary_key=True)
    level_id: Mapped[int] = mapped_column(ForeignKey("factor_levels.id"), primary_key=True)
    factor_id: Mapped[int] = mapped_column(ForeignKey("factors.id"))


STATUSES = ("planned", "done", "discarded")


class Plan(HasId, WithProvenance, Base):
    """A design of experiments: of which factors, how it was made, and from which seed."""

    __tablename__ = "plans"
    __table_args__ = (CheckConstraint(one_of("kind", KINDS), "kind_known"),)

    name: Mapped[str] = mapped_column(unique=True, info=names_row("plan"))
    kind: Mapped[str]
    factors: Mapped[
        str
    ]  # TOML: factors, levels, dependencies and bench limits, as the plan was made from
    method: Mapped[str]  # "lhs", "factorial", "import", ...
    seed: Mapped[int | None]
    description: Mapped[str | None]


class PlannedRun(HasId, WithProvenance, Base):
    """One treatment of a plan, in firing order. What was recorded for it points back here
    (`impacts`, `shots`)."""

    __tablename__ = "planned_runs"
    __table_args__ = (
        UniqueConstraint("plan_id", "run"),
        UniqueConstraint("plan_id", "position"),
        CheckConstraint(one_of("status", STATUSES), "status_known"),
        CheckConstraint("repetitions >= 1", "repetitions_positive"),
        CheckConstraint("status <> 'discarded' OR reason IS NOT NULL", "discarded_with_reason"),
        # "what is still to do": every listing of a plan's state
        Index("ix_planned_runs_plan_status", "plan_id", "status"),
    )

    plan_id: Mapped[int] = mapped_column(ForeignKey("plans.id"))
    run: Mapped[int] = mapped_column(info=names_row("run"))
    position: Mapped[int]
    repetitions: Mapped[int] = mapped_column(default=10)
    configuration_id: Mapped[int] = mapped_column(ForeignKey("configurations.id"), index=True)
    treatment: Mapped[dict[str, Any]]  # column of the plan's table -> level, as written there
    settings: Mapped[dict[str, Any]]  # what follows from the treatment, such as tank_pressure_bar
    #: What a person decided, see `run_states`: "planned" says nothing, also of a run that is
    #: recorded completely.
    status: Mapped[str] = mapped_column(default="planned")
    reason: Mapped[str | None]
    plan: Mapped[Plan] = relationship()
    configuration: Mapped[Configuration] = relationship()


def plan_turn(name: str) -> str:
    """The turn of those who change a plan, or what becomes of its runs."""
    return f"plan {name}"
