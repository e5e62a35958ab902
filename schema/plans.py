"""Designs, and what became of each planned run."""

from __future__ import annotations

from typing import Any

from sqlalchemy import CheckConstraint, ForeignKey, Index, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column, relationship

from .base import Base, HasId, Written, one_of
from .campaigns import KINDS, Configuration

STATUSES = ("planned", "done", "discarded")


class Plan(HasId, Written, Base):
    """A design of experiments: of which factors, how it was made, and from which seed."""

    __tablename__ = "plans"
    __table_args__ = (CheckConstraint(one_of("kind", KINDS), "kind_known"),)

    name: Mapped[str] = mapped_column(unique=True)
    kind: Mapped[str]
    factors: Mapped[str]  # TOML: factors, levels, dependencies and bench limits, as the plan was made from
    method: Mapped[str]  # "lhs", "factorial", "import", ...
    seed: Mapped[int | None]
    description: Mapped[str | None]


class PlannedRun(HasId, Written, Base):
    """One treatment of a plan, in firing order. What was recorded for it points back here (`impacts`, `shots`)."""

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
    run: Mapped[int]
    position: Mapped[int]
    repetitions: Mapped[int] = mapped_column(default=10)
    configuration_id: Mapped[int] = mapped_column(ForeignKey("configurations.id"), index=True)
    treatment: Mapped[dict[str, Any]]  # column of the plan's table -> level, as written there
    settings: Mapped[dict[str, Any]]  # what follows from the treatment, such as tank_pressure_bar
    status: Mapped[str] = mapped_column(default="planned")
    reason: Mapped[str | None]
    plan: Mapped[Plan] = relationship()
    configuration: Mapped[Configuration] = relationship()


def plan_turn(name: str) -> str:
    """The turn of those who change a plan, or what becomes of its runs."""
    return f"plan {name}"
